//! The physics agrees with MuJoCo, an independent implementation, on the scene that
//! [`physics::mjcf`] exports: the arm's own model to rounding, the engine to the order of
//! its integrator. MuJoCo's answers are committed in
//! `reference/`; `scripts/mujoco_reference.py` makes them. After a change of the arm's
//! parameters run it again.
//!
//! In states and motions the fingers are welded at their opening at the start of an episode,
//! as they are in the model of the arm. With fingers that slide but stand still, MuJoCo's
//! arm block of mass matrix and bias is the same to 1e-10 (the script checks it), but not
//! its forward dynamics: free fingers recoil.
//!
//! The door moves as MuJoCo's does too: latch, handle spring, friction and damping of both joints. Both engines collide the
//! latch with the post by themselves.

mod mujoco_reference;

use aforce::{JointMatrix, JointVector, Pose, Vector3};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use mujoco_reference::reference;
use nalgebra::SVector;
use physics::gripper::{GRIP_SITE, INITIAL_OPENING};
use physics::model::Model;
use physics::robots::panda::HOME;
use physics::robots::{Robot, RobotName};
use physics::scene::{Joint, Scene, Stop, at};
use physics::scenes::door::{self, Door, MIDDLE};
use physics::scenes::lift;
use physics::{Deviation, Plant, Simulation, SimulationConfig};

const DT: f64 = 0.002;
const SAMPLE: usize = 25;
const SETS: [(&str, RobotName); 2] = [("robosuite", RobotName::Robosuite), ("identified", RobotName::Identified)];

/// The arm alone, fingers welded, nothing to touch, no joint stops.
fn bare_arm(robot: &Robot) -> (Scene, usize) {
    let (mut scene, gripper) = lift::scene(robot, Vector3::repeat(0.021));
    scene.bodies.pop().filter(|b| b.name == "cube").expect("the cube is the last body");
    scene.actuators.retain(|actuator| actuator.joint.starts_with("joint"));
    for body in &mut scene.bodies {
        body.geoms.clear();
        match &mut body.joint {
            Joint::Slide(axis) => {
                let opening = INITIAL_OPENING * if axis.range[1] > 0.0 { 1.0 } else { -1.0 };
                body.pose *= at((axis.direction.into_inner() * opening).into());
                body.joint = Joint::Fixed;
            }
            Joint::Hinge(axis) => axis.stop = Stop::Spring { stiffness: 0.0, damping: 0.0 },
            Joint::Fixed | Joint::Free => {}
        }
    }
    (scene, gripper)
}

fn simulate_bare_arm(robot: Robot, dt: f64, substeps: usize) -> Simulation {
    let (scene, gripper) = bare_arm(&robot);
    let config = SimulationConfig { substeps, ..SimulationConfig::default() };
    let mut simulation =
        Simulation::new(&scene, gripper, GRIP_SITE, &Plant { robot, dt, config, deviation: Deviation::default() });
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
        let (scene, gripper) = lift::scene(&set.robot(), Vector3::repeat(0.021));
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
        let robot = Robot { air: None, ..set.robot().with_damping(0.0).with_friction(0.0) };
        let mut simulation = simulate_bare_arm(robot, dt, 1);
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
/// with damping, dry friction and robosuite's air, the engine's step of 2 ms with one substep is about as
/// accurate as MuJoCo's Euler step; with four, it is better. The reference is MuJoCo's RK4 at
/// a twentieth of the step, the torque held constant for 2 ms in all of them.
///
/// Both schemes are of first order, but their errors differ in detail and may cross zero:
/// a single one is allowed three times MuJoCo's, their geometric mean 1.3 times.
#[test]
fn motions_follow_mujoco() {
    const PUSH: [f64; 7] = [4.0, -3.0, 3.0, 2.0, -1.5, 1.0, 0.5];
    const AMPLITUDE: [f64; 7] = [20.0, 25.0, 15.0, 15.0, 5.0, 4.0, 2.0];
    const FREQUENCY: [f64; 7] = [0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7];

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
                let mut simulation = simulate_bare_arm(set.robot(), DT, substeps);
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
        let robot = Robot { air: None, ..set.robot().with_friction(0.5) };
        let [(coarse, exchanged, _), (fine, _, work)] = [0.002, 0.0005].map(|dt| unaccounted_work(&robot, dt));
        println!("{name}: {coarse:.3} of {exchanged:.1} J exchanged at 2 ms, {fine:.3} of {work:.2} J at 0.5 ms");
        assert!(coarse < 0.01 * exchanged, "{name}: {coarse} of {exchanged} J");
        assert!(fine < 0.01 * work, "{name}: {fine} of {work} J");
        assert_relative_eq!(coarse / fine, 4.0, max_relative = 0.1);
    }
}

