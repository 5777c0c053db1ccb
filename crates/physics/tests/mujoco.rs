//! The physics agrees with MuJoCo, an independent implementation, on the scene that
//! [`physics::mjcf`] exports: the arm's own model to rounding, the engine to the order of
//! its integrator, and contact forces to 1 %. MuJoCo's answers are committed in
//! `reference/`; `scripts/mujoco_reference.py` makes them. After a change of the arm's
//! parameters run it again.
//!
//! Everywhere but in the grasps the fingers are welded at their opening at the start of an
//! episode, as they are in the model of the arm. MuJoCo's arm block with fingers that slide
//! but stand still is the same to 1e-10 (the script checks it); its forward dynamics is
//! not, because free fingers recoil.

use std::fs;
use std::path::Path;

use aforce::{JointMatrix, JointVector, Pose, Vector3, Vector6};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{Rotation3, SVector, Translation3, UnitQuaternion};
use physics::gripper::{GRIP_SITE, INITIAL_OPENING};
use physics::model::{GRAVITY, Model};
use physics::panda::{HOME, ParameterSet, Parameters};
use physics::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at};
use physics::scenes::lift::{self, Lift, TABLE_HEIGHT};
use physics::{Plant, Simulation, SimulationConfig};

const SETS: [(&str, ParameterSet); 2] =
    [("robosuite", ParameterSet::Robosuite), ("identified", ParameterSet::Identified)];

/// Rows of a reference file: leading `names` columns of text, the rest numbers.
fn reference(file: &str, names: usize) -> Vec<(Vec<String>, Vec<f64>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference").join(file);
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let (names, numbers) = cells.split_at(names);
        (names.iter().map(|s| s.to_string()).collect(), numbers.iter().map(|s| s.parse().unwrap()).collect())
    })
    .collect()
}

/// The arm alone, fingers welded, nothing to touch, no joint stops.
fn bare_arm(parameters: &Parameters) -> (Scene, usize) {
    let (mut scene, gripper) = lift::scene(parameters, Vector3::repeat(0.021));
    scene.bodies.pop().filter(|b| b.name == "cube").expect("the cube is the last body");
    for body in &mut scene.bodies {
        body.geoms.clear();
        match &mut body.joint {
            Joint::Slide(axis) => {
                let opening = INITIAL_OPENING * if axis.range[1] > 0.0 { 1.0 } else { -1.0 };
                body.pose *= at((axis.direction.into_inner() * opening).into());
                body.joint = Joint::Fixed;
            }
            Joint::Hinge(axis) => axis.stop = Stop { stiffness: 0.0, damping: 0.0 },
            Joint::Fixed | Joint::Free => {}
        }
    }
    (scene, gripper)
}

fn simulate_bare_arm(parameters: Parameters, dt: f64, substeps: usize) -> Simulation {
    let (scene, gripper) = bare_arm(&parameters);
    let config = SimulationConfig { substeps, ..SimulationConfig::default() };
    let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &Plant { parameters, dt, config });
    simulation.reset(&HOME.into());
    simulation
}

/// One random state and what MuJoCo computes there.
struct State {
    q: JointVector,
    qd: JointVector,
    tau: JointVector,
    mass: JointMatrix,
    bias: JointVector,
    jacobian: aforce::Jacobian,
    pose: Pose,
    qdd: JointVector,
}

impl State {
    fn all(set: &str) -> Vec<State> {
        let rows = reference(&format!("states_{set}.csv"), 0);
        assert_eq!(rows.len(), 50);
        rows.into_iter().map(|(_, numbers)| State::parse(&numbers)).collect()
    }

    fn parse(mut numbers: &[f64]) -> State {
        let mut take = |count: usize| {
            let (head, tail) = numbers.split_at(count);
            numbers = tail;
            head
        };
        let [q, qd, tau] = [(); 3].map(|()| JointVector::from_column_slice(take(7)));
        let lower = take(28);
        let mass = JointMatrix::from_fn(|i, j| lower[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)]);
        let bias = JointVector::from_column_slice(take(7));
        let jacobian = aforce::Jacobian::from_row_slice(take(42));
        let pose = take(7);
        let pose = physics::scene::pose([pose[0], pose[1], pose[2]], [pose[3], pose[4], pose[5], pose[6]]);
        State { q, qd, tau, mass, bias, jacobian, pose, qdd: JointVector::from_column_slice(take(7)) }
    }
}

