//! From stiffness, damping and error to the wrench, in the two stiffness conventions.

use serde::{Deserialize, Serialize};

use crate::damping::Damping;
use crate::error::{ConfigError, not_negative, positive, within};
use crate::force::ForceAxis;
use crate::operational_space::OperationalSpace;
use crate::reference::Reference;
use crate::spatial::{Vector6, Wrench, linear};

/// What a stiffness number means. kp = 150 shaped is 2 to 6 kN/m on this arm, not 150 N/m.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// Unit mass: stiffness in 1/s^2, and the acceleration it asks for is multiplied by the operational-space inertia,
    /// translation and rotation uncoupled (robosuite).
    Shaped,
    /// Stiffness in N/m and Nm/rad, no inertia shaping (the paper).
    Physical,
}

impl Convention {
    /// Unit of the stiffness of axis 0 to 5.
    #[must_use]
    pub fn stiffness_unit(self, axis: usize) -> &'static str {
        match self {
            Self::Shaped => "1/s^2",
            Self::Physical if axis < 3 => "N/m",
            Self::Physical => "Nm/rad",
        }
    }
}

/// What every impedance has to state besides its stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImpedanceForm {
    /// Units of stiffness.
    pub convention: Convention,
    /// How damping follows stiffness.
    pub damping: Damping,
    /// zeta; 1 is critical.
    pub damping_ratio: f64,
    /// True: e_dot = x_dot - x_d_dot (the paper). False: e_dot = x_dot, damped against standstill (robosuite).
    pub reference_velocity: bool,
    /// What the pose delta of an action is added to.
    pub reference: Reference,
}

impl ImpedanceForm {
    /// Of the paper's own spaces: critical damping, aware of the arm's inertia; a goal that goes on from the last one, so
    /// that the tracking error is more than the latest delta.
    ///
    /// The paper's e_dot counts the reference's velocity. With a linear set-point that is a step at every action, and the
    /// damping term answers it with torque peaks: four to eight times the energy at no gain in return
    /// (docs/decisions.md). Switch it on together with jerk-limited set-points; soft springs in N/m, which crawl without it,
    /// have it with either.
    #[must_use]
    pub fn continued(convention: Convention) -> Self {
        Self {
            convention,
            damping: Damping::MassAware,
            damping_ratio: 1.0,
            reference_velocity: false,
            reference: Reference::Continued { leash_position: 0.04, leash_rotation: 0.3 },
        }
    }

    /// robosuite's OSC: shaped, critical, damped against standstill, re-based on the measured pose.
    #[must_use]
    pub fn robosuite() -> Self {
        Self { reference: Reference::Rebased {}, ..Self::continued(Convention::Shaped) }
    }

    pub(crate) fn validate(&self, space: &str) -> Result<(), ConfigError> {
        within(&format!("{space}.form.damping_ratio"), self.damping_ratio, 0.0..=10.0)?;
        self.reference.validate(&format!("{space}.form"))
    }

    /// D of each axis, in the convention's units, and in the same sample as K.
    #[must_use]
    pub fn damping_of(&self, stiffness: &Vector6, space: &OperationalSpace) -> Vector6 {
        let inertia = match self.convention {
            Convention::Shaped => Vector6::repeat(1.0),
            Convention::Physical => space.diagonal(),
        };
        self.damping.of(stiffness, &inertia, self.damping_ratio)
    }

    /// From the convention's own units to a wrench (N, Nm).
    #[must_use]
    pub fn to_wrench(&self, v: &Vector6, space: &OperationalSpace) -> Wrench {
        match self.convention {
            Convention::Shaped => space.shape(v),
            Convention::Physical => *v,
        }
    }
}

/// A stiffness that never changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedImpedance {
    /// Units, damping, error rate and reference.
    pub form: ImpedanceForm,
    /// Stiffness of the translational axes (N/m; shaped: 1/s^2).
    pub translation: f64,
    /// Stiffness of the rotational axes (Nm/rad; shaped: 1/s^2).
    pub rotation: f64,
}

impl FixedImpedance {
    pub(crate) fn validate(&self, level: &str) -> Result<(), ConfigError> {
        let space = format!("impedance.{level}");
        self.form.validate(&space)?;
        not_negative(&format!("{space}.translation"), self.translation)?;
        not_negative(&format!("{space}.rotation"), self.rotation)
    }

