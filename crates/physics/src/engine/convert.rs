//! Conversions between the types of this crate and the engine's.

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, Quaternion, Translation3, UnitQuaternion};
use rapier3d_f64::geometry::{Group, InteractionGroups, InteractionTestMode};
use rapier3d_f64::math as rapier;
use rapier3d_f64::parry::shape::SharedShape;

use crate::scene::{Role, Shape};

/// Collision groups of a geom of `role`; `never_touch` are the pairs of the robot's parts that do not collide.
pub(super) fn groups(role: Role, never_touch: &[[u8; 2]]) -> InteractionGroups {
    let group = Group::from_bits_truncate;
    InteractionGroups::new(group(role.bit()), group(role.mask(never_touch)), InteractionTestMode::And)
}

pub(super) fn shared_shape(shape: &Shape) -> SharedShape {
    match shape {
        Shape::Box(h) => SharedShape::cuboid(h.x, h.y, h.z),
        Shape::Capsule { half_length, radius } => SharedShape::capsule_z(*half_length, *radius),
        // The engine's cylinders stand along y.
        Shape::Cylinder { half_length, radius } => {
            let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
            let pose = Pose::from_parts(Translation3::identity(), upright);
            SharedShape::compound(vec![(to_engine(&pose), SharedShape::cylinder(*half_length, *radius))])
        }
        Shape::Sphere { radius } => SharedShape::ball(*radius),
        Shape::Convex(hull) => {
            let corners = hull.corners().iter().map(vector).collect();
            SharedShape::convex_mesh(corners, hull.triangles()).expect("a hull has a surface of triangles")
        }
    }
}

pub(super) fn vector(v: &Vector3) -> rapier::Vector {
    rapier::Vector::new(v.x, v.y, v.z)
}

pub(super) fn coordinates(v: rapier::Vector) -> Vector3 {
    Vector3::new(v.x, v.y, v.z)
}

pub(super) fn matrix(m: &Matrix3<f64>) -> rapier::Matrix {
    rapier::Matrix::from_cols(vector(&m.column(0).into()), vector(&m.column(1).into()), vector(&m.column(2).into()))
}

pub(super) fn to_engine(pose: &Pose) -> rapier::Pose {
    let q = pose.rotation;
    rapier::Pose::from_parts(vector(&pose.translation.vector), rapier::Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

pub(super) fn from_engine(pose: &rapier::Pose) -> Pose {
    let (p, q) = (pose.translation, pose.rotation);
    Pose::from_parts(
        Translation3::new(p.x, p.y, p.z),
        UnitQuaternion::new_normalize(Quaternion::new(q.w, q.x, q.y, q.z)),
    )
}
