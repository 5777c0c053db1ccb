//! Where rays meet the collision shapes.

use aforce::Vector3;
use rapier3d_f64::geometry::Collider;
use rapier3d_f64::math as rapier;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d_f64::parry::query::Ray;

use super::Engine;
use super::convert::{coordinates, shared_shape, to_engine, vector};
use super::rays::Target;
use crate::scene::Scene;

/// How far a ray reaches (m).
const REACH: f64 = 100.0;

/// Every collision shape as it stood when this was made, in a tree of boxes: a ray tries only those shapes whose boxes it
/// passes through.
pub struct Surfaces<'a> {
    tree: Bvh,
    /// Shape and colour of each geom, in the order of the scene.
    geoms: Vec<(Target<'a>, [u8; 3])>,
}

impl Engine {
    /// The shapes that rays meet. Tree and poses are computed here, because those of the collision detection are updated only in the
    /// next step.
    pub fn surfaces(&self) -> Surfaces<'_> {
        let placed = self.geoms.iter().map(|&(handle, color)| {
            let collider = &self.world.colliders[handle];
            let pose = self.stands(collider);
            (collider.shape().compute_aabb(&pose), (Target::new(collider, pose), color))
        });
        let (boxes, geoms): (Vec<_>, Vec<_>) = placed.unzip();
        Surfaces { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), geoms }
    }

    /// The present pose of a shape on its body.
    fn stands(&self, collider: &Collider) -> rapier::Pose {
        let body = collider.parent().map(|body| *self.world.bodies[body].position());
        body.zip(collider.position_wrt_parent()).map_or(*collider.position(), |(body, place)| body * *place)
    }
}

/// Whether a geom that stands still is straight below `point` (world).
pub(crate) fn ground_below(scene: &Scene, point: &Vector3) -> bool {
    let ray = Ray::new(vector(point), vector(&-Vector3::z()));
    let still = (0..scene.bodies.len()).filter_map(|index| match scene.moving_root(index) {
        (None, pose) => Some((index, pose)),
        _ => None,
    });
    let mut geoms = still.flat_map(|(index, pose)| scene.bodies[index].geoms.iter().map(move |geom| (pose, geom)));
    geoms.any(|(pose, geom)| {
        shared_shape(&geom.shape).cast_ray(&to_engine(&(pose * geom.pose)), &ray, REACH, true).is_some()
    })
}

impl Surfaces<'_> {
    /// Nearest surface along a ray from `origin` (m, world) within 100 m: distance (in lengths of `direction`), outward
    /// normal (world), colour.
    pub fn cast(&self, origin: &Vector3, direction: &Vector3) -> Option<(f64, Vector3, [u8; 3])> {
        let ray = Ray::new(vector(origin), vector(direction));
        let (geom, distance) = self.nearest(&ray)?;
        let (target, color) = &self.geoms[geom as usize];
        Some((distance, coordinates(target.normal(&ray, REACH)?), *color))
    }

    /// Distance (m) to the nearest surface along the ray, as in `cast`.
    pub fn distance(&self, origin: &Vector3, direction: &Vector3) -> Option<f64> {
        self.nearest(&Ray::new(vector(origin), vector(direction))).map(|(_, distance)| distance)
    }

    /// Whether there is any surface along a ray within 100 m.
    pub fn hides(&self, origin: &Vector3, direction: &Vector3) -> bool {
        let ray = Ray::new(vector(origin), vector(direction));
        let mut leaves = self.tree.leaves(|node| node.cast_ray(&ray, REACH) < REACH);
        leaves.any(|geom| self.geoms[geom as usize].0.distance(&ray, REACH).is_some())
    }

    /// Which geom (its place in the scene) a ray meets first, and the distance to it, as [`cast`](Self::cast) has them.
    pub fn strike(&self, origin: &Vector3, direction: &Vector3) -> Option<(usize, f64)> {
        self.nearest(&Ray::new(vector(origin), vector(direction))).map(|(geom, distance)| (geom as usize, distance))
    }

    fn nearest(&self, ray: &Ray) -> Option<(u32, f64)> {
        self.tree.cast_ray(ray, REACH, |geom, limit| self.geoms[geom as usize].0.distance(ray, limit))
    }
}

#[cfg(test)]
mod tests {
    use aforce::Pose;

    use super::*;
    use crate::robots::RobotName;
    use crate::robots::panda::HOME;
    use crate::scene::{Geom, Hull, Role, Shape, at};
    use crate::scenes::lift;

