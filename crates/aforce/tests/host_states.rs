//! A state whose parts contradict each other is refused, or is a fault before the tool has moved by 5 mm. A right state is never a fault.

mod arm;

use aforce::host::{ArmInterface, ArmState, Fault, Host, HostLimits, HostSetup, Status};
use aforce::{Arm, ControllerConfig, ForceConfig, Interpolation, JointMatrix, JointVector, Vector3, Wrench};
use arm::{BallArm, HOME};

const DT: f64 = 0.001;
/// Cycle at which an arm with a right state is in motion.
const UNDERWAY: usize = 600;

fn setup(space: &str, interface: ArmInterface) -> HostSetup {
    HostSetup {
        contact_axis: [0.0, 0.0, 1.0],
        arm: Arm::FR3,
        interface,
        limits: HostLimits { workspace: [[0.1, -0.8, -0.2], [0.9, 0.8, 1.1]], ..HostLimits::default() },
        controller: ControllerConfig {
            control_hz: 1000,
            position_step: 0.02,
            rotation_step: 0.15,
            interpolation: Interpolation::JerkLimited { dynamics: 0.1 },
            force: ForceConfig { force_max: 30.0, ..ForceConfig::default() },
            ..ControllerConfig::default()
        },
        space: space.parse().unwrap(),
    }
}

/// Result of a drive with a spoilt state.
#[derive(Debug)]
enum Outcome {
    Refused(Fault),
    /// The fault, cycles since the state was spoilt, those in which the tool was faster than 2 cm/s, and the distance that the tool moved
    /// until the fault (m).
    Fault {
        fault: Fault,
        cycles: usize,
        in_motion: usize,
        moved: f64,
    },
    None {
        moved: f64,
    },
}

/// Gentle actions for three seconds; the state is spoilt from cycle `begin` on.
fn drive(interface: ArmInterface, begin: usize, spoil: &dyn Fn(&mut ArmState)) -> Outcome {
    let setup = setup("aforce", interface);
    let mut host = Host::new(&setup).unwrap();
    let mut arm = BallArm::at(HOME, interface);
    let told = |arm: &BallArm, cycle: usize| {
        let mut state = arm.state();
        if cycle >= begin {
            spoil(&mut state);
        }
        state
    };
    let state = told(&arm, 0);
    if let Err(fault) = host.start(&state, &state.pose) {
        return Outcome::Refused(fault);
    }
    let (mut fault, mut spoilt_at, mut in_motion, mut moved) = (None, arm.tool(), 0, 0.0f64);
    for cycle in 0..3000 {
        let at = arm.tool();
        if cycle == begin {
            spoilt_at = at;
        }
        if cycle % 50 == 0 {
            let phase = cycle as f64 * 2e-3;
            let gentle = [0.5 * phase.cos(), 0.5 * phase.sin(), 0.4 * (1.7 * phase).cos(), 0.2, 0.0, -0.2];
            let _ = host.set_goal(&gentle);
        }
        let command = host.update(&told(&arm, cycle), DT);
        if fault.is_none() {
            moved = moved.max((at - spoilt_at).norm() * f64::from(u8::from(cycle >= begin)));
            if let Status::Fault(found) = command.status {
                fault = Some((found, cycle - begin));
            }
        }
        arm.tau = command.tau;
        arm.advance(DT);
        let fast = (arm.tool() - at).norm() / DT > 0.02;
        in_motion += usize::from(fast && cycle >= begin && fault.is_none());
    }
    match fault {
        Some((fault, cycles)) => Outcome::Fault { fault, cycles, in_motion, moved },
        None => Outcome::None { moved },
    }
}

fn in_tool_axes(state: &mut ArmState) {
    let back = state.pose.rotation.inverse().to_rotation_matrix();
    for mut column in state.jacobian.column_iter_mut() {
        let (linear, angular): (Vector3, Vector3) =
            (column.fixed_rows::<3>(0).into(), column.fixed_rows::<3>(3).into());
        column.fixed_rows_mut::<3>(0).copy_from(&(back * linear));
        column.fixed_rows_mut::<3>(3).copy_from(&(back * angular));
    }
}

