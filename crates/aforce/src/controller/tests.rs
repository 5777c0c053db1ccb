//! The whole controller: its formula, its signs, its limits, and a tool that meets a table.

use super::*;
use crate::adaptive_impedance::{AdaptiveImpedance, DeltaSign};
use crate::interpolator::Interpolation;
use crate::reference::Reference;
use crate::spatial::{Vector3, linear};
use crate::testing::{gantry, move_gantry, random_arm, robosuite_steps};
use approx::assert_relative_eq;
use proptest::prelude::*;

const INERTIA: [f64; 6] = [6.0, 4.0, 12.0, 0.5, 0.4, 0.3];
const UNLIMITED: TorqueLimits = TorqueLimits { max: JointVector::from_array_storage(ARRAY), rate: None };
const ARRAY: nalgebra::ArrayStorage<f64, 7, 1> = nalgebra::ArrayStorage([[1e6; 7]]);

fn controller(name: &str, config: &ControllerConfig, limits: TorqueLimits) -> Controller {
    Controller::new(name.parse().unwrap(), config, limits, Vector3::z_axis()).unwrap()
}

/// An action of `name` that asks for nothing but the given pose delta (entries) and force (entry).
fn action(name: &str, delta: [f64; 6], force: f64) -> Vec<f64> {
    let space: ActionSpace = name.parse().unwrap();
    let mut action = vec![0.0; if space.impedance == Impedance::Commanded { 6 } else { 0 }];
    action.extend(delta);
    action.extend(space.force.then_some(force));
    action
}

#[test]
fn osc_torque_is_robosuites_formula() {
    let mut y = random_arm(21);
    let mut control = controller("osc", &robosuite_steps(), UNLIMITED);
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
    for space in ActionSpace::ALL {
        for axis in 0..6 {
            for side in [-1.0, 1.0] {
                let mut y = gantry(INERTIA);
                let mut control = controller(space.name(), &ControllerConfig::default(), UNLIMITED);
                control.reset(&y);
                let mut e = [0.0; 6];
                e[axis] = 0.01 * side;
                y.pose = Pose::new(Vector3::new(e[0], e[1], e[2]), Vector3::new(e[3], e[4], e[5]));
                let tau = control.update(&y);
                assert!(tau[axis] * side < 0.0, "{space} {axis}");
                assert_relative_eq!(tau.amax(), tau[axis].abs());
                assert_relative_eq!(control.error()[axis], e[axis], epsilon = 1e-12);
            }
        }
    }
}

