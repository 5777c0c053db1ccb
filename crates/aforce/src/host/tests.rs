//! What a host can count on, on a gantry: six axes along and about the world's, and an idle seventh joint.

use super::*;
use crate::action::encode;
use crate::action_space::RateRule;
use crate::arm::Arm;
use crate::config::ControllerConfig;
use crate::controller::Controller;
use crate::force::ForceConfig;
use crate::goal::GoalRule;
use crate::interpolator::Interpolation;
use crate::spatial::{JointVector, Measurement, Pose, Vector6, Wrench, linear};
use crate::testing::{gantry, move_gantry, space};
use approx::assert_relative_eq;
use nalgebra::Vector3;

const DT: f64 = 0.001;
const INERTIA: [f64; 6] = [6.0, 4.0, 12.0, 0.5, 0.4, 0.3];
/// Where the gantry stands at first, within the default workspace.
const HOME: [f64; 3] = [0.5, 0.0, 0.3];

/// A gantry without limits of its own, at 1 kHz, with jerk-limited set-points.
fn setup(name: &str) -> HostSetup {
    let arm = Arm {
        range: [[-10.0, 10.0]; 7],
        speed_max: [10.0; 7],
        torque_max: [500.0; 7],
        torque_rate_max: [1e5; 7],
        ..Arm::PANDA
    };
    let controller = ControllerConfig {
        control_hz: 1000,
        interpolation: Interpolation::JerkLimited { dynamics: 0.3 },
        force: ForceConfig { ki: 8.0, ..ForceConfig::default() },
        ..ControllerConfig::default()
    };
    HostSetup {
        contact_axis: [0.0, 0.0, 1.0],
        arm,
        interface: ArmInterface::PLAIN,
        limits: HostLimits::default(),
        controller,
        space: space(name),
    }
}

/// No bound at all.
fn endless() -> HostLimits {
    const FREE: f64 = f64::INFINITY;
    HostLimits {
        silence_max: FREE,
        error_max: [FREE; 2],
        wrench_max: [FREE; 2],
        wrench_rate_max: [FREE; 2],
        external_max: [FREE; 2],
        workspace: [[-FREE; 3], [FREE; 3]],
        joint_margin: 0.0,
        joint_stiffness: [0.0; 7],
        contact_loss: FREE,
        tank: TankConfig { initial: FREE, capacity: FREE, low: 0.0 },
        ..HostLimits::default()
    }
}

fn state(y: &Measurement, tau: &JointVector) -> ArmState {
    ArmState {
        q: y.q,
        qd: y.qd,
        pose: y.pose,
        jacobian: y.jacobian,
        mass: y.mass,
        gravity: y.bias,
        coriolis: JointVector::zeros(),
        wrench: y.wrench,
        tau: *tau,
    }
}

/// A gantry with its host.
struct Plant {
    host: Host,
    y: Measurement,
    tau: JointVector,
}

impl Plant {
    fn new(setup: &HostSetup) -> Self {
        let mut y = gantry(INERTIA);
        y.pose.translation.vector = HOME.into();
        let mut host = Host::new(setup).unwrap();
        host.start(&state(&y, &JointVector::zeros()), &y.pose).unwrap();
        Self { host, y, tau: JointVector::zeros() }
    }

    /// One cycle, in which the environment exerts `external`.
    fn step(&mut self, external: &Wrench) -> Status {
        self.spoilt_step(external, DT, |_| ())
    }

    /// The same, of which the host is told `period` (s) and a spoilt state.
    fn spoilt_step(&mut self, external: &Wrench, period: f64, spoil: impl FnOnce(&mut ArmState)) -> Status {
        self.y.wrench = *external;
        let mut told = state(&self.y, &self.tau);
        spoil(&mut told);
        let command = self.host.update(&told, period);
        self.tau = command.tau;
        move_gantry(&mut self.y, &self.tau, external, DT);
        command.status
    }

    /// A millisecond's cycles under one action after the other.
    fn act(&mut self, action: &[f64], cycles: usize) -> Status {
        let mut status = Status::Stopped;
        for cycle in 0..cycles {
            if cycle % 50 == 0 {
                self.host.set_goal(action).unwrap();
            }
            status = self.step(&Wrench::zeros());
        }
        status
    }