fn about_the_base(state: &mut ArmState) {
    for mut column in state.jacobian.column_iter_mut() {
        let angular: Vector3 = column.fixed_rows::<3>(3).into();
        let linear = column.fixed_rows::<3>(0) - angular.cross(&state.pose.translation.vector);
        column.fixed_rows_mut::<3>(0).copy_from(&linear);
    }
}

fn swap_rows(state: &mut ArmState) {
    for row in 0..3 {
        state.jacobian.swap_rows(row, row + 3);
    }
}

type Spoil = fn(&mut ArmState);

/// The usual mistakes with models and interfaces: name, whether it shows in a resting arm (`at_once`), and the function that makes it.
fn mistakes() -> Vec<(&'static str, bool, Spoil)> {
    vec![
        ("Jacobian in tool axes", false, in_tool_axes),
        ("Jacobian about the base", false, about_the_base),
        ("angular rows first", true, swap_rows),
        ("Jacobian all zero", true, |s| s.jacobian.fill(0.0)),
        ("Jacobian in mm", false, |s| s.jacobian.fixed_rows_mut::<3>(0).scale_mut(1000.0)),
        ("Jacobian row by row", true, |s| {
            let rows: Vec<f64> = s.jacobian.transpose().iter().copied().collect();
            s.jacobian = aforce::Jacobian::from_column_slice(&rows);
        }),
        ("Jacobian with another sign", false, |s| s.jacobian.neg_mut()),
        ("mass all zero", true, |s| s.mass.fill(0.0)),
        ("mass, upper triangle", true, |s| s.mass = s.mass.upper_triangle()),
        ("mass, lower triangle", true, |s| s.mass = s.mass.lower_triangle()),
        ("mass with another sign", true, |s| s.mass.neg_mut()),
        ("mass of rank one", true, |s| s.mass = JointMatrix::repeat(1.0)),
        ("joint angles in degrees", true, |s| s.q *= 180.0 / std::f64::consts::PI),
        ("speeds in degrees", false, |s| s.qd *= 180.0 / std::f64::consts::PI),
        ("speeds with another sign", false, |s| s.qd.neg_mut()),
        ("speeds not filled", false, |s| s.qd.fill(0.0)),
        ("80 Nm of Coriolis torque", true, |s| s.coriolis[1] = 80.0),
        ("gravity for Coriolis torques", true, |s| s.coriolis = s.gravity),
    ]
}

#[test]
fn a_wrong_state_is_refused_or_moves_the_tool_by_less_than_5_mm() {
    for interface in [ArmInterface::PLAIN, ArmInterface::FRANKA] {
        for (name, at_once, spoil) in mistakes() {
            let outcome = drive(interface, 0, &spoil);
            println!("{name}: {outcome:?}");
            match outcome {
                Outcome::Refused(_) => {}
                Outcome::Fault { moved, in_motion, .. } => {
                    assert!(!at_once, "{name} shows at rest");
                    assert!(moved < 0.005, "{name}: {moved} m");
                    assert!(in_motion <= 20, "{name}: {in_motion} cycles in motion");
                }
                Outcome::None { moved } => panic!("{name}: no fault, {moved} m"),
            }
            let Outcome::Fault { fault, cycles, moved, .. } = drive(interface, UNDERWAY, &spoil) else {
                panic!("{name}: no fault");
            };
            println!("    underway: {fault}, {cycles} cycles, {moved:.4} m");
            assert!(cycles <= 20 && moved < 0.005, "{name}: {fault}, {cycles} cycles, {moved} m");
        }
    }
}

