//! Benchmarks on one core: an environment step (25 control samples) under random actions, resets included; a step that
//! presses the wiping tool on the table; an observed picture. One over the time of a step is the number of steps per second.
//!
//! `cargo bench -p tasks`; beside robosuite: `scripts/robosuite_speed.py`.

use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, ObservationOptions, ObservedCamera, PixelKind, Standpoint, TaskName};

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    for task in TaskName::BUILT_IN {
        for space in ["aforce", "variable"] {
            let record = space.parse().expect("an action space");
            let mut env =
                Env::new(EnvConfig { task, space: record, ..EnvConfig::of(task) }, 1).expect("defaults are valid");
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

/// The goal of each `osc` action lies 2 cm below the tool. Sideways the goal stays at the start, because a goal that
/// followed the tool sideways would let it slide off the table.
fn press(criterion: &mut Criterion) {
    let space = "osc".parse().expect("an action space");
    let mut config = EnvConfig { task: TaskName::WIPE, space, horizon: 1_000_000, ..EnvConfig::default() };
    config.controller.position_step = 0.02;
    let mut env = Env::new(config, 1).expect("a valid configuration");
    let above = env.measurement().pose.translation.vector;
    let mut press = || {
        let aside = (above - env.measurement().pose.translation.vector) / env.config().controller.position_step;
        env.step(&[aside.x.clamp(-1.0, 1.0), aside.y.clamp(-1.0, 1.0), -1.0, 0.0, 0.0, 0.0]).reward
    };
    for _ in 0..100 {
        press();
    }
    criterion.benchmark_group("step").bench_function("wipe/pressing", |bencher| bencher.iter(&mut press));
    let force = env.simulation().contact().sustained[2];
    assert!(force > 15.0, "the tool presses with {force} N");
}

/// One observed picture of 84 x 84 pixels of Lift, from the task's camera and from the camera beside the hand.
fn camera(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("camera");
    for kind in [PixelKind::Depth, PixelKind::Rgb] {
        for from in [Standpoint::Task, Standpoint::Hand] {
            let camera = Some(ObservedCamera { kind, from, ..ObservedCamera::default() });
            let observation = ObservationOptions { camera, ..ObservationOptions::default() };
            let env = Env::new(EnvConfig { observation, ..EnvConfig::default() }, 1).expect("a valid configuration");
            group.bench_function(format!("{kind:?}/{from:?}"), |bencher| bencher.iter(|| env.pixels()));
        }
    }
}

criterion_group!(benches, step, press, camera);
criterion_main!(benches);
