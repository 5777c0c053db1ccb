//! What the tasks observe, reward and start from is what robosuite defines, written down a second time here and applied
//! to the named entries of the observations.

use std::f64::consts::FRAC_PI_2;

use aforce::{Arm, JointVector, Vector3, Wrench};
use approx::assert_abs_diff_eq;
use nalgebra::{Quaternion, UnitQuaternion};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::{door, lift, wipe};
use physics::wiping_tool::{RAILS, facing_down};
use physics::{Deviation, Plant, Simulation, SimulationConfig};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tasks::{Component, Env, EnvConfig, RewardTerms, Step, Task, TaskName};

/// Observations have single precision.
const ROUNDING: f64 = 2e-6;
/// Wipe's normalisation: 500 / (5000 + 500 x 25.51).
const NORMALISATION: f64 = 0.0281611;

fn env(task: TaskName) -> Env {
    Env::new(EnvConfig { task, ..EnvConfig::default() }, 1).unwrap()
}

/// A task without the environment around it, the arm at `q`.
fn bare(task: TaskName, q: &JointVector) -> (Box<dyn Task>, Simulation) {
    let robot = RobotName::Robosuite.robot();
    let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
    let mut task = EnvConfig { task, ..EnvConfig::default() }.create_task().unwrap();
    let mut simulation = task.reset(&plant, &mut ChaCha8Rng::seed_from_u64(1));
    simulation.reset(q);
    (task, simulation)
}

/// Place of one of the door's joints, for [`Simulation::joint`].
fn door_joint(name: &str) -> usize {
    door::scene(&RobotName::Robosuite.robot(), &door::root(door::MIDDLE)).0.joint(name)
}

/// Holds the arm at `q`.
fn hold(simulation: &mut Simulation, q: &JointVector, steps: usize) {
    for _ in 0..steps {
        let y = simulation.measure();
        let tau = y.bias + y.mass * ((q - y.q) * 400.0 - y.qd * 40.0);
        simulation.step(&tau, 0.0).unwrap();
    }
}

/// `check` sees the environment and what was earned after each action of the scripted expert, who fulfils the task.
fn follow_expert(task: TaskName, mut check: impl FnMut(&Env, &Step)) {
    let mut env = env(task);
    for _ in 0..250 {
        let step = env.step(&env.expert_action());
        check(&env, &step);
    }
}

/// The entry called `name` of the last observation.
fn entry(env: &Env, name: &str) -> f64 {
    let place = env.observation_components().iter().position(|component| component.name == name);
    f64::from(env.observation()[place.unwrap_or_else(|| panic!("no entry {name:?}"))])
}

fn vector(env: &Env, name: &str) -> Vector3 {
    Vector3::from(["x", "y", "z"].map(|axis| entry(env, &format!("{name}_{axis}"))))
}

/// The terms of these names have these values.
fn assert_terms<const N: usize>(terms: &RewardTerms, expected: [(&str, f64); N]) {
    for (name, value) in expected {
        assert_abs_diff_eq!(terms.value(name), value, epsilon = ROUNDING);
    }
}

#[test]
fn the_robots_entries_are_its_joints_hand_and_fingers() {
    for task in TaskName::BUILT_IN {
        follow_expert(task, |env, _| {
            let simulation = env.simulation();
            let (q, qd) = simulation.joints();
            for i in 0..7 {
                let joint = |what: &str| entry(env, &format!("{what}_{}", i + 1));
                assert_abs_diff_eq!(joint("joint_cos"), q[i].cos(), epsilon = ROUNDING);
                assert_abs_diff_eq!(joint("joint_sin"), q[i].sin(), epsilon = ROUNDING);
                assert_abs_diff_eq!(joint("joint_vel"), qd[i], epsilon = ROUNDING);
            }
            let tool = simulation.model().kinematics(&q).tool;
            assert_abs_diff_eq!(vector(env, "eef_pos"), tool.translation.vector, epsilon = ROUNDING);
            // The hand's frame is the tool's, turned by a right angle about their common z.
            let [x, y, z, w] = ["x", "y", "z", "w"].map(|axis| entry(env, &format!("eef_quat_{axis}")));
            let hand = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
            assert!(x >= 0.0, "of the two quaternions the one with a positive x");
            assert_abs_diff_eq!(hand * Vector3::z(), tool.rotation * Vector3::z(), epsilon = ROUNDING);
            assert_abs_diff_eq!(hand * Vector3::y(), tool.rotation * -Vector3::x(), epsilon = ROUNDING);
            if task == TaskName::WIPE {
                let force = env.measurement().wrench.fixed_rows::<3>(0).norm();
                assert_eq!(entry(env, "gripper_contact"), f64::from(u8::from(force > 1.0)));
            } else {
                for (finger, place) in [("left", 7), ("right", 8)] {
                    let (position, velocity) = simulation.joint(place);
                    let read = |what: &str| entry(env, &format!("gripper_{what}_{finger}"));
                    assert_abs_diff_eq!(read("qpos"), position, epsilon = ROUNDING);
                    assert_abs_diff_eq!(read("qvel"), velocity, epsilon = ROUNDING);
                }
            }
        });
    }
}