#[test]
fn gravity_of_another_sign_is_refused_or_moves_the_tool_by_less_than_5_mm() {
    let negative: &dyn Fn(&mut ArmState) = &|s| s.gravity.neg_mut();
    let Outcome::Refused(fault) = drive(ArmInterface::PLAIN, 0, negative) else { panic!("not refused") };
    assert!(matches!(fault, Fault::RestTorque { .. }), "{fault}");
    let Outcome::Refused(fault) = drive(ArmInterface::PLAIN, 0, &|s| s.tau.fill(0.0)) else { panic!("not refused") };
    assert!(matches!(fault, Fault::RestTorque { found: 0.0, .. }), "{fault}");
    let Outcome::Fault { fault, cycles, moved, .. } = drive(ArmInterface::PLAIN, UNDERWAY, negative) else { panic!() };
    assert!(matches!(fault, Fault::Jump { field: "gravity", .. }) && cycles == 0, "{fault}, {moved} m");

    // Here the reported torque is the host's own, made with the same wrong gravity. Only the arm's motion shows the mistake: `truth` tells
    // who compensates gravity in the simulation.
    for (interface, truth) in [(ArmInterface::PLAIN, ArmInterface::FRANKA), (ArmInterface::FRANKA, ArmInterface::PLAIN)]
    {
        let setup = setup("aforce", interface);
        let (mut host, mut arm) = (Host::new(&setup).unwrap(), BallArm::at(HOME, truth));
        let (mut sent, start) = (BallArm::at(HOME, interface).tau, arm.tool());
        let mut found = None;
        for cycle in 0..200 {
            let state = ArmState {
                tau: sent,
                mass: BallArm { interface, ..BallArm::at(HOME, truth) }.state().mass,
                ..arm.state()
            };
            let state = ArmState { mass: if cycle == 0 { state.mass } else { moved_mass(&arm, interface) }, ..state };
            if cycle == 0 {
                host.start(&state, &state.pose).unwrap();
            }
            let command = host.update(&state, DT);
            if let (Status::Fault(fault), None) = (command.status, found) {
                found = Some((fault, cycle, (arm.tool() - start).norm()));
            }
            sent = command.tau;
            arm.tau = sent;
            arm.advance(DT);
        }
        let (fault, cycle, moved) = found.expect("a fault");
        println!("{fault}: {cycle} cycles, {moved:.4} m");
        assert!(matches!(fault, Fault::Gravity { .. }) && cycle <= 20 && moved < 0.005, "{fault}, {cycle}, {moved} m");
    }
}

fn moved_mass(arm: &BallArm, interface: ArmInterface) -> JointMatrix {
    BallArm { q: arm.q, qd: arm.qd, tau: arm.tau, wrench: arm.wrench, interface }.state().mass
}

#[test]
fn jumps_are_faults_in_the_cycle_of_the_jump() {
    let jumps: [(&str, Spoil); 3] = [
        ("joint", |s| s.q[4] += 0.5),
        ("pose", |s| s.pose.translation.vector.y += 0.3),
        ("turn", |s| {
            s.pose.rotation = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::x() * 0.5) * s.pose.rotation
        }),
    ];
    for (name, jump) in jumps {
        let Outcome::Fault { fault, cycles, .. } = drive(ArmInterface::FRANKA, UNDERWAY, &jump) else {
            panic!("{name}")
        };
        assert!(
            cycles == 0 && matches!(fault, Fault::JointMotion { .. } | Fault::ToolMotion { .. }),
            "{name}: {fault}"
        );
    }
}

/// An interface that never reports the torque it took: the rate is limited relative to the sent torque, until the mismatch is a fault.
#[test]
fn a_torque_that_is_never_told_is_a_fault() {
    let Outcome::Fault { fault, cycles, .. } = drive(ArmInterface::FRANKA, UNDERWAY, &|s| s.tau.fill(3.0)) else {
        panic!("no fault")
    };
    assert!(matches!(fault, Fault::TorqueTaken { told: 3.0, .. }) && cycles <= 25, "{fault}, {cycles} cycles");
}

/// Random numbers in [-1, 1] (an LCG's upper bits).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn one_in(&mut self, n: f64) -> bool {
        (self.unit() + 1.0) * n < 2.0
    }
}

/// Whether a bound was crossed as the fault says. A random push never has the moment for a fault: 3 Nm about each of three axes.
fn is_crossed(fault: Fault, state: &ArmState, limits: &HostLimits) -> bool {
    let beyond = |x: f64, [low, high]: [f64; 2]| x < low || x > high;
    match fault {
        Fault::JointRange { joint, .. } => beyond(state.q[joint - 1], Arm::FR3.range[joint - 1]),
        Fault::JointSpeed { joint, .. } => state.qd[joint - 1].abs() > Arm::FR3.speed_max[joint - 1],
        Fault::Workspace { .. } => {
            let ([low, high], margin) = (limits.workspace, limits.workspace_margin);
            (0..3).any(|i| beyond(state.pose.translation.vector[i], [low[i] - margin, high[i] + margin]))
        }
        Fault::ExternalForce { .. } => state.wrench.fixed_rows::<3>(0).norm() > limits.external_max[0],
        _ => false,
    }
}

