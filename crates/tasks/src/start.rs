//! How an episode starts.

use aforce::{JointVector, Pose};

/// How an episode starts: where the arm stands, how far the fingers are open, what they hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Joint angles (rad) around which the arm starts, with the noise of
    /// [`EnvConfig::initial_noise`](crate::EnvConfig::initial_noise) added. A task that needs another noise says so in the defaults that it is
    /// registered with.
    pub q: JointVector,
    /// How the fingers start; half open for a tool that has none.
    pub fingers: Fingers,
}

/// How the fingers start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fingers {
    /// The pads 4.1 cm apart, as in robosuite.
    HalfOpen,
    /// The distance between the pads (m), from 0 to [`physics::gripper::WIDEST`].
    Apart(f64),
    /// Around a free body, on which they press until an action opens them. The servo of each gives 1 N for each
    /// millimetre of half the width plus 0.5 N, 20 N at most.
    Holding {
        /// Index of the body in the scene, as [`physics::scene::Scene::body`] returns it.
        body: usize,
        /// Its pose as seen from the tool point, whose x axis is the one along which the fingers open.
        grip: Pose,
        /// Its size along that axis (m): how far the pads are apart.
        width: f64,
    },
}

impl Start {
    /// At these joint angles (rad), fingers half open.
    pub fn at(q: JointVector) -> Self {
        Start { q, fingers: Fingers::HalfOpen }
    }
}
