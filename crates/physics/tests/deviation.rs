//! Deviations act on the plant, and leave the controller's model as it is.

use aforce::{JointVector, Vector3};
use approx::assert_relative_eq;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::at;
use physics::scenes::door::{self, Door, MIDDLE};
use physics::scenes::lift::Lift;
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, Wipe};
use physics::{Change, Deviation, Plant, Simulation, SimulationConfig};

fn plant(deviation: Deviation) -> Plant {
    let robot = RobotName::Robosuite.robot();
    Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation }
}

/// Springs and dampers hold the arm at home.
fn hold(simulation: &mut Simulation, steps: usize, grip: f64) {
    for _ in 0..steps {
        let y = simulation.measure();
        let tau = y.bias + (JointVector::from(HOME) - y.q) * 400.0 - y.qd * 60.0;
        simulation.step(&tau, grip).unwrap();
    }
}

/// The weight of a cube of three times the mass pulls three times as hard.
#[test]
fn a_cube_weighs_what_it_is_made_to() {
    let pull = |object_mass| {
        let (mut simulation, cube) =
            Lift::simulate(&plant(Deviation { object_mass, ..Deviation::default() }), Vector3::repeat(0.021));
        simulation.reset(&HOME.into());
        hold(&mut simulation, 250, -1.0);
        for _ in 0..300 {
            let grip = simulation.measure().pose;
            cube.place_cube(&mut simulation, &grip);
            hold(&mut simulation, 1, 1.0);
        }
        hold(&mut simulation, 500, 1.0);
        -simulation.contact().filtered[2]
    };
    let weight = 8.0 * 0.021f64.powi(3) * 1000.0 * 9.81;
    assert_relative_eq!(pull(1.0), weight, max_relative = 0.02);
    assert_relative_eq!(pull(3.0), 3.0 * weight, max_relative = 0.02);
}

/// Against 1 Nm of dry friction and a spring of 5 Nm/rad, 1.5 Nm open the door by 0.1 rad, and somewhat more because the door
/// swings. Without the spring they open it as far as it goes.
#[test]
fn a_hinge_has_the_spring_it_is_given() {
    let opened = |hinge_spring| {
        let deviation = Deviation { hinge_spring, ..Deviation::default() };
        let (mut simulation, door) = Door::simulate(&plant(deviation), &door::root(MIDDLE));
        // The arm is out of the way, and the latch is held open.
        let mut q = JointVector::from(HOME);
        q[0] = 1.5;
        simulation.reset(&q);
        simulation.set_load(door.shaft, 3.0);
        for step in 0..4000 {
            simulation.set_load(door.hinge, if step < 500 { 0.0 } else { 1.5 });
            let y = simulation.measure();
            simulation.step(&(y.bias + (q - y.q) * 400.0 - y.qd * 60.0), 0.0).unwrap();
        }
        door.opening(&simulation)
    };
    let (free, held) = (opened(0.0), opened(5.0));
    assert!(free > 0.39 && (0.1..0.13).contains(&held), "{free} {held}");
}

/// Three times the friction of the table top, measured on the tool that slides over it.
#[test]
fn every_coefficient_of_friction_is_multiplied() {
    let ratio = |friction| {
        let deviation = Deviation { friction, table_height: 0.01, ..Deviation::default() };
        let (mut simulation, _) = Wipe::simulate(&plant(deviation), TABLE_HEIGHT, TABLE_FRICTION);
        simulation.reset(&HOME.into());
        let start = simulation.measure().pose;
        let (mut along, mut normal, mut height) = (0.0, 0.0, 0.0);
        for step in 0..3000 {
            // Down to the table, level, and along y under 20 N.
            let y = simulation.measure();
            let p = y.pose.translation.vector;
            let speed = if step < 2000 { 0.0 } else { 0.05 };
            let level = physics::wiping_tool::facing_down();
            let turn = (level * y.pose.rotation.inverse()).scaled_axis();
            let target = start.translation.vector.y + speed * 0.002 * f64::from((step - 2000).max(0));
            let force = Vector3::new(
                800.0 * (start.translation.vector.x - p.x),
                800.0 * (target - p.y),
                if y.wrench[2] > 0.0 || p.z < 0.93 { -20.0 } else { -200.0 * (p.z - 0.92) },
            ) - 120.0 * y.twist.fixed_rows::<3>(0);
            let moment = 60.0 * turn - 8.0 * y.twist.fixed_rows::<3>(3);
            let wrench = aforce::Wrench::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            simulation.step(&(y.bias + y.jacobian.tr_mul(&wrench)), 0.0).unwrap();
            if step >= 2600 {
                let raw = simulation.contact().raw;
                (along, normal, height) = (along + raw.xy().norm(), normal + raw[2], height + p.z / 400.0);
            }
        }
        assert!((height - TABLE_HEIGHT - 0.01).abs() < 0.002, "{height}");
        along / normal
    };
    assert_relative_eq!(ratio(1.0), TABLE_FRICTION, max_relative = 0.02);
    assert_relative_eq!(ratio(3.0), 3.0 * TABLE_FRICTION, max_relative = 0.02);
}

