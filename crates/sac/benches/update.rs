//! Time of one action and of one update, one thread, at the sizes of the Lift task.
//!
//! `cargo bench -p sac`; with `-- --save-baseline NAME` and `-- --baseline NAME` two versions are compared.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sac::{Act, Config, Preset, Replay, Sac, Transition};

const OBSERVATIONS: usize = 42;
const ACTIONS: usize = 7;

fn learner(config: &Config) -> (Sac, Replay) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut numbers = |n| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
    let mut replay = Replay::new(config, OBSERVATIONS, ACTIONS);
    for k in 0..20_000 {
        let transition = Transition {
            observation: &numbers(OBSERVATIONS),
            action: &numbers(ACTIONS),
            reward: numbers(1)[0],
            next_observation: &numbers(OBSERVATIONS),
            terminated: false,
            truncated: k % 500 == 499,
        };
        replay.push(&transition).unwrap();
    }
    (Sac::new(config, OBSERVATIONS, ACTIONS, 1).unwrap(), replay)
}

fn presets() -> [(&'static str, Config); 3] {
    let desktop = Preset::DESKTOP.settings();
    let large_batch = Config { batch_size: 256, ..desktop.clone() };
    [("desktop", desktop), ("desktop, batch 256", large_batch), ("paper", Preset::PAPER.settings())]
}

fn update(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update");
    for (name, config) in presets() {
        let (mut sac, replay) = learner(&config);
        group.sample_size(if name == "paper" { 10 } else { 50 });
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(|| black_box(sac.update(&replay))));
    }
}

fn act(criterion: &mut Criterion) {
    let (mut sac, _) = learner(&Config::default());
    let mut action = [0.0; ACTIONS];
    criterion.bench_function("act", |b| b.iter(|| sac.act(black_box(&[0.3; OBSERVATIONS]), &mut action, Act::Sample)));
}

criterion_group!(benches, act, update);
criterion_main!(benches);
