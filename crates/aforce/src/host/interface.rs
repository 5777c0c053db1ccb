//! Converts what an arm's interface reports to what the law reads: compensation, inertia, frames and signs.

use nalgebra::{Matrix3, Matrix4, Quaternion, SMatrix, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, within};
use crate::spatial::{
    Jacobian, JointMatrix, JointVector, Measurement, Pose, Vector3, Wrench, all_finite, linear, rotation_from_matrix,
    rotational, stack,
};

/// What an arm's interface reports at each cycle, in its own conventions, which [`ArmInterface`] names.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmState {
    /// Joint positions (rad).
    pub q: JointVector,
    /// Joint velocities (rad/s).
    pub qd: JointVector,
    /// Pose of the tool point in the base frame (m).
    pub pose: Pose,
    /// Jacobian of the tool point, base axes: three linear rows (m/rad), then three rotational ones.
    pub jacobian: Jacobian,
    /// Joint-space mass matrix (kg m^2), of the side that [`ArmInterface::inertia`] names.
    pub mass: JointMatrix,
    /// Torques that hold the resting arm against gravity (Nm).
    pub gravity: JointVector,
    /// Torques of Coriolis and centrifugal forces (Nm).
    pub coriolis: JointVector,
    /// External wrench (N, Nm), as [`ArmInterface`] describes it.
    pub wrench: Wrench,
    /// The torque that the interface took last (Nm), without what the arm adds by itself.
    pub tau: JointVector,
}

/// Who puts a compensating torque on the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CompensatedBy {
    /// The arm, which adds the compensation to the commanded torque: the law must not.
    Arm,
    /// The law, within the torque that it commands.
    Law,
}

/// Who compensates the friction of the joints. The law never does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Friction {
    /// The arm.
    Arm,
    /// Not compensated: each joint keeps this viscous damping (Nm s/rad). Only the observer of an observed wrench uses the number.
    Nobody([f64; 7]),
}

/// Which inertia the reported mass matrix includes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InertiaSide {
    /// Links alone: the host adds the arm's rotor inertia.
    Link,
    /// Links and rotors.
    Motor,
}

/// On which body a reported wrench acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrenchSign {
    /// The wrench that the environment exerts on the tool: a hand that lifts the tool reads +z.
    OnTool,
    /// The wrench that the tool exerts on the environment: a hand that lifts the tool reads -z.
    OnEnvironment,
}

/// Axes of a wrench.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrenchAxes {
    /// Those of the arm's base.
    Base,
    /// Those of the tool.
    Tool,
}

/// Where the external wrench comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WrenchSource {
    /// [`ArmState::wrench`].
    Reported,
    /// A [`MomentumObserver`](crate::MomentumObserver) on [`ArmState::tau`].
    Observed {
        /// Cut-off of the observer (Hz).
        cutoff_hz: f64,
    },
}

/// The conventions of an arm's interface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmInterface {
    /// Who compensates gravity.
    pub gravity: CompensatedBy,
    /// Who compensates Coriolis and centrifugal forces.
    pub coriolis: CompensatedBy,
    /// Who compensates the friction of the joints.
    pub friction: Friction,
    /// Which inertia [`ArmState::mass`] includes.
    pub inertia: InertiaSide,
    /// Where the wrench comes from.
    pub wrench: WrenchSource,
    /// Sign of [`ArmState::wrench`].
    pub wrench_sign: WrenchSign,
    /// Axes of [`ArmState::wrench`].
    pub wrench_axes: WrenchAxes,
    /// The point about which [`ArmState::wrench`] gives the moment, seen from the tool point (m, tool axes).
    pub wrench_point: [f64; 3],
}

impl ArmInterface {
    /// Franka's control interface: the arm compensates gravity and motor friction, `mass` is link-side, and `O_F_ext_hat_K`
    /// is what the tool exerts on the environment. Put the K frame at the tool point (`set_k`).
    pub const FRANKA: Self = Self {
        gravity: CompensatedBy::Arm,
        coriolis: CompensatedBy::Law,
        friction: Friction::Arm,
        inertia: InertiaSide::Link,
        wrench: WrenchSource::Reported,
        wrench_sign: WrenchSign::OnEnvironment,
        wrench_axes: WrenchAxes::Base,
        wrench_point: [0.0; 3],
    };

    /// An arm that compensates nothing, as in a simulator: the law compensates gravity and Coriolis forces, the mass matrix includes the
    /// rotors, and the wrench acts on the tool.
    pub const PLAIN: Self = Self {
        gravity: CompensatedBy::Law,
        coriolis: CompensatedBy::Law,
        friction: Friction::Nobody([0.0; 7]),
        inertia: InertiaSide::Motor,
        wrench: WrenchSource::Reported,
        wrench_sign: WrenchSign::OnTool,
        wrench_axes: WrenchAxes::Base,
        wrench_point: [0.0; 3],
    };