/// An arm that is held up by its own model sinks under a payload that the model does not have.
#[test]
fn the_model_does_not_know_of_a_payload() {
    let mass = |payload| {
        let (simulation, _) =
            Lift::simulate(&plant(Deviation { payload, ..Deviation::default() }), Vector3::repeat(0.021));
        simulation.measure().mass
    };
    assert_eq!(mass(0.0), mass(1.0));
    let (mut simulation, _) =
        Lift::simulate(&plant(Deviation { payload: 1.0, ..Deviation::default() }), Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    let start = simulation.measure();
    let tau = start.bias;
    simulation.step(&tau, 0.0).unwrap();
    // The acceleration of the first step is that of 9.81 N at the tool point, the payload's own inertia included.
    let (j, y) = (start.jacobian.fixed_rows::<3>(0).into_owned(), simulation.measure());
    let qdd = y.qd / 0.002;
    let inertia = start.mass + j.transpose() * j;
    let left = inertia * qdd + j.tr_mul(&Vector3::new(0.0, 0.0, 9.81));
    // What is left is dry friction, 0.1 Nm at each joint, and a fraction for the fingers, which are not rigidly fixed.
    assert!(left.amax() < 0.15, "{left}");
    assert!(qdd.amax() > 0.5);
    // The simulation's energy includes the payload.
    let own = simulation.model().energy(&y.q, &y.qd);
    let speed = y.twist.fixed_rows::<3>(0).norm();
    assert!(speed > 1e-3);
    assert_relative_eq!(simulation.energy() - own, 9.81 * y.pose.translation.z + speed.powi(2) / 2.0, epsilon = 1e-9);
}

/// A change by name has the same effect as the built-in deviation of the same body or joint.
#[test]
fn a_change_by_name_is_that_of_the_body_or_joint_it_names() {
    let swings = |deviation: Deviation| {
        let (mut simulation, door) = Door::simulate(&plant(deviation), &door::root(MIDDLE));
        simulation.reset(&HOME.into());
        simulation.set_load(door.shaft, 3.0);
        simulation.set_load(door.hinge, 5.0);
        (0..200).for_each(|_| simulation.step(&simulation.measure().bias, 0.0).unwrap());
        (simulation.joint(door.hinge), simulation.joint(door.shaft))
    };
    let own = |own: &[(Change, f64)]| Deviation { own: own.to_vec(), ..Deviation::default() };
    let damping = [(Change::JointDamping("hinge"), 3.0), (Change::JointFriction("hinge"), 3.0)];
    let spring = [(Change::JointSpring("hinge"), 20.0)];
    let free = swings(Deviation::default());
    for (named, built_in) in [
        (own(&damping), Deviation { hinge_damping: 3.0, ..Deviation::default() }),
        (own(&spring), Deviation { hinge_spring: 20.0, ..Deviation::default() }),
    ] {
        let swing = swings(named);
        assert_eq!(swing, swings(built_in));
        assert_ne!(swing, free);
    }
    let falls = |deviation: Deviation| {
        let (mut simulation, lift) = Lift::simulate(&plant(deviation), Vector3::repeat(0.02));
        simulation.reset(&HOME.into());
        lift.place_cube(&mut simulation, &at([0.0, 0.0, 0.85]));
        // Air slows a light cube more than a heavy one.
        (0..30).for_each(|_| simulation.step(&simulation.measure().bias, 0.0).unwrap());
        lift.cube_pose(&simulation)
    };
    let heavy = falls(own(&[(Change::BodyMass("cube"), 5.0)]));
    assert_eq!(heavy, falls(Deviation { object_mass: 5.0, ..Deviation::default() }));
    assert_ne!(heavy, falls(Deviation::default()));
}