/// robosuite counts from the cube to the hand, but from the hand to the handle, the door and the markers.
#[test]
fn differences_of_positions_point_robosuites_way() {
    let cube = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0.body("cube");
    follow_expert(TaskName::LIFT, |env, _| {
        let position = vector(env, "cube_pos");
        assert_abs_diff_eq!(position, env.simulation().body_pose(cube).translation.vector, epsilon = ROUNDING);
        assert_abs_diff_eq!(vector(env, "gripper_to_cube_pos"), vector(env, "eef_pos") - position, epsilon = ROUNDING);
    });
    let joints = [("hinge_qpos", door_joint("hinge")), ("handle_qpos", door_joint("handle"))];
    let mut widest = 0.0f64;
    follow_expert(TaskName::DOOR, |env, _| {
        let eef = vector(env, "eef_pos");
        assert_abs_diff_eq!(vector(env, "handle_to_eef_pos"), vector(env, "handle_pos") - eef, epsilon = ROUNDING);
        assert_abs_diff_eq!(vector(env, "door_to_eef_pos"), vector(env, "door_pos") - eef, epsilon = ROUNDING);
        for (name, joint) in joints {
            assert_abs_diff_eq!(entry(env, name), env.simulation().joint(joint).0, epsilon = ROUNDING);
        }
        widest = widest.max(entry(env, "hinge_qpos"));
    });
    assert!(widest > 0.3, "the door has been open: {widest} rad");
    follow_expert(TaskName::WIPE, |env, _| {
        let expected = vector(env, "wipe_centroid") - vector(env, "eef_pos");
        assert_abs_diff_eq!(vector(env, "gripper_to_wipe_centroid"), expected, epsilon = ROUNDING);
    });
}

/// As in robosuite, where markers are taken off when the reward is computed, from observations made before.
#[test]
fn in_wipe_a_marker_is_observed_as_wiped_one_action_later() {
    let mut earlier = 0.0;
    follow_expert(TaskName::WIPE, |env, step| {
        let share = entry(env, "proportion_wiped");
        assert_abs_diff_eq!(share, earlier, epsilon = ROUNDING);
        let wiped = step.reward_terms.value("wiped") / (50.0 * NORMALISATION) / 100.0;
        earlier = if step.success { 1.0 } else { share + wiped };
    });
    assert!(earlier > 0.3, "{earlier}");
}

#[test]
fn scaled_observations_are_centred_scaled_and_clipped_at_10() {
    let components = [Component::new("a", "m", 0.5, 4.0), Component::new("b", "1", -1.0, 0.5)];
    for (observation, expected) in [
        ([1.0, 3.0], [2.0, 2.0]),
        ([0.0, -2.0], [-2.0, -0.5]),
        ([3.1, -21.1], [10.0, -10.0]),
        ([-1.9, 18.0], [-9.6, 9.5]),
    ] {
        let mut scaled = observation;
        tasks::scale(&components, &mut scaled);
        assert_abs_diff_eq!(scaled[..], expected[..], epsilon = 1e-5);
    }
}

/// robosuite divides all of Lift's terms by 2.25, so that a lifted cube earns 1. A grasp needs both pads.
#[test]
fn lift_pays_for_reaching_grasping_and_lifting() {
    let scene = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0;
    let [cube, left, right] = ["cube", "left_pad", "right_pad"].map(|name| scene.geom(name));
    let mut lifted = 0;
    // Actions in which none, one and both pads pressed on the cube that was not lifted yet.
    let mut pads = [0; 3];
    follow_expert(TaskName::LIFT, |env, step| {
        assert_abs_diff_eq!(step.reward, step.reward_terms.sum());
        let height = entry(env, "cube_pos_z");
        assert_eq!(step.success, height > 0.84, "{height} m");
        if height > 0.84 {
            assert_eq!(step.reward_terms, [("reach", 0.0), ("grasp", 0.0), ("lifted", 1.0)].into());
            lifted += 1;
            return;
        }
        let reach = 1.0 - (10.0 * vector(env, "gripper_to_cube_pos").norm()).tanh();
        let pressing = [left, right].into_iter().filter(|&pad| env.simulation().touching(pad, cube)).count();
        let grasp = if pressing == 2 { 0.25 } else { 0.0 };
        assert_terms(&step.reward_terms, [("reach", reach / 2.25), ("grasp", grasp / 2.25), ("lifted", 0.0)]);
        // Its half edges are at most 22 mm: higher than that it hangs.
        assert!(pressing == 2 || height < 0.825, "{height} m");
        pads[pressing] += 1;
    });
    assert!(pads.into_iter().all(|count| count > 0) && lifted > 0, "pads {pads:?}, lifted {lifted}");
}

