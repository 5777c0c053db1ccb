use super::*;
use crate::{Env, TaskName};
use rand::SeedableRng;
use toml::Value;

fn config(space: &str, options: &[(&str, f64)]) -> EnvConfig {
    let mut config = EnvConfig { space: space.parse().unwrap(), ..EnvConfig::of(TaskName::INSERT) };
    config.options.extend(options.iter().map(|(key, value)| (key.to_string(), Value::Float(*value))));
    config
}

/// The task at the start of the episode of `seed`, with the same draws as those of an environment's own task.
fn begun(config: &EnvConfig, seed: u64) -> (Insert, Simulation) {
    let mut task = Insert::new(config).unwrap();
    let plant = Plant {
        robot: config.robot.robot(),
        dt: 0.002,
        config: physics::SimulationConfig::default(),
        deviation: physics::Deviation::default(),
    };
    let simulation = task.reset(&plant, &mut ChaCha8Rng::seed_from_u64(seed));
    (task, simulation)
}

/// The number of this name that a policy or a critic sees.
fn seen(env: &Env, name: &str) -> f64 {
    let components = env.observation_components().iter().chain(env.privileged_components());
    let mut seen = components.zip(env.observation().iter().chain(env.privileged()));
    let (_, value) = seen.find(|(component, _)| component.name == name).unwrap();
    f64::from(*value)
}

fn place(env: &Env, name: &str) -> Vector3 {
    Vector3::from(["x", "y", "z"].map(|axis| seen(env, &format!("{name}_{axis}"))))
}

/// FORGE's three terms at distances of 0 and 5 cm, worked out by hand.
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
        ("chamfer_mm", 1e-9, "0, or 0.01 to 5"),
        ("chamfer_mm", -0.1, "0, or 0.01 to 5"),
        ("chamfer_mm", f64::NAN, "0, or 0.01 to 5"),
        ("chamfer_mm", 5.1, "0, or 0.01 to 5"),
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

/// A chamfer is left out, or is wide enough for the engine to find the hulls of its wedges.
#[test]
fn the_narrowest_chamfer_makes_a_hole() {
    for chamfer in [0.0, 0.01] {
        for clearance in [0.05, 0.114, 1.0, 3.5, 5.0] {
            config("mid", &[("clearance_mm", clearance), ("chamfer_mm", chamfer)]).create_task().unwrap();
        }
    }
}

