//! Mass and its distribution.

use aforce::{Pose, Vector3};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Mass properties in the body frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertial {
    /// kg
    pub mass: f64,
    /// Centre of mass in the body frame (m).
    pub com: Vector3,
    /// Inertia about the centre of mass, axes of the body frame (kg m2).
    pub inertia: Matrix3<f64>,
}

impl Inertial {
    /// No mass: static bodies and frames.
    pub const NONE: Inertial = Inertial {
        mass: 0.0,
        com: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// With principal axes parallel to the body frame.
    pub fn diagonal(mass: f64, com: [f64; 3], inertia: [f64; 3]) -> Self {
        Inertial { mass, com: com.into(), inertia: Matrix3::from_diagonal(&inertia.into()) }
    }

    /// A homogeneous box with the given half extents (m) and density (kg/m3).
    pub fn solid_box(half: Vector3, density: f64) -> Self {
        let mass = 8.0 * half.x * half.y * half.z * density;
        let s = half.component_mul(&half) * (mass / 3.0);
        Self::diagonal(mass, [0.0; 3], [s.y + s.z, s.x + s.z, s.x + s.y])
    }

    /// The same matter, described in the frame in which this body frame has pose `pose`.
    pub fn transformed(&self, pose: &Pose) -> Self {
        let r = pose.rotation.to_rotation_matrix();
        Inertial {
            mass: self.mass,
            com: (pose * nalgebra::Point3::from(self.com)).coords,
            inertia: r.matrix() * self.inertia * r.matrix().transpose(),
        }
    }

    /// Two pieces of matter welded together (parallel-axis theorem).
    pub fn merged(&self, other: &Inertial) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return Self::NONE;
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about = |part: &Inertial| {
            let d = part.com - com;
            part.inertia + part.mass * (Matrix3::identity() * d.norm_squared() - d * d.transpose())
        };
        Inertial { mass, com, inertia: about(self) + about(other) }
    }
}
