//! The contract for hosts on the simulated Panda, dressed as a Franka: it compensates gravity itself, reports the mass of the link
//! side and what the tool exerts.

use aforce::host::{ArmInterface, ArmState, Fault, Host, HostLimits, HostSetup, Status, WrenchSign, WrenchSource};
use aforce::{
    ActionSpace, Arm, ControllerConfig, ForceConfig, GoalRule, Interpolation, JointMatrix, JointVector, Vector6, encode,
};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::wipe::{TABLE_HEIGHT, Wipe};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

const DT: f64 = 0.001;

fn setup(interface: ArmInterface) -> HostSetup {
    let mut space: ActionSpace = "aforce-force".parse().unwrap();
    space.goal = GoalRule::Continued { leash_position: 0.1, leash_rotation: 0.5 };
    HostSetup {
        contact_axis: [0.0, 0.0, 1.0],
        arm: Arm::PANDA,
        interface,
        // The arm stands on a pedestal: its world begins 0.91 m below its base and 0.56 m before it.
        limits: HostLimits { workspace: [[-0.4, -0.5, 0.7], [0.4, 0.5, 1.5]], ..HostLimits::default() },
        controller: ControllerConfig {
            control_hz: 1000,
            position_step: 0.02,
            rotation_step: 0.15,
            interpolation: Interpolation::JerkLimited { dynamics: 0.15 },
            force: ForceConfig { force_max: 30.0, ki: 16.0, ..ForceConfig::default() },
            ..ControllerConfig::default()
        },
        space,
    }
}

/// What a Franka would report of the simulated arm.
fn report(simulation: &Simulation, tau: &JointVector) -> ArmState {
    let y = simulation.measure();
    let gravity = gravity(simulation);
    ArmState {
        q: y.q,
        qd: y.qd,
        pose: y.pose,
        jacobian: y.jacobian,
        mass: y.mass - JointMatrix::from_diagonal(&Arm::PANDA.rotor_inertia.into()),
        gravity,
        coriolis: y.bias - gravity,
        wrench: -y.wrench,
        tau: *tau,
    }
}

fn gravity(simulation: &Simulation) -> JointVector {
    let (q, _) = simulation.joints();
    simulation.model().bias(&simulation.model().kinematics(&q), &JointVector::zeros())
}

/// What happened: the tool's travel (m) before it is lowered; then the mean force on the table over the last second (N), how far
/// force control has taken over, and the last status.
struct Outcome {
    drift: f64,
    force: f64,
    engagement: f64,
    status: Status,
}

/// Holds for a second, goes down at 4 cm/s until there is contact, and asks for 10 N.
fn press(setup: &HostSetup) -> Result<Outcome, Fault> {
    let plant = Plant {
        robot: RobotName::Identified.robot(),
        dt: DT,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, 0.3);
    simulation.reset(&HOME.into());
    let start = simulation.measure().pose;
    let mut tau = JointVector::zeros();
    let mut host = Host::new(setup).unwrap();
    host.start(&report(&simulation, &tau), &start)?;
    let mut outcome = Outcome { drift: 0.0, force: 0.0, engagement: 0.0, status: Status::Stopped };
    for cycle in 0..8000 {
        let state = report(&simulation, &tau);
        if cycle % 50 == 0 {
            let down = if cycle >= 1000 && host.controller().engagement() == 0.0 { -0.002 } else { 0.0 };
            let delta = Vector6::new(0.0, 0.0, down, 0.0, 0.0, 0.0);
            let action = encode(&setup.space, &setup.controller, &delta, if cycle < 1000 { 0.0 } else { 10.0 });
            let _ = host.set_goal(&action); // Not taken after a fault.
        }
        let command = host.update(&state, DT);
        tau = command.tau;
        // The arm adds gravity by itself.
        let lifting = gravity(&simulation);
        simulation.step(&(tau + lifting), 0.0).unwrap();
        if cycle < 1000 {
            let moved = simulation.measure().pose.translation.vector - start.translation.vector;
            outcome.drift = outcome.drift.max(moved.norm());
        }
        if cycle >= 7000 {
            outcome.force += simulation.contact().raw[2] / 1000.0;
        }
        outcome.engagement = host.controller().engagement();
        outcome.status = command.status;
    }
    Ok(outcome)
}

#[test]
fn an_arm_that_compensates_gravity_holds_still_and_presses_as_told() {
    for source in [WrenchSource::Reported, WrenchSource::Observed { cutoff_hz: 25.0 }] {
        // The simulated joints have 1 Nm s/rad of viscous friction that nobody compensates.
        let friction = aforce::host::Friction::Nobody([1.0; 7]);
        let interface = ArmInterface { wrench: source, friction, ..ArmInterface::FRANKA };
        let Outcome { drift, force, engagement, status } = press(&setup(interface)).unwrap();
        println!("{source:?}: drift {drift:.5} m, {force:.2} N, engaged {engagement}, {status:?}");
        assert!(drift < 1e-3, "{drift}");
        assert!(matches!(status, Status::Running | Status::Limited(_)), "{status:?}");
        assert_eq!(engagement, 1.0);
        assert!((force - 10.0).abs() < 0.5, "{force}");
    }
}

/// What the names in the interface are for: each said wrongly shows.
#[test]
fn a_wrong_word_in_the_interface_shows() {
    let sign = ArmInterface { wrench_sign: WrenchSign::OnTool, ..ArmInterface::FRANKA };
    let outcome = press(&setup(sign)).unwrap();
    println!("wrong sign: {:.1} N, engaged {}, {:?}", outcome.force, outcome.engagement, outcome.status);
    assert_eq!(outcome.engagement, 0.0, "contact is never seen");

    let gravity = ArmInterface { gravity: aforce::host::CompensatedBy::Law, ..ArmInterface::FRANKA };
    let fault = press(&setup(gravity)).err();
    println!("gravity twice: {fault:?}");
    assert!(matches!(fault, Some(Fault::RestTorque { .. })), "an arm at rest without torques holds itself: {fault:?}");
}