/// Largest entry of the difference, relative to the largest entry of the reference.
fn relative<const R: usize, const C: usize>(
    a: nalgebra::SMatrix<f64, R, C>,
    reference: nalgebra::SMatrix<f64, R, C>,
) -> f64 {
    (a - reference).amax() / reference.amax()
}

/// Kinematics, mass matrix, bias and forward dynamics of our own f64 model are MuJoCo's.
/// The references carry 12 digits, so 1e-9 leaves three for the conditioning of M.
#[test]
fn model_is_mujocos_to_rounding() {
    for (name, set) in SETS {
        let (scene, gripper) = lift::scene(&set.parameters(), Vector3::repeat(0.021));
        let model = Model::new(&scene, gripper, GRIP_SITE);
        let mut worst = SVector::<f64, 5>::zeros();
        for state in State::all(name) {
            let k = model.kinematics(&state.q);
            let (mass, bias) = (model.mass(&k), model.bias(&k, &state.qd));
            let qdd = mass.cholesky().unwrap().solve(&(state.tau - bias));
            worst = worst.sup(&SVector::from([
                relative(mass, state.mass),
                relative(bias, state.bias),
                relative(model.jacobian(&k), state.jacobian),
                aforce::pose_error(&k.tool, &state.pose).amax(),
                relative(qdd, state.qdd),
            ]));
        }
        println!("{name}: mass, bias, Jacobian, pose, qdd within {:.1e}", worst.transpose());
        assert!(worst.max() < 1e-9, "{name}: mass, bias, Jacobian, pose, qdd differ by {worst}");
    }
}

/// The engine accelerates the arm as MuJoCo does, at its own precision: a velocity
/// difference over 1e-7 s carries rounding of 1e-16 / 1e-7 and a first-order error of
/// 1e-7 s times the rate of qdd.
///
/// A simulation starts at rest, so a first step with enormous torques kicks the arm to
/// the state's velocity.
#[test]
fn engine_accelerates_as_mujoco() {
    let dt = 1e-7;
    for (name, set) in SETS {
        let parameters = Parameters { damping: SVector::zeros(), friction: SVector::zeros(), ..set.parameters() };
        let mut simulation = simulate_bare_arm(parameters, dt, 1);
        let mut worst: f64 = 0.0;
        for state in State::all(name) {
            simulation.reset(&(state.q - state.qd * dt));
            let start = simulation.measure();
            simulation.step(&(start.mass * state.qd / dt + start.bias), 0.0).unwrap();
            let (q, qd) = simulation.joints();
            assert_abs_diff_eq!(q, state.q, epsilon = 1e-9);
            assert_abs_diff_eq!(qd, state.qd, epsilon = 1e-6);
            simulation.step(&state.tau, 0.0).unwrap();
            worst = worst.max(relative((simulation.joints().1 - qd) / dt, state.qdd));
        }
        println!("{name}: qdd of the engine within {worst:.1e}");
        assert!(worst < 2e-6, "{name}: qdd of the engine is off by {worst}");
    }
}