    /// K of the six axes.
    #[must_use]
    pub fn stiffness(&self) -> Vector6 {
        Vector6::from_fn(|axis, _| if axis < 3 { self.translation } else { self.rotation })
    }
}

/// A stiffness that the policy commands: an action entry of -1 to 1 spans `[low, high]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandedImpedance {
    /// Units, damping, error rate and reference.
    pub form: ImpedanceForm,
    /// Lowest and highest stiffness of the translational axes (N/m; shaped: 1/s^2).
    pub translation: [f64; 2],
    /// Lowest and highest stiffness of the rotational axes (Nm/rad; shaped: 1/s^2).
    pub rotation: [f64; 2],
}

impl CommandedImpedance {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        self.form.validate("impedance.variable")?;
        for (group, [low, high]) in [("translation", self.translation), ("rotation", self.rotation)] {
            not_negative(&format!("impedance.variable.{group}[0]"), low)?;
            positive(&format!("impedance.variable.{group}[1]"), high)?;
            within(&format!("impedance.variable.{group}[0]"), low, 0.0..=high)?;
        }
        Ok(())
    }

    /// Lowest and highest stiffness of axis 0 to 5.
    #[must_use]
    pub fn range(&self, axis: usize) -> [f64; 2] {
        if axis < 3 { self.translation } else { self.rotation }
    }
}

