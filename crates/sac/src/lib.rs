//! Soft Actor-Critic for continuous actions. This is the only crate of the workspace that calls libtorch, and it does not depend on robots
//! or tasks.
//!
//! Observations, actions and rewards are `f32` slices. All random numbers come from a seed. The same seed gives the same bits, even if a
//! run is stopped between two episodes, saved ([`Checkpoint::save`]) and continued.
//!
//! ```
//! use sac::{Act, Config, Replay, Sac, Transition};
//!
//! let config = Config { hidden: vec![32, 32], batch_size: 32, random_steps: 100, ..Config::default() };
//! let mut sac = Sac::new(&config, (1, 1), 7)?;
//! let mut replay = Replay::new(&config, (1, 1));
//! let mut action = [0.0];
//! for step in 1..=200 {
//!     sac.begin_episode();
//!     let observation = [(step as f32).sin()];
//!     sac.act(&observation, &mut action, if step <= config.random_steps { Act::Random } else { Act::Sample });
//!     let reward = -(action[0] - observation[0]).powi(2);
//!     replay.push(&Transition {
//!         observation: &observation,
//!         action: &action,
//!         reward,
//!         next_observation: &observation,
//!         terminated: true,
//!         truncated: false,
//!     })?;
//!     for _ in 0..config.updates_after(step) {
//!         assert!(sac.update(&replay).is_finite());
//!     }
//! }
//! # Ok::<(), sac::Error>(())
//! ```

mod actor;
mod adam;
mod buffer;
mod checkpoint;
mod config;
mod error;
mod gaussian;
mod kernels;
mod layer_norm;
mod log;
mod losses;
mod math;
mod n_step;
mod network;
mod nudge;
mod pass;
mod pink;
mod preset;
#[cfg(test)]
mod pytorch;
#[cfg(test)]
mod reference;
mod replay;
mod replay_file;
mod sac;
mod scratch;
mod simd;
mod sizes;
mod synced_file;
mod tensor_file;

pub use actor::{Act, Actor};
pub use checkpoint::Checkpoint;
pub use config::Config;
pub use error::Error;
pub use kernels::{Kernels, kernel};
pub use losses::{ActorLosses, Losses};
pub use n_step::Transition;
pub use preset::Preset;
pub use replay::Replay;
pub use sac::Sac;
pub use sizes::Sizes;
