//! Tasks that are written in Python: a class says scene, draws, observation, reward, success and script; the loop is the same as of
//! every other task.

mod answer;
mod blueprint;
mod scene;
mod start;
mod state;
mod task;
mod values;
mod waypoint;
mod words;

pub use self::blueprint::env;
pub use self::state::{Place, State};
pub use self::task::Trouble;
