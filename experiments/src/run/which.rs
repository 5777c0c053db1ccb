//! The two checkpoints of a run.

use clap::ValueEnum;

/// Which of a run's checkpoints is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Which {
    /// Of the best evaluation
    Best,
    /// The last one
    Last,
}

impl Which {
    /// Name of its folder, in the run's folder `checkpoints`.
    pub fn name(self) -> &'static str {
        match self {
            Which::Best => "best",
            Which::Last => "last",
        }
    }
}
