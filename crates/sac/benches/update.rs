//! CPU time of one update, of the matrix products that an update requires, and of one action; one thread, at the sizes of the Lift task.
//!
//! `cargo bench -p sac` prints a row for each set-up, `cargo bench -p sac -- 1 swift` one round of `swift` alone. Rounds of the set-ups
//! alternate and the least time counts, so that other load on the machine has little effect.

use std::hint::black_box;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::time::{ClockId, clock_gettime};
use sac::{Act, Config, Preset, Replay, Sac, Transition};
use tch::{Device, Kind, Tensor};

const OBSERVATIONS: usize = 42;
const ACTIONS: usize = 7;
/// Updates and actions per round.
const UPDATES: u64 = 200;

/// Name and settings of what is measured.
fn setups() -> Vec<(&'static str, Config)> {
    let desktop = Preset::DESKTOP.settings();
    let small = Config { hidden: vec![128, 128], ..desktop.clone() };
    let large_batch = Config { batch_size: 256, ..desktop.clone() };
    vec![("swift", Preset::SWIFT.settings()), ("128x2", small), ("256x2", desktop), ("256x2-batch-256", large_batch)]
}

/// The learner and the data of a set-up, and the least times so far (ms).
struct Setup {
    name: &'static str,
    sac: Sac,
    replay: Replay,
    /// The products of the critics' update, and those that the actor's step adds.
    products: [Vec<[Tensor; 3]>; 2],
    least: [f64; 3],
}

impl Setup {
    fn new(name: &'static str, config: &Config) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut numbers = |n| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
        let mut replay = Replay::new(config, (OBSERVATIONS, ACTIONS));
        let mut observation = numbers(OBSERVATIONS);
        for k in 0..20_000 {
            let next_observation = numbers(OBSERVATIONS);
            let transition = Transition {
                observation: &observation,
                action: &numbers(ACTIONS),
                reward: numbers(1)[0],
                next_observation: &next_observation,
                terminated: false,
                truncated: k % 500 == 499,
            };
            replay.push(&transition).unwrap();
            observation = next_observation;
        }
        let mut sac = Sac::new(config, (OBSERVATIONS, ACTIONS), 1).unwrap();
        (0..20).for_each(|_| assert!(sac.update(&replay).is_finite()));
        let products = products(config).map(|products| products.into_iter().map(tensors).collect());
        Self { name, sac, replay, products, least: [f64::INFINITY; 3] }
    }

    fn round(&mut self) {
        let Self { sac, replay, products, least, .. } = self;
        let period = sac.config().actor_period;
        let mut action = [0.0; ACTIONS];
        let times = [
            cpu_ms(|_| assert!(black_box(sac.update(replay)).is_finite())),
            cpu_ms(|k| {
                products[0].iter().for_each(multiply);
                if k % period == 0 {
                    products[1].iter().for_each(multiply);
                }
            }),
            cpu_ms(|_| sac.act(black_box(&[0.3; OBSERVATIONS]), &mut action, Act::Sample)),
        ];
        for (least, time) in least.iter_mut().zip(times) {
            *least = least.min(time);
        }
    }
}

/// Mean CPU time of a call (ms).
fn cpu_ms(mut call: impl FnMut(u64)) -> f64 {
    let now = || {
        let time = clock_gettime(ClockId::ProcessCPUTime);
        1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64
    };
    let began = now();
    (0..UPDATES).for_each(&mut call);
    (now() - began) / UPDATES as f64
}

/// Rows, inner length and columns of every matrix product of an update: those of every update, and those that a step of
/// the actor adds.
fn products(config: &Config) -> [Vec<[usize; 3]>; 2] {
    let n = config.batch_size;
    let forward = |sizes: &[usize]| sizes.windows(2).map(|pair| [n, pair[0], pair[1]]).collect::<Vec<_>>();
    // Products for the derivative by a layer's parameters, and by its input.
    let parameters = |sizes: &[usize]| sizes.windows(2).map(|pair| [pair[0], n, pair[1]]).collect::<Vec<_>>();
    let input = |sizes: &[usize]| sizes.windows(2).map(|pair| [n, pair[1], pair[0]]).collect::<Vec<_>>();
    let network = |first: usize, last: usize| [&[first], config.hidden.as_slice(), &[last]].concat();
    let actor = network(OBSERVATIONS, 2 * ACTIONS);
    let critic = network(OBSERVATIONS + ACTIONS, 1);
    // The part of the critics' first layer that belongs to the action, for the derivative by the action.
    let asked = network(ACTIONS, 1);
    let twins = |of_one: Vec<[usize; 3]>| [of_one.clone(), of_one].concat();
    // Of each critic: its target's value, its own value, and its derivatives.
    let of_critics = [forward(&critic), forward(&critic), parameters(&critic), input(&critic[1..])].concat();
    // The actor's present actions and the actor's derivatives; then the critics' value of these actions and its
    // derivative by them.
    let of_actor = [forward(&actor), parameters(&actor), input(&actor[1..])].concat();
    let of_asked = [forward(&critic), input(&critic[1..]), input(&asked[..2])].concat();
    [[forward(&actor), twins(of_critics)].concat(), [of_actor, twins(of_asked)].concat()]
}

fn tensors([rows, inner, columns]: [usize; 3]) -> [Tensor; 3] {
    let random = |rows: usize, columns: usize| {
        Tensor::rand([rows as i64, columns as i64], (Kind::Float, Device::Cpu)).set_requires_grad(false)
    };
    [random(rows, inner), random(inner, columns), random(rows, columns)]
}

fn multiply([a, b, out]: &[Tensor; 3]) {
    let _ = a.mm_out(out, b);
}

fn main() {
    // Cargo adds `--bench`.
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let rounds: u32 =
        arguments.next().map_or(12, |rounds| rounds.parse().expect("the first argument is a number of rounds"));
    let names: Vec<String> = arguments.collect();
    let known = setups();
    for name in &names {
        assert!(known.iter().any(|setup| setup.0 == name), "unknown set-up {name}");
    }
    let wanted = known.iter().filter(|(name, _)| names.is_empty() || names.iter().any(|wanted| wanted == name));
    let mut setups: Vec<Setup> = wanted.map(|(name, config)| Setup::new(name, config)).collect();
    for _ in 0..rounds {
        setups.iter_mut().for_each(Setup::round);
    }
    println!("setup,update_ms,products_ms,act_ms");
    for Setup { name, least: [update, products, act], .. } in setups {
        println!("{name},{update:.4},{products:.4},{act:.5}");
    }
}
