use super::*;
use crate::force_record::ForceRecord;
use crate::observation_options::ObservationOptions;
use crate::penalty::{CountedForce, ForcePenalty};
use crate::protection::Protection;
use crate::sensing::{SensedWrench, Sensing};
use crate::step::Step;
use aforce::{Gains, Stiffness, StiffnessRange};

/// A load that makes the simulation diverge terminates the episode, even in the action at which the horizon would have truncated it.
#[test]
fn a_divergence_ends_the_episode_and_earns_nothing() {
    for horizon in [500, 3] {
        let mut env = Env::new(EnvConfig { horizon, ..EnvConfig::default() }, 1).unwrap();
        let start = env.reset(Some(1)).to_vec();
        let action = vec![0.5; env.action_dim()];
        for _ in 0..2 {
            let step = env.step(&action);
            assert!(!step.terminated && !step.diverged && step.reward > 0.0);
        }
        let before = env.observation().to_vec();
        env.simulation.set_load(6, 1e6);
        let step = env.step(&action);
        assert!(step.terminated && step.diverged && !step.truncated && !step.success);
        assert_eq!((step.reward, step.reward_terms), (0.0, env.nothing_earned));
        assert_eq!(env.observation(), before, "the last valid one stays");
        // The next episode is not affected by the divergence.
        assert_eq!(env.reset(Some(1)), start);
    }
}

/// The error names the field of the environment's configuration, whichever check refuses the numbers.
#[test]
fn a_stiffness_that_is_not_allowed_is_told_with_its_field() {
    let mut env = Env::new(EnvConfig::default(), 1).unwrap();
    let mut told = |stiffness| env.set_stiffness(stiffness).unwrap_err().to_string();
    let kind = told(Stiffness::Fixed(Gains::all(300.0)));
    assert!(kind.starts_with("env.space.stiffness: another kind"), "{kind}");
    let Stiffness::Adaptive(mut psi) = EnvConfig::default().space.stiffness else { panic!("aforce adapts") };
    psi.k_max = Gains::all(1.0);
    let crossed = told(Stiffness::Adaptive(psi));
    assert!(crossed.starts_with("env.space.stiffness.adaptive.k_"), "{crossed}");
    psi.k_min = Gains::all(f64::NAN);
    let no_number = told(Stiffness::Adaptive(psi));
    assert!(no_number.starts_with("env.space.stiffness.adaptive.k_min (axis x) = NaN"), "{no_number}");

    let mut env = Env::new(EnvConfig { space: "variable".parse().unwrap(), ..EnvConfig::default() }, 1).unwrap();
    let Stiffness::Commanded(range) = env.config().space.stiffness else { panic!("variable commands") };
    let length =
        env.set_stiffness(Stiffness::Commanded(StiffnessRange { shared: true, ..range })).unwrap_err().to_string();
    assert!(length.contains("actions of 7 entries, and the running space has 12"), "{length}");
}

/// The last action is observed as it was given, and as zeros after a reset. The rest of the observation does not change.
#[test]
fn the_last_action_is_seen_where_it_is_asked_for() {
    let mut plain = Env::new(EnvConfig::default(), 1).unwrap();
    let mut config = EnvConfig::default();
    config.observation.action = true;
    let mut env = Env::new(config, 1).unwrap();
    let n = env.action_dim();
    let names: Vec<_> = env.action_entries().iter().map(|entry| format!("action_{}", entry.name)).collect();
    let seen: Vec<_> = env.observation_components().iter().map(|component| component.name.clone()).collect();
    assert_eq!(seen[seen.len() - n..], names);
    let action: Vec<f64> = (0..n).map(|i| 0.125 * i as f64 - 0.5).collect();
    for given in [vec![0.0; n], action.clone(), vec![0.0; n]] {
        if given == action {
            plain.step(&action);
            env.step(&action);
        } else {
            plain.reset(Some(7));
            env.reset(Some(7));
        }
        let (own, last) = env.observation().split_at(seen.len() - n);
        assert_eq!(own, plain.observation());
        assert!(last.iter().zip(&given).all(|(seen, given)| f64::from(*seen) == *given), "{last:?}");
    }
}

/// The script lifts the cube and holds it. A second later the episode is truncated, not terminated.
#[test]
fn an_episode_ends_on_success_if_it_is_to() {
    let mut env = Env::new(EnvConfig { ends_on_success: true, ..EnvConfig::default() }, 1).unwrap();
    env.reset(Some(1));
    let mut held = 0;
    let last = loop {
        let step = env.step(&env.expert_action());
        held = if step.success { held + 1 } else { 0 };
        if step.terminated || step.truncated {
            break step;
        }
    };
    assert!(last.truncated && !last.terminated && env.elapsed < env.config.horizon);
    assert_eq!(held, 20, "a second of actions at 20 Hz");
}

/// A NaN acts as 0 and, in the entry of the force, as -1. The observed last action has these values too.
#[test]
fn an_entry_that_is_no_number_asks_for_nothing() {
    let observation = ObservationOptions { action: true, ..ObservationOptions::default() };
    let space = "aforce-force".parse().unwrap();
    let config = EnvConfig { observation, space, ..EnvConfig::default() };
    let [mut env, mut odd] = [(); 2].map(|()| Env::new(config.clone(), 1).unwrap());
    let mut nothing = vec![0.0; env.action_dim()];
    nothing[6] = -1.0; // No force.
    let step = env.step(&nothing);
    assert_eq!(odd.step(&vec![f64::NAN; nothing.len()]), step);
    assert_eq!(odd.observation(), env.observation());
}

