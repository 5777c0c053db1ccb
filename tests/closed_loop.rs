//! Controller and plant together: where the tool goes, what it presses, where energy stays.

use aforce::{Arm, Controller, ControllerConfig, EnergyLedger, JointVector, Measurement, Vector3};
use approx::assert_relative_eq;
use physics::robots::panda::HOME;
use physics::robots::{Robot, RobotName};
use physics::scenes::lift::{Lift, TABLE_HEIGHT};
use physics::{Deviation, Plant, Simulation, SimulationConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const DT: f64 = 0.002;

fn plant(robot: Robot) -> (Simulation, Lift) {
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, lift) = Lift::simulate(&plant, Vector3::repeat(0.021));
    // Out of the way.
    lift.place_cube(&mut simulation, &nalgebra::Isometry3::translation(0.3, 0.3, TABLE_HEIGHT + 0.021));
    simulation.reset(&HOME.into());
    (simulation, lift)
}

fn controller(space: &str, config: &ControllerConfig) -> Controller {
    let arm = RobotName::Robosuite.robot().arm;
    Controller::new(&space.parse().unwrap(), config, &arm, Vector3::z_axis()).unwrap()
}

fn run(simulation: &mut Simulation, controller: &mut Controller, samples: usize) {
    for _ in 0..samples {
        let tau = controller.update(&simulation.measure());
        simulation.step(&tau, 0.0).unwrap();
    }
}

/// One action along each axis moves the tool along that axis of the world, and in the end no
/// other. Small steps: a large turn drives the 12 Nm wrist into its limits, and the tool is
/// centimetres off its path before it settles.
#[test]
fn actions_move_the_tool_along_world_axes() {
    for space in ["aforce", "osc", "high"] {
        for axis in 0..6 {
            let config = ControllerConfig { position_step: 0.005, rotation_step: 0.01, ..ControllerConfig::default() };
            // Without dry friction, which leaves a soft controller short.
            let (mut simulation, _) = plant(RobotName::Robosuite.robot().with_friction(0.0));
            let mut controller = controller(space, &config);
            let start = simulation.measure();
            controller.reset(&start);
            let mut action = [0.0; 6];
            action[axis] = 1.0;
            controller.set_goal(&action, &start);
            run(&mut simulation, &mut controller, 5000);
            let moved = aforce::pose_error(&simulation.measure().pose, &start.pose);
            // In steps, so that metres and radians compare.
            let moved = moved.component_div(&aforce::Vector6::new(0.005, 0.005, 0.005, 0.01, 0.01, 0.01));
            let others: f64 = (0..6).filter(|&i| i != axis).map(|i| moved[i].abs()).fold(0.0, f64::max);
            assert!((moved[axis] - 1.0).abs() < 0.05, "{space} axis {axis}: {:?}", moved.as_slice());
            assert!(others < 0.05, "{space} axis {axis}: {:?}", moved.as_slice());
        }
    }
}

/// Pressing on the table with a commanded force holds that force.
#[test]
fn commanded_force_is_held() {
    let config = ControllerConfig::default();
    let (mut simulation, _) = plant(RobotName::Robosuite.robot());
    let mut controller = controller("aforce-force", &config);
    controller.reset(&simulation.measure());
    let wanted = 10.0;
    let press = 2.0 * wanted / config.force.force_max - 1.0;
    for _ in 0..200 {
        let y = simulation.measure();
        // Down until something pushes back, then still; a soft spring needs more than a few millimetres to move the joints.
        let down = if y.wrench[2] > 4.0 { 0.0 } else { -0.5 };
        controller.set_goal(&[0.0, 0.0, down, 0.0, 0.0, 0.0, press], &y);
        run(&mut simulation, &mut controller, 25);
    }
    let mut mean = 0.0;
    for _ in 0..500 {
        run(&mut simulation, &mut controller, 1);
        mean += simulation.contact().filtered[2] / 500.0;
    }
    assert_relative_eq!(mean, wanted, max_relative = 0.1);
}

/// Work of the motors that is not the change of the arm's energy, as a share of the absolute work, over a second without
/// friction, damping, air or contact.
fn unaccounted(mut torque: impl FnMut(usize, &Measurement) -> JointVector) -> f64 {
    let robot = RobotName::Robosuite.robot().with_damping(0.0).with_friction(0.0);
    let (mut simulation, _) = plant(Robot { air: None, ..robot });
    let energy = |s: &Simulation| {
        let (q, qd) = s.joints();
        s.model().energy(&q, &qd)
    };
    let mut ledger = EnergyLedger::default();
    let start = energy(&simulation);
    for k in 0..500 {
        let y = simulation.measure();
        let tau = torque(k, &y);
        simulation.step(&tau, 0.0).unwrap();
        assert!(!simulation.contact().touching);
        ledger.add(&tau, &((y.qd + simulation.joints().1) / 2.0), &Arm::FRANKA_DRIVES, DT);
    }
    assert!(ledger.absolute > 2.0, "the motion does some work: {} J", ledger.absolute);
    (ledger.net - (energy(&simulation) - start)).abs() / ledger.absolute
}

/// Under smooth torques, and under a stiff policy's that jerk: there the work along the joints' exact travel, which a step of
/// the engine takes with its end velocity, would be 3 % off.
#[test]
fn work_is_the_change_of_energy() {
    let smooth = unaccounted(|k, y| {
        y.bias + JointVector::from_fn(|i, _| 4.0 * (0.01 * k as f64 * (1.0 + 0.3 * i as f64)).sin())
    });
    assert!(smooth < 1e-3, "{smooth}");

    let mut controller = controller("variable", &ControllerConfig::default());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let jerky = unaccounted(|k, y| {
        if k == 0 {
            controller.reset(y);
        }
        if k % 25 == 0 {
            controller.set_goal(&[(); 12].map(|()| rng.random_range(-1.0..1.0)), y);
        }
        controller.update(y)
    });
    assert!(jerky < 1e-3, "{jerky}");
}
