//! Where a ray meets one shape. For boxes, balls and capsules the engine's geometry library computes the point in closed form. For
//! cylinders and hulls it iterates, which took 70 % of the time of a picture. A hull is an intersection of half-spaces, a cylinder one of
//! half-spaces and an endless cylinder. So a ray is inside either of them between two distances, which are computed here.

use rapier3d_f64::geometry::Collider;
use rapier3d_f64::math as rapier;
use rapier3d_f64::parry::query::Ray;
use rapier3d_f64::parry::shape::{ConvexPolyhedron, Cylinder, Shape, TypedShape};

/// A shape in the world.
pub(super) struct Target<'a> {
    form: Form<'a>,
    /// Frame of the form (world).
    pose: rapier::Pose,
}

enum Form<'a> {
    /// A cylinder about y.
    Cylinder(&'a Cylinder),
    Hull(&'a ConvexPolyhedron),
    Known(&'a dyn Shape),
}

impl<'a> Target<'a> {
    /// The shape of a collider, which stands at `pose`.
    pub fn new(collider: &'a Collider, mut pose: rapier::Pose) -> Self {
        let mut shape = collider.shape();
        // A cylinder that stands along z is a compound of one that stands along y.
        if let TypedShape::Compound(compound) = shape.as_typed_shape()
            && let [(place, part)] = compound.shapes()
        {
            (shape, pose) = (&**part, pose * *place);
        }
        let form = match shape.as_typed_shape() {
            TypedShape::Cylinder(cylinder) => Form::Cylinder(cylinder),
            TypedShape::ConvexPolyhedron(hull) => Form::Hull(hull),
            _ => Form::Known(shape),
        };
        Target { form, pose }
    }

    /// The first point of the shape along a ray, within `limit`: its distance (in lengths of the direction).
    pub fn distance(&self, ray: &Ray, limit: f64) -> Option<f64> {
        let ray = ray.inverse_transform_by(&self.pose);
        match self.form {
            Form::Known(shape) => shape.cast_local_ray(&ray, limit, true),
            Form::Cylinder(cylinder) => through_cylinder(cylinder, &ray)?.first(limit),
            Form::Hull(hull) => through_hull(hull, &ray)?.first(limit),
        }
    }

    /// The outward normal (world) at the point where a ray meets the shape; zero if the ray begins inside.
    pub fn normal(&self, ray: &Ray, limit: f64) -> Option<rapier::Vector> {
        let ray = ray.inverse_transform_by(&self.pose);
        let normal = match self.form {
            Form::Known(shape) => shape.cast_local_ray_and_get_normal(&ray, limit, true)?.normal,
            Form::Cylinder(cylinder) => through_cylinder(cylinder, &ray)?.normal(),
            Form::Hull(hull) => through_hull(hull, &ray)?.normal(),
        };
        Some(self.pose.rotation * normal)
    }
}

/// The part of a ray that lies in a convex shape.
struct Span {
    enter: f64,
    exit: f64,
    /// Outward normal of the surface through which the ray enters.
    normal: rapier::Vector,
}

impl Span {
    const ALL: Span = Span { enter: f64::NEG_INFINITY, exit: f64::INFINITY, normal: rapier::Vector::ZERO };

    /// Keeps the part behind a plane with this outward normal, whose distance from the ray's origin along that normal
    /// is `ahead`.
    fn behind(&mut self, normal: rapier::Vector, ahead: f64, direction: rapier::Vector) {
        let along = normal.dot(direction);
        if along < 0.0 {
            let at = ahead / along;
            if at > self.enter {
                (self.enter, self.normal) = (at, normal);
            }
        } else if along > 0.0 {
            self.exit = self.exit.min(ahead / along);
        } else if ahead < 0.0 {
            self.exit = f64::NEG_INFINITY;
        }
    }

    fn first(&self, limit: f64) -> Option<f64> {
        let begins = self.enter.max(0.0);
        (begins <= self.exit && begins <= limit).then_some(begins)
    }

    fn normal(&self) -> rapier::Vector {
        if self.enter > 0.0 { self.normal } else { rapier::Vector::ZERO }
    }
}

/// The part of a ray in a cylinder. `None`: the ray misses the endless cylinder. A part is empty if the ray passes
/// beyond an end.
fn through_cylinder(cylinder: &Cylinder, ray: &Ray) -> Option<Span> {
    let (origin, direction) = (ray.origin, ray.dir);
    let mut span = Span::ALL;
    for end in [rapier::Vector::Y, -rapier::Vector::Y] {
        span.behind(end, cylinder.half_height - end.dot(origin), direction);
    }
    let across = rapier::Vector::new(direction.x, 0.0, direction.z);
    let from_axis = rapier::Vector::new(origin.x, 0.0, origin.z);
    let (speed, radius) = (across.length_squared(), cylinder.radius);
    if speed == 0.0 {
        return (from_axis.length() <= radius).then_some(span);
    }
    // Computed from the point of the ray that is nearest to the axis, so that a distant origin costs no precision.
    let nearest = -from_axis.dot(across) / speed;
    let aside = from_axis + across * nearest;
    let half = (radius * radius - aside.length_squared()) / speed;
    if half < 0.0 {
        return None;
    }
    let half = half.sqrt();
    if nearest - half > span.enter {
        (span.enter, span.normal) = (nearest - half, (aside - across * half) / radius);
    }
    span.exit = span.exit.min(nearest + half);
    Some(span)
}

/// The part of a ray in a hull; `None` if the ray misses it.
fn through_hull(hull: &ConvexPolyhedron, ray: &Ray) -> Option<Span> {
    let (points, corners) = (hull.points(), hull.vertices_adj_to_face());
    let mut span = Span::ALL;
    for face in hull.faces() {
        let corner = points[corners[face.first_vertex_or_edge as usize] as usize];
        span.behind(face.normal, face.normal.dot(corner - ray.origin), ray.dir);
        if span.enter > span.exit {
            return None;
        }
    }
    Some(span)
}
