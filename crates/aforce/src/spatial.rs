//! Vectors, poses, and the measurement that the controller reads. Six-vectors are linear first, in world axes, at the tool point.

use nalgebra::{Isometry3, Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// One value per joint: positions (rad), velocities (rad/s) or torques (Nm).
pub type JointVector = SVector<f64, 7>;
/// Joint-space matrix, for example the mass matrix (kg m^2).
pub type JointMatrix = SMatrix<f64, 7, 7>;
/// A vector in world axes.
pub type Vector3 = SVector<f64, 3>;
/// A six-vector: linear part first, rotational part second, world axes.
pub type Vector6 = SVector<f64, 6>;
/// Maps joint velocities to the tool's [`Twist`]: rows are linear first, in world axes, at the tool point.
pub type Jacobian = SMatrix<f64, 6, 7>;
/// Position (m) and orientation of the tool in the world.
pub type Pose = Isometry3<f64>;
/// Linear velocity of the tool point (m/s) and angular velocity (rad/s), world axes.
pub type Twist = Vector6;
/// Force (N) and moment about the tool point (Nm), world axes.
pub type Wrench = Vector6;

/// What a simulated or real arm provides at each control sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Joint positions (rad).
    pub q: JointVector,
    /// Joint velocities (rad/s).
    pub qd: JointVector,
    /// Pose of the tool point in the world (m).
    pub pose: Pose,
    /// Velocity of the tool point (m/s, rad/s), world axes: `jacobian * qd`.
    pub twist: Twist,
    /// Jacobian of the tool point, world axes.
    pub jacobian: Jacobian,
    /// Joint-space mass matrix (kg m^2), rotor inertia included.
    pub mass: JointMatrix,
    /// Torques that compensate gravity and Coriolis forces (Nm), without those that the arm adds by itself.
    pub bias: JointVector,
    /// Filtered wrench that the environment exerts on the tool (N, Nm), world axes, at the tool point.
    pub wrench: Wrench,
}

/// e = x - x_d as `[p - p_d; log(R R_d^T)]` (m, rad): actual minus desired, world axes.
///
/// The rotational part is the rotation vector that turns the desired into the actual orientation, the short way round.
#[must_use]
pub fn pose_error(x: &Pose, x_d: &Pose) -> Vector6 {
    let p = x.translation.vector - x_d.translation.vector;
    let r = rotation_vector(&(x.rotation * x_d.rotation.inverse()));
    stack(&p, &r)
}

/// A matrix R as a rotation. `None` if R is no rotation: an entry of R^T R is NaN or differs from the identity's by 1e-3 or more, or R
/// mirrors.
#[must_use]
pub fn rotation_from_matrix(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let off = (matrix.transpose() * matrix - Matrix3::identity()).amax();
    let is_rotation = off < 1e-3 && matrix.determinant() > 0.0;
    is_rotation.then(|| UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix)))
}

/// Row and column (from 0) of the entry below the diagonal of a mass matrix that differs most from the entry mirrored at the diagonal.
/// `None` if no difference exceeds 1e-4 of the largest entry, which allows for rounding to single precision. The check finds a matrix of
/// which a library filled one triangle only.
#[must_use]
pub fn asymmetry(mass: &JointMatrix) -> Option<[usize; 2]> {
    let (mut worst, mut place) = (1e-4 * mass.amax(), None);
    for row in 1..7 {
        for column in 0..row {
            let off = (mass[(row, column)] - mass[(column, row)]).abs();
            if off > worst {
                (worst, place) = (off, Some([row, column]));
            }
        }
    }
    place
}

/// How the rotational part of an error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationError {
    /// angle x axis: the rotation vector (rad).
    Angle,
    /// sin(angle) x axis, as in robosuite: close to the angle while that is small, smaller beyond, 0 at half a turn.
    Sine,
}

impl RotationError {
    /// e = x - x_d (m, rad; world axes), as [`pose_error`], with the rotational part measured by this rule.
    #[must_use]
    pub fn of(self, x: &Pose, x_d: &Pose) -> Vector6 {
        match self {
            Self::Angle => pose_error(x, x_d),
            Self::Sine => {
                let turn = x.rotation * x_d.rotation.inverse();
                // 2 cos(angle/2) sin(angle/2) x axis.
                stack(&(x.translation.vector - x_d.translation.vector), &(2.0 * turn.w * turn.imag()))
            }
        }
    }
}

