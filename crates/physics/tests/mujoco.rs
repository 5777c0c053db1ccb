//! The physics agrees with MuJoCo, an independent implementation, on the scene that
//! [`physics::mjcf`] exports: the arm's own model to rounding, the engine to the order of
//! its integrator, and contact forces to 1 %. MuJoCo's answers are committed in
//! `reference/`; `scripts/mujoco_reference.py` makes them. After a change of the arm's
//! parameters run it again.
//!
//! In states and motions the fingers are welded at their opening at the start of an episode,
//! as they are in the model of the arm. With fingers that slide but stand still, MuJoCo's
//! arm block of mass matrix and bias is the same to 1e-10 (the script checks it), but not
//! its forward dynamics: free fingers recoil.

mod mujoco_reference;

use aforce::{JointMatrix, JointVector, Pose, Vector3, Vector6};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use mujoco_reference::reference;
use nalgebra::{Rotation3, SVector, Translation3, UnitQuaternion};
use physics::gripper::{GRIP_SITE, INITIAL_OPENING};
use physics::model::{GRAVITY, Model};
use physics::panda::{HOME, ParameterSet, Parameters};
use physics::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at};
use physics::scenes::lift::{self, Lift, TABLE_HEIGHT};
use physics::{Plant, Simulation, SimulationConfig};

const SETS: [(&str, ParameterSet); 2] =
    [("robosuite", ParameterSet::Robosuite), ("identified", ParameterSet::Identified)];

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
///
/// Both schemes are of first order, but their errors differ in detail and may cross zero:
/// a single one is allowed three times MuJoCo's, their geometric mean 1.3 times.
#[test]
fn motions_follow_mujoco() {
    const PUSH: [f64; 7] = [4.0, -3.0, 3.0, 2.0, -1.5, 1.0, 0.5];
    const AMPLITUDE: [f64; 7] = [20.0, 25.0, 15.0, 15.0, 5.0, 4.0, 2.0];
    const FREQUENCY: [f64; 7] = [0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7];
    const DT: f64 = 0.002;
    const SAMPLE: usize = 25;

    let euler = reference("errors.csv", 2);
    let mut log_ratios = [0.0, 0.0];
    for (name, set) in SETS {
        let samples = reference(&format!("motions_{name}.csv"), 1);
        for motion in ["fall", "push", "sinusoids"] {
            let fine: Vec<JointVector> = samples
                .iter()
                .filter(|(names, _)| names[0] == motion)
                .map(|(_, numbers)| JointVector::from_column_slice(&numbers[1..]))
                .collect();
            assert_eq!(fine.len(), 41);
            for (k, (substeps, factor)) in [(1, 3.0), (4, 1.0)].into_iter().enumerate() {
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
                        log_ratios[k] += (error / numbers[1]).ln() / euler.len() as f64;
                        println!(
                            "{name} {motion} {} s, {substeps} substeps: {error:.2e} rad, MuJoCo {:.2e}",
                            numbers[0], numbers[1]
                        );
                        assert!(error < factor * numbers[1], "{name}, {motion}, {substeps} substeps: {error} rad");
                    }
                }
            }
        }
    }
    let [one, four] = log_ratios.map(f64::exp);
    println!("error against MuJoCo Euler's: {one:.2} with one substep, {four:.2} with four");
    assert!(one < 1.3 && four < 0.4, "{one}, {four}");
}

/// Work of the motors = change of energy + damping loss + friction loss, within 1 % of the
/// work exchanged with the motors at 2 ms, and of the net work at 0.5 ms. What is left is
/// the error of a first-order scheme (it dissipates a little): it is proportional to the step.
#[test]
fn energy_balance_closes() {
    for (name, set) in SETS {
        let mut parameters = set.parameters();
        parameters.friction.fill(0.5);
        let [(coarse, exchanged, _), (fine, _, work)] = [0.002, 0.0005].map(|dt| unaccounted_work(&parameters, dt));
        println!("{name}: {coarse:.3} of {exchanged:.1} J exchanged at 2 ms, {fine:.3} of {work:.2} J at 0.5 ms");
        assert!(coarse < 0.01 * exchanged, "{name}: {coarse} of {exchanged} J");
        assert!(fine < 0.01 * work, "{name}: {fine} of {work} J");
        assert_relative_eq!(coarse / fine, 4.0, max_relative = 0.1);
    }
}