#[test]
fn motion_costs_its_price_per_joule() {
    let rewards = |motion_price| {
        let mut env = Env::new(EnvConfig { motion_price, ..EnvConfig::default() }, 1).unwrap();
        let action = vec![0.5; env.action_dim()];
        let step = env.step(&action);
        (step.reward, step.motion_cost, step.interval.energy.absolute)
    };
    let ((free, nothing, _), (priced, cost, energy)) = (rewards(0.0), rewards(0.1));
    assert_eq!((nothing, cost), (0.0, 0.1 * energy));
    assert!(energy > 0.01 && (free - priced - cost).abs() < 1e-12);
}

/// A joint that turns too fast ends the episode with `stops`; without `stops` the arm goes on.
#[test]
fn an_arm_that_is_to_stop_ends_the_episode_and_earns_nothing() {
    let play = |stops, stop_price| {
        let protection = Protection { joint_speed: 0.05, ..Protection::default() };
        let mut env = Env::new(EnvConfig { stops, stop_price, protection, ..EnvConfig::default() }, 1).unwrap();
        let action = vec![0.5; env.action_dim()];
        let mut steps = vec![];
        while steps.len() < 10 && !steps.last().is_some_and(|step: &Step| step.terminated || step.truncated) {
            steps.push(env.step(&action));
        }
        (steps, env)
    };
    let ((going_on, _), (stopping, env)) = (play(false, None), play(true, None));
    let at =
        going_on.iter().position(|step| step.interval.stop.is_some()).expect("a joint at a twentieth of its speed");
    assert_eq!((going_on.len(), stopping.len()), (10, at + 1));
    assert_eq!(stopping[..at], going_on[..at]);
    let (last, there) = (&stopping[at], &going_on[at]);
    assert!(last.terminated && !last.truncated && !last.diverged && !last.success);
    assert_eq!((last.reward, last.reward_terms), (0.0, env.nothing_earned));
    assert_eq!(last.interval.stop, there.interval.stop);
    assert_eq!(last.interval.stop.unwrap().time, last.interval.time, "not a sample longer");
    assert_eq!(env.observation().len(), env.observation_components().len());
    let (priced, _) = play(true, Some(3.0));
    let paid = Step { reward: -3.0, stop_cost: 3.0, terminated: false, truncated: true, ..*last };
    assert_eq!((&priced[..at], &priced[at..]), (&stopping[..at], &[paid][..]));
    let config = EnvConfig { stop_price: Some(3.0), ..EnvConfig::default() };
    assert!(config.validate().unwrap_err().to_string().contains("env.stops = true is missing"));
}

/// Of 100 N on the whole arm 10 N act on the hand.
#[test]
fn the_penalty_counts_whom_it_is_told_to() {
    let force = |max| ForceRecord { max, ..ForceRecord::default() };
    let interval = Interval { hand: force(10.0), arm: force(100.0), ..Interval::default() };
    for (of, penalty) in [(CountedForce::Arm, 5.0), (CountedForce::Hand, 0.0)] {
        let force_penalty = ForcePenalty { of, ..ForcePenalty::default() };
        let mut env = Env::new(EnvConfig { force_penalty, ..EnvConfig::default() }, 1).unwrap();
        let step = env.outcome(interval, false);
        assert_eq!((step.penalty, step.over_limit), (penalty, penalty > 0.0));
    }
    assert_eq!(ForcePenalty::default().of, CountedForce::Arm);
}

/// The energy of an action is that of the samples that a watcher sees.
#[test]
fn whoever_watches_sees_every_control_sample() {
    let mut env = Env::new(EnvConfig::default(), 1).unwrap();
    let action: Vec<f64> = (0..env.action_dim()).map(|i| [0.5, -0.5][i % 2]).collect();
    let drives = env.robot().drives;
    let dt = env.config().controller.dt();
    let (mut samples, mut energy) = (0, aforce::EnergyLedger::default());
    let step = env.step_watched(&action, |sample| {
        samples += 1;
        let qd = (sample.given.qd + sample.simulation.joints().1) / 2.0;
        energy.add(sample.tau, &qd, &drives, dt);
    });
    assert_eq!((samples, energy), (25, step.interval.energy));
    assert!(energy.absolute > 0.0);
}

/// Without contact the estimated wrench is bias and noise, and the same seed gives the same values.
#[test]
fn an_estimated_wrench_has_bias_and_noise() {
    let forces = |source, bias, seed| {
        let sensing = Sensing { source, bias, ..Sensing::default() };
        let mut env = Env::new(EnvConfig { sensing, ..EnvConfig::default() }, 1).unwrap();
        env.reset(Some(seed));
        let still = vec![0.0; env.action_dim()];
        let mut forces = vec![];
        for _ in 0..40 {
            env.step_watched(&still, |sample| forces.push(sample.given.wrench[0]));
        }
        forces.split_off(1) // The first is that of the reset.
    };
    let default = Sensing::default().bias;
    assert!(forces(SensedWrench::Exact, default, 3).iter().all(|&force| force == 0.0));
    let estimated = forces(SensedWrench::Estimated, default, 3);
    assert!(estimated == forces(SensedWrench::Estimated, default, 3));
    assert!(estimated != forces(SensedWrench::Estimated, default, 4));
    // The noise is the same with and without a bias, so the difference is the bias, which is constant.
    let unbiased = forces(SensedWrench::Estimated, [0.0; 2], 3);
    let bias: Vec<f64> = estimated.iter().zip(&unbiased).map(|(with, without)| with - without).collect();
    assert!(bias[0].abs() > 1e-3 && bias.iter().all(|value| (value - bias[0]).abs() < 1e-9), "{bias:?}");
    // From one sample to the next only the noise changes, 0.3 N.
    let steps: Vec<f64> = estimated.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let noise = (steps.iter().map(|step| step * step).sum::<f64>() / (2 * steps.len()) as f64).sqrt();
    assert!((0.27..0.33).contains(&noise), "{noise} N");
}
