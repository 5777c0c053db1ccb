//! A policy that observes the measured force reads newtons, in the tool's axes, from nothing when the episode began; a critic may see
//! what the policy does not.

use std::collections::BTreeMap;

use aforce::{Vector3, Wrench};
use nalgebra::{Translation3, UnitQuaternion};
use physics::robots::RobotName;
use physics::scenes::{door, lift, wipe};
use physics::wiping_tool::RAILS;
use tasks::{Disturbance, Draw, Env, EnvConfig, ObservationOptions, Privileged, SensedWrench, Sensing, TaskName};

const NAMES: [&str; 6] = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"];

fn feeling(task: TaskName, space: &str) -> EnvConfig {
    let observation = ObservationOptions { force: true, ..ObservationOptions::default() };
    EnvConfig { task, space: space.parse().unwrap(), observation, ..EnvConfig::default() }
}

/// The six numbers, which stand last where the last action is not observed.
fn felt(env: &Env) -> Wrench {
    let components = env.observation_components();
    assert_eq!(components[components.len() - 1].name, NAMES[5]);
    felt_in(env)
}

fn felt_in(env: &Env) -> Wrench {
    let (components, values) = (env.observation_components(), env.observation());
    let first = components.iter().position(|component| component.name == NAMES[0]).unwrap();
    let names: Vec<&str> = components[first..first + 6].iter().map(|component| component.name.as_str()).collect();
    assert_eq!(names, NAMES);
    Wrench::from_fn(|i, _| f64::from(values[first + i]))
}

fn force(wrench: &Wrench) -> Vector3 {
    wrench.fixed_rows::<3>(0).into()
}

fn moment(wrench: &Wrench) -> Vector3 {
    wrench.fixed_rows::<3>(3).into()
}

/// An action of a space that moves the goal by nothing.
fn still(env: &Env) -> Vec<f64> {
    vec![0.0; env.action_dim()]
}

#[test]
fn it_is_six_numbers_more_in_every_task_and_space() {
    for task in TaskName::BUILT_IN {
        for space in aforce::ActionSpace::built_in() {
            let config = EnvConfig { space, ..feeling(task, "aforce") };
            let without = EnvConfig { observation: ObservationOptions::default(), ..config.clone() };
            let [mut with, mut without] = [config, without].map(|config| Env::new(config, 1).unwrap());
            assert_eq!(with.reset(Some(1))[..without.observation().len()], *without.reset(Some(1)));
            assert_eq!(felt(&with), Wrench::zeros());
            let action = still(&with);
            assert_eq!(with.step(&action), without.step(&action), "it changes nothing else");
        }
    }
}

/// A force controller holds 30 N against the table, which pushes the tool up: along -z of a tool that looks down.
#[test]
fn pressing_with_30_newtons_reads_30() {
    let mut env = Env::new(feeling(TaskName::WIPE, "low-force"), 1).unwrap();
    env.reset(Some(1));
    while force(&env.measurement().wrench).z < 5.0 {
        assert!(!env.step(&env.expert_action()).truncated, "the script never touches the table");
    }
    // The last entry asks for 0 to 50 N.
    let mut action = still(&env);
    *action.last_mut().unwrap() = 0.2;
    for _ in 0..60 {
        env.step(&action);
    }
    let mut mean = Vector3::zeros();
    for _ in 0..20 {
        env.step(&action);
        mean += force(&felt(&env)) / 20.0;
    }
    assert!((mean.z + 30.0).abs() < 1.5, "{mean:?}");
    // Friction holds a tool that rests; mu is 0.03 to 1.
    assert!(mean.xy().norm() < 0.5 * 30.0, "{mean:?}");
}

