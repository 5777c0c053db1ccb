//! Contact forces agree with statics and Coulomb's law within 1 %: of a block at rest, pressed and
//! sliding, and of the arm that presses. MuJoCo's forces agree for the block at rest and pressed. Its
//! sliding block is not compared: it hops, because MuJoCo relaxes the friction cone to a convex
//! problem. `scripts/mujoco_reference.py` makes MuJoCo's answers.

mod mujoco_reference;

use aforce::{JointVector, Pose, Vector3, Vector6};
use approx::assert_relative_eq;
use mujoco_reference::reference;
use nalgebra::Translation3;
use physics::gripper::GRIP_SITE;
use physics::model::GRAVITY;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at};
use physics::scenes::lift::{self, Lift, TABLE_HEIGHT};
use physics::wiping_tool::facing_down;
use physics::{Deviation, Plant, Simulation, SimulationConfig};

const SETS: [(&str, RobotName); 2] = [("robosuite", RobotName::Robosuite), ("identified", RobotName::Identified)];

/// The Lift scene with a flat block instead of the cube. The table has the role of the hand, so that
/// the contact reading is the wrench on the table. Tools on rails come down or push.
/// (A cube that slides with friction coefficient 1 is at the brink of tipping.)
struct Bench {
    simulation: Simulation,
    block: usize,
    /// The body added last.
    tool: usize,
}

const BLOCK_HALF: [f64; 3] = [0.03, 0.03, 0.01];
const BLOCK_X: f64 = -0.2;
/// Mass of each tool (kg).
const TOOL: f64 = 0.1;

/// A tool of half size `half` at `position` in its parent, on a rail along `direction`,
/// under gravity and the force of its `stop` beyond `range`.
fn tool(half: [f64; 3], position: [f64; 3], direction: Vector3, (range, stop): ([f64; 2], Stop)) -> Body {
    let name = format!("tool along {:?}", direction.as_slice());
    Body {
        name: name.clone(),
        parent: None,
        pose: at(position),
        joint: Joint::Slide(Axis {
            name: name.clone(),
            direction: nalgebra::Unit::new_normalize(direction),
            range,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            spring: 0.0,
            rest: 0.0,
            stop,
        }),
        inertial: Inertial::solid_box(half.into(), TOOL / (8.0 * half.iter().product::<f64>())),
        geoms: vec![Geom {
            name,
            shape: Shape::Box(half.into()),
            pose: Pose::identity(),
            friction: 0.0,
            role: Role::Object,
            color: [0; 3],
        }],
    }
}

/// A force that hardly depends on the position: a soft stop, a million metres away.
fn constant(force: f64) -> ([f64; 2], Stop) {
    const FAR: f64 = 1e6;
    let range = if force > 0.0 { [FAR, 2.0 * FAR] } else { [-2.0 * FAR, -FAR] };
    (range, Stop::Spring { stiffness: force.abs() / FAR, damping: 0.0 })
}

impl Bench {
    /// `add` adds the tools. A pair takes the larger coefficient of friction: the table's is
    /// 1, those of block and tools are 0.
    fn new(add: impl FnOnce(&mut Scene)) -> Bench {
        let plant = Plant {
            robot: RobotName::Robosuite.robot(),
            dt: 0.002,
            config: SimulationConfig::default(),
            deviation: Deviation::default(),
        };
        let (mut scene, gripper) = lift::scene(&plant.robot, BLOCK_HALF.into());
        let (table, block) = (scene.body("table"), scene.body("cube"));
        scene.bodies[table].geoms[0].role = Role::Hand;
        scene.bodies[block].geoms[0].friction = 0.0;
        add(&mut scene);
        let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &plant);
        simulation.reset(&HOME.into());
        simulation.place(block, &at([BLOCK_X, 0.0, TABLE_HEIGHT + BLOCK_HALF[2]]));
        Bench { simulation, block, tool: scene.bodies.len() - 1 }
    }

    /// Mean force on the table in `steps` steps, the arm being held.
    fn run(&mut self, steps: usize) -> Vector3 {
        let mut sum = Vector3::zeros();
        for _ in 0..steps {
            let y = self.simulation.measure();
            let tau = y.bias + y.mass * ((JointVector::from(HOME) - y.q) * 400.0 - y.qd * 40.0);
            self.simulation.step(&tau, 0.0).unwrap();
            sum += self.simulation.contact().raw.fixed_rows::<3>(0);
        }
        sum / steps as f64
    }

    /// Mean acceleration of `body` along x, and mean force on the table, in `steps` steps.
    fn slide(&mut self, body: usize, steps: usize) -> (f64, Vector3) {
        let speed = |s: &Simulation| s.body_velocity(body)[0];
        let start = speed(&self.simulation);
        let force = self.run(steps);
        assert!(speed(&self.simulation) > 0.1, "it still slides");
        ((speed(&self.simulation) - start) / (steps as f64 * self.simulation.dt()), force)
    }
}

