//! The observation before each action, and the action, as columns of text.

use tasks::Env;

/// The unscaled observation before each action, and the action.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Inputs {
    /// Adds an `action` of `env` and the `observation` before it.
    pub fn add(&mut self, env: &Env, observation: &[f32], action: &[f64]) {
        if self.names.is_empty() {
            let observed = env.observation_components().iter().map(|c| format!("Observation, {} ({})", c.name, c.unit));
            let done = env.action_entries().into_iter().map(|entry| format!("Action, {} (-1 to 1)", entry.name));
            self.names = observed.chain(done).collect();
        }
        // The shortest decimals that read back as the same numbers.
        self.rows.push(observation.iter().map(f32::to_string).chain(action.iter().map(f64::to_string)).collect());
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A row for each action.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }
}