/// -F_ff - K e - D e_dot (N, Nm; world axes): the wrench law without force control's part.
///
/// `stiffness` and `feedforward` are in the units of the form's convention. Of K and F_ff along `axis` its engagement
/// is taken away, and damping there grows to at least the force axis' own.
///
/// What is given up is the acceleration along the axis, before it is shaped. The arm's inertia couples the axes: the
/// wrench along n that remains cancels what an acceleration across n would add to the contact force, and it vanishes
/// in steady sliding, where spring and damper are balanced.
#[must_use]
pub fn impedance_wrench(
    form: &ImpedanceForm,
    space: &OperationalSpace,
    axis: &ForceAxis,
    e: &Vector6,
    e_dot: &Vector6,
    stiffness: &Vector6,
    feedforward: &Vector6,
) -> Wrench {
    let damping = form.damping_of(stiffness, space);
    let damp = |velocity: &Vector6| form.to_wrench(&damping.component_mul(velocity), space);
    let elastic = form.to_wrench(&axis.release(&(feedforward + stiffness.component_mul(e))), space); // F_ff + K e
    let viscous = damp(e_dot) + axis.missing_damping(space, damp) * linear(e_dot).dot(&axis.direction) * axis.unit(); // D e_dot
    -elastic - viscous
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::Vector3;
    use crate::testing::{gantry, random_arm};
    use approx::assert_relative_eq;

    fn free() -> ForceAxis {
        ForceAxis { direction: Vector3::z(), engagement: 0.0, damping_min: 60.0, damping_rate_min: 5.0 }
    }

    fn space() -> OperationalSpace {
        let y = gantry([4.0, 4.0, 10.0, 0.5, 0.5, 0.5]);
        OperationalSpace::new(&y.mass, &y.jacobian).unwrap()
    }

    #[test]
    fn physical_by_hand() {
        // z: K = 100, m = 10: D = 2 sqrt(1000); e = 2 cm, e_dot = 0.1 m/s, F_ff = 3 N.
        let form = ImpedanceForm::continued(Convention::Physical);
        let axis = |v: f64| Vector6::new(0.0, 0.0, v, 0.0, 0.0, 0.0);
        let w =
            impedance_wrench(&form, &space(), &free(), &axis(0.02), &axis(0.1), &Vector6::repeat(100.0), &axis(3.0));
        assert_relative_eq!(w, axis(-3.0 - 2.0 - 0.2 * 1000f64.sqrt()), epsilon = 1e-9);
    }

    #[test]
    fn shaped_by_hand() {
        // The same numbers are accelerations: D = 2 sqrt(100) = 20 1/s, and everything is multiplied by 10 kg.
        let form = ImpedanceForm::continued(Convention::Shaped);
        let axis = |v: f64| Vector6::new(0.0, 0.0, v, 0.0, 0.0, 0.0);
        let w =
            impedance_wrench(&form, &space(), &free(), &axis(0.02), &axis(0.1), &Vector6::repeat(100.0), &axis(3.0));
        assert_relative_eq!(w, axis(-10.0 * (3.0 + 2.0 + 2.0)), epsilon = 1e-9);
    }

    #[test]
    fn every_axis_is_pushed_back() {
        for convention in [Convention::Shaped, Convention::Physical] {
            let form = ImpedanceForm::continued(convention);
            for axis in 0..6 {
                let mut e = Vector6::zeros();
                e[axis] = 0.01;
                let w = impedance_wrench(
                    &form,
                    &space(),
                    &free(),
                    &e,
                    &Vector6::zeros(),
                    &Vector6::repeat(50.0),
                    &Vector6::zeros(),
                );
                assert!(w[axis] < 0.0 && w.dot(&e) == w[axis] * e[axis] && w.amax() == -w[axis]);
                let w = impedance_wrench(
                    &form,
                    &space(),
                    &free(),
                    &Vector6::zeros(),
                    &e,
                    &Vector6::repeat(50.0),
                    &Vector6::zeros(),
                );
                assert!(w[axis] < 0.0 && w.amax() == -w[axis]);
            }
        }
    }

    /// A spring pulls along x and the damper brakes as much: an arm whose inertia couples x and z must not push along z.
    #[test]
    fn steady_sliding_leaves_the_force_axis_alone() {
        let y = random_arm(3);
        let space = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        assert!(space.lambda_p[(2, 0)].abs() > 0.01 * space.lambda_p[(2, 2)], "x and z are coupled");
        let engaged = ForceAxis { engagement: 1.0, ..free() };
        let form = ImpedanceForm::continued(Convention::Shaped);
        // K = 100, D = 20: 0.01 m behind and 0.05 m/s forward.
        let along_x = |v: f64| Vector6::new(v, 0.0, 0.0, 0.0, 0.0, 0.0);
        let (k, f_ff) = (Vector6::repeat(100.0), Vector6::zeros());
        let w = impedance_wrench(&form, &space, &engaged, &along_x(-0.01), &along_x(0.05), &k, &f_ff);
        assert_relative_eq!(w, Wrench::zeros(), epsilon = 1e-9);
    }

    #[test]
    fn an_axis_engaged_by_half_has_half_of_the_stiffness() {
        let half = ForceAxis { engagement: 0.5, ..free() };
        let (e, k, f_ff) = (Vector6::repeat(0.01), Vector6::repeat(100.0), Vector6::repeat(2.0));
        let form = ImpedanceForm::continued(Convention::Physical);
        let w = impedance_wrench(&form, &space(), &half, &e, &Vector6::zeros(), &k, &f_ff);
        assert_relative_eq!(w, Vector6::new(-3.0, -3.0, -1.5, -3.0, -3.0, -3.0), epsilon = 1e-12);
    }

    #[test]
    fn an_engaged_axis_gives_up_stiffness_and_keeps_damping() {
        let engaged = ForceAxis { engagement: 1.0, ..free() };
        for convention in [Convention::Shaped, Convention::Physical] {
            let form = ImpedanceForm { damping_ratio: 0.0, ..ImpedanceForm::continued(convention) };
            let (e, k) = (Vector6::repeat(0.01), Vector6::repeat(100.0));
            let still = impedance_wrench(&form, &space(), &engaged, &e, &Vector6::zeros(), &k, &Vector6::repeat(2.0));
            assert!(still[2].abs() < 1e-9 && still[0] < 0.0 && still[5] < 0.0);
            // With no damping of its own the axis still has 60 Ns/m (5 1/s of 10 kg is less).
            let moving = impedance_wrench(
                &form,
                &space(),
                &engaged,
                &Vector6::zeros(),
                &(Vector6::repeat(0.1)),
                &k,
                &Vector6::zeros(),
            );
            assert_relative_eq!(moving, Vector6::new(0.0, 0.0, -6.0, 0.0, 0.0, 0.0), epsilon = 1e-9);
        }
    }
}
