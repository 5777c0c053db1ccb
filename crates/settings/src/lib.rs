//! The settings of an environment: layers of keys, of which the last wins; files; names of action spaces, robots and
//! set-ups.
//!
//! This crate needs no libtorch. The training programs have a learner's settings besides these; environments in Python
//! have no other settings.

mod layers;
pub mod robots;
pub mod setup;
mod source;
pub mod spaces;

/// The keys at the top of a run's `config.toml` that do not belong to its environment.
pub const RUN_KEYS: [&str; 9] = [
    "preset",
    "variant",
    "seed",
    "steps",
    "evaluate_every",
    "evaluation_episodes",
    "checkpoint_every",
    "checkpoint_minutes",
    "learner",
];

pub use layers::{WANTED, env, lay_over, layered, nested, of_file};
pub use source::{Source, parse, text};
