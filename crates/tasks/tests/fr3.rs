//! The scripts do their tasks with a robot that they were not written for.

use std::ops::ControlFlow;

use physics::robots::RobotName;
use tasks::{Env, EnvConfig, TaskName, play};

#[test]
fn the_scripts_solve_every_task_with_an_fr3() {
    for (task, space) in [(TaskName::Lift, "aforce"), (TaskName::Door, "aforce"), (TaskName::Wipe, "aforce-force")] {
        let space = space.parse().unwrap();
        let config = EnvConfig { task, space, robot: RobotName::Fr3.into(), ..EnvConfig::default() };
        let mut env = Env::new(config, 0).unwrap();
        assert_eq!(env.robot().name, "fr3");
        for seed in 0..4 {
            let outcome = play(&mut env, Env::expert_action, seed, |_, _| ControlFlow::Continue(())).outcome();
            assert!(
                outcome.flag("success_held") && !outcome.flag("diverged"),
                "{}, seed {seed}: {outcome:?}",
                task.as_str()
            );
        }
    }
}
