//! Shows whether a change to the code changes a number. Prints a line for every robot, task and built-in action space: a hash over the
//! bits of observations, rewards, energies, forces and joint states under random actions.
//!
//! `digest [ACTIONS]` (200 by default). Two builds behave alike if they print the same.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::{env, process};

use aforce::ActionSpace;
use physics::robots::RobotName;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, TaskName};

fn main() {
    let actions = env::args().nth(1).map_or(Ok(200), |text| text.parse::<u32>());
    let Ok(actions) = actions else {
        eprintln!("usage: digest [ACTIONS]");
        process::exit(2)
    };
    for robot in RobotName::ALL {
        for task in TaskName::BUILT_IN {
            for space in ActionSpace::built_in() {
                let name = space.to_string();
                let (digest, diverged) =
                    digest(EnvConfig { task, space, robot: robot.into(), ..EnvConfig::of(task) }, actions);
                let (robot, task) = (robot.as_str(), task.as_str());
                println!("{robot:<10} {task:<5} {name:<24} {digest:016x} {diverged} diverged");
            }
        }
    }
}

/// Hash of the numbers of `actions` random actions, and how many of the actions diverged. When an episode ends, the next one begins.
fn digest(config: EnvConfig, actions: u32) -> (u64, u32) {
    let mut env = Env::new(config, 1).expect("defaults are valid");
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut hash = DefaultHasher::new();
    let mut diverged = 0;
    env.reset(Some(3));
    for _ in 0..actions {
        let action: Vec<f64> = (0..env.action_dim()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let step = env.step(&action);
        env.observation().iter().for_each(|v| v.to_bits().hash(&mut hash));
        let y = env.measurement();
        let record = &step.interval;
        let numbers = [step.reward, record.energy.absolute, record.arm.impulse, record.arm.max_raw, record.overlap];
        numbers.iter().chain(&y.q).chain(&y.qd).chain(&y.bias).for_each(|v| v.to_bits().hash(&mut hash));
        diverged += u32::from(step.diverged);
        if step.terminated || step.truncated {
            env.reset(None);
        }
    }
    (hash.finish(), diverged)
}
