//! What neither the controller's model nor the policy knows acts as its unit says, and nothing else does.

use aforce::{JointVector, Vector3};
use physics::robots::{RobotChoice, RobotName};
use physics::scenes::lift;
use tasks::{Disturbance, Draw, Env, EnvConfig, SensedWrench, Sensing, TaskName};

fn fixed(value: f64) -> Option<Draw> {
    Some(Draw::Fixed(value))
}

fn at_rate(policy_hz: u32, task: TaskName, space: &str, disturbance: Disturbance) -> Env {
    let mut config = EnvConfig { task, space: space.parse().unwrap(), disturbance, ..EnvConfig::default() };
    config.controller.policy_hz = policy_hz;
    Env::new(config, 1).unwrap()
}

/// Every control sample can be seen.
fn env(task: TaskName, space: &str, disturbance: Disturbance) -> Env {
    at_rate(500, task, space, disturbance)
}

fn tool(env: &Env) -> Vector3 {
    env.simulation().measure().pose.translation.vector
}

/// The observations of some actions.
fn seen(task: TaskName, disturbance: Disturbance) -> Vec<f32> {
    let mut env = env(task, "aforce", disturbance);
    let mut seen = env.reset(Some(1)).to_vec();
    for k in 0..300 {
        let action: Vec<f64> =
            (0..env.action_dim()).map(|i| f64::from((k / 25 * 7 + i) as u8 % 5) / 2.0 - 1.0).collect();
        env.step(&action);
        seen.extend(env.observation());
    }
    seen
}

#[test]
fn what_disturbs_nothing_changes_no_byte() {
    let neutral = Disturbance {
        friction: fixed(1.0),
        payload_kg: fixed(0.0),
        push_n: fixed(0.0),
        push_hz: Some(Draw::Between([0.2, 5.0])),
        torque_delay_s: fixed(0.0),
        torque_gain: fixed(1.0),
        force_noise_n: fixed(0.0),
        ..Disturbance::default()
    };
    for task in TaskName::BUILT_IN {
        assert!(seen(task, neutral.clone()) == seen(task, Disturbance::default()), "{}", task.as_str());
        let heavier = Disturbance { payload_kg: fixed(0.5), ..Disturbance::default() };
        assert!(seen(task, heavier) != seen(task, Disturbance::default()), "{}", task.as_str());
    }
}

/// What the scripted expert earns with each of its first actions.
fn earned(task: TaskName, actions: usize, disturbance: Disturbance) -> Vec<f64> {
    let mut env = Env::new(EnvConfig { task, disturbance, ..EnvConfig::default() }, 1).unwrap();
    (0..actions).map(|_| env.step(&env.expert_action()).reward).collect()
}

/// The script holds the cube and touches the table after 45 actions, and pulls the door open after 160.
#[test]
fn every_disturbance_of_a_scene_changes_what_happens_and_each_in_its_own_way() {
    let none = Disturbance::default;
    let slippery = Disturbance { friction: fixed(0.5), ..none() };
    for (task, actions, disturbances) in [
        (TaskName::LIFT, 60, vec![slippery.clone(), Disturbance { cube_mass: fixed(3.0), ..none() }]),
        (
            TaskName::DOOR,
            200,
            vec![
                slippery.clone(),
                Disturbance { hinge_damping: fixed(3.0), ..none() },
                Disturbance { hinge_spring: fixed(3.0), ..none() },
            ],
        ),
        (TaskName::WIPE, 80, vec![slippery, Disturbance { table_height_m: fixed(0.01), ..none() }]),
    ] {
        let mut traces = vec![(String::from("nothing"), earned(task, actions, none()))];
        for disturbance in disturbances {
            let (what, trace) = (disturbance.in_words(), earned(task, actions, disturbance));
            for (other, known) in &traces {
                assert!(trace != *known, "{task:?}: {what} is like {other}");
            }
            traces.push((what, trace));
        }
    }
}

