//! CPU time of a whole environment step: `step_time lift|door|wipe|insert SPACE ACTIONS` prints the mean of ACTIONS random actions,
//! resets included, in microseconds. Other load on the machine changes CPU time less than wall-clock time.

use std::{env, process};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::time::{ClockId, clock_gettime};
use tasks::{Env, EnvConfig, TaskName};

/// Actions before the measurement, so that one-time work of the process is not counted.
const WARM_UP: u32 = 50;

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [task, space, actions] = arguments.as_slice() else { usage() };
    let (Ok(task), Ok(space)) = (task.parse::<TaskName>(), space.parse()) else { usage() };
    let Ok(actions @ 1..) = actions.parse::<u32>() else { usage() };
    let mut env = Env::new(EnvConfig { task, space, ..EnvConfig::of(task) }, 1).expect("defaults are valid");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut run = |actions: u32| {
        for _ in 0..actions {
            let action: Vec<f64> = (0..env.action_dim()).map(|_| rng.random_range(-1.0..=1.0)).collect();
            let step = env.step(&action);
            if step.terminated || step.truncated {
                env.reset(None);
            }
        }
    };
    run(WARM_UP);
    let start = cpu_seconds();
    run(actions);
    println!("{:.3}", 1e6 * (cpu_seconds() - start) / f64::from(actions));
}

fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn usage() -> ! {
    eprintln!("usage: step_time lift|door|wipe|insert SPACE ACTIONS");
    process::exit(2)
}