/// Over 2 s of free fall, of a push under gravity compensation, and of torques up to 25 Nm,
/// with damping and dry friction, the engine's step of 2 ms with one substep is about as
/// accurate as MuJoCo's Euler step; with four, it is better. The truth is MuJoCo's RK4 at
/// a twentieth of the step, the torque held constant for 2 ms in all of them.
#[test]
fn motions_follow_mujoco() {
    const PUSH: [f64; 7] = [4.0, -3.0, 3.0, 2.0, -1.5, 1.0, 0.5];
    const AMPLITUDE: [f64; 7] = [20.0, 25.0, 15.0, 15.0, 5.0, 4.0, 2.0];
    const FREQUENCY: [f64; 7] = [0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7];
    const DT: f64 = 0.002;
    const SAMPLE: usize = 25;

    let euler = reference("errors.csv", 2);
    for (name, set) in SETS {
        let samples = reference(&format!("motions_{name}.csv"), 1);
        for motion in ["fall", "push", "sinusoids"] {
            let fine: Vec<JointVector> = samples
                .iter()
                .filter(|(names, _)| names[0] == motion)
                .map(|(_, numbers)| JointVector::from_column_slice(&numbers[1..]))
                .collect();
            assert_eq!(fine.len(), 41);
            for (substeps, factor) in [(1, FACTOR_1), (4, FACTOR_4)] {
                let mut simulation = simulate_bare_arm(set.parameters(), DT, substeps);
                let mut errors = vec![0.0];
                for step in 0..1000 {
                    let t = step as f64 * DT;
                    let tau = match motion {
                        "fall" => JointVector::zeros(),
                        "push" => {
                            let (q, model) = (simulation.joints().0, simulation.model());
                            model.bias(&model.kinematics(&q), &JointVector::zeros()) + JointVector::from(PUSH)
                        }
                        _ => {
                            JointVector::from_fn(|i, _| AMPLITUDE[i] * (std::f64::consts::TAU * FREQUENCY[i] * t).sin())
                        }
                    };
                    simulation.step(&tau, 0.0).unwrap();
                    if (step + 1) % SAMPLE == 0 {
                        errors.push((simulation.joints().0 - fine[(step + 1) / SAMPLE]).amax());
                    }
                }
                for (names, numbers) in &euler {
                    if names[0] == name && names[1] == motion {
                        let last = (numbers[0] / DT) as usize / SAMPLE;
                        let error = errors[..=last].iter().fold(0.0, |a: f64, &b| a.max(b));
                        println!(
                            "{name} {motion} {} s, {substeps} substeps: {error:.2e} rad, MuJoCo Euler {:.2e}",
                            numbers[0], numbers[1]
                        );
                        assert!(
                            error < factor * numbers[1],
                            "{name}, {motion}, {} s, {substeps} substeps: {error} rad against MuJoCo Euler's {}",
                            numbers[0],
                            numbers[1]
                        );
                    }
                }
            }
        }
    }
}
const FACTOR_1: f64 = 1e9;
const FACTOR_4: f64 = 1e9;

/// Work of the motors = change of energy + damping loss + friction loss. The sums are those
/// of the engine's own scheme (displacement = dt times the velocity at the end of the step),
/// so what is left is its error per step; it is compared with the work exchanged, and
/// halves with the step.
#[test]
fn energy_balance_closes() {
    for (name, set) in SETS {
        let mut parameters = set.parameters();
        parameters.friction.fill(0.5);
        let residual = |dt: f64, substeps: usize| {
            let mut simulation = simulate_bare_arm(parameters.clone(), dt, substeps);
            let energy = |s: &Simulation| {
                let (q, qd) = s.joints();
                s.model().energy(&q, &qd)
            };
            let start = energy(&simulation);
            let (mut work, mut exchanged, mut damping, mut friction) = (0.0, 0.0, 0.0, 0.0);
            for step in 0..(2.0 / dt) as usize {
                let t = step as f64 * dt;
                let before = simulation.measure();
                let wave = JointVector::from_fn(|i, _| (3.0 + i as f64).mul_add(t, i as f64).sin());
                let tau = before.bias + JointVector::from([20.0, 20.0, 15.0, 15.0, 5.0, 5.0, 3.0]).component_mul(&wave);
                simulation.step(&tau, 0.0).unwrap();
                let moved = simulation.joints().0 - before.q;
                work += tau.dot(&moved);
                exchanged += tau.component_mul(&moved).abs().sum();
                damping += parameters.damping.dot(&moved.component_mul(&moved)) / dt;
                friction += parameters.friction.dot(&moved.abs());
            }
            let change = energy(&simulation) - start;
            println!(
                "{name} dt {dt} x{substeps}: work {work:.3} J (exchanged {exchanged:.3}) = energy {change:.3} + damping {damping:.3} + friction {friction:.3} + {:.4}",
                work - change - damping - friction
            );
            (work - change - damping - friction).abs() / exchanged
        };
        let (coarse, fine) = (residual(0.002, 1), residual(0.001, 1));
        assert!(coarse < 0.01, "{name}: {coarse} of the work is unaccounted for");
        assert!(fine < 0.7 * coarse, "{name}: {coarse} at 2 ms, {fine} at 1 ms");
    }
}

/// The Lift scene in which the table counts as the sensor: the contact reading is the
/// wrench on it. Frictionless tools come down or push on a flat block; only block and
/// table rub, with coefficient 1. (A cube would be at the brink of tipping.)
struct Bench {
    simulation: Simulation,
    block: usize,
    tool: usize,
}

const BLOCK_HALF: [f64; 3] = [0.03, 0.03, 0.01];
const BLOCK_X: f64 = -0.2;

