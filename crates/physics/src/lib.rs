//! The plant: a torque-controlled arm of six or seven joints ([`robots`]) and the scenes it works in.
//!
//! One description of a scene ([`scene::Scene`]) feeds three consumers: the Rapier
//! world that is simulated ([`Simulation`]), the MJCF file with which MuJoCo checks it
//! ([`mjcf`]), and the ray caster that draws it ([`camera`]). The arm's kinematics and
//! dynamics are computed a second time, independently of the engine, by [`model`]: that
//! is what a controller reads.
//!
//! SI units; world frame with z up; quaternions w, x, y, z; six-vectors linear part
//! first. Only this crate uses Rapier.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // See clippy.toml.

mod air;
pub mod camera;
mod check;
mod contact;
mod deviation;
mod engine;
mod friction;
pub mod gripper;
pub mod mesh;
pub mod mjcf;
pub mod model;
pub mod objects;
mod plant;
pub mod robots;
pub mod scene;
pub mod scenes;
mod shading;
mod simulation;
mod solid;
mod stop;
mod view;
pub mod wiping_tool;

pub use check::SceneError;
pub use contact::{ContactReading, LinkReading};
pub use deviation::{Change, Deviation};
pub use engine::Surfaces;
pub use plant::{Plant, SimulationConfig};
pub use simulation::{Diverged, Overlap, Push, Simulation};
pub use solid::Solid;
pub use view::View;