/// In the air there is nothing but the sensor's own error. Tared, a bias reads nothing until the tool turns: it stays in the world's
/// axes, as the weight of a tool that is known too heavy does.
#[test]
fn a_bias_is_tared_and_comes_back_as_the_tool_turns() {
    let disturbance = Disturbance { force_bias_n: Some(Draw::Fixed(5.0)), ..Disturbance::default() };
    let mut env = Env::new(EnvConfig { disturbance, ..feeling(TaskName::LIFT, "osc") }, 1).unwrap();
    env.reset(Some(1));
    let start = env.measurement().clone();
    assert!((force(&start.wrench).norm() - 5.0).abs() < 1e-9);
    assert_eq!(felt(&env), Wrench::zeros());
    let mut action = still(&env);
    action[5] = 0.5;
    for _ in 0..10 {
        env.step(&action);
    }
    let now = env.measurement().pose.rotation;
    assert!(now.angle_to(&start.pose.rotation) > 0.3);
    let bias = force(&start.wrench);
    let expected = now.inverse() * bias - start.pose.rotation.inverse() * bias;
    assert!(expected.norm() > 0.5 && (force(&felt(&env)) - expected).norm() < 1e-6, "{:?}", felt(&env));
}

#[test]
fn noise_is_as_strong_as_said() {
    let disturbance = Disturbance { force_noise_n: Some(Draw::Fixed(2.0)), ..Disturbance::default() };
    let mut env = Env::new(EnvConfig { disturbance, ..feeling(TaskName::WIPE, "osc") }, 1).unwrap();
    env.reset(Some(1));
    let action = still(&env);
    let seen: Vec<Vector3> = (0..400)
        .map(|_| {
            env.step(&action);
            force(&felt(&env))
        })
        .collect();
    let mean = seen.iter().sum::<Vector3>() / 400.0;
    for axis in 0..3 {
        let variance = seen.iter().map(|force| (force[axis] - mean[axis]).powi(2)).sum::<f64>() / 399.0;
        // The standard deviation of an estimate from 400 is 3.5 %.
        assert!((variance.sqrt() - 2.0).abs() < 0.3, "{}", variance.sqrt());
    }
}

/// An arm without a sensor estimates, with a bias of up to 10 N in each direction; tared, it does not show.
#[test]
fn the_bias_of_an_estimate_is_tared_too() {
    let largest = |bias: f64| {
        let sensing =
            Sensing { source: SensedWrench::Estimated, bias: [bias, 0.0], noise: [0.0; 2], ..Sensing::default() };
        let mut env = Env::new(EnvConfig { sensing, ..feeling(TaskName::LIFT, "osc") }, 1).unwrap();
        env.reset(Some(1));
        let action = still(&env);
        for _ in 0..40 {
            env.step(&action);
        }
        (force(&felt(&env)).norm(), force(&env.measurement().wrench).norm())
    };
    let ((none, _), (some, measured)) = (largest(0.0), largest(10.0));
    assert!(measured > 4.0 && (some - none).abs() < 0.2, "{none} {some} {measured}");
}

fn with_critic(task: TaskName, critic: Vec<Privileged>, disturbance: Disturbance) -> EnvConfig {
    let observation = ObservationOptions { critic, ..ObservationOptions::default() };
    EnvConfig { task, observation, disturbance, ..EnvConfig::default() }
}

fn privileged(env: &Env) -> Vec<(&str, f32)> {
    let names = env.privileged_components().iter().map(|component| component.name.as_str());
    names.zip(env.privileged().iter().copied()).collect()
}

