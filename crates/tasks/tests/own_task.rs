//! A user's own task: registered by name, with options, defaults, disturbances, a start and a script of its own.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use aforce::{ConfigError, Measurement, Pose, Vector3};
use physics::camera::Camera;
use physics::gripper::{GRIP_SITE, add_gripper};
use physics::robots::Robot;
use physics::scene::{Body, Geom, Inertial, Joint, Role, Scene, Shape, at};
use physics::scenes::{Table, add_fixtures};
use physics::{Plant, Simulation};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use tasks::{
    Change, Draw, Env, EnvConfig, Fingers, Observer, OwnDisturbance, Reward, Start, Task, TaskKind, TaskName, Waypoint,
    register, register_anew,
};
use toml::Table as Toml;

/// Half extents of the block in the hand (m).
const HALF: [f64; 3] = [0.012, 0.01, 0.03];

const COLOR: [u8; 3] = [60, 120, 200];

/// A fault of the task, which an option chooses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Fault {
    #[default]
    None,
    /// One number more is observed after the first action.
    Longer,
    /// The reward becomes NaN with the second action.
    NoNumber,
    /// The reward gets a term more with the second action.
    MoreTerms,
    /// A number of its observation has the name of one of the arm's.
    ArmsName,
    /// The reward has a term twice.
    TermTwice,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Options {
    fault: Fault,
    /// Whether an episode starts with the block in the hand.
    in_hand: bool,
    /// Whether the arm starts out of its range.
    out_of_range: bool,
    /// After how many actions the task is lost.
    lost_after: Option<u32>,
}

/// The hand goes around in a circle, with or without a block between the fingers.
#[derive(Default)]
struct Circle {
    options: Options,
    block: usize,
    /// Factor on the block's mass, as the plant's deviation has it.
    mass: f64,
    actions: u32,
}

fn create(config: &EnvConfig) -> Result<Box<dyn Task>, ConfigError> {
    Ok(Box::new(Circle { options: config.own_options()?, ..Circle::default() }))
}

const MASS: OwnDisturbance =
    OwnDisturbance { key: "block_mass", change: Change::BodyMass("block"), allowed: [0.1, 10.0] };

const KIND: TaskKind = TaskKind::new("circle", "go around in a circle", create)
    .defaults(|env| (env.horizon, env.initial_noise) = (60, 0.0))
    .own_disturbances(&[MASS])
    .takes_options();

impl Task for Circle {
    fn reset(&mut self, plant: &Plant, _: &mut ChaCha8Rng) -> Simulation {
        let mut scene = Scene::default();
        let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, 0.8], friction: 1.0 };
        let base = add_fixtures(&mut scene, &plant.robot, &table);
        let wrist = plant.robot.add_to(&mut scene, base);
        let gripper = add_gripper(&mut scene, &plant.robot, wrist);
        self.block = scene.add(Body {
            name: "block".into(),
            parent: None,
            pose: at([0.2, 0.2, 0.8 + HALF[2]]),
            joint: Joint::Free,
            inertial: Inertial::solid_box(HALF.into(), 1000.0),
            geoms: vec![Geom {
                name: "block".into(),
                shape: Shape::Box(HALF.into()),
                pose: Pose::identity(),
                friction: 1.0,
                role: Role::Object,
                color: COLOR,
            }],
        });
        self.mass = plant.deviation.own.first().map_or(1.0, |(_, factor)| *factor);
        self.actions = 0;
        Simulation::new(&scene, gripper, GRIP_SITE, plant)
    }

    fn start(&self, robot: &Robot) -> Start {
        let grip = at([0.0, 0.0, 0.02]);
        let holding = Fingers::Holding { body: self.block, grip, width: 2.0 * HALF[0] };
        let mut start = Start::at(robot.home);
        if self.options.out_of_range {
            start.q[3] = 0.5;
        }
        Start { fingers: if self.options.in_hand { holding } else { Fingers::Apart(0.03) }, ..start }
    }

    fn name(&self) -> &'static str {
        "circle"
    }

    fn has_gripper(&self) -> bool {
        false
    }

    fn observe(&self, _: &Simulation, _: &Measurement, out: &mut Observer) {
        out.put("mass", self.mass, "1", 1.0, 1.0);
        if self.options.fault == Fault::Longer && self.actions > 0 {
            out.put("more", 0.0, "1", 0.0, 1.0);
        }
        if self.options.fault == Fault::ArmsName {
            out.put("eef_pos_x", 0.0, "m, world", 0.0, 1.0);
        }
    }

    fn reward(&mut self, _: &Simulation, _: &Measurement, _: Option<f64>) -> Reward {
        let later = self.actions > 1;
        let value = if self.options.fault == Fault::NoNumber && later { f64::NAN } else { 0.0 };
        let near = ("near", value);
        let terms = match self.options.fault {
            Fault::MoreTerms if later => [near, ("far", 0.0)].into(),
            Fault::TermTwice => [near, near].into(),
            _ => [near].into(),
        };
        Reward { terms, success: false }
    }

    fn lost(&self, _: &Simulation, _: &Measurement) -> bool {
        self.options.lost_after.is_some_and(|actions| self.actions >= actions)
    }

    /// Once around in two seconds.
    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint {
        let (sin, cos) = libm::sincos(std::f64::consts::PI * simulation.time());
        let mut pose = y.pose;
        pose.translation.vector = Vector3::new(-0.1 + 0.05 * cos, 0.05 * sin, 1.0);
        Waypoint { pose, grip: 0.0, force: 0.0 }
    }

    fn advance(&mut self, _: &Simulation, _: &Measurement) {
        self.actions += 1;
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.95, -0.95, 1.5], target: [-0.22, 0.0, 1.04], field_of_view: 0.76 }
    }
}

