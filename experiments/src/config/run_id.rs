//! The identity of a run.

use std::fmt::{self, Display, Formatter};

use serde::{Deserialize, Serialize};

use crate::config::RunConfig;

/// The identity of a run, by which its rows, its folder, its checkpoints and a sweep name it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct RunId {
    /// Task name.
    pub task: String,
    /// Action space name.
    pub space: String,
    /// What tells it from other runs of a sweep with this task, space and seed; mostly empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub variant: String,
    /// Seed of the run; 0 if an old checkpoint does not store it.
    #[serde(default)]
    pub seed: u64,
}

impl RunId {
    /// The identity of the run with this configuration.
    pub fn of(config: &RunConfig) -> Self {
        RunId {
            task: config.env.task.as_str().into(),
            space: config.env.space.name.clone(),
            variant: config.variant.clone(),
            seed: config.seed,
        }
    }

    /// Space and variant: the name of the run's folder, and of its group in tables.
    pub fn label(&self) -> String {
        label(&self.space, &self.variant)
    }
}

impl Display for RunId {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.task, self.label(), self.seed)
    }
}

/// `SPACE,VARIANT`, or the space alone.
pub fn label(space: &str, variant: &str) -> String {
    if variant.is_empty() { space.into() } else { format!("{space},{variant}") }
}