#[test]
fn a_critic_sees_what_was_drawn_and_the_policy_does_not() {
    let disturbance = Disturbance {
        friction: Some(Draw::Between([0.5, 2.0])),
        force_bias_n: Some(Draw::Fixed(5.0)),
        push_n: Some(Draw::Fixed(8.0)),
        push_hz: Some(Draw::Fixed(2.0)),
        ..Disturbance::default()
    };
    let mut env = Env::new(with_critic(TaskName::WIPE, vec![Privileged::Disturbance], disturbance.clone()), 1).unwrap();
    let plain = Env::new(with_critic(TaskName::WIPE, vec![], disturbance), 1).unwrap();
    assert_eq!(env.observation_components(), plain.observation_components());
    let mut drawn = vec![];
    for seed in 0..20 {
        env.reset(Some(seed));
        let seen = privileged(&env);
        let value = |name: &str| f64::from(seen.iter().find(|(of, _)| *of == name).unwrap().1);
        let vector = |name: &str| Vector3::from(["x", "y", "z"].map(|axis| value(&format!("{name}_{axis}"))));
        assert_eq!(seen.len(), 10, "{seen:?}");
        let friction = value("disturbance_friction");
        assert!((0.5..=2.0).contains(&friction));
        drawn.push(friction);
        let bias = vector("disturbance_force_bias");
        assert!((bias - force(&env.measurement().wrench)).norm() < 1e-6, "in the air all that is measured");
        assert!(vector("disturbance_push").norm() <= 8.0 + 1e-6);
    }
    assert!(drawn.iter().any(|friction| *friction < 1.0) && drawn.iter().any(|friction| *friction > 1.5));
}

/// `NAME_x`, `NAME_y`, `NAME_z`.
fn three(name: &str, value: Vector3) -> Vec<(String, f64)> {
    ["x", "y", "z"].into_iter().zip(value.iter()).map(|(axis, value)| (format!("{name}_{axis}"), *value)).collect()
}

/// `NAME_x` to `NAME_z`, `NAME_rx` to `NAME_rz`.
fn six(name: &str, linear: Vector3, angular: Vector3) -> Vec<(String, f64)> {
    let angular = three(name, angular).into_iter().zip(["rx", "ry", "rz"]);
    let angular = angular.map(|((_, value), axis)| (format!("{name}_{axis}"), value));
    three(name, linear).into_iter().chain(angular).collect()
}

/// What a critic sees of contact, controller and force, as simulation and controller have it.
fn common(env: &Env) -> Vec<(String, f64)> {
    let (simulation, controller, y) = (env.simulation(), env.controller(), env.simulation().measure());
    let (contact, goal, stiffness) = (simulation.contact(), controller.goal(), controller.stiffness());
    let to_tool = y.pose.rotation.inverse();
    let (pressing, torque) = (force(&contact.filtered), moment(&contact.filtered));
    // In Insert a policy feels in the world's axes, and about the peg's end, 38.5 mm below the tool point.
    let in_insert = env.config().task == TaskName::INSERT;
    let about = y.pose.rotation * Vector3::z() * if in_insert { 0.0385 } else { 0.0 };
    let turn = if in_insert { UnitQuaternion::identity() } else { to_tool };
    let short = goal.translation.vector - y.pose.translation.vector;
    [
        six("contact", to_tool * pressing, to_tool * torque),
        vec![("contact_touching".to_owned(), f64::from(contact.touching))],
        vec![("contact_links".to_owned(), contact.links.sustained)],
        six("goal_error", short, (goal.rotation * to_tool).scaled_axis()),
        six("stiffness", force(&stiffness), moment(&stiffness)),
        six("feedforward", force(controller.feedforward()), moment(controller.feedforward())),
        vec![("desired_force".to_owned(), controller.desired_force())],
        three("force", turn * pressing),
        three("torque", turn * (torque - about.cross(&pressing))),
    ]
    .concat()
}