    /// The measurement that the law reads, given the arm's `rotor_inertia` (kg m^2). Its wrench is the reported one, even where an
    /// observer's estimate replaces it later.
    #[must_use]
    pub fn measurement(&self, state: &ArmState, rotor_inertia: &JointVector) -> Measurement {
        let rotors = match self.inertia {
            InertiaSide::Link => JointMatrix::from_diagonal(rotor_inertia),
            InertiaSide::Motor => JointMatrix::zeros(),
        };
        Measurement {
            q: state.q,
            qd: state.qd,
            pose: state.pose,
            twist: state.jacobian * state.qd,
            jacobian: state.jacobian,
            mass: state.mass + rotors,
            bias: self.bias(state),
            wrench: self.wrench_on_tool(&state.wrench, &state.pose),
        }
    }

    /// Torques that the law compensates (Nm).
    pub(crate) fn bias(&self, state: &ArmState) -> JointVector {
        let by_law = |who: CompensatedBy, torque: &JointVector| match who {
            CompensatedBy::Law => *torque,
            CompensatedBy::Arm => JointVector::zeros(),
        };
        by_law(self.gravity, &state.gravity) + by_law(self.coriolis, &state.coriolis)
    }

    /// Viscous friction of the joints that the arm does not compensate (Nm s/rad).
    pub(crate) fn damping(&self) -> JointVector {
        match self.friction {
            Friction::Arm => JointVector::zeros(),
            Friction::Nobody(viscous) => viscous.into(),
        }
    }

    /// The reported wrench as what the environment exerts on the tool (N, Nm; base axes, about the tool point).
    fn wrench_on_tool(&self, reported: &Wrench, pose: &Pose) -> Wrench {
        let sign = match self.wrench_sign {
            WrenchSign::OnTool => 1.0,
            WrenchSign::OnEnvironment => -1.0,
        };
        let axes = match self.wrench_axes {
            WrenchAxes::Base => Matrix3::identity(),
            WrenchAxes::Tool => *pose.rotation.to_rotation_matrix().matrix(),
        };
        let force = sign * (axes * linear(reported));
        let moment = sign * (axes * rotational(reported));
        // The moment about the tool point is larger by r x F, where r leads from the tool point to the reported point.
        let point = pose.rotation * Vector3::from(self.wrench_point);
        stack(&force, &(moment + point.cross(&force)))
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        if let Friction::Nobody(viscous) = self.friction {
            for (joint, value) in viscous.into_iter().enumerate() {
                not_negative(&format!("friction.nobody (joint {})", joint + 1), value)?;
            }
        }
        if let WrenchSource::Observed { cutoff_hz } = self.wrench {
            within("wrench.observed.cutoff_hz", cutoff_hz, 0.1..=100.0)?;
        }
        for value in self.wrench_point {
            within("wrench_point", value, -1.0..=1.0)?;
        }
        Ok(())
    }
}

/// The pose (m) of a homogeneous 4 x 4 matrix that is given column by column, as Franka's interface and C have it. If the matrix holds no
/// rotation, the rotation of the pose is NaN, and [`Host`](crate::host::Host) refuses the state.
#[must_use]
pub fn pose_from_matrix(column_major: &[f64; 16]) -> Pose {
    let matrix = Matrix4::from_column_slice(column_major);
    let position: Vector3 = matrix.fixed_view::<3, 1>(0, 3).into();
    let unknown = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let rotation = rotation_from_matrix(&matrix.fixed_view::<3, 3>(0, 0).into());
    Pose::from_parts(position.into(), rotation.unwrap_or(unknown))
}

impl ArmState {
    /// The first field with an entry that no arm has: not a number, beyond 1e4 (a position: 10 m), or a rotation that is no unit
    /// quaternion. Within these bounds nothing in the law overflows. The wrench is checked only if `reads_wrench`.
    pub(crate) fn unreadable(&self, reads_wrench: bool) -> Option<&'static str> {
        let rotation = self.pose.rotation.coords;
        let checks = [
            ("q", in_range(&self.q)),
            ("qd", in_range(&self.qd)),
            ("pose (position)", self.pose.translation.vector.iter().all(|x| x.abs() <= 10.0)),
            ("pose (rotation)", all_finite(&rotation) && (rotation.norm() - 1.0).abs() < 1e-3),
            ("jacobian", in_range(&self.jacobian)),
            ("mass", in_range(&self.mass)),
            ("gravity", in_range(&self.gravity)),
            ("coriolis", in_range(&self.coriolis)),
            ("wrench", in_range(&self.wrench) || !reads_wrench),
            ("tau", in_range(&self.tau)),
        ];
        checks.into_iter().find(|(_, readable)| !readable).map(|(field, _)| field)
    }

    /// Whether posture and velocity can be read, whatever else cannot.
    pub(crate) fn has_joints(&self) -> bool {
        in_range(&self.q) && in_range(&self.qd)
    }

    /// Whether the torque that the interface took can be read.
    pub(crate) fn has_torque(&self) -> bool {
        in_range(&self.tau)
    }

    /// Whether gravity and Coriolis torques can be read.
    pub(crate) fn has_bias(&self) -> bool {
        in_range(&self.gravity) && in_range(&self.coriolis)
    }
}