/// Right states with the errors of real arms: rounded to single precision, filtered and noisy speeds, lost commands and states, hands that
/// push. `CYCLES=1000000` sets the number of cycles.
#[test]
fn a_right_state_is_never_a_fault() {
    let cycles: usize = std::env::var("CYCLES").map_or(60_000, |cycles| cycles.parse().expect("a number"));
    let mut random = Random(7);
    let (mut done, mut starts, mut others) = (0, 0, [0u32; 11]);
    while done < cycles {
        let interface = if starts % 2 == 0 { ArmInterface::FRANKA } else { ArmInterface::PLAIN };
        let space = ["aforce", "aforce-force", "variable", "osc", "high"][starts % 5];
        let mut setup = setup(space, interface);
        setup.controller.position_step = 0.05;
        setup.controller.interpolation = Interpolation::JerkLimited { dynamics: 0.3 };
        let mut host = Host::new(&setup).unwrap();
        let mut arm = BallArm::at(HOME.map(|q| q + 0.2 * random.unit()), interface);
        let (mut speed, mut felt, mut push) = (JointVector::zeros(), Wrench::zeros(), Wrench::zeros());
        let mut told = move |arm: &BallArm, random: &mut Random, felt: &Wrench, dt: f64| {
            speed += dt / (dt + 0.002) * (arm.qd - speed); // A filter of 80 Hz.
            let qd = speed + JointVector::from_fn(|_, _| 2e-3 * random.unit());
            let mut state = BallArm { q: arm.q, qd, tau: arm.tau, wrench: *felt, interface }.state();
            let single = |x: f64| f64::from(x as f32);
            state.q.apply(|x| *x = single(*x));
            state.qd.apply(|x| *x = single(*x));
            state.tau.apply(|x| *x = single(*x));
            state.mass.apply(|x| *x = single(*x));
            state.jacobian.apply(|x| *x = single(*x));
            state
        };
        let state = told(&arm, &mut random, &felt, DT);
        host.start(&state, &state.pose).unwrap();
        starts += 1;
        let mut action = vec![0.0; host.controller().space().dim()];
        for cycle in 0..5000 {
            done += 1;
            if cycle % 50 == 0 {
                action.iter_mut().for_each(|entry| *entry = (*entry + random.unit()).clamp(-1.0, 1.0));
                let _ = host.set_goal(&action);
            }
            if random.one_in(400.0) {
                push = if random.one_in(2.0) {
                    Wrench::zeros()
                } else {
                    Wrench::from_fn(|i, _| [30.0, 3.0][i / 3] * random.unit())
                };
            }
            // Some states are lost, up to four in a row: the arm goes on under the torque that it has.
            let lost = if random.one_in(50.0) { 1 + cycle % 4 } else { 0 };
            for _ in 0..=lost {
                arm.wrench += 0.02 * (push - arm.wrench); // A hand is soft.
                felt += 0.12 * (arm.wrench - felt); // A sensor's 20 Hz.
                arm.advance(DT);
            }
            let dt = if cycle == 0 { 0.0 } else { DT * (lost + 1) as f64 };
            let state = told(&arm, &mut random, &felt, DT * (lost + 1) as f64);
            let command = host.update(&state, dt);
            if let Status::Fault(fault) = command.status {
                assert!(is_crossed(fault, &state, &setup.limits), "{space}, cycle {cycle}: {fault}");
                others[fault.code() as usize] += 1;
                break;
            }
            // Some commands are lost: a fifth of them in the first 100 of 1000 cycles, a hundredth in the others.
            if !random.one_in(if cycle % 1000 < 100 { 5.0 } else { 100.0 }) {
                arm.tau = command.tau;
            }
        }
    }
    println!("{done} cycles after {starts} starts; faults that have nothing to do with it, by code: {others:?}");
}
