use super::*;
use crate::Transition;
use crate::simd::with_and_without_avx2;

fn small() -> Config {
    Config { hidden: vec![8], batch_size: 4, ..Config::default() }
}

/// Ten steps, each with the reward `reward`.
fn replay(config: &Config, reward: f32) -> Replay {
    let mut replay = Replay::new(config, (2, 1));
    for k in 0..10 {
        let observe = |k: u8| [f32::from(k).sin(), f32::from(k).cos()];
        replay
            .push(&Transition {
                observation: &observe(k),
                action: &[0.5],
                reward,
                next_observation: &observe(k + 1),
                terminated: k == 9,
                truncated: false,
            })
            .unwrap();
    }
    replay
}

#[test]
fn the_policy_is_a_running_mean_of_the_actor() {
    let config = Config { policy_average: 0.3, ..small() };
    let mut sac = Sac::new(&config, (2, 1), 3).unwrap();
    let replay = replay(&config, 1.0);
    let weights = |sac: &mut Sac| {
        sac.update(&replay);
        sac.actor.network.values.to_vec()
    };
    let actors: Vec<_> = (0..4).map(|_| weights(&mut sac)).collect();
    for (i, &average) in sac.average.values.iter().enumerate() {
        // The plain mean of the first three, as 1/3 is more than 0.3, and then 0.3 of the way to the fourth.
        let mean = (actors[0][i] + actors[1][i] + actors[2][i]) / 3.0;
        assert!((average - (0.7 * mean + 0.3 * actors[3][i])).abs() < 1e-6, "{i}: {average}");
    }
    assert_ne!(sac.average.values[0], sac.actor.network.values[0]);
}

#[test]
fn actor_average_and_temperature_wait_for_their_turn() {
    let config = Config { actor_period: 3, ..small() };
    let mut sac = Sac::new(&config, (2, 1), 3).unwrap();
    let replay = replay(&config, 1.0);
    for k in 1..=6 {
        let all = |sac: &Sac| [sac.actor.network.values.to_vec(), sac.average.values.to_vec(), vec![sac.temperature()]];
        let (before, critics) = (all(&sac), sac.critics.values.to_vec());
        let losses = sac.update(&replay);
        let due = k % 3 == 0;
        assert_eq!((losses.actor.is_some(), losses.is_finite()), (due, true));
        for (before, after) in before.iter().zip(&all(&sac)) {
            assert_eq!(before != after, due, "update {k}");
        }
        assert_ne!(critics, sac.critics.values.to_vec());
    }
    // Adam's first step is as long as the learning rate, so Adam's count began with the actor's first step.
    let first = Sac::new(&config, (2, 1), 3).unwrap();
    let mut third = Sac::new(&config, (2, 1), 3).unwrap();
    for _ in 0..3 {
        third.update(&replay);
    }
    let steps = first.actor.network.values.iter().zip(third.actor.network.values.iter()).map(|(a, b)| (a - b).abs());
    approx::assert_relative_eq!(steps.fold(0.0, f32::max), 5e-4, max_relative = 1e-3);
}

#[test]
fn half_of_a_batch_is_prior_data() {
    let mut sac = Sac::new(&small(), (2, 1), 3).unwrap();
    let (own, prior) = (replay(&small(), 1.0), replay(&small(), 2.0));
    sac.update_with_prior(&own, &prior);
    // A reward is the sum over three steps, or over the steps that were left: 1, 1 + gamma, 1 + gamma + gamma^2.
    let unit = |reward: f32| [1.0, 1.97, 2.9109].iter().any(|sum| (reward - sum).abs() < 1e-5);
    let rewards = &sac.scratch.batch.reward;
    assert!(rewards[..2].iter().all(|&r| unit(r)) && rewards[2..].iter().all(|&r| unit(r / 2.0)), "{rewards:?}");
}

/// The mean is over the steps of the actor, however many updates lie between two of them.
#[test]
fn the_running_mean_counts_the_actors_own_turns() {
    for actor_period in [2, 3] {
        let config = Config { actor_period, ..small() };
        let mut sac = Sac::new(&config, (2, 1), 3).unwrap();
        let replay = replay(&config, 1.0);
        let mut actors: Vec<Vec<f32>> = Vec::new();
        for k in 1..=20 {
            if sac.update(&replay).actor.is_none() {
                continue;
            }
            actors.push(sac.actor.network.values.to_vec());
            for (i, average) in sac.average.values.iter().enumerate() {
                let mean = actors.iter().map(|actor| actor[i]).sum::<f32>() / actors.len() as f32;
                assert!((average - mean).abs() < 1e-6, "update {k}, weight {i}: {average}, not {mean}");
            }
        }
    }
}

#[test]
fn as_many_episodes_as_said_have_pink_noise() {
    // With pink noise an action is correlated with the one before.
    let pink_episodes = |pink_noise| {
        let mut sac = Sac::new(&Config { pink_noise, ..small() }, (2, 1), 3).unwrap();
        let episode = |_: &usize| {
            sac.begin_episode();
            let mut action = [0.0];
            let draw = |_| {
                sac.act(&[0.0, 0.0], &mut action, Act::Sample);
                action[0]
            };
            let actions: Vec<f32> = (0..400).map(draw).collect();
            let products = actions.windows(2).map(|pair| pair[0] * pair[1]).sum::<f32>();
            products / actions.iter().map(|a| a * a).sum::<f32>() > 0.25
        };
        (0..40).filter(episode).count()
    };
    let [white, half, pink] = [0.0, 0.5, 1.0].map(pink_episodes);
    assert!(white == 0 && (10..30).contains(&half) && pink == 40, "{white} {half} {pink}");
}

#[test]
fn an_update_has_the_same_bits_without_avx2() {
    let config = Config { layer_norm: true, hidden: vec![19, 24], batch_size: 13, ..small() };
    let [with, without] = with_and_without_avx2(|| {
        let mut sac = Sac::new(&config, (2, 1), 3).unwrap();
        let replay = replay(&config, 1.0);
        let losses: Vec<Losses> = (0..9).map(|_| sac.update(&replay)).collect();
        (losses, sac.critics.values.to_vec(), sac.average.values.to_vec())
    });
    assert_eq!(with, without);
}