/// 1 kg that the model does not know of sinks by m g / K: `high` has 1500 N/m. The dry friction of the joints holds up to
/// a fifth of it.
#[test]
fn a_payload_sinks_into_the_spring() {
    let sink = |disturbance| {
        // One action, as the next would take the goal along.
        let mut env = at_rate(1, TaskName::WIPE, "high", disturbance);
        env.reset(Some(1));
        env.step(&[0.0; 6]);
        tool(&env).z
    };
    let sunk = sink(Disturbance::default()) - sink(Disturbance { payload_kg: fixed(1.0), ..Disturbance::default() });
    let expected = 9.81 / 1500.0;
    assert!((0.8..1.05).contains(&(sunk / expected)), "{sunk} m, {expected} m without friction");
}

/// A swinging force moves the tool by force / stiffness while it is slow, along one line through where it rests.
#[test]
fn a_push_swings_with_its_amplitude_and_frequency() {
    let push = Disturbance { push_n: fixed(20.0), push_hz: fixed(0.5), ..Disturbance::default() };
    let mut env = env(TaskName::WIPE, "high", push);
    env.reset(Some(1));
    let still = vec![0.0; env.action_dim()];
    let path: Vec<Vector3> = (0..4000)
        .map(|_| {
            env.step(&still);
            tool(&env)
        })
        .collect();
    // From the second period on.
    let centre = path[1000..3000].iter().sum::<Vector3>() / 2000.0;
    let far = path[1000..3000].iter().max_by(|a, b| (*a - centre).norm().total_cmp(&(*b - centre).norm())).unwrap();
    let reach = (far - centre).norm();
    assert!((0.6..1.1).contains(&(reach * 1500.0 / 20.0)), "{reach} m");
    let direction = (far - centre) / reach;
    let along = |i: usize| (path[i] - centre).dot(&direction);
    let crossings = (1000..3999).filter(|&i| along(i) * along(i + 1) < 0.0).count();
    assert_eq!(crossings, 6, "twice in each of the three periods of 2 s");
}

/// The torque that acts is the one commanded 20 ms before; until then the arm is held as it was at reset.
#[test]
fn torques_come_late() {
    let action = |env: &Env| vec![0.5; env.action_dim()];
    let torques = |disturbance| {
        let mut env = env(TaskName::WIPE, "osc", disturbance);
        env.reset(Some(1));
        let holding = env.measurement().bias;
        let torques: Vec<JointVector> = (0..15).map(|_| env.step(&action(&env)).interval.mean_torque()).collect();
        (holding, torques)
    };
    let (_, now) = torques(Disturbance::default());
    let (holding, late) = torques(Disturbance { torque_delay_s: fixed(0.02), ..Disturbance::default() });
    assert!(late[..10].iter().all(|tau| *tau == holding));
    assert_eq!(late[10], now[0], "both are commanded at reset");
    assert!((now[0] - holding).amax() > 0.1);
}

/// Motors with half of their gain give half of what is commanded beyond gravity compensation.
#[test]
fn weak_motors_give_half_of_a_spring() {
    let given = |torque_gain| {
        let weak = Disturbance { torque_gain: fixed(torque_gain), ..Disturbance::default() };
        let mut env = env(TaskName::WIPE, "osc", weak);
        env.reset(Some(1));
        let bias = env.measurement().bias;
        env.step(&vec![0.5; env.action_dim()]).interval.mean_torque() - bias
    };
    let (half, whole) = (given(0.5), given(1.0));
    assert!(whole.amax() > 0.1 && (half - whole * 0.5).amax() < 1e-9, "{half} {whole}");
}

