//! From stiffness, damping and errors to the wrench, in either unit of stiffness.

use crate::law::action_space::ActionSpace;
use crate::law::step_values::{Adapted, Errors};
use crate::spatial::{Vector6, Wrench, linear};

/// The wrenches of spring with feed-forward, and of damper (N, Nm; world axes). The law's wrench without force control is -`elastic` -
/// `viscous`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impedance {
    /// F_ff + K e.
    pub elastic: Wrench,
    /// D e_dot.
    pub viscous: Wrench,
}

/// F_ff + K e and D e_dot (N, Nm; world axes), with the unit and the damping of `space`.
///
/// Along the contact axis K and F_ff act in the share 1 - engagement only, and damping grows to at least the least damping of the force
/// axis.
///
/// With stiffness in 1/s^2, the share is taken of the acceleration that spring and F_ff ask for, before Lambda turns the acceleration into
/// a wrench. As Lambda couples the axes, a wrench along n remains: it cancels what an acceleration across n would add to the contact force.
/// In steady sliding that acceleration is zero, and so is this wrench.
#[must_use]
pub fn impedance(space: &ActionSpace, errors: &Errors, adapted: &Adapted) -> Impedance {
    let Errors { e, e_dot, axis, lambda, .. } = errors;
    let Adapted { stiffness, feedforward, .. } = adapted;
    let damping = space.damping.of(stiffness, &space.unit.inertia(&lambda.diagonal()), &space.damping_ratio);
    let damp = |velocity: &Vector6| space.unit.to_wrench(&damping.component_mul(velocity), lambda);
    Impedance {
        elastic: space.unit.to_wrench(&axis.release(&(feedforward + stiffness.component_mul(e))), lambda), // F_ff + K e
        viscous: damp(e_dot) + axis.missing_damping(lambda, damp) * linear(e_dot).dot(&axis.direction) * axis.unit(), // D e_dot
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::force::ForceAxis;
    use crate::law::gains::Gains;
    use crate::law::operational_space::OperationalSpace;
    use crate::spatial::Vector3;
    use crate::testing::{gantry, random_arm};
    use approx::assert_relative_eq;

    /// A space with critical damping; `low` is in N/m, `osc` in 1/s^2.
    fn space(name: &str) -> ActionSpace {
        name.parse().unwrap()
    }

    fn free() -> ForceAxis {
        ForceAxis { direction: Vector3::z(), engagement: 0.0, damping_min: 60.0, damping_rate_min: 5.0 }
    }

    fn lambda() -> OperationalSpace {
        let y = gantry([4.0, 4.0, 10.0, 0.5, 0.5, 0.5]);
        OperationalSpace::new(&y.mass, &y.jacobian).unwrap()
    }

    /// A sample with the errors e and e_dot.
    fn sensed(lambda: &OperationalSpace, axis: &ForceAxis, [e, e_dot]: [&Vector6; 2]) -> Errors {
        Errors { e: *e, e_dot: *e_dot, excess: Vector6::zeros(), axis: *axis, lambda: lambda.clone(), dt: 0.002 }
    }

    /// -F_ff - K e - D e_dot.
    fn wrench(space: &ActionSpace, errors: &Errors, stiffness: &Vector6, feedforward: &Vector6) -> Wrench {
        let adapted = Adapted { stiffness: *stiffness, feedforward: *feedforward, force: Wrench::zeros() };
        let Impedance { elastic, viscous } = impedance(space, errors, &adapted);
        -elastic - viscous
    }

    #[test]
    fn a_spring_in_newtons_per_metre_by_hand() {
        // z: K = 100, m = 10: D = 2 sqrt(1000); e = 2 cm, e_dot = 0.1 m/s, F_ff = 3 N.
        let axis = |v: f64| Vector6::new(0.0, 0.0, v, 0.0, 0.0, 0.0);
        let errors = [&axis(0.02), &axis(0.1)];
        let w = wrench(&space("low"), &sensed(&lambda(), &free(), errors), &Vector6::repeat(100.0), &axis(3.0));
        assert_relative_eq!(w, axis(-3.0 - 2.0 - 0.2 * 1000f64.sqrt()), epsilon = 1e-9);
    }

    #[test]
    fn a_shaped_spring_by_hand() {
        // The same numbers are accelerations: D = 2 sqrt(100) = 20 1/s, and everything is multiplied by 10 kg.
        let axis = |v: f64| Vector6::new(0.0, 0.0, v, 0.0, 0.0, 0.0);
        let errors = [&axis(0.02), &axis(0.1)];
        let w = wrench(&space("osc"), &sensed(&lambda(), &free(), errors), &Vector6::repeat(100.0), &axis(3.0));
        assert_relative_eq!(w, axis(-10.0 * (3.0 + 2.0 + 2.0)), epsilon = 1e-9);
    }

    #[test]
    fn every_axis_is_pushed_back() {
        let (none, k) = (Vector6::zeros(), Vector6::repeat(50.0));
        for name in ["low", "osc"] {
            for axis in 0..6 {
                let mut e = none;
                e[axis] = 0.01;
                let w = wrench(&space(name), &sensed(&lambda(), &free(), [&e, &none]), &k, &none);
                assert!(w[axis] < 0.0 && w.dot(&e) == w[axis] * e[axis] && w.amax() == -w[axis]);
                let w = wrench(&space(name), &sensed(&lambda(), &free(), [&none, &e]), &k, &none);
                assert!(w[axis] < 0.0 && w.amax() == -w[axis]);
            }
        }
    }

    /// A spring pulls along x and the damper brakes as much: an arm whose inertia couples x and z must not push along z.
    #[test]
    fn steady_sliding_leaves_the_force_axis_alone() {
        let y = random_arm(3);
        let lambda = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        assert!(lambda.lambda_p[(2, 0)].abs() > 0.01 * lambda.lambda_p[(2, 2)], "x and z are coupled");
        let engaged = ForceAxis { engagement: 1.0, ..free() };
        // K = 100, D = 20: 0.01 m behind and 0.05 m/s forward.
        let along_x = |v: f64| Vector6::new(v, 0.0, 0.0, 0.0, 0.0, 0.0);
        let errors = [&along_x(-0.01), &along_x(0.05)];
        let w = wrench(&space("osc"), &sensed(&lambda, &engaged, errors), &Vector6::repeat(100.0), &Vector6::zeros());
        assert_relative_eq!(w, Wrench::zeros(), epsilon = 1e-9);
    }

    #[test]
    fn an_axis_engaged_by_half_has_half_of_the_stiffness() {
        let half = ForceAxis { engagement: 0.5, ..free() };
        let (e, k, f_ff) = (Vector6::repeat(0.01), Vector6::repeat(100.0), Vector6::repeat(2.0));
        let w = wrench(&space("low"), &sensed(&lambda(), &half, [&e, &Vector6::zeros()]), &k, &f_ff);
        assert_relative_eq!(w, Vector6::new(-3.0, -3.0, -1.5, -3.0, -3.0, -3.0), epsilon = 1e-12);
    }

    #[test]
    fn an_engaged_axis_gives_up_stiffness_and_keeps_damping() {
        let engaged = ForceAxis { engagement: 1.0, ..free() };
        let none = Vector6::zeros();
        for name in ["low", "osc"] {
            let space = ActionSpace { damping_ratio: Gains::all(0.0), ..space(name) };
            let (e, k) = (Vector6::repeat(0.01), Vector6::repeat(100.0));
            let still = wrench(&space, &sensed(&lambda(), &engaged, [&e, &none]), &k, &Vector6::repeat(2.0));
            assert!(still[2].abs() < 1e-9 && still[0] < 0.0 && still[5] < 0.0);
            // With no damping of its own the axis still has 60 Ns/m (5 1/s of 10 kg is less).
            let moving = wrench(&space, &sensed(&lambda(), &engaged, [&none, &Vector6::repeat(0.1)]), &k, &none);
            assert_relative_eq!(moving, Vector6::new(0.0, 0.0, -6.0, 0.0, 0.0, 0.0), epsilon = 1e-9);
        }
    }
}