/// After 2 s of motion (J): the work of the motors that energy and losses do not account for, the sum of the size of
/// the work over joints and steps, and the work itself.
fn unaccounted_work(robot: &Robot, dt: f64) -> (f64, f64, f64) {
    let mut simulation = simulate_bare_arm(robot.clone(), dt, 1);
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
        lost += robot.damping().dot(&moved.component_mul(&moved)) / dt + robot.friction().dot(&moved.abs());
    }
    (work - lost - (energy(&simulation) - start), exchanged, work)
}

/// Loads on hinge and handle (Nm), and the time in which they are reached linearly (s).
type Loads<'a> = &'a [(f64, f64, f64)];
const TURNED: (f64, f64, f64) = (0.0, 1.45, 3.0);

/// Opening and handle angle (rad) every 50 ms; the arm is held aside.
fn door_motion(loads: Loads) -> Vec<[f64; 2]> {
    let robot = RobotName::Robosuite.robot();
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, door) = Door::simulate(&plant, &door::root(MIDDLE));
    let mut aside = JointVector::from(HOME);
    aside[0] = 1.5;
    simulation.reset(&aside);
    let mut samples = vec![[0.0, 0.0]];
    let mut last = [0.0, 0.0];
    for &(hinge, handle, seconds) in loads {
        let steps = (seconds / DT).round() as usize;
        for step in 0..steps {
            let part = step as f64 / steps as f64;
            simulation.set_load(door.hinge, last[0] + (hinge - last[0]) * part);
            simulation.set_load(door.shaft, last[1] + (handle - last[1]) * part);
            let y = simulation.measure();
            simulation.step(&(y.bias + y.mass * ((aside - y.q) * 400.0 - y.qd * 40.0)), 0.0).unwrap();
            if (step + 1) % SAMPLE == 0 {
                samples.push([door.opening(&simulation), door.handle_angle(&simulation)]);
            }
        }
        last = [hinge, handle];
    }
    samples
}

/// Largest differences (rad) of opening and handle angle from MuJoCo's.
fn door_differences(case: &str, loads: Loads) -> [f64; 2] {
    let samples = door_motion(loads);
    let rows: Vec<_> = reference("door.csv", 1).into_iter().filter(|(names, _)| names[0] == case).collect();
    assert_eq!(rows.len(), samples.len());
    let worst = [0, 1].map(|k| {
        let differences = rows.iter().zip(&samples).map(|((_, numbers), sample)| (numbers[k + 1] - sample[k]).abs());
        differences.fold(0.0, f64::max)
    });
    println!("{case}: opening within {:.1e} rad, handle within {:.1e} rad", worst[0], worst[1]);
    worst
}

/// The remaining differences come from the contact of latch and post, which is soft in MuJoCo, and
/// from dry friction, which holds still here and creeps in MuJoCo. A handle that springs back through
/// the whole range amplifies them.
#[test]
fn door_moves_as_mujocos() {
    let cases: [(&str, Loads, [f64; 2]); 5] = [
        ("latched", &[(20.0, 0.0, 1.0), (20.0, 0.0, 1.0)], [3e-3, 2e-3]),
        ("half_turned", &[(0.0, 0.8, 3.0), (20.0, 0.8, 1.0), (20.0, 0.8, 1.0)], [3e-3, 1e-2]),
        ("spring_return", &[TURNED, (0.0, 0.0, 0.0), (0.0, 0.0, 4.0)], [1e-3, 5e-2]),
        ("opens", &[TURNED, (3.0, 1.45, 0.0), (3.0, 1.45, 0.3)], [2e-3, 5e-3]),
        (
            "swings_freely",
            &[TURNED, (5.0, 1.45, 0.0), (5.0, 1.45, 0.1), (0.0, 1.45, 0.0), (0.0, 1.45, 1.0)],
            [2e-3, 1e-2],
        ),
    ];
    for (case, loads, allowed) in cases {
        let [opening, handle] = door_differences(case, loads);
        assert!(opening < allowed[0] && handle < allowed[1], "{case}: opening {opening}, handle {handle}");
    }
}

/// The latch releases at MuJoCo's load on the handle, to 0.1 Nm, whichever way the handle is turned.
#[test]
fn latch_releases_at_mujocos_load() {
    let rows = reference("release.csv", 0);
    let loads: Vec<f64> = rows.into_iter().map(|(_, numbers)| numbers[0]).collect();
    assert!(matches!(loads[..], [down, up] if down > 0.0 && up < 0.0), "{loads:?}");
    for load in loads {
        let opens =
            |load: f64| door_motion(&[(0.0, load, 3.0), (5.0, load, 0.0), (5.0, load, 1.0)]).last().unwrap()[0] > 0.2;
        assert!(!opens(load - 0.1 * load.signum()) && opens(load + 0.02 * load.signum()), "{load} Nm");
    }
}