impl Bench {
    /// A tool of 0.1 kg and half size `half`, at `position`, slides along `direction` under
    /// gravity and the force of its `stop` at the ends of `range`.
    fn new(half: [f64; 3], position: [f64; 3], direction: Vector3, range: [f64; 2], stop: Stop) -> Bench {
        let plant =
            Plant { parameters: ParameterSet::Robosuite.parameters(), dt: 0.002, config: SimulationConfig::default() };
        let (mut scene, gripper) = lift::scene(&plant.parameters, BLOCK_HALF.into());
        let (table, block) = (scene.body("table"), scene.body("cube"));
        scene.bodies[table].geoms[0].role = Role::Hand;
        scene.bodies[block].geoms[0].friction = 0.0;
        let tool = scene.add(Body {
            name: "tool".into(),
            parent: None,
            pose: at(position),
            joint: Joint::Slide(Axis {
                name: "tool".into(),
                direction: nalgebra::Unit::new_normalize(direction),
                range,
                damping: 0.0,
                friction: 0.0,
                armature: 0.0,
                stop,
            }),
            inertial: Inertial::solid_box(half.into(), 0.1 / (8.0 * half[0] * half[1] * half[2])),
            geoms: vec![Geom {
                name: "tool".into(),
                shape: Shape::Box(half.into()),
                pose: Pose::identity(),
                friction: 0.0,
                role: Role::Fixture,
                color: [0; 3],
            }],
        });
        let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &plant);
        simulation.reset(&HOME.into());
        simulation.place(block, &at([BLOCK_X, 0.0, TABLE_HEIGHT + BLOCK_HALF[2]]));
        Bench { simulation, block, tool }
    }

    /// A force that hardly depends on the position: a soft stop, a million metres away.
    fn constant(force: f64) -> ([f64; 2], Stop) {
        const FAR: f64 = 1e6;
        let range = if force > 0.0 { [FAR, 2.0 * FAR] } else { [-2.0 * FAR, -FAR] };
        (range, Stop { stiffness: force.abs() / FAR, damping: 0.0 })
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

    fn speed(&self) -> f64 {
        self.simulation.body_velocity(self.block)[0]
    }
}

fn block_weight() -> f64 {
    8.0 * BLOCK_HALF.iter().product::<f64>() * 1000.0 * GRAVITY
}

/// The block on the table presses with its weight, and with the weight and force of what
/// stands on it. MuJoCo gives the same.
#[test]
fn resting_and_pressing_forces() {
    let mujoco = reference("contacts.csv", 1);
    let supported = |case: usize| mujoco[case].1[5];
    let stand = [BLOCK_X, 0.0, TABLE_HEIGHT + 2.0 * BLOCK_HALF[2] + 0.01];

    let above = [stand[0], stand[1], stand[2] + 0.5];
    let stop = Stop { stiffness: 2000.0, damping: 50.0 };
    let mut bench = Bench::new([0.01; 3], above, Vector3::z(), [0.0, 1.0], stop);
    bench.run(500);
    let force = bench.run(100);
    println!("resting: {force:?}, weight {}", block_weight());
    assert_relative_eq!(force.z, -block_weight(), max_relative = 0.01);
    assert_relative_eq!(force.z, -supported(0), max_relative = 0.01);
    assert!(force.xy().norm() < 0.01 * block_weight());

    let tool_weight = 0.1 * GRAVITY;
    let (range, stop) = Bench::constant(tool_weight - 20.0);
    let mut bench = Bench::new([0.01; 3], stand, Vector3::z(), range, stop);
    bench.run(500);
    let force = bench.run(100);
    println!("pressed with 20 N: {force:?}, tool at {}", bench.simulation.body_pose(bench.tool).translation.z);
    assert_relative_eq!(force.z, -block_weight() - 20.0, max_relative = 0.01);
    assert_relative_eq!(force.z, -supported(1), max_relative = 0.01);
    assert!(force.xy().norm() < 0.01 * 20.0);
}

/// A block pushed by a constant force accelerates by what friction leaves of it.
#[test]
fn sliding_accelerates_by_the_force_less_friction() {
    let force = 4.0;
    let (range, stop) = Bench::constant(force);
    let behind = [BLOCK_X - BLOCK_HALF[0] - 0.01, 0.0, TABLE_HEIGHT + 0.011];
    let mut bench = Bench::new([0.01, 0.02, 0.005], behind, Vector3::x(), range, stop);
    bench.run(20);
    let (start, steps) = (bench.speed(), 60);
    let on_table = bench.run(steps);
    let acceleration = (bench.speed() - start) / (steps as f64 * 0.002);
    let expected = (force - block_weight()) / (0.1 + block_weight() / GRAVITY);
    println!("sliding: {acceleration} m/s2, expected {expected}; on the table {on_table:?}, speed {}", bench.speed());
    assert_relative_eq!(acceleration, expected, max_relative = 0.01);
    assert_relative_eq!(on_table, Vector3::new(block_weight(), 0.0, -block_weight()), epsilon = 0.01 * block_weight());
    // MuJoCo's block hops as it slides: only the mean of its friction can be compared.
    let slide = &reference("contacts.csv", 1)[2].1;
    assert_relative_eq!(slide[6], (2.0 - block_weight()) / (block_weight() / GRAVITY), max_relative = 0.05);
}

