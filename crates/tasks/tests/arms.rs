//! The scripts do their tasks with robots that they were not written for.

use std::ops::ControlFlow;

use physics::robots::{RobotChoice, RobotName};
use tasks::{Disturbance, Draw, Env, EnvConfig, TaskName, play};

fn config(task: TaskName, space: &str, robot: RobotName) -> EnvConfig {
    EnvConfig { task, space: space.parse().unwrap(), robot: robot.into(), ..EnvConfig::default() }
}

/// Asserts that the script has each task fulfilled through the last second of each of `episodes` episodes.
fn the_script_solves(robot: RobotName, setups: &[(TaskName, &str)], episodes: u64) {
    for &(task, space) in setups {
        let mut env = Env::new(config(task, space, robot), 0).unwrap();
        assert_eq!(env.robot().name, robot.as_str());
        for seed in 0..episodes {
            let outcome = play(&mut env, Env::expert_action, seed, |_, _| ControlFlow::Continue(())).outcome();
            let solved = outcome.flag("success_held") && !outcome.flag("diverged");
            assert!(solved, "{robot}, {}, {space}, seed {seed}: {outcome:?}", task.as_str());
        }
    }
}

#[test]
fn the_scripts_solve_every_task_with_an_fr3() {
    let setups = [(TaskName::DOOR, "aforce"), (TaskName::WIPE, "aforce-force")];
    the_script_solves(RobotName::Fr3, &[&setups[..], &BOTH].concat(), 4);
}

const BOTH: [(TaskName, &str); 4] =
    [(TaskName::LIFT, "aforce"), (TaskName::LIFT, "osc"), (TaskName::WIPE, "aforce"), (TaskName::WIPE, "osc")];

#[test]
fn the_scripts_lift_and_wipe_with_an_iiwa14() {
    the_script_solves(RobotName::Iiwa14, &BOTH, 4);
}

#[test]
fn the_scripts_lift_and_wipe_with_the_six_joints_of_a_ur5e() {
    the_script_solves(RobotName::Ur5e, &BOTH, 4);
}

/// The seventh joint, which the arm does not have, stays at zero and gets no torque, whatever the action is. Noise is on
/// the other six alone.
#[test]
fn an_arm_of_six_joints_has_a_seventh_that_does_nothing() {
    let noise = Disturbance {
        position_noise_rad: Some(Draw::Fixed(0.001)),
        velocity_noise_rad_per_s: Some(Draw::Fixed(0.01)),
        ..Disturbance::default()
    };
    for (disturbance, is_noisy) in [(Disturbance::default(), false), (noise, true)] {
        let config = EnvConfig { disturbance, ..config(TaskName::LIFT, "variable", RobotName::Ur5e) };
        let mut env = Env::new(config, 0).unwrap();
        env.reset(Some(1));
        for i in 0..20 {
            let action: Vec<f64> = (0..env.action_dim()).map(|k| (0.7 * f64::from(i) + 1.3 * k as f64).sin()).collect();
            let step = env.step_watched(&action, |sample| assert_eq!(sample.tau[6], 0.0));
            let y = env.measurement();
            assert_eq!((y.q[6], y.qd[6], step.diverged), (0.0, 0.0, false));
            let (q, qd) = env.simulation().joints();
            assert!((0..6).all(|joint| (y.q[joint] != q[joint]) == is_noisy && (y.qd[joint] != qd[joint]) == is_noisy));
        }
        assert!(env.simulation().joints().0[0] != env.robot().home[0]);
    }
}

#[test]
fn a_home_in_the_table_is_refused_by_the_names_of_what_overlaps() {
    let mut robot = RobotName::Iiwa14.robot();
    robot.home[1] += 0.9;
    let config = EnvConfig { robot: RobotChoice::Own(Box::new(robot)), ..EnvConfig::default() };
    let error = Env::new(config, 0).err().unwrap().to_string();
    assert!(
        error.starts_with("env.task: ") && error.ends_with(" overlap at the start of lift, with the arm iiwa14"),
        "{error}"
    );
    assert!(error.contains("table") && error.contains(" and "), "{error}");
}
