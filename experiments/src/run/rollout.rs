//! Playing episodes with a policy.

use std::ops::ControlFlow;

use anyhow::Result;
use output::statistics::mean_of;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sac::{Act, Actor, Sizes};
use tasks::{Env, Outcome, play};

use crate::config::RunId;
use crate::run::rows::{EvaluationKey, SCHEMA};

/// What chooses the actions.
#[derive(Clone)]
pub enum Policy {
    /// A trained network.
    Actor {
        /// The network.
        actor: Box<Actor>,
        /// Mean or sampled action.
        act: Act,
        /// Whether it was trained on scaled observations.
        scaled: bool,
    },
    /// The task's script.
    Expert,
    /// Uniform in [-1, 1].
    Random(Box<ChaCha8Rng>),
}

impl Policy {
    /// Uniform random actions from `seed`.
    pub fn random(seed: u64) -> Self {
        Policy::Random(Box::new(ChaCha8Rng::seed_from_u64(seed)))
    }

    /// Name in tables.
    pub fn name(&self) -> &'static str {
        match self {
            Policy::Actor { act: Act::Mean, .. } => "mean",
            Policy::Actor { .. } => "sampled",
            Policy::Expert => "expert",
            Policy::Random(_) => "random",
        }
    }

    /// The next action in [-1, 1]^n.
    pub fn act(&mut self, env: &Env) -> Vec<f64> {
        match self {
            Policy::Actor { actor, act, scaled } => {
                let observation = learner_view(env, *scaled);
                let mut action = vec![0.0; env.action_dim()];
                actor.act(&observation, &mut action, *act);
                action.into_iter().map(f64::from).collect()
            }
            Policy::Expert => env.expert_action(),
            Policy::Random(rng) => (0..env.action_dim()).map(|_| rng.random_range(-1.0..=1.0)).collect(),
        }
    }
}

/// The observation as a learner sees it.
pub fn learner_view(env: &Env, scaled: bool) -> Vec<f32> {
    let mut observation = env.observation().to_vec();
    if scaled {
        tasks::scale(env.observation_components(), &mut observation);
    }
    observation
}

/// What the learner's critics see, as the replay buffer stores it: the observation, then what critics alone see.
pub fn critics_view(env: &Env, scaled: bool) -> Vec<f32> {
    let mut seen = learner_view(env, scaled);
    let policy = seen.len();
    seen.extend(env.privileged());
    if scaled {
        tasks::scale(env.privileged_components(), &mut seen[policy..]);
    }
    seen
}

/// Lengths of observation, critics' part and action in `env`.
pub fn sizes(env: &Env) -> Sizes {
    Sizes {
        observation: env.observation_components().len(),
        privileged: env.privileged_components().len(),
        action: env.action_dim(),
    }
}

/// Plays an episode from each of `starts`; `write` gets a row for each episode as it ends. Returns the outcomes.
///
/// # Errors
/// If a row cannot be written.
pub fn evaluate(
    env: &mut Env,
    policy: &mut Policy,
    starts: impl Iterator<Item = u64>,
    step: u64,
    id: &RunId,
    mut write: impl FnMut(EvaluationKey, &Outcome) -> Result<()>,
) -> Result<Vec<Outcome>> {
    let mut outcomes = Vec::new();
    for (index, seed) in (0..).zip(starts) {
        let outcome = play(env, |env| policy.act(env), seed, |_, _| ControlFlow::Continue(())).outcome();
        let key = EvaluationKey {
            schema: SCHEMA,
            task: id.task.clone(),
            space: id.space.clone(),
            seed: id.seed,
            step,
            policy: policy.name().into(),
            eval_episode: index,
            episode_seed: seed,
        };
        write(key, &outcome)?;
        outcomes.push(outcome);
    }
    Ok(outcomes)
}

/// Mean over episodes of the column `name`; NaN if an episode has no number there.
pub fn mean_of_column(outcomes: &[Outcome], name: &str) -> f64 {
    mean_of(outcomes, |outcome| outcome.number(name).unwrap_or(f64::NAN))
}
