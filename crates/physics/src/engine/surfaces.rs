//! Where rays meet the collision shapes.

use aforce::Vector3;
use rapier3d_f64::geometry::Collider;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d_f64::parry::query::Ray;

use super::Engine;
use super::convert::{coordinates, shared_shape, to_engine, vector};
use crate::scene::Scene;

/// How far a ray reaches (m).
const REACH: f64 = 100.0;

/// Every collision shape as it stood when this was made, in a tree of boxes: a ray tries only those shapes whose boxes it
/// passes through.
pub struct Surfaces<'a> {
    tree: Bvh,
    /// Shape and colour of each geom, in the order of the scene.
    geoms: Vec<(&'a Collider, [u8; 3])>,
}

impl Engine {
    /// What rays meet. The tree is made here and not taken from the collision detection, which knows a shape only after
    /// a step.
    pub fn surfaces(&self) -> Surfaces<'_> {
        let geoms: Vec<_> = self.geoms.iter().map(|&(handle, color)| (&self.world.colliders[handle], color)).collect();
        let boxes: Vec<_> = geoms.iter().map(|(collider, _)| collider.compute_aabb()).collect();
        Surfaces { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), geoms }
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
        let hit = |geom: u32, limit: f64| {
            let (collider, _) = self.geoms[geom as usize];
            collider.shape().cast_ray_and_get_normal(collider.position(), &ray, limit, true)
        };
        let (geom, _) =
            self.tree.cast_ray(&ray, REACH, |geom, limit| hit(geom, limit).map(|hit| hit.time_of_impact))?;
        let hit = hit(geom, REACH)?;
        Some((hit.time_of_impact, coordinates(hit.normal), self.geoms[geom as usize].1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robots::RobotName;
    use crate::robots::panda::HOME;
    use crate::scenes::lift;

    /// The tree leaves out no shape that trying them all finds.
    #[test]
    fn rays_meet_what_they_meet_without_the_tree() {
        let scene = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0;
        let mut engine = Engine::new(&scene, 0.002, 1);
        HOME.iter().enumerate().for_each(|(i, &q)| engine.set_coordinate(i, q, 0.0));
        engine.settle();
        engine.step(&[0.0; 9]);
        let surfaces = engine.surfaces();
        let eye = Vector3::new(1.5, -0.8, 1.6);
        let mut hits = 0;
        for (row, column) in (0..40).flat_map(|row| (0..40).map(move |column| (row, column))) {
            let target = Vector3::new(-0.6 + 0.03 * f64::from(column), 0.0, 0.4 + 0.03 * f64::from(row));
            let direction = (target - eye).normalize();
            let ray = Ray::new(vector(&eye), vector(&direction));
            let each = surfaces.geoms.iter().filter_map(|(collider, color)| {
                let hit = collider.shape().cast_ray_and_get_normal(collider.position(), &ray, REACH, true)?;
                Some((hit.time_of_impact, coordinates(hit.normal), *color))
            });
            let nearest = each.min_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(surfaces.cast(&eye, &direction), nearest, "row {row}, column {column}");
            hits += usize::from(nearest.is_some());
        }
        assert!(hits > 400, "{hits} of 1600 rays meet something");
    }
}
