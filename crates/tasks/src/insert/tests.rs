use super::*;
use crate::{Env, TaskName};
use toml::Value;

fn config(space: &str, options: &[(&str, f64)]) -> EnvConfig {
    let mut config = EnvConfig { space: space.parse().unwrap(), ..EnvConfig::of(TaskName::INSERT) };
    config.options.extend(options.iter().map(|(key, value)| (key.to_string(), Value::Float(*value))));
    config
}

/// The three terms of FORGE's published sizes at distances 0 and 5 cm: 1 / 6 + 1 / 4 + 1 / 2, and by hand.
#[test]
fn keypoints_earn_forges_reward() {
    let base = Vector3::new(0.1, 0.2, 0.8);
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let at = |offset: Vector3| Pose::from_parts(Translation3::from(base + offset), down);
    assert!(distance(&at(Vector3::zeros()), &base) < 1e-15);
    assert!((distance(&at(Vector3::new(0.03, 0.0, 0.04)), &base) - 0.05).abs() < 1e-12);
    let earned = |distance: f64| -> f64 { SLOPES.iter().map(|&slope| squashed(distance, slope)).sum() };
    assert!((earned(0.0) - (1.0 / 6.0 + 1.0 / 4.0 + 1.0 / 2.0)).abs() < 1e-12);
    // e^0.25 + 4 + e^-0.25 = 6.062826; e^2.5 + 2 + e^-2.5 = 14.264579; e^5 + e^-5 = 148.419897.
    assert!((earned(0.05) - (1.0 / 6.062826 + 1.0 / 14.264579 + 1.0 / 148.419897)).abs() < 1e-6);
}

#[test]
fn what_makes_no_insertion_is_refused_in_one_line() {
    for (key, value, range) in [
        ("clearance_mm", 0.0, "0.05"),
        ("clearance_mm", -1.0, "0.05"),
        ("clearance_mm", f64::NAN, "0.05"),
        ("clearance_mm", 5.1, "0.05 to 5"),
        ("length_mm", 900.0, "200"),
        ("start_mm", 5.0, "11"),
    ] {
        let error = config("mid", &[(key, value)]).validate().unwrap_err().to_string();
        assert!(error.contains(&format!("env.options.{key}")) && error.contains(range), "{error}");
        assert_eq!(error.lines().count(), 1);
    }
    let misspelt = config("mid", &[("clearence_mm", 1.0)]).validate().unwrap_err().to_string();
    assert!(misspelt.contains("clearance_mm"), "{misspelt}");
}

/// A robot that stands too far away is named.
#[test]
fn a_hole_out_of_reach_is_refused() {
    let mut config = config("mid", &[]);
    let mut robot = config.robot.robot();
    robot.mount.behind_table += 1.0;
    config.robot = physics::robots::RobotChoice::Own(Box::new(robot));
    let error = config.create_task().err().expect("refused").to_string();
    assert!(error.contains("above the hole: length_mm = "), "{error}");
}

#[test]
fn an_arm_that_reaches_the_middle_and_not_a_corner_is_refused() {
    let away = |behind_table: f64| {
        let mut config = config("mid", &[]);
        let mut robot = config.robot.robot();
        robot.mount.behind_table += behind_table;
        config.robot = physics::robots::RobotChoice::Own(Box::new(robot));
        config
    };
    let first_refused = (0..100).map(|step| away(0.01 * f64::from(step))).find(|config| config.create_task().is_err());
    let config = first_refused.expect("no arm reaches a metre further");
    let (task, robot) = (Insert { options: Options::of(&config).unwrap(), episode: None }, config.robot.robot());
    let (scene, gripper) = insert::scene(&robot, &task.options.sizes(), [0.0; 2]);
    let model = Model::new(&scene, gripper, GRIP_SITE);
    assert!(task.posture(&model, &robot, Vector3::z() * (TABLE_HEIGHT + DEPTH), 0.0).is_some());
}

