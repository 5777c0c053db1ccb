//! The whole controller: its formula, its signs, its limits, and a tool that meets a table.

use super::*;
use crate::law::action_space::RateRule;
use crate::law::gains::Gains;
use crate::law::goal::GoalRule;
use crate::law::interpolator::Interpolation;
use crate::law::psi::Psi;
use crate::spatial::{Vector3, linear, pose_error};
use crate::testing::{adaptive, gantry, move_gantry, psi, random_arm, space};
use approx::assert_relative_eq;
use proptest::prelude::*;

const INERTIA: [f64; 6] = [6.0, 4.0, 12.0, 0.5, 0.4, 0.3];

fn unlimited() -> Arm {
    Arm { torque_max: [1e6; 7], torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA }
}

fn controller(space: &ActionSpace, config: &ControllerConfig, arm: Arm) -> Controller {
    Controller::new(space, config, &arm, Vector3::z_axis()).unwrap()
}

/// An action of `space` that asks for nothing but the given pose delta (entries) and force (entry).
fn action(space: &ActionSpace, delta: [f64; 6], force: f64) -> Vec<f64> {
    let mut action = vec![0.0; space.dim() - 6 - usize::from(space.force)];
    action.extend(delta);
    action.extend(space.force.then_some(force));
    action
}