/// Whether the absolute value of every entry is 1e4 or below; NaN is not.
fn in_range<const R: usize, const C: usize>(values: &SMatrix<f64, R, C>) -> bool {
    values.iter().all(|x| x.abs() <= 1e4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::resting_arm;
    use approx::assert_relative_eq;
    use nalgebra::UnitQuaternion;

    #[test]
    fn a_franka_holds_itself_against_gravity_and_reports_what_the_tool_exerts() {
        let mut state = resting_arm();
        state.wrench = Wrench::new(0.0, 0.0, -7.0, 0.1, 0.0, 0.0);
        let rotors = JointVector::repeat(0.5);
        let y = ArmInterface::FRANKA.measurement(&state, &rotors);
        assert_eq!(y.bias, state.coriolis);
        assert_eq!(y.wrench, -state.wrench);
        assert_relative_eq!(y.mass - state.mass, JointMatrix::identity() * 0.5, epsilon = 1e-12);
        let y = ArmInterface::PLAIN.measurement(&state, &rotors);
        assert_eq!((y.bias, y.wrench, y.mass), (state.coriolis + state.gravity, state.wrench, state.mass));
    }

    #[test]
    fn a_wrench_in_tool_axes_about_another_point_is_moved() {
        // The tool points down: half a turn about x. A sensor 10 cm behind the tool point reads 5 N along the tool's y axis.
        let mut state = resting_arm();
        state.pose.rotation = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
        state.wrench = Wrench::new(0.0, 5.0, 0.0, 0.0, 0.0, 0.0);
        let interface =
            ArmInterface { wrench_axes: WrenchAxes::Tool, wrench_point: [0.0, 0.0, -0.1], ..ArmInterface::PLAIN };
        // The tool's y axis is the base's -y; the sensor lies 10 cm above: (0, 0, 0.1) x (0, -5, 0) = (0.5, 0, 0).
        let y = interface.measurement(&state, &JointVector::zeros());
        assert_relative_eq!(y.wrench, Wrench::new(0.0, -5.0, 0.0, 0.5, 0.0, 0.0), epsilon = 1e-12);
    }

    #[test]
    fn a_matrix_that_is_no_rotation_cannot_be_read() {
        let good = resting_arm().pose.to_homogeneous();
        let (mut stretched, mut skewed, mut mirrored, mut unknown) = (good, good, good, good);
        stretched[0] = 3.0;
        skewed[4] += 0.003;
        mirrored.column_mut(1).neg_mut();
        unknown[4] = f64::NAN;
        let read = |matrix: Matrix4<f64>| {
            let pose = pose_from_matrix(&std::array::from_fn(|entry| matrix[entry]));
            ArmState { pose, ..resting_arm() }.unreadable(true)
        };
        assert_eq!(read(good), None);
        for matrix in [stretched, skewed, mirrored, unknown, Matrix4::zeros()] {
            assert_eq!(read(matrix), Some("pose (rotation)"), "{matrix}");
        }
    }

    #[test]
    fn the_field_that_cannot_be_read_is_named() {
        assert_eq!(resting_arm().unreadable(true), None);
        let spoilt = |spoil: fn(&mut ArmState)| {
            let mut state = resting_arm();
            spoil(&mut state);
            state.unreadable(true)
        };
        assert_eq!(spoilt(|s| s.q[3] = f64::NAN), Some("q"));
        assert_eq!(spoilt(|s| s.mass[(1, 2)] = f64::INFINITY), Some("mass"));
        assert_eq!(spoilt(|s| s.wrench[5] = -1e5), Some("wrench"));
        let unmeasured = ArmState { wrench: Wrench::repeat(f64::NAN), ..resting_arm() };
        assert_eq!(unmeasured.unreadable(false), None);
        assert_eq!(spoilt(|s| s.pose.translation.vector.x = 11.0), Some("pose (position)"));
        let stretched = |s: &mut ArmState| {
            s.pose.rotation = UnitQuaternion::new_unchecked(2.0 * s.pose.rotation.into_inner());
        };
        assert_eq!(spoilt(stretched), Some("pose (rotation)"));
    }
}