fn block_weight() -> f64 {
    8.0 * BLOCK_HALF.iter().product::<f64>() * 1000.0 * GRAVITY
}

/// The block on the table presses with its weight, and with its weight and 20 N when a
/// tool presses with 20 N. MuJoCo gives the same.
#[test]
fn resting_and_pressing_forces() {
    let mujoco = reference("contacts.csv", 1);
    let mut rest = Bench::new(|_| ());
    let on_block = [BLOCK_X, 0.0, TABLE_HEIGHT + 2.0 * BLOCK_HALF[2] + 0.01];
    let mut press = Bench::new(|scene| {
        scene.add(tool([0.01; 3], on_block, Vector3::z(), constant(TOOL * GRAVITY - 20.0)));
    });
    for (case, bench, pressed) in [(0, &mut rest, 0.0), (1, &mut press, 20.0)] {
        bench.run(500);
        let force = bench.run(100);
        let expected = block_weight() + pressed;
        println!("pressed with {pressed} N: {:?}, MuJoCo {}", force.as_slice(), mujoco[case].1[5]);
        assert_relative_eq!(-force.z, expected, max_relative = 0.01);
        assert_relative_eq!(-force.z, mujoco[case].1[5], max_relative = 0.01);
        assert!(force.xy().norm() < 0.01 * expected);
    }
}

/// A block pushed by a constant force accelerates by what friction leaves of the force,
/// and one that was launched slows down with mu g.
///
/// Between bodies that are no links the engine stores the friction of four points at each
/// of them, so that the reading is too large; such pairs are never beyond the wrist.
#[test]
fn a_sliding_block_obeys_coulomb() {
    let half = [0.01, 0.02, 0.005];
    let behind = [BLOCK_X - BLOCK_HALF[0] - 0.01, 0.0, TABLE_HEIGHT + 0.011];

    let mut bench = Bench::new(|scene| {
        scene.add(tool(half, behind, Vector3::x(), constant(4.0)));
    });
    bench.run(20);
    let (acceleration, force) = bench.slide(bench.block, 60);
    let expected = (4.0 - block_weight()) / (TOOL + block_weight() / GRAVITY);
    println!("pushed: {acceleration} m/s2 of {expected}, on the table {:?}", force.as_slice());
    assert_relative_eq!(acceleration, expected, max_relative = 0.01);
    assert_relative_eq!(-force.z, block_weight(), max_relative = 0.01);

    // A spring pushes over 5 cm; its other end stops the tool 1 mm later.
    let spring = ([0.05, 0.051], Stop::Spring { stiffness: 200.0, damping: 5.0 });
    let mut bench = Bench::new(|scene| {
        scene.add(tool(half, behind, Vector3::x(), spring));
    });
    while bench.simulation.joint(9).0 < 0.06 {
        bench.run(1);
    }
    let (acceleration, force) = bench.slide(bench.block, 20);
    println!("launched: {acceleration} m/s2 of {}, on the table {:?}", -GRAVITY, force.as_slice());
    assert_relative_eq!(acceleration, -GRAVITY, max_relative = 0.01);
    assert_relative_eq!(-force.z, block_weight(), max_relative = 0.01);
}

/// The friction of a link that slides is read as it acts: mu N, along the motion on what it
/// rubs, while its mechanism accelerates by the rest of the force.
#[test]
fn a_sliding_link_reads_coulomb_friction() {
    let (pushed, pressed) = (9.0, 5.0);
    // A sled under a carriage: one rail along x, one along z.
    let mut bench = Bench::new(|scene| {
        let carriage = [0.1, 0.2, TABLE_HEIGHT + 0.1];
        let parent = scene.add(tool([0.01; 3], carriage, Vector3::x(), constant(pushed)));
        let sled = tool([0.03, 0.03, 0.01], [0.0, 0.0, -0.09], Vector3::z(), constant(-pressed));
        scene.add(Body { parent: Some(parent), ..sled });
    });
    bench.run(20);
    let (acceleration, mut on_table) = bench.slide(bench.tool, 50);
    on_table.z += block_weight();
    let normal = TOOL * GRAVITY + pressed;
    println!("sled: {acceleration} m/s2, on the table {:?}, pressed with {normal}", on_table.as_slice());
    assert_relative_eq!(acceleration, (pushed - normal) / (2.0 * TOOL), max_relative = 0.01);
    assert_relative_eq!(on_table, Vector3::new(normal, 0.0, -normal), epsilon = 0.01 * normal);
}