/// Noise has the deviation asked for, and is in what is measured, not in what is.
#[test]
fn noise_is_measured_and_nothing_else() {
    let noise = Disturbance {
        position_noise_rad: fixed(1e-3),
        velocity_noise_rad_per_s: fixed(0.02),
        force_noise_n: fixed(2.0),
        force_bias_n: fixed(5.0),
        ..Disturbance::default()
    };
    let mut env = env(TaskName::LIFT, "mid", noise);
    let still = vec![0.0; env.action_dim()];
    env.reset(Some(1));
    let (mut squares, mut mean) = ([0.0; 3], Vector3::zeros());
    const N: usize = 1000;
    for _ in 0..N {
        env.step(&still);
        let ((q, qd), y) = (env.simulation().joints(), env.measurement());
        let force: Vector3 = (y.wrench - env.simulation().contact().filtered).fixed_rows::<3>(0).into();
        mean += force / N as f64;
        squares[0] += (y.q - q).norm_squared() / (7 * N) as f64;
        squares[1] += (y.qd - qd).norm_squared() / (7 * N) as f64;
        squares[2] += force.norm_squared() / N as f64;
    }
    assert!((mean.norm() - 5.0).abs() < 0.4, "{mean}");
    let deviations = [squares[0].sqrt(), squares[1].sqrt(), ((squares[2] - 25.0) / 3.0).sqrt()];
    for (deviation, expected) in deviations.into_iter().zip([1e-3, 0.02, 2.0]) {
        assert!((deviation / expected - 1.0).abs() < 0.1, "{deviations:?}");
    }
}

/// An arm that does not measure the wrench but estimates it has the same bias in what it estimates. The first reading is exact, and the
/// bias all that it has in the air.
#[test]
fn a_bias_is_in_an_estimated_wrench_too() {
    let readings = |force_bias_n| {
        let sensing =
            Sensing { source: SensedWrench::Estimated, bias: [0.0; 2], noise: [0.0; 2], ..Sensing::default() };
        let disturbance = Disturbance { force_bias_n, ..Disturbance::default() };
        let space = "mid".parse().unwrap();
        let mut env = Env::new(EnvConfig { space, sensing, disturbance, ..EnvConfig::default() }, 1).unwrap();
        env.reset(Some(1));
        let force = |env: &Env| Vector3::from(env.measurement().wrench.fixed_rows::<3>(0));
        let (first, still) = (force(&env), vec![0.0; env.action_dim()]);
        let mut mean = Vector3::zeros();
        for _ in 0..40 {
            env.step(&still);
            mean += force(&env) / 40.0;
        }
        (first, mean)
    };
    let ((none, without), (bias, with)) = (readings(None), readings(fixed(5.0)));
    assert!(none.norm() == 0.0 && (bias.norm() - 5.0).abs() < 1e-9, "{none} {bias}");
    assert!((with - without - bias).norm() < 0.1, "{with} {without} {bias}");
}

/// Lift pays for nearness, in an arm that knows its joints to a hundredth of a radian.
#[test]
fn a_reward_goes_by_what_is_and_not_by_what_is_measured() {
    let cube = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0.body("cube");
    let noise = Disturbance { position_noise_rad: fixed(0.01), ..Disturbance::default() };
    let mut env = at_rate(20, TaskName::LIFT, "mid", noise);
    env.reset(Some(1));
    let still = vec![0.0; env.action_dim()];
    let mut off = 0.0f64;
    for _ in 0..50 {
        let step = env.step(&still);
        let place = env.simulation().body_pose(cube).translation.vector;
        let reach = |tool: Vector3| (1.0 - (10.0 * (tool - place).norm()).tanh()) / 2.25;
        let (true_reach, measured) = (reach(tool(&env)), reach(env.measurement().pose.translation.vector));
        assert!((step.reward_terms.value("reach") - true_reach).abs() < 1e-9);
        off = off.max((measured - true_reach).abs());
    }
    assert!(off > 1e-4, "what is measured would earn at most {off} more or less");
}

/// The tool meets a higher table sooner, by as much; what is seen of the markers stays.
#[test]
fn the_table_stands_where_the_disturbance_puts_it() {
    let touch = |raised: f64| {
        let mut env =
            env(TaskName::WIPE, "mid", Disturbance { table_height_m: fixed(raised), ..Disturbance::default() });
        let start = env.reset(Some(1))[..8].to_vec();
        while !env.simulation().contact().touching {
            env.step(&[0.0, 0.0, -0.05, 0.0, 0.0, 0.0]);
        }
        (tool(&env).z, start)
    };
    let ((low, seen_low), (high, seen_high)) = (touch(0.0), touch(0.02));
    assert!((high - low - 0.02).abs() < 0.002, "{low} {high}");
    assert!(seen_low.iter().zip(&seen_high).all(|(a, b)| (a - b).abs() < 1e-6));
}

