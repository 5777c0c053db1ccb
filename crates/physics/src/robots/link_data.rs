//! A link as makers and model collections publish it: numbers in a table.

use aforce::Pose;
use nalgebra::UnitQuaternion;

use super::Link;
use super::panda::capsule;
use crate::scene::{Inertial, Role, pose};

/// Ends of the axis (m, link frame) and radius (m).
pub(super) type Capsule = ([f64; 3], [f64; 3], f64);

/// How a link's frame is turned against that of the link before.
pub(super) enum Turn {
    /// w, x, y, z.
    Quaternion([f64; 4]),
    /// Roll, pitch, yaw (rad), as in a URDF.
    RollPitchYaw([f64; 3]),
}

/// A link whose principal axes of inertia are parallel to the axes of its frame.
pub(super) struct LinkData {
    /// Position of the link's frame in that of the link before (m).
    pub position: [f64; 3],
    pub turn: Turn,
    pub mass: f64,
    pub com: [f64; 3],
    /// Principal moments about the centre of mass, along the link's axes (kg m2).
    pub moments: [f64; 3],
    pub capsules: &'static [Capsule],
}

impl LinkData {
    /// The link number `i`, counted from 0, with damping and friction of the joint of `other`.
    pub fn link(&self, i: usize, other: &Link) -> Link {
        let name = format!("link{}", i + 1);
        let role = Role::Link(i as u8 + 1);
        let frame = match self.turn {
            Turn::Quaternion(wxyz) => pose(self.position, wxyz),
            Turn::RollPitchYaw([roll, pitch, yaw]) => {
                Pose::from_parts(self.position.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
            }
        };
        let capsules = self.capsules.iter().enumerate();
        Link {
            frame,
            inertial: Inertial::diagonal(self.mass, self.com, self.moments),
            geoms: capsules.map(|(k, &(a, b, radius))| capsule(&name, k, role, a, b, radius)).collect(),
            damping: other.damping,
            friction: other.friction,
        }
    }
}

/// Pairs of neighbours, which never touch: 0 is every fixture, the base among them, 1 to 7 a link.
pub(super) const NEIGHBOURS: [[u8; 2]; 7] = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7]];