/// The closed gripper presses on the table with 20 and 50 N: at rest, statics demands that
/// the contact wrench balances what the motors exert beyond gravity compensation,
/// tau - bias = -J^T F.
///
/// With four substeps the reading is still, and right within 1 %. With one, a stiff flat
/// contact of the arm chatters: single readings scatter by a few tenths of a newton and by
/// as much moment as the support allows, but their mean is right.
#[test]
fn wrench_beyond_the_wrist_balances_the_joint_torques() {
    let down = facing_down();
    let stiffness = Vector6::new(800.0, 800.0, 800.0, 60.0, 60.0, 60.0);
    let damping = Vector6::new(40.0, 40.0, 40.0, 2.0, 2.0, 2.0);
    for ((name, set), substeps, pressed) in
        SETS.into_iter().flat_map(|set| [(set, 1, 20.0), (set, 1, 50.0), (set, 4, 20.0), (set, 4, 50.0)])
    {
        let robot = set.robot().with_damping(5.0).with_friction(0.0);
        let config = SimulationConfig { substeps, ..SimulationConfig::default() };
        let (mut simulation, cube) = Lift::simulate(
            &Plant { robot, dt: 0.002, config, deviation: Deviation::default() },
            Vector3::repeat(0.021),
        );
        simulation.reset(&HOME.into());
        cube.place_cube(&mut simulation, &at([0.2, 0.2, TABLE_HEIGHT + 0.021]));

        // Down to the table under a Cartesian spring, then the force; the last second counts.
        let (mut read, mut squares, mut balanced) = (Vector6::zeros(), Vector6::zeros(), Vector6::zeros());
        for step in 0..4000 {
            let y = simulation.measure();
            let height = (1.0 - 1e-4 * step as f64).max(TABLE_HEIGHT + 0.015);
            let target = Pose::from_parts(Translation3::new(-0.1, 0.02, height), down);
            let error = aforce::pose_error(&y.pose, &target);
            let mut wrench = -stiffness.component_mul(&error) - damping.component_mul(&y.twist);
            if step > 2200 {
                wrench[2] = -pressed - 40.0 * y.twist[2];
            }
            let tau = y.bias + y.jacobian.transpose() * wrench;
            simulation.step(&tau, 1.0).unwrap();
            if step >= 3500 {
                let raw = simulation.contact().raw;
                read += raw / 500.0;
                squares += raw.component_mul(&raw) / 500.0;
                let pseudo_inverse = (y.jacobian * y.jacobian.transpose()).try_inverse().unwrap() * y.jacobian;
                balanced += pseudo_inverse * (y.bias - tau) / 500.0;
            }
        }
        let scatter = (squares - read.component_mul(&read)).map(|v| v.max(0.0).sqrt());
        println!(
            "{name} {pressed} N, {substeps} substeps: read {:.3?} +- {:.3?}, from the torques {:.3?}",
            read.as_slice(),
            scatter.as_slice(),
            balanced.as_slice()
        );
        let (force, moment) =
            ((read - balanced).fixed_rows::<3>(0).norm(), (read - balanced).fixed_rows::<3>(3).norm());
        assert_relative_eq!(read[2], pressed, max_relative = 0.01);
        assert!(force < 0.01 * pressed, "{name}: force {read} against {balanced}");
        // 1 % of the force at a lever of 10 cm, the arm from the wrist to the grip; chatter
        // of one substep leaves the mean over a second 5 mm uncertain.
        let lever = if substeps == 1 { 0.005 } else { 0.001 };
        assert!(moment < lever * pressed, "{name}: moment {read} against {balanced}");
        if substeps == 4 {
            assert!(scatter.amax() < 0.01 * pressed, "{name}: scatter {scatter}");
        }
    }
}