/// What a critic sees of the task, as the simulation has it; `wiped` is the share of the markers that the actions before the last
/// have wiped. Where the hole is only the task knows: its own tests look at that.
fn of_task(env: &Env, wiped: f64) -> Vec<(String, f64)> {
    let (task, simulation) = (env.config().task, env.simulation());
    let pose = simulation.measure().pose;
    let robot = RobotName::Robosuite.robot();
    let flag = |name: &str, yes: bool| (name.to_owned(), f64::from(yes));
    if task == TaskName::LIFT {
        let scene = lift::scene(&robot, Vector3::repeat(0.021)).0;
        let velocity = simulation.body_velocity(scene.body("cube"));
        let grasped = ["left_pad", "right_pad"].map(|pad| simulation.touching(scene.geom(pad), scene.geom("cube")));
        let mut known = six("cube_vel", force(&velocity), moment(&velocity));
        known.push(flag("cube_grasped", grasped == [true; 2]));
        known
    } else if task == TaskName::DOOR {
        let scene = door::scene(&robot, &door::root(door::MIDDLE)).0;
        let speed = |joint: &str| (format!("{joint}_qvel"), simulation.joint(scene.joint(joint)).1);
        let grasped = ["left_pad", "right_pad"].map(|pad| simulation.touching(scene.geom(pad), scene.geom("lever")));
        vec![speed("hinge"), speed("handle"), flag("handle_grasped", grasped == [true; 2])]
    } else if task == TaskName::WIPE {
        let scene = wipe::scene(&robot, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION).0;
        let points = RAILS.map(|rail| simulation.contact_points(scene.geom(rail), scene.geom("table")));
        let height = ("height_above_table".to_owned(), pose.translation.z - wipe::TABLE_HEIGHT);
        vec![height, flag("tool_flat", points.iter().all(|&points| points >= 4)), ("wiped_share".to_owned(), wiped)]
    } else {
        let seen: BTreeMap<&str, f32> = privileged(env).into_iter().collect();
        let rim = Vector3::from(["rim_pos_x", "rim_pos_y", "rim_pos_z"].map(|name| f64::from(seen[name])));
        let end = (pose * Translation3::new(0.0, 0.0, 0.0385)).translation.vector;
        let turn = ["x", "y", "z", "w"].into_iter().zip(pose.rotation.coords.iter());
        let mut known = three("base_to_peg_end_pos", end - rim + Vector3::z() * 0.025);
        known.extend(turn.map(|(axis, value)| (format!("peg_quat_{axis}"), *value)));
        known
    }
}

/// Over an episode of the script in every task, and the start of another. What simulation and controller tell is shown as they tell it, and
/// no number stays the same, but for two: no script lays a link on anything, and all rims are as high.
#[test]
fn every_entry_shows_something_in_every_task() {
    use Privileged::{Contact, Controller, Force, Task};
    let mut ends = BTreeMap::<String, [f32; 2]>::new();
    for task in TaskName::BUILT_IN {
        // Only a space with a force has a desired one, and Wipe's script alone asks for it.
        let space = if task == TaskName::WIPE { "aforce-force" } else { "aforce" };
        let critic = vec![Contact, Controller, Force, Task];
        let config = EnvConfig { space: space.parse().unwrap(), ..with_critic(task, critic, Disturbance::default()) };
        let mut env = Env::new(config.clone(), 1).unwrap();
        let plain = Env::new(EnvConfig { observation: ObservationOptions::default(), ..config }, 1).unwrap();
        assert_eq!((plain.privileged().len(), plain.observation()), (0, env.observation()));
        for action in 0..=200 {
            let mut wiped = env.task().progress().unwrap_or_default();
            if action < 200 {
                env.step(&env.expert_action());
            } else {
                env.reset(Some(1));
                wiped = 0.0;
            }
            let seen = privileged(&env);
            for &(name, value) in &seen {
                let [low, high] = ends.entry(name.to_owned()).or_insert([value; 2]);
                (*low, *high) = (f32::min(*low, value), f32::max(*high, value));
            }
            let known: BTreeMap<String, f64> = [common(&env), of_task(&env, wiped)].concat().into_iter().collect();
            assert!(known.keys().all(|name| seen.iter().any(|(of, _)| of == name)), "{known:?}");
            for (name, value) in seen {
                let Some(expected) = known.get(name) else {
                    assert!(name.starts_with("rim_pos_") || name.starts_with("believed_error_"), "{name}");
                    continue;
                };
                let off = (f64::from(value) - expected).abs();
                let what = format!("{task:?}, action {action}: {name} is {expected} and shown as {value}");
                assert!(off < 1e-6 * expected.abs().max(1.0), "{what}");
            }
        }
    }
    let fixed: Vec<&str> = ends.iter().filter(|(_, [low, high])| low == high).map(|(name, _)| name.as_str()).collect();
    assert!(fixed.iter().all(|name| ["contact_links", "rim_pos_z"].contains(name)), "{fixed:?} never change");
}

