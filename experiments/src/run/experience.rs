//! Transitions of an environment, stored in a replay buffer.

use anyhow::Result;
use sac::{Config, Replay, Transition};
use tasks::{Env, Step};

use crate::config::RunConfig;
use crate::run::rollout::{critics_view, sizes};
use crate::run::seeds::sub_seed;
use crate::run::stop::Stop;

/// Takes a step in `env` and stores it in `replay`. `observation`, what critics see, is replaced by the next one.
pub(super) fn step_and_store(
    env: &mut Env,
    observation: &mut Vec<f32>,
    action: &[f32],
    replay: &mut Replay,
    scaled: bool,
) -> Result<Step> {
    let wide: Vec<f64> = action.iter().map(|&a| f64::from(a)).collect();
    let step = env.step(&wide);
    let next = critics_view(env, scaled);
    replay.push(&Transition {
        observation,
        action,
        reward: step.reward as f32,
        next_observation: &next,
        terminated: step.terminated,
        truncated: step.truncated,
    })?;
    *observation = next;
    Ok(step)
}

/// Transitions of the script's episodes, which have starts of their own. They are the same in every process, so that no
/// checkpoint stores them. Some are missing if a stop is requested meanwhile.
pub(super) fn prior_data(config: &RunConfig, stop: &Stop) -> Result<Replay> {
    let mut env = Env::new(config.env.clone(), sub_seed(config.seed, "prior", 0))?;
    // The buffer holds all of the script's episodes, even if the learner's own buffer is smaller.
    let played = config.learner.prior_episodes as usize * config.env.horizon as usize;
    let capacity = config.learner.replay_capacity.max(played);
    let mut replay = Replay::new(&Config { replay_capacity: capacity, ..config.learner.clone() }, sizes(&env));
    for _ in 0..config.learner.prior_episodes {
        if stop.requested() {
            break;
        }
        env.reset(None);
        let mut observation = critics_view(&env, config.learner.scaled_observations);
        loop {
            let action: Vec<f32> = env.expert_action().iter().map(|&a| a as f32).collect();
            let step =
                step_and_store(&mut env, &mut observation, &action, &mut replay, config.learner.scaled_observations)?;
            if step.terminated || step.truncated {
                break;
            }
        }
    }
    Ok(replay)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The script's episodes, played again from the seed of their stream, fill a buffer in which every number is the same.
    #[test]
    fn prior_data_is_what_the_script_does_from_starts_of_its_own() {
        let mut config = RunConfig::preset(sac::Preset::DESKTOP);
        config.env.horizon = 30;
        config.learner.prior_episodes = 2;
        config.learner.scaled_observations = true;
        // Smaller than the number of the script's steps, all of which are stored nevertheless.
        config.learner.replay_capacity = 20;

        let env = |stream: &str| Env::new(config.env.clone(), sub_seed(config.seed, stream, 0)).unwrap();
        let scaled = |env: &Env| {
            let mut observation = env.observation().to_vec();
            tasks::scale(env.observation_components(), &mut observation);
            observation
        };
        let mut script = env("prior");
        let of_a_step = (script.observation().len(), script.action_dim());
        let mut expected = Replay::new(&Config { replay_capacity: 60, ..config.learner.clone() }, of_a_step);
        for _ in 0..2 {
            script.reset(None);
            for action_number in 1..=30 {
                let observation = scaled(&script);
                let action: Vec<f32> = script.expert_action().iter().map(|&a| a as f32).collect();
                let step = script.step(&action.iter().map(|&a| f64::from(a)).collect::<Vec<_>>());
                let transition = Transition {
                    observation: &observation,
                    action: &action,
                    reward: step.reward as f32,
                    next_observation: &scaled(&script),
                    terminated: false,
                    truncated: action_number == 30,
                };
                expected.push(&transition).unwrap();
            }
        }
        let prior = prior_data(&config, &Stop::default()).unwrap();
        assert_eq!(prior.len(), 60);
        // Compared as text, which tells 0 from -0.
        assert!(format!("{prior:?}") == format!("{expected:?}"), "other numbers than the script's");

        let [own, training] = ["prior", "train-env"].map(|stream| env(stream).reset(None).to_vec());
        assert_ne!(own, training);
    }
}
