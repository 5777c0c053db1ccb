//! The settings of an environment: layers of keys, of which the last wins, a file, names of action spaces, robots and set-ups.
//!
//! Needs no libtorch: the programs lay a learner's settings beside these, Python's environments have no others.

mod layers;
pub mod robots;
pub mod setup;
mod source;
pub mod spaces;

/// The keys of a run's `config.toml` that are none of its environment.
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

pub use layers::{WANTED, env, layered, nested, of_file};
pub use source::{Source, parse, text};