/// The settings of the task with these options.
fn config(options: &str) -> EnvConfig {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| register(&[KIND]).unwrap());
    let task: TaskName = "circle".parse().unwrap();
    EnvConfig { options: options.parse::<Toml>().unwrap(), ..EnvConfig::of(task) }
}

#[test]
fn a_registered_task_is_known_by_name_with_its_defaults() {
    let config = config("");
    assert_eq!((config.horizon, config.initial_noise), (60, 0.0));
    assert_eq!(config.task.purpose(), "go around in a circle");
    assert!(TaskName::all().contains(&config.task));
    assert_eq!(Env::new(config, 0).unwrap().task().name(), "circle");
    assert!(register(&[KIND]).unwrap_err().to_string().contains("registered twice"));
    let other = TaskKind::new("square", "go around in a square", create);
    register(&[other]).unwrap();
    let square = EnvConfig::of("square".parse().unwrap());
    let error = square.validate().unwrap_err().to_string();
    assert_eq!(error, "env.task: registered as \"square\", it calls itself \"circle\"");
}

/// A task that is written in another language may be redefined while the program runs.
#[test]
fn a_task_that_is_made_elsewhere_may_be_written_anew() {
    let kind = TaskKind::made_elsewhere("spiral", "go around in a spiral");
    let disturbed = |kind: TaskKind| {
        let mut config = EnvConfig::of(register_anew(kind).unwrap());
        config.disturbance.own.insert("block_mass".into(), Draw::Fixed(2.0));
        config.validate().map_err(|error| error.to_string())
    };
    assert!(disturbed(kind).unwrap_err().contains("it has no disturbances of its own"));
    assert_eq!(disturbed(kind.own_disturbances(&[MASS])), Ok(()));
    let spiral = EnvConfig::of("spiral".parse().unwrap());
    assert!(spiral.create_task().err().unwrap().to_string().contains("made by the program that plays it"));
    for taken in ["lift", "circle"] {
        config("");
        let error = register_anew(TaskKind::made_elsewhere(taken, "")).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "task {taken:?}: the name is that of a task in Rust; choose another one (in Python the attribute `name`)"
            )
        );
    }
}

#[test]
fn an_option_is_the_tasks_own() {
    assert!(config("in_hand = true").validate().is_ok());
    let error = |config: EnvConfig| config.validate().unwrap_err().to_string();
    assert_eq!(error(config("inhand = true")), "env.options: unknown key \"inhand\"; did you mean \"in_hand\"?");
    let lift = EnvConfig { task: TaskName::LIFT, ..config("in_hand = true") };
    assert_eq!(error(lift), "env.options.in_hand: lift has no options of its own");
}

/// The hand holds the block still for two seconds, then moves it for two more in a circle of 5 cm radius.
#[test]
fn a_body_stays_in_the_hand() {
    let mut env = Env::new(config("in_hand = true"), 0).unwrap();
    let body = |env: &Env| env.simulation().solids().iter().find(|solid| solid.color == COLOR).unwrap().body;
    let seen = |env: &Env| env.measurement().pose.inverse() * env.simulation().body_pose(body(env).unwrap());
    let start = seen(&env);
    assert!((start.translation.vector - Vector3::new(0.0, 0.0, 0.02)).norm() < 1e-12);
    let still = vec![0.0; env.action_dim()];
    for action in 0..80 {
        if action < 40 {
            env.step(&still)
        } else {
            env.step(&env.expert_action())
        };
        let now = seen(&env);
        let moved = (now.translation.vector - start.translation.vector).norm();
        let turned = now.rotation.angle_to(&start.rotation);
        assert!(moved < 1e-3 && turned < 0.02, "action {action}: {moved} m, {turned} rad");
    }
}

