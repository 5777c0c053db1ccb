//! Contact manipulation tasks for reinforcement learning.
//!
//! [`Env`] holds a [`Task`], a simulated arm and an [`aforce::Controller`], and owns the only loop: one action (by default at 20 Hz)
//! leads to 25 control samples (500 Hz) with a torque each, and to a reward, an observation and an [`Interval`] of energies and forces.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // See clippy.toml.

mod axis_group;
pub mod columns;
mod controller_state;
mod describe;
mod disturbance;
mod door;
mod drawn;
mod env;
mod env_config;
mod episode;
mod expert;
mod force_record;
mod force_sensor;
mod grasp;
mod insert;
mod interval;
mod lift;
mod motion;
mod normal;
mod normalisation;
mod observation;
mod observation_options;
mod observer;
mod outcome;
mod penalty;
mod pixels;
mod placing;
mod privileged;
mod protection;
mod registry;
mod reward_terms;
mod sample;
mod sensing;
mod spot;
mod start;
mod step;
mod task;
mod task_kind;
mod task_name;
mod wipe;

pub use axis_group::AxisGroup;
pub use describe::{Derived, Description};
pub use disturbance::{Disturbance, Draw, OwnDisturbance};
pub use env::Env;
pub use env_config::EnvConfig;
pub use episode::{Episode, play};
pub use force_record::ForceRecord;
pub use force_sensor::Feel;
pub use grasp::{nearest, nearest_straight_down, straight_down};
pub use interval::{Interval, Stop};
pub use observation::scale;
pub use observation_options::{MarkerView, ObservationOptions};
pub use observer::{Component, Observer};
pub use outcome::Outcome;
pub use penalty::{CountedForce, ForcePenalty};
pub use physics::Change;
pub use pixels::{FARTHEST, ObservedCamera, PixelForm, PixelKind, Pixels, Standpoint};
pub use privileged::Privileged;
pub use protection::{Protection, StopReason};
pub use registry::{register, register_anew};
pub use reward_terms::RewardTerms;
pub use sample::Sample;
pub use sensing::{SensedWrench, Sensing};
pub use spot::Spot;
pub use start::{Fingers, Start};
pub use step::Step;
pub use task::{Reward, Task, Waypoint};
pub use task_kind::TaskKind;
pub use task_name::TaskName;
pub use wipe::{Markers, Wipe};