/// Work that is missing after 2 s of motion, sum of its size over joints and steps, and its
/// sum (J).
fn unaccounted_work(parameters: &Parameters, dt: f64) -> (f64, f64, f64) {
    let mut simulation = simulate_bare_arm(parameters.clone(), dt, 1);
    let energy = |s: &Simulation| {
        let (q, qd) = s.joints();
        s.model().energy(&q, &qd)
    };
    let start = energy(&simulation);
    let (mut work, mut exchanged, mut lost) = (0.0, 0.0, 0.0);
    for step in 0..(2.0 / dt).round() as usize {
        let t = step as f64 * dt;
        let before = simulation.measure();
        let wave = JointVector::from_fn(|i, _| ((3.0 + i as f64) * t + i as f64).sin());
        let tau = before.bias + JointVector::from([20.0, 20.0, 15.0, 15.0, 5.0, 5.0, 3.0]).component_mul(&wave);
        simulation.step(&tau, 0.0).unwrap();
        let moved = simulation.joints().0 - before.q;
        work += tau.dot(&moved);
        exchanged += tau.component_mul(&moved).abs().sum();
        lost += parameters.damping.dot(&moved.component_mul(&moved)) / dt + parameters.friction.dot(&moved.abs());
    }
    (work - lost - (energy(&simulation) - start), exchanged, work)
}

/// The Lift scene with a flat block instead of the cube, in which the table counts as the
/// sensor: the contact reading is the wrench on it. Tools on rails come down or push.
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
    (range, Stop { stiffness: force.abs() / FAR, damping: 0.0 })
}

