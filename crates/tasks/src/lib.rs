//! Contact manipulation tasks for reinforcement learning.
//!
//! [`Env`] holds a [`Task`], a simulated arm and an [`aforce::Controller`], and owns the
//! only loop: one action (by default at 20 Hz) becomes torques (25 at 500 Hz) and comes
//! back as a reward, an observation and an [`Interval`] of energies and forces.

mod door;
mod env;
mod expert;
mod interval;
mod lift;
mod markers;
mod observation;
mod penalty;
mod task;
mod wipe;

pub use env::{Env, EnvConfig, Step};
pub use interval::Interval;
pub use markers::Markers;
pub use observation::scale;
pub use penalty::ForcePenalty;
pub use task::{Component, REWARD_TERMS, Reward, Task, TaskName, Waypoint};
