//! Disturbances of a task's own bodies and joints.

use physics::Change;

/// A disturbance of a body or a joint of one's own task: a key below `env.disturbance.own`.
///
/// ```
/// # use tasks::{Change, OwnDisturbance};
/// const STICKY: OwnDisturbance = OwnDisturbance { key: "slide_friction", change: Change::JointFriction("slide"), allowed: [0.0, 10.0] };
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnDisturbance {
    /// The key.
    pub key: &'static str,
    /// What it changes.
    pub change: Change,
    /// Smallest and largest value allowed, in the unit of the change.
    pub allowed: [f64; 2],
}
