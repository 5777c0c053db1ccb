//! A spot of paint on a table, which Wipe may have in place of its line of markers.

use aforce::JointVector;

/// A round spot of paint and the table that it is on, which are the same in every episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Its middle (m, world).
    pub centre: [f64; 2],
    /// Its radius (m).
    pub radius: f64,
    /// Height of the table top (m).
    pub height: f64,
    /// Sliding friction of the table top.
    pub friction: f64,
    /// Paint comes off under more than the first and at most the second force (N).
    pub wiping_force: [f64; 2],
    /// Joint angles around which an episode starts (rad).
    pub start: JointVector,
}