impl Bench {
    /// `add` adds the tools. A pair takes the larger coefficient of friction: the table's is
    /// 1, those of block and tools are 0.
    fn new(add: impl FnOnce(&mut Scene)) -> Bench {
        let plant =
            Plant { parameters: ParameterSet::Robosuite.parameters(), dt: 0.002, config: SimulationConfig::default() };
        let (mut scene, gripper) = lift::scene(&plant.parameters, BLOCK_HALF.into());
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
/// and one that was launched slows down with mu g. MuJoCo's block hops as it slides (its
/// friction cone is relaxed to a convex problem), so the mean that its file has is within
/// 5 % of the same law.
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
    let spring = ([0.05, 0.051], Stop { stiffness: 200.0, damping: 5.0 });
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

    let slide = &reference("contacts.csv", 1)[2].1;
    let mass = block_weight() / GRAVITY;
    assert_relative_eq!(slide[6], slide[0] / mass - GRAVITY, max_relative = 0.05);
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
    let down = [Vector3::y(), Vector3::x(), -Vector3::z()];
    let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&down));
    let stiffness = Vector6::new(800.0, 800.0, 800.0, 60.0, 60.0, 60.0);
    let damping = Vector6::new(40.0, 40.0, 40.0, 2.0, 2.0, 2.0);
    for ((name, set), substeps, pressed) in
        SETS.into_iter().flat_map(|set| [(set, 1, 20.0), (set, 1, 50.0), (set, 4, 20.0), (set, 4, 50.0)])
    {
        let parameters =
            Parameters { friction: SVector::zeros(), damping: JointVector::repeat(5.0), ..set.parameters() };
        let config = SimulationConfig { substeps, ..SimulationConfig::default() };
        let (mut simulation, cube) = Lift::simulate(&Plant { parameters, dt: 0.002, config }, Vector3::repeat(0.021));
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

/// Where the cube is in the hand (m) after 10 s in which the joints swing around HOME with
/// amplitudes `swing` (rad) and frequencies `rate` (rad/s): difference from the start, its
/// prediction, and the root mean square of the hand's acceleration (m/s2).
///
/// The prediction: the solver holds the cube by equal velocities at the contact points, with
/// the Jacobian of the start of the step. A cube flies on straight within the step, a pad
/// on its curve: dt^2 / 2 times J_dot qd apart, and friction has no memory of position.
fn shaken_grasp(set: ParameterSet, swing: JointVector, rate: JointVector) -> (Vector3, Vector3, f64) {
    let dt = 0.002;
    let plant = Plant { parameters: set.parameters(), dt, config: SimulationConfig::default() };
    let (mut simulation, cube) = Lift::simulate(&plant, Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    let in_hand = |s: &Simulation| (s.measure().pose.inverse() * cube.cube_pose(s)).translation.vector;
    let (mut start, mut predicted, mut squares) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    let mut last = Vector3::zeros();
    for step in -1050..5000 {
        if step == 0 {
            assert!(cube.is_grasped(&simulation));
            start = in_hand(&simulation);
        }
        // Open, close on the cube that is kept between the fingers, hold, swing.
        let grip = if step < -800 { -1.0 } else { 1.0 };
        let y = simulation.measure();
        if (-800..-500).contains(&step) {
            cube.place_cube(&mut simulation, &y.pose);
        }
        let t = f64::from(step.max(0)) * dt;
        let swing = swing * (t / 0.5).min(1.0);
        let wave = |f: fn(f64) -> f64| JointVector::from_fn(|i, _| f(rate[i] * t) * swing[i]);
        let q = JointVector::from(HOME) + wave(f64::sin);
        let qd = wave(f64::cos).component_mul(&rate);
        let qdd = -wave(f64::sin).component_mul(&rate).component_mul(&rate);
        let tau = y.bias + y.mass * (qdd + (q - y.q) * 2500.0 + (qd - y.qd) * 100.0);
        simulation.step(&tau, grip).unwrap();

        let after = simulation.measure();
        let velocity = after.twist.fixed_rows::<3>(0).into_owned();
        if step >= 0 {
            squares += ((velocity - last) / dt).norm_squared() / 5000.0;
            let model = simulation.model();
            let twist = |s: f64| model.jacobian(&model.kinematics(&(after.q + after.qd * s))) * after.qd;
            let curve = ((twist(1e-6) - twist(-1e-6)) / 2e-6).fixed_rows::<3>(0).into_owned();
            predicted -= after.pose.rotation.inverse() * curve * (0.5 * dt * dt);
        }
        last = velocity;
    }
    assert!(cube.is_grasped(&simulation));
    (in_hand(&simulation) - start, predicted, squares.sqrt())
}

/// A grasped cube stays in the hand within 0.2 mm for 10 s while the arm shakes it with
/// 1 m/s2 (root mean square) at 2 Hz or more in all joints.
#[test]
fn grasp_holds_while_the_arm_accelerates() {
    for (name, set) in SETS {
        let rate = JointVector::from_fn(|i, _| std::f64::consts::TAU * (2.0 + 0.1 * i as f64));
        let swing = JointVector::from([0.0075, 0.005, 0.0075, 0.005, 0.015, 0.015, 0.015]);
        let (slip, _, acceleration) = shaken_grasp(set, swing, rate);
        println!("{name}: {acceleration:.2} m/s2, slip {:.1?} um", (slip * 1e6).as_slice());
        assert!((0.8..1.5).contains(&acceleration));
        assert!(slip.norm() < 2e-4, "{name}: slipped by {slip} m");
    }
}

/// In wider swings a grasped cube drifts, by what a first-order step makes of the curved
/// path, and by nothing else: friction itself does not give way.
#[test]
fn a_grasped_cube_drifts_by_the_curvature_of_its_path_alone() {
    for (name, set) in SETS {
        let rate = JointVector::from_fn(|i, _| std::f64::consts::TAU * (0.7 + 0.1 * i as f64));
        let swing = JointVector::from([0.06, 0.03, 0.06, 0.03, 0.1, 0.1, 0.1]);
        let (slip, predicted, acceleration) = shaken_grasp(set, swing, rate);
        let [slip_um, predicted_um] = [slip, predicted].map(|v| v * 1e6);
        println!(
            "{name}: {acceleration:.2} m/s2, {:.0?} um, predicted {:.0?}",
            slip_um.as_slice(),
            predicted_um.as_slice()
        );
        assert!((slip - predicted).norm() < 3e-5, "{name}: {slip} m, predicted {predicted}");
    }
}
