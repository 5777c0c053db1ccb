//! Time of one environment step (25 control samples) under random actions, resets included, on one
//! core. One over it is the number of environment steps per second.
//!
//! `cargo bench -p tasks`; beside robosuite: `scripts/robosuite_speed.py`.

use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, TaskName};

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    for task in TaskName::ALL {
        for space in ["aforce", "variable"] {
            let space = space.parse().expect("an action space");
            let mut env = Env::new(EnvConfig { task, space, ..EnvConfig::default() }, 1).expect("defaults are valid");
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            group.bench_function(format!("{}/{space}", task.as_str()), |bencher| {
                bencher.iter(|| {
                    let action: Vec<f64> = (0..env.action_dim()).map(|_| rng.random_range(-1.0..=1.0)).collect();
                    let step = env.step(&action);
                    if step.terminated || step.truncated {
                        env.reset(None);
                    }
                    step.reward
                });
            });
        }
    }
}

criterion_group!(benches, step);
criterion_main!(benches);