#[test]
fn a_positive_entry_moves_the_tool_along_the_positive_axis() {
    for space in ActionSpace::ALL {
        for axis in 0..6 {
            let mut y = gantry(INERTIA);
            let mut control = controller(space.name(), &robosuite_steps(), UNLIMITED);
            control.reset(&y);
            let mut delta = [0.0; 6];
            delta[axis] = 0.5;
            control.set_goal(&action(space.name(), delta, -1.0), &y);
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
    let mut control = controller("variable", &ControllerConfig::default(), UNLIMITED);
    control.reset(&y);
    let mut entries = [0.0; 12];
    entries[2] = 1.0; // kp_z = 300 takes effect at once
    control.set_goal(&entries, &y);
    assert_eq!(control.own_stiffness()[2], 300.0);
    assert_relative_eq!(control.stiffness()[2], 3600.0, epsilon = 1e-9);
    assert_relative_eq!(control.stiffness()[3], 75.0, epsilon = 1e-9);
    let mut low = controller("low", &ControllerConfig::default(), UNLIMITED);
    low.reset(&y);
    assert_eq!((low.stiffness()[0], low.stiffness()[5]), (150.0, 10.0));
}

/// The configuration with one way to form the goal in every action space.
fn with_reference(config: &ControllerConfig, reference: Reference) -> ControllerConfig {
    let mut config = *config;
    let settings = &mut config.impedance;
    for level in [&mut settings.low, &mut settings.mid, &mut settings.high, &mut settings.osc] {
        level.form.reference = reference;
    }
    settings.aforce.form.reference = reference;
    settings.variable.form.reference = reference;
    config
}

/// Lowers the tool onto an elastic table at z = 0 and presses for 4 s; returns the force on the tool and the controller.
fn press(name: &str, config: &ControllerConfig, force_entry: f64) -> (f64, Controller) {
    let reference = Reference::Continued { leash_position: 0.03, leash_rotation: 0.1 };
    let config = &with_reference(config, reference);
    let mut y = gantry(INERTIA);
    y.pose.translation.z = 0.005;
    let mut control = controller(name, config, UNLIMITED);
    control.reset(&y);
    let dt = config.dt();
    let filter = 1.0 - (-dt * std::f64::consts::TAU * 100.0).exp();
    for sample in 0..2000 {
        if sample % 25 == 0 {
            // Down at 5 cm/s until contact has engaged the force controller.
            let down = if control.engagement() == 0.0 { -0.05 } else { 0.0 };
            control.set_goal(&action(name, [0.0, 0.0, down, 0.0, 0.0, 0.0], force_entry), &y);
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
    for name in ["aforce-force", "variable-force", "low-force", "mid-force", "high-force", "osc-force"] {
        let (force, control) = press(name, &ControllerConfig::default(), -0.6); // 10 of 50 N
        assert_relative_eq!(force, 10.0, epsilon = 0.3);
        assert_eq!(control.engagement(), 1.0);
        assert!((5.0..15.0).contains(&control.force_command()), "{name}");
    }
}

#[test]
fn a_share_of_the_spring_acts_while_force_control_takes_over() {
    let mut y = gantry(INERTIA);
    let mut control = controller("low-force", &ControllerConfig::default(), UNLIMITED);
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
    let mut config = ControllerConfig::default();
    config.impedance.aforce = AdaptiveImpedance::physical();
    let (force, control) = press("aforce-force", &config, -0.6);
    assert_relative_eq!(force, 10.0, epsilon = 0.3);
    // Stiffness has relaxed to its floor there, and no feed-forward pushes.
    assert_eq!(control.stiffness()[2], 50.0);
    assert_relative_eq!(control.feedforward()[2], 0.0, epsilon = 1e-9);
}

#[test]
fn a_broken_measurement_is_a_fault_and_leaves_no_trace() {
    let y = gantry(INERTIA);
    let mut control = controller("aforce-force", &ControllerConfig::default(), UNLIMITED);
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
fn reset_restores_the_beginning() {
    let config = ControllerConfig::default();
    for space in ActionSpace::ALL {
        let mut y = gantry(INERTIA);
        let mut control = controller(space.name(), &config, UNLIMITED);
        let mut episode = || {
            let mut last = JointVector::zeros();
            y = gantry(INERTIA);
            control.reset(&y);
            for sample in 0..200 {
                if sample % 25 == 0 {
                    control.set_goal(&action(space.name(), [0.3, -0.2, 0.9, 0.1, 0.5, -0.4], 0.1), &y);
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
fn an_unstable_law_is_refused_only_where_it_is_used() {
    let mut config = ControllerConfig::default();
    config.impedance.aforce.translation.feedforward_gain = 700.0;
    let limits = UNLIMITED;
    let error = Controller::new("aforce".parse().unwrap(), &config, limits, Vector3::z_axis()).unwrap_err();
    assert!(error.to_string().starts_with("impedance.aforce.translation: feedforward_gain (alpha) = 700 is unstable"));
    controller("osc", &config, limits);
    config.impedance.aforce.allow_unstable = true;
    controller("aforce", &config, limits);
    config.impedance.aforce.allow_unstable = false;
    config.impedance.aforce.sign = DeltaSign::Literal;
    config.impedance.aforce.translation.feedforward_gain = 20.0;
    controller("aforce", &config, limits);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn limits_hold_under_random_goals(
        which in 0..12usize,
        jerk_limited: bool,
        continued: bool,
        entries in prop::collection::vec(prop::array::uniform13(-1.5..1.5f64), 12),
        push in prop::array::uniform6(-40.0..40.0f64),
    ) {
        let space = ActionSpace::ALL[which];
        let mut config = ControllerConfig::default();
        if jerk_limited {
            config.interpolation = Interpolation::JerkLimited { dynamics: 1.0 };
        }
        let reference = match continued {
            true => Reference::Continued { leash_position: 0.02, leash_rotation: 0.15 },
            false => Reference::Rebased {},
        };
        config = with_reference(&config, reference);
        let max = JointVector::from([80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0]);
        let limits = TorqueLimits { max, rate: Some(JointVector::repeat(1000.0)) };
        let mut control = controller(space.name(), &config, limits);
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
                prop_assert!(control.own_stiffness().iter().all(|k| (0.0..=1500.0).contains(k)));
                prop_assert!(control.force_command().abs() <= 50.0);
                previous = tau;
                y.wrench = Vector6::from(push);
                move_gantry(&mut y, &tau, &Vector6::from(push), 0.002);
            }
        }
        prop_assert_eq!(control.faults(), 0);
    }
}
