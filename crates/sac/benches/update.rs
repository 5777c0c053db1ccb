//! Time of one action, of one update, and of the matrix products that an update cannot do without; one thread, at the sizes of
//! the Lift task.
//!
//! `cargo bench -p sac`; with `-- --save-baseline NAME` and `-- --baseline NAME` two versions are compared.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sac::{Act, Config, Preset, Replay, Sac, Transition};
use tch::{Device, Kind, Tensor};

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
        let mut multiply = multiply(&products(&config));
        group.bench_function(BenchmarkId::new("matrix products", name), |b| b.iter(&mut multiply));
    }
}

/// Rows, inner length and columns of every product of an update.
fn products(config: &Config) -> Vec<[usize; 3]> {
    let n = config.batch_size;
    let forward = |sizes: &[usize]| sizes.windows(2).map(|pair| [n, pair[0], pair[1]]).collect::<Vec<_>>();
    // Towards the layer's parameters; towards its input.
    let parameters = |sizes: &[usize]| sizes.windows(2).map(|pair| [pair[0], n, pair[1]]).collect::<Vec<_>>();
    let input = |sizes: &[usize]| sizes.windows(2).map(|pair| [n, pair[1], pair[0]]).collect::<Vec<_>>();
    let network = |first: usize, last: usize| [&[first], config.hidden.as_slice(), &[last]].concat();
    let actor = network(OBSERVATIONS, 2 * ACTIONS);
    let critic = network(OBSERVATIONS + ACTIONS, 1);
    // Towards the action alone.
    let asked = network(ACTIONS, 1);
    // Actions for the next and the present observations, and the actor's own step.
    let of_actor = [forward(&actor), forward(&actor), parameters(&actor), input(&actor[1..])].concat();
    // Targets, what was done, what the actor would do, and the critics' own step.
    let of_critic =
        [forward(&critic), forward(&critic), forward(&critic), parameters(&critic), input(&critic[1..]), input(&asked)];
    let of_critic = of_critic.concat();
    [of_actor, of_critic.clone(), of_critic].concat()
}

/// Does nothing but them.
fn multiply(products: &[[usize; 3]]) -> impl FnMut() + use<> {
    let random = |rows: usize, columns: usize| {
        Tensor::rand([rows as i64, columns as i64], (Kind::Float, Device::Cpu)).set_requires_grad(false)
    };
    let tensors: Vec<[Tensor; 3]> =
        products.iter().map(|&[m, k, n]| [random(m, k), random(k, n), random(m, n)]).collect();
    move || {
        for [a, b, out] in &tensors {
            let _ = a.mm_out(out, b);
        }
    }
}

fn act(criterion: &mut Criterion) {
    let (mut sac, _) = learner(&Config::default());
    let mut action = [0.0; ACTIONS];
    criterion.bench_function("act", |b| b.iter(|| sac.act(black_box(&[0.3; OBSERVATIONS]), &mut action, Act::Sample)));
}

criterion_group!(benches, act, update);
criterion_main!(benches);