#[test]
fn a_list_that_makes_no_sense_is_refused_in_one_line() {
    let refused = |config: EnvConfig| Env::new(config, 1).err().unwrap().to_string();
    let nothing = refused(with_critic(TaskName::LIFT, vec![Privileged::Disturbance], Disturbance::default()));
    assert_eq!(nothing, "env.observation.critic: \"disturbance\" shows what env.disturbance has, and it has nothing");
    let twice = refused(with_critic(TaskName::LIFT, vec![Privileged::Task; 2], Disturbance::default()));
    assert_eq!(twice, "env.observation.critic: \"task\" stands in it twice");
    let mut seen = feeling(TaskName::LIFT, "aforce");
    seen.observation.critic = vec![Privileged::Force];
    assert_eq!(
        refused(seen),
        "env.observation.critic: observation.force = true shows it to the policy: leave \"force\" out"
    );
}

/// A peg that presses beside its hole feels a point of the block, and not one in the hole: friction at its end has no arm about the end.
#[test]
fn a_peg_feels_where_its_end_presses() {
    const ASIDE: f64 = 0.003;
    let options = [("clearance_mm".to_owned(), 1.0.into())].into_iter().collect();
    let space = "mid".parse().unwrap();
    let mut env = Env::new(EnvConfig { space, options, ..EnvConfig::of(TaskName::INSERT) }, 1).unwrap();
    for (episode, side) in [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()].into_iter().enumerate() {
        env.reset(Some(episode as u64));
        let place = |env: &Env, name: &str| {
            let components = env.privileged_components();
            let first = components.iter().position(|component| component.name == format!("{name}_x")).unwrap();
            Vector3::from_fn(|i, _| f64::from(env.privileged()[first + i]))
        };
        let beside = place(&env, "rim_pos") + ASIDE * side;
        let (mut wrench, mut pressed, mut above) = (Wrench::zeros(), 0, false);
        while pressed < 5 {
            let end = place(&env, "base_to_peg_end_pos") + place(&env, "rim_pos") - 0.025 * Vector3::z();
            let mut apart = beside - end;
            // Down once it is above the place.
            above |= apart.xy().norm() < 0.0005;
            apart.z += if above { -0.001 } else { 0.005 };
            let mut action = still(&env);
            let step = env.config().controller.position_step;
            for axis in 0..3 {
                // The goal is further than the place: a spring pulls there, against the joints' friction.
                action[axis] = (20.0 * apart[axis] / step).clamp(-0.3, 0.3);
            }
            assert!(!env.step(&action).truncated, "the peg never pressed on the rim");
            if force(&felt_in(&env)).z > 2.0 {
                (wrench, pressed) = (felt_in(&env), pressed + 1);
            }
        }
        let (force, torque) = (force(&wrench), Vector3::from(wrench.fixed_rows::<3>(3)));
        let contact = Vector3::z().cross(&torque) / force.z;
        let from_axis = place(&env, "base_to_peg_end_pos") + contact;
        // The peg's radius is 4 mm. While it slides, the engine acts up to half a millimetre beside where the shapes meet.
        assert!(contact.norm() < 0.0045, "beyond the peg's edge: {contact:?}");
        // Half of 9 mm, and a chamfer of 1 mm.
        assert!(from_axis.xy().norm() > 0.0053, "in the hole: {from_axis:?}, pressed at {contact:?} with {force:?}");
    }
}