    /// The hand above a table, a cylinder and a hull beside it, both slanting.
    fn engine() -> Engine {
        let mut scene = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0;
        let corners: Vec<Vector3> = (0..40)
            .map(|i| 0.1 * Vector3::new(libm::sin(7.0 * i as f64), libm::cos(3.0 * i as f64), 0.1 * (i % 9) as f64))
            .collect();
        let shapes = [Shape::Cylinder { half_length: 0.1, radius: 0.05 }, Shape::Convex(Hull::new(&corners).unwrap())];
        let geoms = shapes.into_iter().zip([0.2, -0.2]).map(|(shape, y)| {
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 0.3, 0.1));
            let pose: Pose = at([0.0, y, 0.9]) * turn;
            Geom { name: format!("at {y}"), shape, pose, friction: 1.0, role: Role::Fixture, color: [200, 100, 50] }
        });
        scene.add_static("beside", geoms.collect());
        let mut engine = Engine::new(&scene, 0.002, 1);
        HOME.iter().enumerate().for_each(|(i, &q)| engine.set_coordinate(i, q, 0.0));
        engine.settle();
        engine.step(&[0.0; 9]);
        engine
    }

    /// Rays meet bodies that were moved at their new place before any step, so that the first picture of an episode shows its start.
    #[test]
    fn an_arm_that_was_put_elsewhere_is_met_there() {
        let mut engine = engine();
        engine.set_coordinate(0, 0.9, 0.0);
        engine.settle();
        let seen = |engine: &Engine| {
            let surfaces = engine.surfaces();
            let heights =
                (0..400).map(|k| Vector3::new(-0.6 + 0.04 * f64::from(k % 20), -0.4 + 0.04 * f64::from(k / 20), 3.0));
            heights.map(|above| surfaces.strike(&above, &-Vector3::z())).collect::<Vec<_>>()
        };
        let put = seen(&engine);
        engine.step(&[0.0; 9]);
        for (put, stepped) in put.iter().zip(seen(&engine)) {
            let (put, stepped) = (put.unwrap(), stepped.unwrap());
            assert!(put.0 == stepped.0 && (put.1 - stepped.1).abs() < 1e-3, "{put:?}, a step later {stepped:?}");
        }
        engine.set_coordinate(0, -0.9, 0.0);
        engine.settle();
        assert_ne!(put, seen(&engine), "the arm was turned");
    }

    /// A ray meets the shape that the engine's geometry library finds without the tree, at the same distance within 0.01 um. Normals may
    /// differ more, because the library's normals of cylinders and hulls are less exact.
    #[test]
    fn rays_meet_what_the_library_finds_without_the_tree() {
        let engine = engine();
        let surfaces = engine.surfaces();
        let mut hits = 0;
        for eye in [Vector3::new(1.5, -0.8, 1.6), Vector3::new(-0.1, 0.0, 1.15), Vector3::new(0.0, 0.6, 0.85)] {
            for (row, column) in (0..100).flat_map(|row| (0..100).map(move |column| (row, column))) {
                let target = Vector3::new(-0.6 + 0.012 * f64::from(column), 0.0, 0.4 + 0.012 * f64::from(row));
                let direction = (target - eye).normalize();
                let ray = Ray::new(vector(&eye), vector(&direction));
                let each = engine.geoms.iter().filter_map(|(handle, color)| {
                    let collider = &engine.world.colliders[*handle];
                    let hit = collider.shape().cast_ray_and_get_normal(collider.position(), &ray, REACH, true)?;
                    Some((hit.time_of_impact, coordinates(hit.normal), *color))
                });
                let expected = each.min_by(|a, b| a.0.total_cmp(&b.0));
                let found = surfaces.cast(&eye, &direction);
                assert_eq!(found.map(|(distance, ..)| distance), surfaces.distance(&eye, &direction));
                assert_eq!(found.is_some(), surfaces.hides(&eye, &direction));
                let same = match (found, expected) {
                    (Some(a), Some(b)) => (a.0 - b.0).abs() < 1e-8 && (a.1 - b.1).norm() < 1e-3 && a.2 == b.2,
                    (a, b) => a == b,
                };
                assert!(same, "row {row}, column {column} from {eye:?}: {found:?}, not {expected:?}");
                hits += usize::from(found.is_some());
            }
        }
        assert!(hits > 20_000, "{hits} of 30000 rays meet something");
    }
}