#[test]
fn osc_torque_is_robosuites_formula() {
    let mut y = random_arm(21);
    let mut control = controller(&space("osc"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    let q0 = y.q;
    control.set_goal(&[0.4, -0.2, 0.6, 0.1, -0.3, 0.2], &y);
    let offset = JointVector::from([0.1, -0.2, 0.05, 0.3, -0.1, 0.2, 0.15]);
    y.q += offset;
    y.pose = Pose::new(Vector3::new(0.01, 0.02, -0.03), Vector3::new(0.05, -0.02, 0.04));
    let tau = control.update(&y);

    // Written out again, with plain inverses and without anything of this crate but the pose error.
    let x_d = Pose::new(
        Vector3::new(0.02, -0.01, 0.03) / 25.0,
        Vector3::new(0.05, -0.15, 0.1) / 25.0, // the first of 25 equal steps
    );
    let e = pose_error(&y.pose, &x_d);
    let f = -150.0 * e - 2.0 * 150f64.sqrt() * y.twist;
    let inverse = y.mass.try_inverse().unwrap();
    let (jp, jo) = (y.jacobian.fixed_rows::<3>(0).into_owned(), y.jacobian.fixed_rows::<3>(3).into_owned());
    let lambda_p = (jp * inverse * jp.transpose()).try_inverse().unwrap();
    let lambda_o = (jo * inverse * jo.transpose()).try_inverse().unwrap();
    let lambda = (y.jacobian * inverse * y.jacobian.transpose()).try_inverse().unwrap();
    let task = jp.transpose() * lambda_p * f.fixed_rows::<3>(0) + jo.transpose() * lambda_o * f.fixed_rows::<3>(3);
    let posture = y.mass * (10.0 * (q0 - y.q) - 2.0 * 10f64.sqrt() * y.qd);
    let null = posture - y.jacobian.transpose() * lambda * y.jacobian * inverse * posture;
    assert_relative_eq!(tau, task + y.bias + null, max_relative = 1e-7, epsilon = 1e-7);
}

#[test]
fn a_displaced_tool_is_pulled_back_in_every_space_and_axis() {
    for space in ActionSpace::built_in() {
        for axis in 0..6 {
            for side in [-1.0, 1.0] {
                let mut y = gantry(INERTIA);
                let mut control = controller(&space, &ControllerConfig::default(), unlimited());
                control.reset(&y);
                let mut e = [0.0; 6];
                e[axis] = 0.01 * side;
                y.pose = Pose::new(Vector3::new(e[0], e[1], e[2]), Vector3::new(e[3], e[4], e[5]));
                let tau = control.update(&y);
                assert!(tau[axis] * side < 0.0, "{space} {axis}");
                assert_relative_eq!(tau.amax(), tau[axis].abs());
                // The sine of 0.01 rad is 2e-7 less.
                assert_relative_eq!(control.error()[axis], e[axis], epsilon = 2e-7);
            }
        }
    }
}

#[test]
fn a_positive_entry_moves_the_tool_along_the_positive_axis() {
    for space in ActionSpace::built_in() {
        for axis in 0..6 {
            let mut y = gantry(INERTIA);
            let mut control = controller(&space, &ControllerConfig::default(), unlimited());
            control.reset(&y);
            let mut delta = [0.0; 6];
            delta[axis] = 0.5;
            control.set_goal(&action(&space, delta, -1.0), &y);
            for _ in 0..100 {
                let tau = control.update(&y);
                move_gantry(&mut y, &tau, &Wrench::zeros(), 0.002);
            }
            let moved = pose_error(&y.pose, &Pose::identity());
            assert!(moved[axis] > 1e-3 && (moved.amax() - moved[axis]).abs() < 1e-12, "{space} {axis}: {moved}");
        }
    }
}

#[test]
fn shaped_stiffness_is_reported_in_both_units() {
    let y = gantry(INERTIA);
    let mut control = controller(&space("variable"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    let mut entries = [0.0; 12];
    entries[2] = 1.0; // kp_z = 300 takes effect at once
    control.set_goal(&entries, &y);
    assert_eq!(control.own_stiffness()[2], 300.0);
    assert_relative_eq!(control.stiffness()[2], 3600.0, epsilon = 1e-9);
    assert_relative_eq!(control.stiffness()[3], 75.0, epsilon = 1e-9);
    let mut low = controller(&space("low"), &ControllerConfig::default(), unlimited());
    low.reset(&y);
    assert_eq!((low.stiffness()[0], low.stiffness()[5]), (150.0, 10.0));
}

/// Lowers the tool onto an elastic table at z = 0 and presses for 4 s; returns the force on the tool and the controller.
fn press(space: &ActionSpace, force_entry: f64) -> (f64, Controller) {
    let goal = GoalRule::Continued { leash_position: 0.03, leash_rotation: 0.1 };
    let space = ActionSpace { goal, ..space.clone() };
    let config = ControllerConfig { position_step: 0.02, rotation_step: 0.15, ..ControllerConfig::default() };
    let mut y = gantry(INERTIA);
    y.pose.translation.z = 0.005;
    let mut control = controller(&space, &config, unlimited());
    control.reset(&y);
    let dt = config.dt();
    let filter = 1.0 - (-dt * std::f64::consts::TAU * 100.0).exp();
    for sample in 0..2000 {
        if sample % 25 == 0 {
            // Down at 2 cm/s until contact has engaged the force controller.
            let down = if control.engagement() == 0.0 { -0.05 } else { 0.0 };
            control.set_goal(&action(&space, [0.0, 0.0, down, 0.0, 0.0, 0.0], force_entry), &y);
        }
        let tau = control.update(&y);
        let table = Wrench::new(0.0, 0.0, (-1e4 * y.pose.translation.z).max(0.0), 0.0, 0.0, 0.0);
        move_gantry(&mut y, &tau, &table, dt);
        y.wrench += filter * (table - y.wrench);
    }
    (y.wrench[2], control)
}

#[test]
fn a_commanded_force_is_exerted_on_the_table_below() {
    for space in ActionSpace::built_in().into_iter().filter(|space| space.force) {
        let (force, control) = press(&space, -0.6); // 10 of 50 N
        assert!((force - 10.0).abs() < 0.3, "{space}: {force}");
        assert_eq!(control.engagement(), 1.0);
        assert!((5.0..15.0).contains(&control.force_command()), "{space}");
    }
}

#[test]
fn a_share_of_the_spring_acts_while_force_control_takes_over() {
    let mut y = gantry(INERTIA);
    let mut control = controller(&space("low-force"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    y.wrench[2] = 10.0;
    while control.engagement() < 0.5 {
        control.update(&y);
    }
    let share = control.engagement();
    assert!(share < 0.6, "{share}");
    y.pose = Pose::new(Vector3::new(0.01, 0.0, 0.01), Vector3::zeros());
    let tau = control.update(&y);
    assert_relative_eq!(tau[0], -150.0 * 0.01, epsilon = 1e-9);
    assert_relative_eq!(tau[2], -(1.0 - share) * 150.0 * 0.01 - control.force_command(), epsilon = 1e-9);
}

#[test]
fn the_law_does_not_see_the_contact_axis_once_engaged() {
    let (force, control) = press(&ActionSpace { force: true, ..adaptive(psi()) }, -0.6);
    assert_relative_eq!(force, 10.0, epsilon = 0.3);
    // Stiffness has relaxed to its floor there, and no feed-forward pushes.
    assert_eq!(control.stiffness()[2], 50.0);
    assert_relative_eq!(control.feedforward()[2], 0.0, epsilon = 1e-9);
}

/// Along the contact axis force control determines how the tool moves: a damper that followed the set-point would push against it.
#[test]
fn along_an_engaged_axis_the_damper_does_not_follow_the_set_point() {
    let space = ActionSpace { rate: RateRule::SetPoint, ..space("low-force") };
    let damper = |push: f64| {
        let mut y = gantry(INERTIA);
        y.wrench[2] = push;
        let mut control = controller(&space, &ControllerConfig::default(), unlimited());
        control.reset(&y);
        for _ in 0..100 {
            control.update(&y);
        }
        // Half a step, 2.5 cm, along x and down, in 50 ms.
        control.set_goal(&action(&space, [0.5, 0.0, -0.5, 0.0, 0.0, 0.0], -1.0), &y);
        control.update(&y);
        (control.engagement(), *control.damper_wrench())
    };
    // The tool rests: D e_dot = -2 sqrt(K m) x_d_dot, with K = 150 N/m, and 6 kg along x and 12 along z.
    let along = |x: f64, z: f64| Vector6::new(-2.0 * 900f64.sqrt() * x, 0.0, -2.0 * 1800f64.sqrt() * z, 0.0, 0.0, 0.0);
    for (push, engagement, expected) in [(0.0, 0.0, along(0.5, -0.5)), (10.0, 1.0, along(0.5, 0.0))] {
        let (engaged, wrench) = damper(push);
        assert_eq!(engaged, engagement, "{push} N");
        assert_relative_eq!(wrench, expected, epsilon = 1e-9);
    }
}

/// A spring that a torque limit cuts does not stiffen, whatever the error.
#[test]
fn stiffness_does_not_grow_while_its_torque_is_cut() {
    let weak = Arm { torque_max: [5.0; 7], ..unlimited() };
    let grown = |anti_windup: bool| {
        let space = adaptive(Psi { anti_windup, ..*space("aforce").psi().unwrap() });
        let mut y = gantry(INERTIA);
        let mut control = controller(&space, &ControllerConfig::default(), weak);
        control.reset(&y);
        // 6 cm at 500 N/m ask for 30 N.
        y.pose.translation.x = 0.06;
        for _ in 0..200 {
            control.update(&y);
        }
        control.own_stiffness()[0] - 500.0
    };
    // dt (beta e - gamma) = 0.002 (72 000 * 0.06 - 2700) = 3.24 N/m a sample. At the first sample no torque had been cut.
    assert_relative_eq!(grown(true), 3.24, epsilon = 1e-6);
    assert_relative_eq!(grown(false), 200.0 * 3.24, epsilon = 1e-6);
}

#[test]
fn a_broken_measurement_is_a_fault_and_leaves_no_trace() {
    let y = gantry(INERTIA);
    let mut control = controller(&space("aforce-force"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    let healthy = control.update(&y);
    for spoil in [
        |y: &mut Measurement| y.pose.translation.x = f64::NAN,
        |y: &mut Measurement| y.twist[4] = f64::INFINITY,
        |y: &mut Measurement| y.mass[(3, 3)] = f64::NAN,
        |y: &mut Measurement| y.wrench[2] = f64::NAN,
        |y: &mut Measurement| y.q[2] = f64::NAN,
    ] {
        let mut broken = y.clone();
        broken.bias = JointVector::repeat(0.5);
        spoil(&mut broken);
        let faults = control.faults();
        assert_eq!(control.update(&broken), JointVector::repeat(0.5));
        control.set_goal(&[0.0; 7], &broken);
        assert_eq!(control.faults(), faults + 1);
        let after = control.update(&y);
        assert!((after - healthy).amax() < 1e-6);
    }
}

#[test]
fn a_space_without_force_reads_no_wrench() {
    let y = gantry(INERTIA);
    for name in ["aforce", "variable", "osc", "low"] {
        let mut control = controller(&space(name), &ControllerConfig::default(), unlimited());
        control.reset(&y);
        control.set_goal(&vec![0.5; control.space().dim()], &y);
        let mut without = control.clone();
        let unmeasured = Measurement { wrench: Wrench::repeat(f64::NAN), ..y.clone() };
        for _ in 0..25 {
            assert_eq!(control.update(&unmeasured), without.update(&y), "{name}");
        }
        assert_eq!(control.faults(), 0);
    }
}

#[test]
fn reset_restores_the_beginning() {
    let config = ControllerConfig::default();
    for space in ActionSpace::built_in() {
        let mut y = gantry(INERTIA);
        let mut control = controller(&space, &config, unlimited());
        let mut episode = || {
            let mut last = JointVector::zeros();
            y = gantry(INERTIA);
            control.reset(&y);
            for sample in 0..200 {
                if sample % 25 == 0 {
                    control.set_goal(&action(&space, [0.3, -0.2, 0.9, 0.1, 0.5, -0.4], 0.1), &y);
                }
                last = control.update(&y);
                y.wrench[2] = 10.0;
                move_gantry(&mut y, &last, &Wrench::zeros(), 0.002);
            }
            last
        };
        let first = episode();
        assert_eq!(first, episode(), "{space}: the second episode must repeat the first to the bit");
    }
}

#[test]
fn an_unstable_law_is_refused() {
    let unstable = Psi { alpha: Gains::pair(7000.0, 5.0), ..psi() };
    let build = |psi| Controller::new(&adaptive(psi), &ControllerConfig::default(), &unlimited(), Vector3::z_axis());
    let error = build(unstable).unwrap_err().to_string();
    assert!(error.starts_with("space.stiffness.adaptive.alpha (axis x) = 7000 is unstable"), "{error}");
    build(Psi { allow_unstable: true, ..unstable }).unwrap();
}

#[test]
fn commanded_parameters_hold_for_ten_actions() {
    let y = gantry(INERTIA);
    let mut control = controller(&space("aforce-psi"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    // k_min of the translational axes. Actions 0, 10 and 20 choose; what comes between has no effect.
    let floor_after = |control: &mut Controller, entry: f64| {
        control.set_goal(&[0.0, 0.0, entry, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], &y);
        control.psi().unwrap().k_min[0]
    };
    for (first, floor) in [(1.0, 900.0), (-1.0, 100.0), (0.0, 300.0)] {
        assert_relative_eq!(floor_after(&mut control, first), floor, max_relative = 1e-12);
        for _ in 1..10 {
            assert_relative_eq!(floor_after(&mut control, 0.5), floor, max_relative = 1e-12);
        }
    }
    // An entry of 0 is the geometric mean: the tolerance is that of `aforce`.
    assert_relative_eq!(control.psi().unwrap().tolerance()[0], 0.0375, max_relative = 1e-9);
    control.reset(&y);
    assert_eq!(control.psi().unwrap().k_min[0], 300.0, "an episode begins with the record's own");
}

#[test]
fn the_parts_of_the_wrench_add_up() {
    let mut y = random_arm(5);
    let mut control = controller(&space("aforce-force"), &ControllerConfig::default(), unlimited());
    control.reset(&y);
    y.pose = Pose::new(Vector3::new(0.02, -0.01, 0.03), Vector3::new(0.1, 0.0, -0.1));
    for _ in 0..50 {
        control.update(&y);
    }
    let sum = -control.feedforward() - control.spring_wrench() - control.damper_wrench();
    assert_relative_eq!(*control.wrench(), sum, epsilon = 1e-9);
    assert_relative_eq!(control.spring_wrench(), control.stiffness().component_mul(control.error()), epsilon = 1e-9);
    assert!(control.feedforward().norm() > 1e-3 && control.damper_wrench().norm() > 1e-3);
    let power = control.power();
    assert_relative_eq!(power[0] + power[1], control.wrench().dot(&y.twist), epsilon = 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn limits_hold_under_random_goals(
        which in 0..ActionSpace::built_in().len(),
        jerk_limited: bool,
        continued: bool,
        entries in prop::collection::vec(prop::array::uniform13(-1.5..1.5f64), 12),
        push in prop::array::uniform6(-40.0..40.0f64),
    ) {
        let mut space = ActionSpace::built_in().swap_remove(which);
        let mut config = ControllerConfig::default();
        if jerk_limited {
            config.interpolation = Interpolation::JerkLimited { dynamics: 1.0 };
        }
        if continued {
            space.goal = GoalRule::Continued { leash_position: 0.02, leash_rotation: 0.15 };
        }
        let max = [80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0];
        let mut control = controller(&space, &config, Arm { torque_max: max, torque_rate_max: [1000.0; 7], ..Arm::PANDA });
        let mut y = gantry(INERTIA);
        control.reset(&y);
        let mut previous = y.bias;
        for entry in entries {
            control.set_goal(&entry[..space.dim()], &y);
            let goal = pose_error(control.goal(), &y.pose);
            if continued {
                prop_assert!(linear(&goal).norm() <= 0.02 + 1e-9);
            }
            for _ in 0..25 {
                let tau = control.update(&y);
                for i in 0..7 {
                    prop_assert!(tau[i].abs() <= max[i] && (tau[i] - previous[i]).abs() <= 2.0 + 1e-9);
                }
                for (axis, k) in control.own_stiffness().iter().enumerate() {
                    match control.stiffness_bounds(axis) {
                        // Bounds that an action moved are reached at a limited rate.
                        Some([low, high]) if space.commanded_psi.is_none() => prop_assert!((low..=high).contains(k)),
                        Some(_) => prop_assert!((7.0..=3000.0).contains(k)),
                        None => prop_assert_eq!(*k, space.stiffness.at_reset()[axis]),
                    }
                }
                prop_assert!(control.force_command().abs() <= 50.0);
                previous = tau;
                y.wrench = Vector6::from(push);
                move_gantry(&mut y, &tau, &Vector6::from(push), 0.002);
            }
        }
        prop_assert_eq!(control.faults(), 0);
    }
}
