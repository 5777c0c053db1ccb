use super::*;
use crate::interval::ForceRecord;
use crate::penalty::{ForcePenalty, Sensor};
use crate::protection::Protection;

/// A load that no joint can bear ends the episode, even where its horizon would have.
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
        // The next episode begins as if nothing had happened.
        assert_eq!(env.reset(Some(1)), start);
    }
}

/// The script lifts the cube and holds it: the episode ends a second after, and its value goes on.
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

/// A joint that turns faster than it may stops the arm where episodes end with that; elsewhere the arm goes on.
#[test]
fn an_arm_that_is_to_stop_ends_the_episode_and_earns_nothing() {
    let play = |stops| {
        let protection = Protection { joint_speed: 0.05, ..Protection::default() };
        let mut env = Env::new(EnvConfig { stops, protection, ..EnvConfig::default() }, 1).unwrap();
        let action = vec![0.5; env.action_dim()];
        let mut steps = vec![];
        while steps.len() < 10 && !steps.last().is_some_and(|step: &Step| step.terminated) {
            steps.push(env.step(&action));
        }
        (steps, env)
    };
    let ((going_on, _), (stopping, env)) = (play(false), play(true));
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
}

/// 100 N on the arm of which the hand feels 10.
#[test]
fn the_penalty_counts_whom_it_is_told_to() {
    let force = |max| ForceRecord { max, ..ForceRecord::default() };
    let interval = Interval { hand: force(10.0), arm: force(100.0), ..Interval::default() };
    for (of, penalty) in [(Sensor::Arm, 5.0), (Sensor::Hand, 0.0)] {
        let force_penalty = ForcePenalty { of, ..ForcePenalty::default() };
        let mut env = Env::new(EnvConfig { force_penalty, ..EnvConfig::default() }, 1).unwrap();
        let step = env.outcome(interval, false);
        assert_eq!((step.penalty, step.over_limit), (penalty, penalty > 0.0));
    }
    assert_eq!(ForcePenalty::default().of, Sensor::Arm);
}