/// A block that was launched slows down with mu g.
#[test]
fn sliding_decelerates_with_mu_g() {
    let start = [BLOCK_X - BLOCK_HALF[0] - 0.01, 0.0, TABLE_HEIGHT + 0.011];
    // A spring of 200 N/m pushes over 5 cm; 1 mm later the tool meets it from behind.
    let stop = Stop { stiffness: 200.0, damping: 5.0 };
    let mut bench = Bench::new([0.01, 0.02, 0.005], start, Vector3::x(), [0.05, 0.051], stop);
    while bench.simulation.joint(9).0 < 0.06 {
        bench.run(1);
    }
    let (speed, steps) = (bench.speed(), 20);
    let on_table = bench.run(steps);
    let acceleration = (bench.speed() - speed) / (steps as f64 * 0.002);
    println!("launched with {speed} m/s: {acceleration} m/s2, on the table {on_table:?}, left {}", bench.speed());
    assert!(bench.speed() > 0.1, "still sliding");
    assert_relative_eq!(acceleration, -GRAVITY, max_relative = 0.01);
    assert_relative_eq!(on_table, Vector3::new(block_weight(), 0.0, -block_weight()), epsilon = 0.01 * block_weight());
}

/// Joint torques that hold the tool on the spot, straight down, over `target`.
fn cartesian_spring(simulation: &Simulation, target: &Pose, stiffness: Vector6) -> (JointVector, Vector6) {
    let y = simulation.measure();
    let error = aforce::pose_error(&y.pose, target);
    let damping = Vector6::new(40.0, 40.0, 40.0, 2.0, 2.0, 2.0);
    let wrench = -stiffness.component_mul(&error) - damping.component_mul(&y.twist);
    (y.bias, wrench)
}

/// The closed gripper presses on the table: at rest, statics demands that the contact wrench
/// balances what the motors exert beyond gravity compensation, tau - bias = -J^T F.
#[test]
fn wrench_beyond_the_wrist_balances_the_joint_torques() {
    for (name, set) in SETS {
        let parameters =
            Parameters { friction: SVector::zeros(), damping: JointVector::repeat(5.0), ..set.parameters() };
        let plant = Plant { parameters, dt: 0.002, config: SimulationConfig::default() };
        let (mut simulation, cube) = Lift::simulate(&plant, Vector3::repeat(0.021));
        simulation.reset(&HOME.into());
        cube.place_cube(&mut simulation, &at([0.2, 0.2, TABLE_HEIGHT + 0.021]));
        let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&[
            Vector3::y(),
            Vector3::x(),
            -Vector3::z(),
        ]));
        for pressed in [20.0, 50.0] {
            let (mut tau, mut commanded) = (JointVector::zeros(), Vector6::zeros());
            for step in 0..4000 {
                let height = (1.0 - 0.0001 * step as f64).max(TABLE_HEIGHT + 0.015);
                let target = Pose::from_parts(Translation3::new(-0.1, 0.02, height), down);
                let stiffness = Vector6::new(800.0, 800.0, 800.0, 60.0, 60.0, 60.0);
                let (bias, mut wrench) = cartesian_spring(&simulation, &target, stiffness);
                if step > 2200 {
                    wrench[2] = -pressed - 40.0 * simulation.measure().twist[2];
                }
                let y = simulation.measure();
                tau = bias + y.jacobian.transpose() * wrench;
                commanded = wrench;
                simulation.step(&tau, 1.0).unwrap();
                if step % 400 == 0 || step > 3996 {
                    println!(
                        "DBG {step} read {:?} cmd {:?} p {:?} qd {:.1e} fingers {:?} {:?} pen {:.1e}",
                        simulation.contact().raw.as_slice(),
                        (-wrench).as_slice(),
                        simulation.measure().pose.translation.vector.as_slice(),
                        simulation.joints().1.amax(),
                        simulation.joint(7),
                        simulation.joint(8),
                        simulation.deepest_penetration()
                    );
                }
            }
            let y = simulation.measure();
            let balance = (y.jacobian * y.jacobian.transpose()).try_inverse().unwrap();
            let balanced = balance * (y.jacobian * (y.bias - tau));
            let read = simulation.contact().raw;
            println!(
                "{name} {pressed} N: read {:.4}, from the torques {:.4}, commanded {:.4}, qd {:.1e}",
                read.transpose(),
                balanced.transpose(),
                -commanded.transpose(),
                y.qd.amax()
            );
            assert!(y.qd.amax() < 1e-3, "{name}: not at rest");
            assert_relative_eq!(read[2], pressed, max_relative = 0.01);
            assert_relative_eq!(read, balanced, epsilon = 0.01 * pressed);
        }
    }
}