/// In a corner of the widest hole a square peg still counts as in. A wider hole is for round pegs.
#[test]
fn a_square_peg_counts_in_a_corner_of_its_hole() {
    let square = |clearance: f64| {
        let mut config = config("mid", &[("clearance_mm", clearance)]);
        config.options.insert("profile".into(), Value::String("square".into()));
        config
    };
    let (task, _) = begun(&square(3.5), 3);
    let corner = task.base() + Vector3::new(0.5, 0.5, 0.0) * 3.5e-3;
    assert!(task.height(&Pose::from_parts(Translation3::from(corner), straight_down(&Vector3::x()))).is_some());
    let error = square(3.6).validate().unwrap_err().to_string();
    assert_eq!(error, "env.options.clearance_mm = 3.6 is not allowed; allowed: 0.05 to 3.5 with profile = \"square\"");
    config("mid", &[("clearance_mm", 3.6)]).validate().unwrap();
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
    let (task, _) = begun(&config, 3);
    let (sin, cos) = libm::sincos(heading);
    let rim = task.running().rim;
    let mut script =
        Held { goal: rim + Vector3::new(cos, sin, 0.0) * aside, missing: Vector3::zeros(), turn: Vector3::zeros() };
    for n in 0..260 {
        // Held above the rim until the integrators have settled, then lowered at 1 mm/s to 3 mm below it. At a higher
        // speed the joints' friction would no longer hold the peg in place sideways.
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
        // The integrators stop in contact, where the wall would wind them up.
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

/// A peg held by the arm does what geometry says: it enters if it is aside by less than half the clearance, and else stays on the rim.
#[test]
fn the_arm_puts_the_peg_in_below_half_the_clearance() {
    for clearance in [1e-3, 5e-4, 1.14e-4] {
        for (part, enters) in [(0.0, true), (0.3, true), (0.8, false), (1.5, false)] {
            let depth = depth(clearance, part * clearance, 0.13);
            assert_eq!(depth > 0.001, enters, "clearance {clearance} m, aside by {part} of it: {depth} m deep");
        }
    }
}

/// The script inserts the peg although the believed place of the hole has an error of about a millimetre.
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

/// By default the largest force of an action costs nothing. With the option `penalty` it costs the force penalty.
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

/// A peg counts within 2.5 mm of the axis only: as engaged below 22.5 mm above the base, as inserted below 1 mm.
#[test]
fn a_peg_is_engaged_or_in_by_where_its_end_is() {
    let (mut task, simulation) = begun(&config("mid", &[]), 3);
    let base = task.running().rim - Vector3::z() * 0.025;
    for (aside, above, engaged, inserted) in [
        (0.0, 0.0, 1.0, 1.0),
        (0.0024, 0.0009, 1.0, 1.0),
        (0.0026, 0.0009, 0.0, 0.0),
        (0.0024, 0.0011, 1.0, 0.0),
        (0.0024, 0.0224, 1.0, 0.0),
        (0.0024, 0.0226, 0.0, 0.0),
        (0.02, 0.0, 0.0, 0.0),
    ] {
        // The tool point of a hand that looks down is 38.5 mm above the peg's end.
        let tool = base + Vector3::new(0.6 * aside, -0.8 * aside, above + 0.0385);
        let pose = Pose::from_parts(Translation3::from(tool), straight_down(&Vector3::x()));
        let reward = task.reward(&simulation, &Measurement { pose, ..simulation.measure() }, None);
        let terms = ["engaged", "inserted"].map(|term| reward.terms.value(term));
        assert_eq!(terms, [engaged, inserted], "{aside} m aside, {above} m above");
        assert_eq!(reward.success, inserted > 0.0);
    }
}

/// The script puts the peg in. Then a goal 5 cm lower presses it on the base with more than the allowed force.
#[test]
fn the_way_in_earns_its_terms_and_a_force_costs_what_is_beyond_the_allowed() {
    let mut env = Env::new(config("mid", &[("clearance_mm", 3.0)]), 0).unwrap();
    env.reset(Some(0));
    let mut down = vec![0.0; env.action_dim()];
    down[2] = -1.0;
    // Numbers of actions after which the peg was engaged but not inserted, inserted, and pressed too hard.
    let (mut on_the_way, mut inside, mut pressed) = (0, 0, 0);
    for _ in 0..200 {
        let action = if inside > 0 { down.clone() } else { env.expert_action() };
        let step = env.step(&action);
        let end = place(&env, "base_to_peg_end_pos");
        let below = |height: f64| end.xy().norm() < 0.0025 && end.z < height;
        let (engaged, inserted) = (below(0.0225), below(0.001));
        let excess = (env.simulation().contact().hand_force() - seen(&env, "allowed_force")).max(0.0);
        let [is_engaged, is_in, price] = ["engaged", "inserted", "force"].map(|term| step.reward_terms.value(term));
        assert_eq!((is_engaged, is_in, step.success), (f64::from(engaged), f64::from(inserted), inserted));
        assert!((price + 0.2 * excess).abs() < 1e-6, "{price} for {excess} N");
        on_the_way += u32::from(engaged && !inserted);
        inside += u32::from(inserted);
        pressed += u32::from(excess > 0.0);
    }
    assert!(on_the_way > 0 && inside > 0 && pressed > 0, "{on_the_way} {inside} {pressed}");
}

/// The rim is within 5 cm of the table's middle, believed with 1 mm of error along each axis, and 5 to 10 N are allowed.
#[test]
fn each_episode_draws_a_hole_a_belief_and_an_allowed_force() {
    let mut env = Env::new(config("mid", &[]), 0).unwrap();
    let mut draws = vec![];
    for seed in 0..200 {
        env.reset(Some(seed));
        let [eef, from_hole, rim, error] =
            ["eef_pos", "hole_to_eef_pos", "rim_pos", "believed_error"].map(|name| place(&env, name));
        // A policy observes the tool relative to the believed hole.
        assert!((from_hole + rim + error - eef).norm() < 1e-6, "{from_hole} {rim} {error} {eef}");
        draws.push((rim, error, seen(&env, "allowed_force")));
    }
    let ends = |of: &dyn Fn(&(Vector3, Vector3, f64)) -> f64| {
        let values = || draws.iter().map(of);
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    };
    for axis in 0..2 {
        let [low, high] = ends(&|(rim, ..)| rim[axis]);
        assert!((-0.05..-0.045).contains(&low) && (0.045..0.05).contains(&high), "axis {axis}: {low} to {high} m");
    }
    for axis in 0..3 {
        let squares = draws.iter().map(|(_, error, _)| error[axis].powi(2)).sum::<f64>();
        // A standard deviation that is estimated from 200 values has a standard error of 5 %.
        let deviation = (squares / 200.0).sqrt();
        assert!((0.0008..0.0012).contains(&deviation), "axis {axis}: {deviation} m");
    }
    let [low, high] = ends(&|(.., allowed)| *allowed);
    assert!((5.0..5.5).contains(&low) && (9.5..10.0).contains(&high), "{low} to {high} N");
}

/// The script must not use the true place of the hole.
#[test]
fn the_script_sees_the_hole_where_it_is_believed_to_be() {
    let (task, simulation) = begun(&config("mid", &[]), 3);
    let Running { rim, believed, .. } = task.running();
    assert_ne!(believed, rim);
    assert_eq!(task.seen(&simulation.measure()).rim, *believed);
}