/// What a range gives lies within it, differs from episode to episode, and is the same for the same episode.
#[test]
fn a_range_is_drawn_anew_for_every_episode() {
    let heights = |seed: u64| {
        let range = Disturbance { table_height_m: Some(Draw::Between([-0.02, 0.02])), ..Disturbance::default() };
        let mut env = env(TaskName::WIPE, "mid", range);
        env.reset(Some(seed));
        let decal = env.task().decals()[0].centre;
        decal[2] - 0.9
    };
    let drawn: Vec<f64> = (0..50).map(heights).collect();
    assert!(drawn.iter().all(|height| height.abs() <= 0.02));
    assert!(drawn.iter().any(|&height| height > 0.015) && drawn.iter().any(|&height| height < -0.015));
    assert_eq!(heights(7), drawn[7]);
}

#[test]
fn what_cannot_be_is_refused_in_one_line() {
    let refused = |task, disturbance| {
        let error = Env::new(EnvConfig { task, disturbance, ..EnvConfig::default() }, 1).err().unwrap().to_string();
        assert!(!error.contains('\n'));
        error
    };
    let error = refused(TaskName::WIPE, Disturbance { cube_mass: fixed(2.0), ..Disturbance::default() });
    assert_eq!(error, "env.disturbance.cube_mass: lift has it, wipe has not");
    let error = refused(TaskName::WIPE, Disturbance { payload_kg: fixed(-1.0), ..Disturbance::default() });
    assert_eq!(error, "env.disturbance.payload_kg = -1 is not allowed; allowed: 0 to 5");
    let error =
        refused(TaskName::LIFT, Disturbance { friction: Some(Draw::Between([2.0, 0.5])), ..Disturbance::default() });
    assert_eq!(error, "env.disturbance.friction: [2.0, 0.5] is upside down: the lower end comes first");
    // The tool's lowest corner starts 0.174 m above the table. In a table that is 0.18 m higher it would be less deep than
    // its soft layer gives way.
    let table = |highest| Disturbance { table_height_m: Some(Draw::Between([0.0, highest])), ..Disturbance::default() };
    let error = refused(TaskName::WIPE, table(0.18));
    assert_eq!(error, "env.disturbance.table_height_m: 0.18 m raise the table into the arm at its start; lower it");
    let below = EnvConfig { task: TaskName::WIPE, disturbance: table(0.17), ..EnvConfig::default() };
    assert!(Env::new(below, 1).is_ok());
    // An arm that stands too low is in the table however high that is.
    let mut robot = RobotName::default().robot();
    robot.mount.height -= 0.5;
    let robot = RobotChoice::Own(Box::new(robot));
    let disturbance = Disturbance { table_height_m: fixed(0.01), ..Disturbance::default() };
    let config = EnvConfig { task: TaskName::WIPE, robot, disturbance, ..EnvConfig::default() };
    let error = Env::new(config, 1).err().unwrap().to_string();
    assert!(error.starts_with("env.task: ") && error.contains(" overlap at the start of wipe"), "{error}");
    let error = refused(TaskName::LIFT, Disturbance { push_n: fixed(5.0), ..Disturbance::default() });
    assert_eq!(error, "env.disturbance.push_n: push_n and push_hz stand together or not at all");
    let mut slow = EnvConfig::default();
    slow.controller.control_hz = 20;
    slow.disturbance = Disturbance { push_n: fixed(5.0), push_hz: fixed(20.0), ..Disturbance::default() };
    let error = Env::new(slow, 1).err().unwrap().to_string();
    assert_eq!(error, "env.disturbance.push_hz = 20 is not allowed; allowed: 0 to 10");
}
