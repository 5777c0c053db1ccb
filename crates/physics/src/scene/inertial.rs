//! Mass and its distribution.

use std::f64::consts::PI;

use aforce::{Pose, Vector3};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::Shape;

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

/// Tolerance of the bounds of the moments, as a share of the largest one, for the rounding in published tables.
const ROUNDED: f64 = 1e-3;

/// Why no body can have this inertia about its centre of mass (kg m2); `None` if one can.
pub(crate) fn impossible(inertia: &Matrix3<f64>) -> Option<String> {
    if inertia.iter().any(|part| !part.is_finite()) {
        return Some("the inertia is not finite".into());
    }
    let mut moments = inertia.symmetric_eigenvalues();
    moments.as_mut_slice().sort_by(f64::total_cmp);
    let [[a, b, c]] = moments.data.0;
    let slack = ROUNDED * moments.amax();
    (a < -slack || a + b < c - slack).then(|| {
        format!(
            "principal moments of inertia of {a:.3e}, {b:.3e} and {c:.3e} kg m2; no body has them: none may be below 0, none above the sum of \
             the others"
        )
    })
}

impl Inertial {
    /// No mass: static bodies and frames.
    pub const NONE: Inertial = Inertial {
        mass: 0.0,
        com: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// From mass (kg), centre of mass (m) and moments about it (kg m2), the principal axes parallel to the body frame.
    pub fn diagonal(mass: f64, com: [f64; 3], inertia: [f64; 3]) -> Self {
        Inertial { mass, com: com.into(), inertia: Matrix3::from_diagonal(&inertia.into()) }
    }

    /// A homogeneous box with the given half extents (m) and density (kg/m3).
    pub fn solid_box(half: Vector3, density: f64) -> Self {
        let mass = 8.0 * half.x * half.y * half.z * density;
        let s = half.component_mul(&half) * (mass / 3.0);
        Self::diagonal(mass, [0.0; 3], [s.y + s.z, s.x + s.z, s.x + s.y])
    }

    /// A homogeneous body of the given density (kg/m3), in the frame of its shape.
    pub fn solid(shape: &Shape, density: f64) -> Self {
        let round = |mass: f64, radius: f64, length: f64| {
            let across = mass * (radius * radius / 4.0 + length * length / 12.0);
            Self::diagonal(mass, [0.0; 3], [across, across, mass * radius * radius / 2.0])
        };
        let ball = |radius: f64| 4.0 / 3.0 * PI * radius.powi(3) * density;
        match shape {
            Shape::Box(half) => Self::solid_box(*half, density),
            Shape::Sphere { radius } => {
                let mass = ball(*radius);
                Self::diagonal(mass, [0.0; 3], [0.4 * mass * radius * radius; 3])
            }
            Shape::Cylinder { half_length, radius } => {
                round(2.0 * PI * radius * radius * half_length * density, *radius, 2.0 * half_length)
            }
            Shape::Capsule { half_length, radius } => {
                let (r, h) = (*radius, *half_length);
                let middle = round(2.0 * PI * r * r * h * density, r, 2.0 * h);
                // Two half balls: the middle of each is 3/8 of the radius beyond the end of the segment.
                let mass = ball(r);
                let along = 0.4 * mass * r * r;
                let across = along + mass * (h * h + 0.75 * h * r);
                middle.merged(&Self::diagonal(mass, [0.0; 3], [across, across, along]))
            }
            Shape::Convex(hull) => hull.inertial(density),
        }
    }

    /// A homogeneous body of the given mass (kg), in the frame of its shape.
    pub fn of_mass(shape: &Shape, mass: f64) -> Self {
        let one = Self::solid(shape, 1.0);
        let factor = mass / one.mass;
        Inertial { mass, com: one.com, inertia: one.inertia * factor }
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

    /// Moment of inertia (kg m2) about an axis through the origin along the unit vector `axis`.
    pub fn about(&self, axis: &Vector3) -> f64 {
        axis.dot(&(self.inertia * axis)) + self.mass * axis.cross(&self.com).norm_squared()
    }
}