#[test]
fn door_pays_for_reaching_turning_and_opening() {
    let (mut turned, mut opened) = (0, 0);
    follow_expert(TaskName::DOOR, |env, step| {
        let angle = entry(env, "handle_qpos");
        let open = entry(env, "hinge_qpos") > 0.3;
        let reach = 1.0 - (10.0 * vector(env, "handle_to_eef_pos").norm()).tanh();
        let on_the_way = [("reach", 0.25 * reach), ("handle", 0.25 * (angle.abs() / FRAC_PI_2)), ("open", 0.0)];
        let expected = if open { [("reach", 0.0), ("handle", 0.0), ("open", 1.0)] } else { on_the_way };
        assert_terms(&step.reward_terms, expected);
        assert_eq!(step.success, open);
        assert_abs_diff_eq!(step.reward, step.reward_terms.sum());
        turned += usize::from(!open && angle > 1.0);
        opened += usize::from(open);
    });
    assert!(turned > 0 && opened > 0, "{turned} {opened}");
}

/// The soft stop gives way a little beyond a quarter turn, which is all that is paid for.
#[test]
fn a_turned_handle_counts_either_way_up_to_a_quarter_turn() {
    // Aside, so that the lever is free.
    let mut q = JointVector::from(HOME);
    q[0] = 1.5;
    let handle = door_joint("handle");
    for load in [0.8, -0.8, 8.0, -8.0] {
        let (mut task, mut simulation) = bare(TaskName::DOOR, &q);
        simulation.set_load(handle, load);
        hold(&mut simulation, &q, 1000);
        let angle = simulation.joint(handle).0;
        assert_eq!(angle.abs() > 1.6, load.abs() > 1.0, "{angle} rad under {load} Nm");
        let turned = task.reward(&simulation, &simulation.measure(), None).terms.value("handle");
        assert_abs_diff_eq!(turned, 0.25 * (angle.abs() / FRAC_PI_2).min(1.0), epsilon = 1e-12);
        assert!(turned > 0.1 && turned <= 0.25, "{turned}");
    }
}

/// The reward of an action in Wipe that costs the arm's penalty and earns nothing.
fn costs_the_arm(terms: &RewardTerms) -> bool {
    let earned = ["reach", "wiped", "press"].map(|name| terms.value(name));
    earned == [0.0; 3] && (terms.value("penalty") + 10.0 * NORMALISATION).abs() < 1e-5
}

#[test]
fn in_wipe_a_joint_within_a_tenth_of_a_radian_of_its_end_costs_10() {
    let (mut task, simulation) = bare(TaskName::WIPE, &HOME.into());
    for (joint, [low, high]) in Arm::PANDA.range.into_iter().enumerate() {
        for (q, near) in [(low + 0.09, true), (low + 0.11, false), (high - 0.11, false), (high - 0.09, true)] {
            let mut y = simulation.measure();
            y.q[joint] = q;
            let terms = task.reward(&simulation, &y, None).terms;
            assert_eq!(costs_the_arm(&terms), near, "joint {} at {q} rad: {terms:?}", joint + 1);
            let free = terms.value("reach") > 0.0 && terms.value("penalty") == 0.0;
            assert!(near || free, "joint {} at {q} rad: {terms:?}", joint + 1);
        }
    }
}

/// The arm, stretched out over the table with its hand bent up, sinks onto its forearm.
#[test]
fn in_wipe_a_forearm_on_the_table_costs_10() {
    let (mut task, mut simulation) = bare(TaskName::WIPE, &JointVector::from([0.0, 1.4, 0.0, -0.9, 0.0, 3.5, 0.8]));
    let (mut free, mut touched) = (0, 0);
    for _ in 0..500 {
        simulation.step(&JointVector::zeros(), 0.0).unwrap();
        // No joint is near its end.
        let y = aforce::Measurement { q: HOME.into(), ..simulation.measure() };
        let terms = task.reward(&simulation, &y, None).terms;
        assert_eq!(costs_the_arm(&terms), simulation.contact().arm_touches(), "{terms:?}");
        free += usize::from(!simulation.contact().arm_touches());
        touched += usize::from(simulation.contact().arm_touches());
    }
    assert!(free > 10 && touched > 10, "{free} {touched}");
}