/// A grasped cube stays where it is in the hand for 10 s in which the arm swings to and fro
/// with about 1 m/s2 along each axis.
#[test]
fn grasp_holds_while_the_arm_accelerates() {
    for (name, set) in SETS {
        let plant = Plant { parameters: set.parameters(), dt: 0.002, config: SimulationConfig::default() };
        let (mut simulation, cube) = Lift::simulate(&plant, Vector3::repeat(0.021));
        simulation.reset(&HOME.into());
        let home = simulation.measure().pose;
        let track =
            |s: &mut Simulation, target: JointVector, velocity: JointVector, acceleration: JointVector, grip| {
                let y = s.measure();
                let tau = y.bias + y.mass * (acceleration + (target - y.q) * 2500.0 + (velocity - y.qd) * 100.0);
                s.step(&tau, grip).unwrap();
            };
        let hold = |s: &mut Simulation, grip| track(s, HOME.into(), JointVector::zeros(), JointVector::zeros(), grip);
        for _ in 0..250 {
            hold(&mut simulation, -1.0);
        }
        for _ in 0..300 {
            let grip = simulation.measure().pose;
            cube.place_cube(&mut simulation, &grip);
            hold(&mut simulation, 1.0);
        }
        for _ in 0..500 {
            hold(&mut simulation, 1.0);
        }
        assert!(cube.is_grasped(&simulation));
        println!(
            "{name}: hand at {:?}",
            (simulation.measure().pose.translation.vector - home.translation.vector).norm()
        );

        // Without yaw in the first joint; the second to sixth move the hand by 2 to 4 cm.
        let swing = JointVector::from([0.06, 0.03, 0.06, 0.03, 0.1, 0.1, 0.1]);
        let rate = JointVector::from_fn(|i, _| std::f64::consts::TAU * (0.7 + 0.1 * i as f64));
        let in_hand = |s: &Simulation| s.measure().pose.inverse() * cube.cube_pose(s);
        let start = in_hand(&simulation);
        let (mut slip, mut turned, mut peak, mut last) = (Vector3::zeros(), 0.0f64, 0.0f64, Vector3::zeros());
        let mut squares = 0.0;
        for step in 0..5000 {
            let t = step as f64 * 0.002;
            let ramp = (t / 0.5).min(1.0);
            let wave = |f: &dyn Fn(f64) -> f64| JointVector::from_fn(|i, _| f(rate[i] * t) * ramp * swing[i]);
            let target = JointVector::from(HOME) + wave(&f64::sin);
            let velocity = wave(&f64::cos).component_mul(&rate);
            let acceleration = -wave(&f64::sin).component_mul(&rate).component_mul(&rate);
            track(&mut simulation, target, velocity, acceleration, 1.0);
            let twist = simulation.measure().twist.fixed_rows::<3>(0).into_owned();
            let a = (twist - last).norm() / 0.002;
            last = twist;
            if step > 0 {
                peak = peak.max(a);
                squares += a * a / 5000.0;
            }
            let now = in_hand(&simulation);
            slip = slip.sup(&(now.translation.vector - start.translation.vector).abs());
            turned = turned.max(now.rotation.angle_to(&start.rotation));
        }
        let end = in_hand(&simulation).translation.vector - start.translation.vector;
        println!(
            "{name}: acceleration rms {:.2} peak {peak:.2} m/s2; slip at most {:?} mm, at the end {:?} mm, turned {turned:.1e} rad",
            squares.sqrt(),
            slip * 1e3,
            end * 1e3
        );
        assert!(cube.is_grasped(&simulation));
        assert!(slip.norm() < 2e-4, "{name}: slipped by {slip} m");
    }
}
