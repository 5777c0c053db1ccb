//! Drag of the air on the bodies of a scene, after MuJoCo's model, in which each body is a box.
//!
//! MuJoCo 3.2.7, documentation, Computation, "Fluid forces", "Inertia model"; `mj_inertiaBoxFluidModel` in
//! `src/engine/engine_passive.c`. The box is homogeneous and has the body's mass and inertia. A light body with a large
//! inertia has a large box, whatever its shape: that of robosuite's finger tip (10 g) is 2.4 m wide.

use std::f64::consts::PI;

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, Point3};

use crate::scene::{Air, Inertial, Scene};

/// How the air resists one body: with -(b + c |v|) v along each of the body's principal axes of inertia, and likewise
/// against its rotation about each of them.
#[derive(Debug, Clone)]
pub(crate) struct Drag {
    /// Centre of mass in the frame of the moving body that carries this one (m).
    centre: Vector3,
    /// Principal axes as columns in the same frame. `None`: the axes of the frame, the usual case, which costs half as
    /// much.
    axes: Option<Matrix3<f64>>,
    /// b of translation (N s/m) and rotation (Nm s).
    viscous: [f64; 2],
    /// c of translation (N s2/m2) and rotation (Nm s2).
    inertial: [Vector3; 2],
}

impl Drag {
    /// Drag of a body with `inertial`, in the frame of `inertial`.
    fn new(air: &Air, inertial: &Inertial) -> Self {
        let principal = inertial.inertia.symmetric_eigen();
        let moments = principal.eigenvalues;
        let half = moments.map(|moment| (1.5 * (moments.sum() - 2.0 * moment).max(0.0) / inertial.mass).sqrt());
        let radius = half.mean();
        // For each axis: j and k are the half sizes across it, and `turned` is r (j^4 + k^4) with r the half size along
        // it.
        let (j, k) = (half.yzx(), half.zxy());
        let turned = half.component_mul(&(j.map(|r| r.powi(4)) + k.map(|r| r.powi(4))));
        Drag {
            centre: inertial.com,
            axes: Some(principal.eigenvectors).filter(|axes| !axes.is_identity(0.0)),
            viscous: [6.0 * PI * radius * air.viscosity, 8.0 * PI * radius.powi(3) * air.viscosity],
            inertial: [2.0 * air.density * j.component_mul(&k), 0.5 * air.density * turned],
        }
    }

    /// The same drag in the frame in which the present one has pose `pose`.
    fn moved(self, pose: &Pose) -> Self {
        let axes = pose.rotation.to_rotation_matrix() * self.axes.unwrap_or_else(Matrix3::identity);
        let centre = (pose * Point3::from(self.centre)).coords;
        Drag { centre, axes: Some(axes).filter(|axes| !axes.is_identity(0.0)), ..self }
    }

    /// Force (N), and moment (Nm) about the origin of the carrying body's frame, at the velocity of that origin (m/s) and of
    /// rotation (rad/s); all in the frame's axes.
    #[inline]
    pub fn load(&self, [v, omega]: [Vector3; 2]) -> [Vector3; 2] {
        let resisted = |velocity: Vector3, part: usize| -> Vector3 {
            let along = self.axes.as_ref().map_or(velocity, |axes| axes.tr_mul(&velocity));
            let size = self.inertial[part].component_mul(&along.abs()).add_scalar(self.viscous[part]);
            let force = -size.component_mul(&along);
            self.axes.as_ref().map_or(force, |axes| axes * force)
        };
        let force = resisted(v + omega.cross(&self.centre), 0);
        [force, resisted(omega, 1) + self.centre.cross(&force)]
    }
}

impl Scene {
    /// Drags on the moving body `index`: its own, and that of each body welded to it.
    pub(crate) fn drags(&self, index: usize) -> Vec<Drag> {
        let Some(air) = &self.air else { return vec![] };
        let carried = self.bodies.iter().enumerate().filter(|(_, body)| body.inertial.mass > 0.0);
        carried
            .filter_map(|(i, body)| match self.moving_root(i) {
                (Some(root), pose) if root == index => Some(Drag::new(air, &body.inertial).moved(&pose)),
                _ => None,
            })
            .collect()
    }
}