/// The tool is pressed on the table with 30 N, level and then tilted, and torn off. The filtered force outlasts the touch, and pays nothing
/// then.
#[test]
fn wipe_pays_for_pressing_while_the_tool_touches_and_more_for_its_whole_face() {
    let (mut task, mut simulation) = bare(TaskName::WIPE, &HOME.into());
    let scene = wipe::scene(&RobotName::Robosuite.robot(), wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION).0;
    let (table, rails) = (scene.geom("table"), RAILS.map(|rail| scene.geom(rail)));
    let start = simulation.measure().pose.translation.vector;
    // Control samples in which the whole face pressed, in which an edge did, and in which a force was felt without a touch.
    let (mut whole, mut edge, mut torn_off) = (0, 0, 0);
    for step in 0..3010 {
        if step == 3000 {
            simulation.set_push(&Vector3::new(0.0, 0.0, 2000.0));
        }
        let y = simulation.measure();
        let tilt = Vector3::x() * if step < 2000 { 0.0 } else { 0.15 };
        let goal = UnitQuaternion::from_scaled_axis(tilt) * facing_down();
        let aside = start - y.pose.translation.vector;
        let force = Vector3::new(800.0 * aside.x, 800.0 * aside.y, -30.0) - 400.0 * y.twist.fixed_rows::<3>(0);
        let turn = (goal * y.pose.rotation.inverse()).scaled_axis();
        let moment = 60.0 * turn - 8.0 * y.twist.fixed_rows::<3>(3);
        let wrench = Wrench::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
        simulation.step(&(y.bias + y.jacobian.tr_mul(&wrench)), 0.0).unwrap();

        let contact = simulation.contact();
        let (force, feels) = (contact.hand_force(), contact.filtered.fixed_rows::<3>(0).norm() > 1.0);
        let touches = contact.touching && feels;
        let flat = rails.iter().all(|&rail| simulation.contact_points(rail, table) >= 4);
        let presses = touches && force > 0.5;
        let pressing = if presses { 0.01 + 0.01 * force + if flat { 0.1 } else { 0.0 } } else { 0.0 };
        let press = pressing + if touches { 0.01 } else { 0.0 };
        let terms = task.reward(&simulation, &simulation.measure(), None).terms;
        assert_terms(&terms, [("press", NORMALISATION * press), ("penalty", 0.0)]);

        let leans = simulation.measure().pose.rotation.angle_to(&facing_down()) > 0.05;
        assert!(!(flat && leans), "a tilted tool stands on an edge");
        whole += usize::from(presses && flat);
        edge += usize::from(presses && leans);
        torn_off += usize::from(feels && !contact.touching);
    }
    assert!(whole > 100 && edge > 100 && torn_off > 0, "{whole} {edge} {torn_off}");
}

/// Mean and standard deviation.
fn spread(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}

/// Each joint starts around its home with a deviation of 0.02 rad, whatever the others do; the cube within 3 cm of the
/// middle of the table.
#[test]
fn episodes_start_spread_as_robosuites() {
    let mut env = env(TaskName::LIFT);
    let starts: Vec<(JointVector, Vector3)> = (0..200)
        .map(|seed| {
            env.reset(Some(seed));
            (env.measurement().q, vector(&env, "cube_pos"))
        })
        .collect();

    let joints: [Vec<f64>; 7] = std::array::from_fn(|i| starts.iter().map(|(q, _)| q[i] - HOME[i]).collect());
    for (i, a) in joints.iter().enumerate() {
        let (mean, deviation) = spread(a);
        assert!(mean.abs() < 0.005, "joint {}: {mean} rad from home", i + 1);
        assert!((0.016..0.024).contains(&deviation), "joint {}: deviation {deviation} rad", i + 1);
        for (j, b) in joints.iter().enumerate().skip(i + 1) {
            let products: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
            let correlation = spread(&products).0 / (deviation * spread(b).1);
            assert!(correlation.abs() < 0.3, "joints {} and {}: {correlation}", i + 1, j + 1);
        }
    }

    for axis in 0..2 {
        let cube = || starts.iter().map(|(_, cube)| cube[axis]);
        let (low, high) = (cube().fold(0.0, f64::min), cube().fold(0.0, f64::max));
        assert!((-0.03..-0.027).contains(&low) && (0.027..0.03).contains(&high), "axis {axis}: {low} to {high} m");
    }
}
