//! Tests of what a host guarantees, on a gantry: six axes along and about the world's, and an idle seventh joint.

mod caps;
mod contact;
mod faults;
mod tank;

use super::*;
use crate::arm::Arm;
use crate::law::action::encode;
use crate::law::action_space::RateRule;
use crate::law::config::ControllerConfig;
use crate::law::controller::Controller;
use crate::law::force::ForceConfig;
use crate::law::goal::GoalRule;
use crate::law::interpolator::Interpolation;
use crate::spatial::{JointVector, Measurement, Pose, Vector6, Wrench, linear};
use crate::testing::{gantry, move_gantry, space};
use approx::assert_relative_eq;
use nalgebra::Vector3;

const DT: f64 = 0.001;
const INERTIA: [f64; 6] = [6.0, 4.0, 12.0, 0.5, 0.4, 0.3];
/// Where the gantry stands at first, within the default workspace.
const HOME: [f64; 3] = [0.5, 0.0, 0.3];

/// A gantry with wide limits, at 1 kHz, with jerk-limited set-points. The parts of its state are not compared: the tests move its tool
/// between cycles, and three of its joints are slides.
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
        limits: HostLimits { disagreement_max: f64::INFINITY, ..HostLimits::default() },
        controller,
        space: space(name),
    }
}

/// No bounds on the law; the longest cycle, the start's tolerances and the hold keep their defaults.
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
        disagreement_max: FREE,
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

    /// As [`step`](Self::step), but the host is told `period` (s) and a state that `spoil` has changed.
    fn spoilt_step(&mut self, external: &Wrench, period: f64, spoil: impl FnOnce(&mut ArmState)) -> Status {
        self.y.wrench = *external;
        let mut told = state(&self.y, &self.tau);
        spoil(&mut told);
        let command = self.host.update(&told, period);
        self.tau = command.tau;
        move_gantry(&mut self.y, &self.tau, external, DT);
        command.status
    }

    /// Runs `cycles` cycles of a millisecond, the same action every 50.
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
        let up = nalgebra::Vector3::z_axis();
        let mut alone = Controller::new(&setup.space, &setup.controller, &setup.arm, up).unwrap();
        alone.reset(&plant.y);
        for cycle in 0..2000 {
            if cycle % 50 == 0 {
                let action = vec![f64::sin(f64::from(cycle)); setup.space.dim()];
                // A cycle with a `dt` of 0 hands over the state from which the goal is computed.
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
    assert_eq!(refused(&|s| s.wrench[2] = 150.0, &pose), "the environment pushes with 150.0 N; allowed: 50");
    let outside = Pose::new(Vector3::new(0.5, 0.0, 1.2), Vector3::zeros());
    assert_eq!(refused(&|s| s.pose = outside, &outside), "the tool is at z = 1.2000 m; allowed: -0.1500 to 0.9500");
    host.start(&good, &pose).unwrap();
    assert_eq!(host.set_goal(&[0.0; 7]), Err(NotTaken::Length { found: 7, expected: 6 }));
}

/// The first torque counts from the one that the arm took, and has to hold the arm. Neither is possible beyond the arm's limits.
#[test]
fn a_start_beyond_the_arms_torques_is_refused() {
    let refused = |interface: ArmInterface, spoil: &dyn Fn(&mut ArmState)| {
        let mut host = Host::new(&HostSetup { interface, ..setup("low") }).unwrap();
        let mut y = gantry(INERTIA);
        y.pose.translation.vector = HOME.into();
        let mut state = state(&y, &JointVector::zeros());
        spoil(&mut state);
        let error = host.start(&state, &y.pose).err();
        let started = host.update(&state, DT).status != Status::Stopped;
        assert_eq!(started, error.is_none());
        error.map_or(String::new(), |fault| fault.to_string())
    };
    let plain = ArmInterface::PLAIN;
    for (value, told) in [(500.0, ""), (-500.0, ""), (500.5, "500.50"), (-501.0, "-501.00")] {
        let by_tau = refused(plain, &|s| s.tau[1] = value);
        let by_gravity = refused(plain, &|s| s.gravity[5] = value);
        if told.is_empty() {
            assert_eq!((by_tau, by_gravity), (String::new(), String::new()), "{value} Nm");
            continue;
        }
        let allowed = format!("is {told} Nm; arm.torque_max allows 500");
        assert_eq!(by_tau, format!("joint 2: the torque that the arm took last {allowed}"));
        assert_eq!(by_gravity, format!("joint 6: the torque against gravity and Coriolis forces {allowed}"));
    }
    let both = |s: &mut ArmState| (s.gravity[0], s.coriolis[0]) = (450.0, 100.0);
    assert!(refused(plain, &both).starts_with("joint 1: the torque against gravity and Coriolis forces is 550.00 Nm"));
    // An arm that compensates gravity by itself has its torque besides the one that it is sent.
    assert_eq!(refused(ArmInterface::FRANKA, &|s| s.gravity[5] = 900.0), "");
}

#[test]
fn the_contact_axis_turns_and_needs_a_direction() {
    let mut plant = Plant::new(&HostSetup { limits: endless(), ..setup("low-force") });
    let sideways = Wrench::new(10.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let engagement = |plant: &mut Plant| {
        for _ in 0..100 {
            plant.step(&sideways);
        }
        plant.host.controller().engagement()
    };
    assert_eq!(engagement(&mut plant), 0.0, "a force along x is no contact along z");
    let refused = plant.host.set_contact_axis([0.0; 3]).unwrap_err().to_string();
    assert_eq!(refused, "contact_axis: [0.0, 0.0, 0.0] has no direction");
    assert_eq!(plant.host.controller().contact_axis(), Vector3::z());
    plant.host.set_contact_axis([2.0, 0.0, 0.0]).unwrap();
    assert_eq!((engagement(&mut plant), plant.host.controller().contact_axis()), (1.0, Vector3::x()));
}