#[test]
fn a_start_out_of_range_is_told_with_its_joint() {
    let error = Env::new(config("out_of_range = true"), 0).err().unwrap().to_string();
    assert!(error.starts_with("env.task: circle starts with joint 4 at 0.5 rad; allowed: -3.0"), "{error}");
}

#[test]
fn an_episode_is_terminated_where_the_task_is_lost() {
    let last = |options: &str| {
        let mut env = Env::new(config(options), 0).unwrap();
        let still = vec![0.0; env.action_dim()];
        let mut steps = (1..).map(|action| (action, env.step(&still)));
        steps
            .find(|(_, step)| step.terminated || step.truncated)
            .map(|(action, step)| (action, step.terminated))
            .unwrap()
    };
    assert_eq!(last(""), (60, false));
    assert_eq!(last("lost_after = 7"), (7, true));
    assert_eq!(last("lost_after = 60"), (60, true), "a terminal state at the horizon is one");
}

#[test]
fn the_fingers_start_as_far_apart_as_the_task_says() {
    let mut env = Env::new(config(""), 0).unwrap();
    let still = vec![0.0; env.action_dim()];
    for _ in 0..10 {
        let [left, right] = env.simulation().fingers().unwrap();
        assert!((left.0 - right.0 - 0.031).abs() < 1e-4, "{left:?} {right:?}");
        env.step(&still);
    }
}

#[test]
fn a_script_has_a_clock() {
    let mut env = Env::new(config(""), 0).unwrap();
    for _ in 0..2 {
        env.reset(Some(1));
        let mut ways = vec![];
        for action in 0..40 {
            assert!((env.simulation().time() - 0.05 * f64::from(action)).abs() < 1e-9);
            env.step(&env.expert_action());
            ways.push(env.measurement().pose.translation.vector);
        }
        let width = |axis: usize| {
            let places = ways.iter().map(|way| way[axis]);
            places.clone().fold(f64::MIN, f64::max) - places.fold(f64::MAX, f64::min)
        };
        assert!(width(0) > 0.04 && width(1) > 0.04, "a circle: {} m, {} m", width(0), width(1));
    }
}

#[test]
fn a_disturbance_of_its_own_is_drawn_for_every_episode() {
    let mut disturbed = config("");
    disturbed.disturbance.own.insert("block_mass".into(), Draw::Between([0.5, 2.0]));
    let mut env = Env::new(disturbed.clone(), 0).unwrap();
    let mut mass = |seed| env.reset(Some(seed))[0];
    let drawn: Vec<f32> = (0..20).map(&mut mass).collect();
    assert!(drawn.iter().all(|mass| (0.5..2.0).contains(mass)) && drawn[0] != drawn[1] && mass(0) == drawn[0]);
    let refused = |key: &str, draw, task| {
        let mut config = EnvConfig { task, ..config("") };
        config.disturbance.own.insert(key.into(), draw);
        config.validate().unwrap_err().to_string()
    };
    let circle = disturbed.task;
    assert_eq!(
        refused("block_mas", Draw::Fixed(1.0), circle),
        "env.disturbance.own.block_mas: circle has no such disturbance; did you mean \"block_mass\"?"
    );
    assert!(refused("block_mass", Draw::Fixed(11.0), circle).contains("0.1 to 10"));
    assert!(refused("block_mass", Draw::Fixed(1.0), TaskName::LIFT).contains("it has no disturbances of its own"));
}

/// Each fault is reported in one line that names the task and what is wrong.
#[test]
fn a_task_that_breaks_its_word_is_named() {
    for (fault, words) in [
        ("longer", "task circle: 34 numbers are shown to a policy after action 1, 33 were at first"),
        ("no-number", "task circle: the term \"near\" of the reward of action 2 is NaN: a finite number is wanted"),
        ("more-terms", "the reward of action 2 has the terms [\"near\", \"far\"], the first had [\"near\"]"),
    ] {
        let mut env = Env::new(config(&format!("fault = \"{fault}\"")), 0).unwrap();
        let still = vec![0.0; env.action_dim()];
        let panic = catch_unwind(AssertUnwindSafe(|| (0..3).map(|_| env.step(&still)).count())).unwrap_err();
        let message = panic.downcast_ref::<String>().expect("a text");
        assert!(message.contains(words) && !message.contains('\n'), "{message}");
    }
}

#[test]
fn a_name_that_is_used_twice_is_refused() {
    for (fault, words) in [
        (
            "arms-name",
            "env.task: two numbers of its observation are called \"eef_pos_x\" in circle; each needs a name of its own",
        ),
        ("term-twice", "env.task: two terms of its reward are called \"near\" in circle; each needs a name of its own"),
    ] {
        let error = Env::new(config(&format!("fault = \"{fault}\"")), 0).err().unwrap();
        assert_eq!(error.to_string(), words);
    }
}
