//! Problems so small that a correct learner solves them every time.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sac::{Act, Config, Replay, Sac, Sizes, Transition};

fn small() -> Config {
    Config {
        hidden: vec![64, 64],
        batch_size: 64,
        random_steps: 300,
        updates_per_step: 1.0,
        policy_average: 0.02,
        ..Config::default()
    }
}

/// A point on a line is pushed by the action, and its reward is minus its distance from the origin. Episodes of 20 steps end by their time
/// limit.
struct Point {
    x: f32,
    v: f32,
    t: u32,
    rng: ChaCha8Rng,
}

impl Point {
    fn reset(&mut self) {
        (self.x, self.v, self.t) = (self.rng.random_range(-1.0..1.0), 0.0, 0);
    }

    /// Returns the reward and whether the time is over.
    fn step(&mut self, action: f32) -> (f32, bool) {
        self.v = 0.5 * self.v + 0.2 * action;
        self.x += self.v;
        self.t += 1;
        (-self.x.abs(), self.t == 20)
    }

    /// Mean return of the deterministic policy.
    fn evaluate(sac: &Sac) -> f32 {
        let mut point = Self { x: 0.0, v: 0.0, t: 0, rng: ChaCha8Rng::seed_from_u64(99) };
        let mut actor = sac.policy(0);
        let mut sum = 0.0;
        for _ in 0..20 {
            point.reset();
            loop {
                let mut action = [0.0];
                actor.act(&[point.x, point.v], &mut action, Act::Mean);
                let (reward, over) = point.step(action[0]);
                sum += reward;
                if over {
                    break;
                }
            }
        }
        sum / 20.0
    }
}

fn learn_point(steps: u64, seed: u64) -> Sac {
    let config = small();
    let mut sac = Sac::new(&config, (2, 1), seed).unwrap();
    let mut replay = Replay::new(&config, (2, 1));
    let mut point = Point { x: 0.0, v: 0.0, t: 0, rng: ChaCha8Rng::seed_from_u64(seed) };
    point.reset();
    for step in 1..=steps {
        let observation = [point.x, point.v];
        let mut action = [0.0];
        sac.act(&observation, &mut action, if step <= config.random_steps { Act::Random } else { Act::Sample });
        let (reward, truncated) = point.step(action[0]);
        let next_observation = [point.x, point.v];
        let transition = Transition {
            observation: &observation,
            action: &action,
            reward,
            next_observation: &next_observation,
            terminated: false,
            truncated,
        };
        replay.push(&transition).unwrap();
        for _ in 0..config.updates_after(step) {
            assert!(sac.update(&replay).is_finite());
        }
        if truncated {
            point.reset();
        }
    }
    sac
}

#[test]
fn a_point_is_brought_to_the_origin() {
    for seed in [1, 2] {
        let before = Point::evaluate(&learn_point(1, seed));
        let after = Point::evaluate(&learn_point(2500, seed));
        // The point starts 0.5 away on average and moves about 0.3 per step: the best policy gets about -1.
        assert!(after > -1.6 && after > before + 3.0, "seed {seed}: {before} -> {after}");
    }
}

/// Each episode has one step, and its best action is the observation: the policy must copy it.
#[test]
fn the_action_asked_for_is_given() {
    let config = Config { random_steps: 200, ..small() };
    let mut sac = Sac::new(&config, (2, 2), 3).unwrap();
    let mut replay = Replay::new(&config, (2, 2));
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut observe = || [rng.random_range(-0.8..0.8f32), rng.random_range(-0.8..0.8f32)];
    let mut action = [0.0; 2];
    let distance = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    for step in 1..=1500 {
        let observation = observe();
        sac.act(&observation, &mut action, if step <= config.random_steps { Act::Random } else { Act::Sample });
        let transition = Transition {
            observation: &observation,
            action: &action,
            reward: -4.0 * distance(action, observation),
            next_observation: &observation,
            terminated: true,
            truncated: false,
        };
        replay.push(&transition).unwrap();
        for _ in 0..config.updates_after(step) {
            sac.update(&replay);
        }
    }
    let mut actor = sac.policy(0);
    let error = (0..100).map(|_| {
        let observation = observe();
        actor.act(&observation, &mut action, Act::Mean);
        distance(action, observation)
    });
    let rms = (error.sum::<f32>() / 200.0).sqrt();
    assert!(rms < 0.1, "root mean square error {rms}");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_does_not() {
    let bits = |seed| {
        let mut actor = learn_point(500, seed).policy(0);
        let mut action = [0.0];
        actor.act(&[0.3, -0.1], &mut action, Act::Mean);
        action[0].to_bits()
    };
    assert_eq!(bits(7), bits(7));
    assert_ne!(bits(7), bits(8));
}

/// A nudged entry stands at an end of its range, which no sample of a fresh policy reaches.
#[test]
fn nudges_are_of_sampled_actions_in_their_share_of_the_episodes() {
    let nudged = |share: f64, mode: Act| {
        let mut sac = Sac::new(&Config { nudges: share, ..small() }, (2, 3), 1).unwrap();
        let (mut action, mut at_an_end) = ([0.0f32; 3], 0);
        for _ in 0..20 {
            sac.begin_episode();
            for _ in 0..500 {
                sac.act(&[0.1, -0.2], &mut action, mode);
                at_an_end += usize::from(action.iter().any(|entry| entry.abs() == 1.0));
            }
        }
        at_an_end as f64 / 10_000.0
    };
    // Nudges take 40 of 89 actions.
    assert!((0.35..0.5).contains(&nudged(1.0, Act::Sample)));
    assert!((0.1..0.35).contains(&nudged(0.5, Act::Sample)));
    assert_eq!((nudged(0.0, Act::Sample), nudged(1.0, Act::Mean)), (0.0, 0.0));
}

/// A part of the reward depends on a number. If the critics do not see the number, that part is noise to them; if they see it, little of
/// their loss is left.
#[test]
fn critics_use_what_only_they_see() {
    let loss = |privileged: usize| {
        let config = Config { random_steps: 200, ..small() };
        let sizes = Sizes { observation: 1, privileged, action: 1 };
        let mut sac = Sac::new(&config, sizes, 3).unwrap();
        let mut replay = Replay::new(&config, sizes);
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (mut action, mut last) = ([0.0], vec![]);
        for step in 1..=1500 {
            let seen = [rng.random_range(-0.8..0.8f32), rng.random_range(-1.0..1.0f32)];
            sac.act(&seen[..1], &mut action, if step <= config.random_steps { Act::Random } else { Act::Sample });
            let transition = Transition {
                observation: &seen[..1 + privileged],
                action: &action,
                reward: 2.0 * seen[1] - (action[0] - seen[0]).powi(2),
                next_observation: &seen[..1 + privileged],
                terminated: true,
                truncated: false,
            };
            replay.push(&transition).unwrap();
            for _ in 0..config.updates_after(step) {
                last.push(sac.update(&replay).critic_loss);
            }
        }
        last[last.len() - 100..].iter().sum::<f32>() / 100.0
    };
    let (seeing, blind) = (loss(1), loss(0));
    // There are two critics, and the variance of the part that depends on the number is 4/3.
    assert!(blind > 2.0 && seeing < 0.1 * blind, "{seeing} {blind}");
}