/// How deep the peg's end is below the rim (m) after it was pressed down, its goal `aside` (m) from the hole's axis, with a spring of
/// 1500 N/m and an integrator.
fn depth(clearance: f64, aside: f64, heading: f64) -> f64 {
    let config = config("high", &[("clearance_mm", 1e3 * clearance), ("chamfer_mm", 0.0)]);
    let mut env = Env::new(config.clone(), 1).unwrap();
    env.reset(Some(3));
    let mut task = Insert::new(&config).unwrap();
    // The same draws as those of the environment's own task.
    let plant = Plant {
        robot: env.robot().clone(),
        dt: 0.002,
        config: physics::SimulationConfig::default(),
        deviation: physics::Deviation::default(),
    };
    let mut rng = <ChaCha8Rng as rand::SeedableRng>::seed_from_u64(3);
    task.reset(&plant, &mut rng);
    let (sin, cos) = libm::sincos(heading);
    let rim = task.running().rim;
    let mut script =
        Held { goal: rim + Vector3::new(cos, sin, 0.0) * aside, missing: Vector3::zeros(), turn: Vector3::zeros() };
    for n in 0..260 {
        // Held above the rim until the integrators have settled, then lowered at 1 mm/s to 3 mm below it: faster,
        // the joints' friction lets go.
        let height = (0.004 - 5e-5 * f64::from((n - 100).max(0))).max(-0.003);
        let action = script.action(&env, &task, height);
        env.step(&action);
    }
    rim.z - task.end(&env.measurement().pose).translation.z
}

/// Keeps the peg upright above a point.
struct Held {
    goal: Vector3,
    missing: Vector3,
    turn: Vector3,
}

impl Held {
    fn action(&mut self, env: &Env, task: &Insert, height: f64) -> Vec<f64> {
        let y = env.measurement();
        let end = task.end(&y.pose).translation.vector;
        let upright = straight_down(&(y.pose.rotation * Vector3::x()));
        let left = self.goal + Vector3::z() * height - end;
        let lean: Vector3 =
            aforce::pose_error(&Pose::from_parts(y.pose.translation, upright), &y.pose).fixed_rows::<3>(3).into();
        // Sideways the integrators stop in contact, where the wall would wind them up.
        if y.wrench.z < 0.5 {
            self.missing += 0.1 * left;
            self.turn += 0.1 * lean;
        }
        let delta = 2.0 * left + self.missing;
        let turn = 2.0 * lean + self.turn;
        let delta = aforce::Vector6::new(delta.x, delta.y, delta.z, turn.x, turn.y, turn.z);
        aforce::encode(&env.config().space, &env.config().controller, &delta, 0.0)
    }
}

/// With the arm behind it the peg goes as geometry says: in below half the clearance, on the rim beyond it.
#[test]
fn the_arm_puts_the_peg_in_below_half_the_clearance() {
    for clearance in [1e-3, 5e-4, 1.14e-4] {
        for (part, enters) in [(0.0, true), (0.3, true), (0.8, false), (1.5, false)] {
            let depth = depth(clearance, part * clearance, 0.13);
            assert_eq!(depth > 0.001, enters, "clearance {clearance} m, aside by {part} of it: {depth} m deep");
        }
    }
}

/// The script finds a hole that is a millimetre aside of where it is believed, and feels its way in.
#[test]
fn the_script_puts_the_peg_in() {
    for (space, clearance) in [("mid", 3.0), ("mid", 1.0), ("aforce-force", 3.0)] {
        let mut env = Env::new(config(space, &[("clearance_mm", clearance)]), 0).unwrap();
        for seed in 0..3 {
            env.reset(Some(seed));
            let inserted = (0..200).any(|_| env.step(&env.expert_action()).success);
            assert!(inserted, "{space}, {clearance} mm, seed {seed}");
        }
    }
}

/// The largest force of an action costs nothing by default, and what the penalty says where the options ask for it.
#[test]
fn a_blow_costs_the_penalty_if_the_options_say_so() {
    let mut free = config("high", &[("clearance_mm", 1.0)]);
    (free.force_penalty.limit, free.force_penalty.weight) = (10.0, 0.5);
    let mut priced = free.clone();
    priced.options.insert("penalty".into(), Value::Boolean(true));
    let mut envs = [free, priced].map(|config| Env::new(config, 0).unwrap());
    for env in &mut envs {
        env.reset(Some(2));
    }
    let mut blows = 0;
    for _ in 0..60 {
        let [free, priced] = envs.each_mut().map(|env| env.step(&env.expert_action()));
        assert!((free.reward - priced.reward - priced.penalty).abs() < 1e-9);
        let force = priced.interval.arm.max;
        assert_eq!(priced.penalty, if force > 10.0 { 0.5 * force } else { 0.0 });
        blows += i32::from(force > 10.0);
    }
    assert!(blows > 0);
}
