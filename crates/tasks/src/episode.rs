//! An episode from its first action to its last.

use std::ops::ControlFlow;

use crate::env::Env;
use crate::outcome::Outcome;
use crate::step::Step;

/// Plays the episode of `seed` to its end, or until `on_step` breaks off. `act` chooses each action, in [-1, 1]^n;
/// `on_step` is called after each step.
pub fn play(
    env: &mut Env,
    mut act: impl FnMut(&Env) -> Vec<f64>,
    seed: u64,
    mut on_step: impl FnMut(&Env, &Step) -> ControlFlow<()>,
) -> Episode {
    env.reset(Some(seed));
    let mut episode = Episode::default();
    loop {
        let action = act(env);
        let step = env.step(&action);
        let flow = on_step(env, &step);
        episode.add(step);
        if step.terminated || step.truncated || flow.is_break() {
            return episode;
        }
    }
}

/// What every action of an episode led to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Episode {
    steps: Vec<Step>,
}

impl Episode {
    /// Adds the outcome of one action.
    pub fn add(&mut self, step: Step) {
        self.steps.push(step);
    }

    /// The steps, one per action.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The outcome of the episode: a cell for each column.
    pub fn outcome(&self) -> Outcome {
        Outcome::of(&self.steps)
    }
}