    fn position(&self) -> Vector3<f64> {
        self.y.pose.translation.vector
    }
}

fn still(host: &Host) -> Vec<f64> {
    encode(host.controller().space(), &ControllerConfig::default(), &Vector6::zeros(), 0.0)
}

#[test]
fn without_bounds_a_host_is_the_controller_bit_by_bit() {
    for name in ["aforce-force", "variable", "osc", "aforce-psi"] {
        let setup = HostSetup { limits: endless(), ..setup(name) };
        let mut plant = Plant::new(&setup);
        let limits = setup.arm.torque_limits().unwrap();
        let mut alone = Controller::new(&setup.space, &setup.controller, limits, nalgebra::Vector3::z_axis()).unwrap();
        alone.reset(&plant.y);
        for cycle in 0..2000 {
            if cycle % 50 == 0 {
                let action = vec![f64::sin(f64::from(cycle)); setup.space.dim()];
                // A cycle of no length hands over the state from which the action counts.
                plant.host.update(&state(&plant.y, &plant.tau), 0.0);
                plant.host.set_goal(&action).unwrap();
                alone.set_goal(&action, &plant.y);
            }
            let push = (plant.position().z - 0.3) * -2e3;
            let wrench = Wrench::new(0.0, 0.0, push.max(0.0), 0.0, 0.0, 0.0);
            let y = Measurement { wrench, ..plant.y.clone() };
            let expected = alone.update(&y);
            let status = plant.step(&wrench);
            assert_eq!(status, Status::Running, "{name}, cycle {cycle}");
            assert_eq!(plant.tau, expected, "{name}, cycle {cycle}");
        }
    }
}