/// The logarithm of a rotation (rad, at most pi long). A quaternion and its negative give the same vector.
#[must_use]
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3 {
    // q and -q are the same rotation. The one whose scalar part is not negative turns by half a turn at most.
    let w = rotation.w;
    let v = rotation.imag() * if w < 0.0 { -1.0 } else { 1.0 };
    let sine = v.norm();
    if sine < 1e-12 { 2.0 * v } else { v * (2.0 * libm::atan2(sine, w.abs()) / sine) }
}

/// `[linear; rotational]`.
pub(crate) fn stack(linear: &Vector3, rotational: &Vector3) -> Vector6 {
    Vector6::new(linear.x, linear.y, linear.z, rotational.x, rotational.y, rotational.z)
}

/// The first three entries.
pub(crate) fn linear(v: &Vector6) -> Vector3 {
    Vector3::new(v[0], v[1], v[2])
}

/// The last three entries.
pub(crate) fn rotational(v: &Vector6) -> Vector3 {
    Vector3::new(v[3], v[4], v[5])
}

/// Shortens `v` to `limit`, keeping its direction.
pub(crate) fn limit_norm(v: Vector3, limit: f64) -> Vector3 {
    let norm = v.norm();
    if norm > limit { v * (limit / norm) } else { v }
}

/// No NaN and no infinity.
pub(crate) fn all_finite<const N: usize>(v: &SVector<f64, N>) -> bool {
    v.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Quaternion;
    use std::f64::consts::PI;

    fn turned(axis_angle: Vector3) -> Pose {
        Pose::new(Vector3::zeros(), axis_angle)
    }

    #[test]
    fn error_is_actual_minus_desired_in_world_axes() {
        let x_d = Pose::new(Vector3::new(0.4, 0.1, 0.2), Vector3::new(0.0, 0.0, PI / 2.0));
        // A world-axis turn about x multiplies from the left, whatever the orientation is.
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.0, 0.0));
        let x = Pose::from_parts(Vector3::new(0.5, 0.1, 0.1).into(), turn * x_d.rotation);
        let e = pose_error(&x, &x_d);
        assert_relative_eq!(e, Vector6::new(0.1, 0.0, -0.1, 0.3, 0.0, 0.0), epsilon = 1e-12);
    }

    #[test]
    fn a_quaternion_and_its_negative_give_the_same_error() {
        let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -1.0, 0.7));
        let minus_q = UnitQuaternion::new_unchecked(Quaternion::from(-q.coords));
        let identity = Pose::identity();
        let (x, x_double) =
            (Pose::from_parts(identity.translation, q), Pose::from_parts(identity.translation, minus_q));
        assert_relative_eq!(pose_error(&x, &identity), pose_error(&x_double, &identity), epsilon = 1e-12);
        assert_relative_eq!(rotation_vector(&minus_q), Vector3::new(0.2, -1.0, 0.7), epsilon = 1e-12);
    }

    #[test]
    fn the_short_way_round_is_taken() {
        // 350 degrees forward is 10 degrees back.
        let e = pose_error(&turned(Vector3::z() * (350f64).to_radians()), &Pose::identity());
        assert_relative_eq!(e[5], -(10f64).to_radians(), epsilon = 1e-9);
    }

    #[test]
    fn the_sine_of_an_angle_is_less_than_the_angle() {
        let axis = Vector3::new(0.6, 0.0, -0.8);
        for angle in [-2.5, -0.3, 1e-9, 0.4, 1.5, 3.0] {
            let x = turned(axis * angle);
            assert_relative_eq!(
                rotational(&RotationError::Sine.of(&x, &Pose::identity())),
                axis * angle.sin(),
                epsilon = 1e-12
            );
            assert_relative_eq!(
                rotational(&RotationError::Angle.of(&x, &Pose::identity())),
                axis * angle,
                epsilon = 1e-12
            );
        }
    }

    #[test]
    fn tiny_and_half_turns_are_finite() {
        assert_relative_eq!(rotation_vector(&turned(Vector3::x() * 1e-14).rotation).x, 1e-14, epsilon = 1e-20);
        assert_relative_eq!(rotation_vector(&turned(Vector3::y() * PI).rotation).norm(), PI, epsilon = 1e-12);
        assert_eq!(rotation_vector(&UnitQuaternion::identity()), Vector3::zeros());
    }
}