#[test]
fn a_fault_latches_holds_and_relaxes_until_a_new_start() {
    let mut plant = Plant::new(&setup("aforce"));
    plant.act(&[0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 100);
    let moving = plant.y.twist.norm();
    assert!(moving > 0.01, "{moving}");
    let mut broken = state(&plant.y, &plant.tau);
    broken.mass[(2, 2)] = f64::NAN;
    let command = plant.host.update(&broken, DT);
    let fault = Fault::Unreadable { field: "mass" };
    assert_eq!(command.status, Status::Fault(fault));
    let held_at = plant.position();
    for _ in 0..3000 {
        assert_eq!(plant.step(&Wrench::zeros()), Status::Fault(fault), "a good measurement does not end it");
        assert_eq!(plant.host.set_goal(&[0.0; 6]), Err(NotTaken::NotRunning));
    }
    assert!(plant.host.is_relaxed());
    assert!(plant.y.twist.norm() < 1e-3 && (plant.position() - held_at).norm() < 0.05);
    // Relaxed: 20 Nm/rad, which the gantry's first axis has as 20 N/m. 1 N moves it by 5 cm.
    let before = plant.position().x;
    for _ in 0..5000 {
        plant.step(&Wrench::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    }
    assert_relative_eq!(plant.position().x - before, 0.05, epsilon = 2e-3);
    plant.host.stop();
    assert_eq!(plant.step(&Wrench::zeros()), Status::Fault(fault), "to stop is not to forget");
    plant.y.pose.translation.vector = HOME.into();
    plant.host.start(&state(&plant.y, &plant.tau), &plant.y.pose).unwrap();
    assert!(matches!(plant.act(&[0.0; 6], 50), Status::Running | Status::Limited(_)));
}

/// A gantry that has just begun to move, and where it is.
fn moving() -> (Plant, Vector3<f64>) {
    let mut plant = Plant::new(&setup("aforce"));
    plant.act(&[0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 100);
    assert!(plant.y.twist.norm() > 0.01);
    let position = plant.position();
    (plant, position)
}

/// Three seconds after a fault at `position`.
fn assert_held(plant: &Plant, position: &Vector3<f64>) {
    assert!(plant.host.is_relaxed());
    let (speed, distance) = (plant.y.twist.norm(), (plant.position() - position).norm());
    assert!(speed < 1e-3 && distance < 0.05, "{speed} m/s, {distance} m");
}

#[test]
fn a_hold_stops_the_tool_whatever_else_stays_unreadable() {
    type Spoil = fn(&mut ArmState);
    let spoils: [(&str, Spoil); 4] = [
        ("wrench", |state| state.wrench[2] = f64::NAN),
        ("mass", |state| state.mass[(0, 0)] = f64::NAN),
        ("jacobian", |state| state.jacobian[(1, 1)] = f64::INFINITY),
        ("tau", |state| state.tau[6] = f64::NAN),
    ];
    for (field, spoil) in spoils {
        let (mut plant, position) = moving();
        // It is also handed a weight, which only the present state tells.
        plant.y.bias[2] = 30.0;
        for _ in 0..3000 {
            let status = plant.spoilt_step(&Wrench::zeros(), DT, spoil);
            assert_eq!(status, Status::Fault(Fault::Unreadable { field }));
        }
        assert_held(&plant, &position);
    }
}

#[test]
fn a_hold_goes_on_when_the_clock_does_not() {
    for period in [f64::NAN, -0.001, 0.0, 1.0] {
        let (mut plant, position) = moving();
        // A few cycles of no length are believed.
        let believed = if period == 0.0 { 5 } else { 0 };
        for cycle in 0..3000 {
            let status = plant.spoilt_step(&Wrench::zeros(), period, |_| ());
            let is_fault = matches!(status, Status::Fault(Fault::Period { .. }));
            assert_eq!(is_fault, cycle >= believed, "{status:?} in cycle {cycle} of {period} s");
        }
        assert_held(&plant, &position);
    }
}

#[test]
fn a_silent_policy_and_a_stalled_loop_are_faults() {
    let mut plant = Plant::new(&setup("low"));
    plant.act(&[0.3; 6], 50);
    let mut cycles = 50; // Since the latest action, at cycle 0.
    let fault = loop {
        cycles += 1;
        if let Status::Fault(fault) = plant.step(&Wrench::zeros()) {
            break fault;
        }
    };
    assert!(matches!(fault, Fault::Silence { max: 0.25, .. }), "{fault}");
    assert!((250..=252).contains(&cycles), "{cycles}");
    for period in [-0.001, f64::NAN, 0.021] {
        let mut plant = Plant::new(&setup("low"));
        let command = plant.host.update(&state(&plant.y, &plant.tau), period);
        assert!(matches!(command.status, Status::Fault(Fault::Period { .. })), "{period}");
    }
}

#[test]
fn the_first_cycle_of_no_length_repeats_the_last_torque() {
    let setup = setup("low");
    let y = {
        let mut y = gantry(INERTIA);
        y.pose.translation.vector = HOME.into();
        y
    };
    let mut host = Host::new(&setup).unwrap();
    let tau = JointVector::from([1.0, -2.0, 3.0, 0.0, 0.5, 0.0, 0.0]);
    host.start(&state(&y, &tau), &y.pose).unwrap();
    assert_eq!(host.update(&state(&y, &tau), 0.0).tau, tau);
}

#[test]
fn a_start_is_refused_with_the_two_numbers_that_disagree() {
    let setup = HostSetup { arm: Arm { range: Arm::PANDA.range, ..setup("low").arm }, ..setup("low") };
    let mut host = Host::new(&setup).unwrap();
    let mut y = gantry(INERTIA);
    y.pose.translation.vector = HOME.into();
    y.q = JointVector::from([0.0, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8]);
    let good = state(&y, &JointVector::zeros());
    let mut refused = |spoil: &dyn Fn(&mut ArmState), model: &Pose| {
        let mut state = good.clone();
        spoil(&mut state);
        let error = host.start(&state, model).unwrap_err().to_string();
        assert_eq!(host.update(&good, DT).status, Status::Stopped);
        error
    };
    let shifted = Pose::new(Vector3::new(0.5, 0.0, 0.407), Vector3::zeros());
    assert_eq!(
        refused(&|_| {}, &shifted),
        "the arm's pose is 0.1070 m and 0.0000 rad from the model's kinematics; allowed: 0.002 m, 0.01 rad"
    );
    let nowhere = Pose::new(Vector3::repeat(f64::NAN), Vector3::zeros());
    assert!(refused(&|_| {}, &nowhere).starts_with("the arm's pose is NaN m"));
    let pose = good.pose;
    assert_eq!(refused(&|s| s.q[3] = 0.5, &pose), "joint 4 is at 0.5000 rad; its range: -3.0718 to -0.0698");
    assert_eq!(refused(&|s| s.qd[1] = -11.0, &pose), "joint 2 moves at 11.000 rad/s; allowed: 10");
    assert_eq!(refused(&|s| s.wrench[2] = 150.0, &pose), "the environment pushes with 150.0 N; allowed: 100");
    let outside = Pose::new(Vector3::new(0.5, 0.0, 1.2), Vector3::zeros());
    assert_eq!(refused(&|s| s.pose = outside, &outside), "the tool is at z = 1.2000 m; allowed: -0.1500 to 0.9500");
    host.start(&good, &pose).unwrap();
    assert_eq!(host.set_goal(&[0.0; 7]), Err(NotTaken::Length { found: 7, expected: 6 }));
}

#[test]
fn errors_are_clipped_and_the_wrench_keeps_its_bound_and_its_rate() {
    let limits =
        HostLimits { error_max: [0.02, 0.1], wrench_max: [12.0, 2.0], wrench_rate_max: [200.0, 50.0], ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("high") });
    let mut last = Wrench::zeros();
    // Somebody holds the tool aside: 10 cm of error at 1500 N/m were 150 N.
    plant.y.pose.translation.vector.x += 0.1;
    let mut strongest = 0.0f64;
    for _ in 0..100 {
        let status = plant.host.update(&state(&plant.y, &plant.tau), DT).status;
        assert!(matches!(status, Status::Limited(limited) if limited.contains(Limited::ERROR)), "{status:?}");
        let wrench = *plant.host.controller().wrench();
        assert!(linear(&(wrench - last)).norm() <= 0.2 + 1e-9, "200 N/s");
        strongest = strongest.max(linear(&wrench).norm());
        last = wrench;
    }
    assert!(strongest <= 12.0 + 1e-9 && strongest > 9.0, "{strongest}");
}

#[test]
fn goals_stay_in_the_workspace_and_a_tool_outside_of_it_is_a_fault() {
    let limits = HostLimits { workspace: [[0.4, -0.1, 0.2], [0.6, 0.1, 0.4]], ..HostLimits::default() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
    let status = plant.act(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3000);
    let Status::Limited(limited) = status else { panic!("{status:?}") };
    assert!(limited.contains(Limited::GOAL));
    assert!((plant.position().x - 0.6).abs() < 5e-3, "{}", plant.position());
    plant.y.pose.translation.vector.x = 0.66;
    assert!(matches!(plant.step(&Wrench::zeros()), Status::Fault(Fault::Workspace { axis: 'x', .. })));
}

#[test]
fn a_joint_near_its_end_is_pushed_back_and_beyond_it_is_a_fault() {
    let mut arm = setup("low").arm;
    arm.range[6] = [-0.5, 0.5]; // The idle joint: nothing else moves it.
    let mut plant = Plant::new(&HostSetup { arm, ..setup("low") });
    plant.y.q[6] = 0.45;
    plant.host.start(&state(&plant.y, &plant.tau), &plant.y.pose).unwrap();
    let Status::Limited(limited) = plant.step(&Wrench::zeros()) else { panic!() };
    assert!(limited.contains(Limited::JOINT_RANGE));
    assert_relative_eq!(plant.tau[6], -0.05 * 50.0, epsilon = 1e-9);
    plant.y.q[6] = 0.55;
    assert!(matches!(plant.step(&Wrench::zeros()), Status::Fault(Fault::JointRange { joint: 7, .. })));
}

/// The environment takes energy out of the arm wherever K grows at one end of a motion and falls at the other. The tank
/// pays until it is empty, and no longer.
#[test]
fn the_tank_bounds_what_growing_stiffness_pays() {
    let paid = |initial: f64| {
        let tank = TankConfig { initial, capacity: initial.max(1e-9), low: 0.1 };
        let limits = HostLimits { tank, ..endless() };
        let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
        let mut growth = 0.0;
        let mut level = initial;
        for _ in 0..4000 {
            // A hand holds the tool 4 cm aside of where the law wants it. The damper rests: nothing fills the tank.
            plant.y.pose.translation.vector = Vector3::from(HOME) + Vector3::x() * 0.04;
            let before = plant.host.acting_stiffness()[0];
            let e = plant.host.controller().error()[0];
            plant.host.update(&state(&plant.y, &plant.tau), DT);
            growth += 0.5 * e * e * (plant.host.acting_stiffness()[0] - before);
            assert!(plant.host.tank() >= 0.0 && plant.host.tank() <= level + 1e-9);
            level = plant.host.tank();
        }
        growth
    };
    let (rich, poor) = (paid(f64::INFINITY), paid(0.3));
    assert!(rich > 0.5, "{rich}");
    assert!(poor <= 0.3 && poor > 0.2, "{poor}");
}

/// A set-point that leaves a held tool behind gets nothing out of the arm, however hard the damper pulls.
#[test]
fn a_held_tool_fills_no_tank() {
    let mut setup = setup("high");
    setup.space.rate = RateRule::SetPoint;
    setup.space.goal = GoalRule::Continued { leash_position: 0.1, leash_rotation: 0.5 };
    setup.limits = HostLimits { tank: TankConfig { initial: 1.0, capacity: 5.0, low: 0.5 }, ..endless() };
    let mut plant = Plant::new(&setup);
    let mut strongest = 0.0f64;
    for cycle in 0..500 {
        if cycle % 50 == 0 {
            plant.host.set_goal(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        }
        plant.host.update(&state(&plant.y, &plant.tau), DT);
        strongest = strongest.max(plant.host.controller().wrench()[0]);
        assert_eq!(plant.host.tank(), 1.0);
    }
    assert!(strongest > 20.0, "it pulls: {strongest} N");
}

/// A hand drags the tool by 10 cm against a cap of 5 N: that takes half a joule out of it, whatever the damper wants.
#[test]
fn a_damper_that_is_cut_fills_the_tank_with_what_is_left_of_it() {
    let tank = TankConfig { initial: 0.0, capacity: 100.0, low: 0.0 };
    let limits = HostLimits { wrench_max: [5.0, f64::INFINITY], tank, ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("high") });
    plant.y.qd[0] = 0.2;
    plant.y.twist[0] = 0.2;
    for _ in 0..500 {
        plant.y.pose.translation.vector.x += 0.2 * DT;
        plant.host.update(&state(&plant.y, &plant.tau), DT);
    }
    let filled = plant.host.tank();
    assert!(filled > 0.1 && filled <= 0.5, "{filled} J");
}

#[test]
fn stiffness_does_not_wind_up_against_a_cap() {
    let grown = |wrench_max: f64| {
        let limits = HostLimits { wrench_max: [wrench_max, f64::INFINITY], ..endless() };
        let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce") });
        for _ in 0..500 {
            // A hand holds the tool 6 cm aside.
            plant.y.pose.translation.vector = Vector3::from(HOME) + Vector3::x() * 0.06;
            plant.host.update(&state(&plant.y, &plant.tau), DT);
        }
        plant.host.acting_stiffness()[0]
    };
    let k_0 = space("aforce").psi().unwrap().k_0[0];
    assert!(grown(f64::INFINITY) > 2.0 * k_0);
    let capped = grown(5.0);
    assert!(capped < k_0 + 5.0, "{capped}");
}

/// A tool that presses on a table: the table vanishes.
/// A rigid table answers with what acts. When a smaller force is asked for than the cap lets through, it comes with the ramp.
#[test]
fn a_force_that_is_capped_does_not_wind_up() {
    let limits = HostLimits { wrench_max: [8.0, 50.0], ..endless() };
    let mut plant = Plant::new(&HostSetup { limits, ..setup("aforce-force") });
    let mut press = |force: f64, cycles: usize| {
        for cycle in 0..cycles {
            if cycle % 50 == 0 {
                let action =
                    encode(plant.host.controller().space(), &ControllerConfig::default(), &Vector6::zeros(), force);
                plant.host.set_goal(&action).unwrap();
            }
            let table = f64::max(-plant.tau[2], 2.0);
            plant.step(&Wrench::new(0.0, 0.0, if cycle < 20 { table.max(5.0) } else { table }, 0.0, 0.0, 0.0));
        }
        (-plant.tau[2], plant.host.controller().force_command())
    };
    let (pressed, told) = press(10.0, 5000);
    assert!(pressed > 7.9 && told < 8.1, "{pressed} N of {told} N");
    let (pressed, _) = press(5.0, 400);
    assert!(pressed < 6.0, "{pressed} N");
}

#[test]
fn after_contact_is_lost_the_tool_does_not_run_after_it() {
    let travel = |contact_loss: f64| {
        let limits = HostLimits { contact_loss, ..endless() };
        let mut setup = HostSetup { limits, ..setup("high-force") };
        // In the controller's eyes contact lasts, as with a wrench that is filtered much.
        setup.controller.force.contact_hold = 0.3;
        let mut plant = Plant::new(&setup);
        let table = HOME[2] - 0.002;
        let mut status = Status::Stopped;
        let mut faded = false;
        for cycle in 0..2290 {
            if cycle % 50 == 0 {
                let mut action = still(&plant.host);
                action[6] = -0.2; // 20 N.
                if plant.host.controller().engagement() == 0.0 {
                    action[2] = -0.3;
                }
                plant.host.set_goal(&action).unwrap();
            }
            let depth = table - plant.position().z;
            let touches = depth > 0.0 && cycle < 2000;
            let push = if touches { (1e4 * depth - 50.0 * plant.y.twist[2]).max(0.0) } else { 0.0 };
            if cycle == 1999 {
                assert_relative_eq!(push, 20.0, epsilon = 1.0);
            }
            status = plant.step(&Wrench::new(0.0, 0.0, push, 0.0, 0.0, 0.0));
            faded |= matches!(status, Status::Limited(limited) if limited.contains(Limited::CONTACT_LOSS));
        }
        assert!(!matches!(status, Status::Fault(_)), "{status:?}");
        assert_eq!(faded, contact_loss.is_finite());
        table - plant.position().z
    };
    let (shaped, unshaped) = (travel(0.01), travel(f64::INFINITY));
    println!("travel into the void: {shaped:.4} m shaped, {unshaped:.4} m not");
    assert!(shaped < 0.4 * unshaped, "{shaped} {unshaped}");
}

#[test]
fn an_observed_wrench_is_what_pushes() {
    let interface = ArmInterface { wrench: WrenchSource::Observed { cutoff_hz: 25.0 }, ..ArmInterface::PLAIN };
    let mut plant = Plant::new(&HostSetup { interface, ..setup("low") });
    let push = Wrench::new(3.0, -2.0, 5.0, 0.1, 0.0, -0.2);
    // What the arm reports is nonsense, and nobody reads it.
    let nonsense = |state: &mut ArmState| state.wrench = Wrench::repeat(33.0);
    let observed = |plant: &mut Plant, period| {
        let status = plant.spoilt_step(&push, period, nonsense);
        (status, plant.host.measurement().unwrap().wrench)
    };
    for cycle in 0..1500 {
        if cycle % 50 == 0 {
            plant.host.set_goal(&[0.0; 6]).unwrap();
        }
        observed(&mut plant, DT);
    }
    let (_, settled) = observed(&mut plant, DT);
    assert_relative_eq!(settled, push, epsilon = 0.05);
    let (status, unchanged) = observed(&mut plant, 0.0);
    assert!(matches!(status, Status::Running | Status::Limited(_)));
    assert_eq!(unchanged, settled, "a cycle of no length");
    plant.host.stop();
    for _ in 0..3000 {
        let (status, held) = observed(&mut plant, DT);
        assert_eq!(status, Status::Stopped);
        assert_relative_eq!(held, push, epsilon = 0.5);
    }
}
