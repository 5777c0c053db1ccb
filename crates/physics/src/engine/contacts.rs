//! The contacts, and their forces.

use aforce::{Vector3, Wrench};
use rapier3d_f64::dynamics::IntegrationParameters;
use rapier3d_f64::geometry::{ColliderHandle, Contact, ContactManifold, ContactPair};
use rapier3d_f64::pipeline::PhysicsWorld;

use super::Engine;
use crate::scene::Role;

/// The contacts of the arm in the last step. The force of the wiping tool's pad is that at the beginning of the next step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ArmContacts {
    /// Wrench on all geoms beyond the wrist (world axes, torque about the point asked for); `None` without contact.
    pub beyond_wrist: Option<Wrench>,
    /// Sum over the contacts of the links short of the wrist of the size of the force (N), so that opposite forces do not cancel.
    pub on_links: f64,
    /// Whether the scene presses on a link.
    pub scene_on_links: bool,
    /// Whether two parts of the arm press on each other.
    pub itself: bool,
}

impl Engine {
    /// The contacts of the arm in the last step, torques about `point` (m, world). The force of a link on the hand counts as a
    /// force on the hand.
    pub fn arm_contacts(&self, point: &Vector3) -> ArmContacts {
        let mut contacts = ArmContacts::default();
        for pair in self.world.narrow_phase.contact_pairs() {
            // The engine also lists pairs that are near each other without contact; these have no impulse.
            let (Some(first), Some(second)) = (self.role(pair.collider1), self.role(pair.collider2)) else { continue };
            let (ours, others) = (first.is_on_arm(), second.is_on_arm());
            if !(ours || others) || !pressing(pair) {
                continue;
            }
            contacts.itself |= ours && others;
            let (hand, other_hand) = (first.is_beyond_wrist(), second.is_beyond_wrist());
            if hand != other_hand {
                let on_first = self.contact_wrench(pair, point);
                *contacts.beyond_wrist.get_or_insert_default() += if hand { on_first } else { -on_first };
            } else if !hand {
                contacts.on_links += self.contact_wrench(pair, point).fixed_rows::<3>(0).norm();
                contacts.scene_on_links |= ours != others;
            }
        }
        for touch in self.soft_touches() {
            let torque = (touch.point - point).cross(&touch.force);
            let wrench = Wrench::from_iterator(touch.force.iter().chain(&torque).copied());
            *contacts.beyond_wrist.get_or_insert_default() += wrench;
        }
        contacts
    }

    /// Wrench on the first collider of a pair (N, Nm; world axes, torque about `point`).
    fn contact_wrench(&self, pair: &ContactPair, point: &Vector3) -> Wrench {
        let IntegrationParameters { dt, num_solver_iterations: substeps, .. } = self.world.integration_parameters;
        let [frame, other] = [pair.collider1, pair.collider2].map(|of| self.world.colliders[of].position());
        let mut wrench = Wrench::zeros();
        for manifold in pair.solver_manifolds() {
            let frame = manifold.subshape_pos1().map_or(*frame, |sub| *frame * *sub);
            let other = manifold.subshape_pos2().map_or(*other, |sub| *other * *sub);
            for contact in solved(manifold) {
                // The stored normal impulse is that of the whole step, the stored tangential impulse that of the last substep.
                // The tangential impulse is the point's own only because one of the pair belongs to a multibody: between
                // other bodies the engine stores the friction of all points at each point.
                let friction = contact.data.warmstart_tangent_world * substeps as f64;
                let force = (friction - manifold.data.normal * contact.data.impulse) / dt;
                let force = Vector3::new(force.x, force.y, force.z);
                // The solver applies the force midway between the points of the two shapes, which are up to 1 mm apart where shapes slide.
                let at = (frame * contact.local_p1 + other * contact.local_p2) * 0.5;
                let torque = (Vector3::new(at.x, at.y, at.z) - point).cross(&force);
                wrench += Wrench::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
            }
        }
        wrench
    }

    /// Number of points at which geoms `a` and `b` (indices in the scene's order) press on
    /// each other.
    pub fn contact_points(&self, a: usize, b: usize) -> usize {
        let (a, b) = (self.geoms[a].0, self.geoms[b].0);
        if self.soft_layer.as_ref().is_some_and(|layer| layer.between(a, b)) {
            return self.soft_touches().filter(|touch| touch.geom == a || touch.geom == b).count();
        }
        let pair = self.world.narrow_phase.contact_pair(a, b);
        let points = pair.into_iter().flat_map(|pair| pair.solver_manifolds()).flat_map(solved);
        points.filter(|point| point.data.impulse > 0.0).count()
    }

    /// Deepest overlap (m) of any two geoms that may touch, at the start of the last step; 0 without contact. The travel of
    /// a soft layer does not count as overlap.
    pub fn deepest_penetration(&self) -> f64 {
        let pairs = self.world.narrow_phase.contact_pairs();
        pairs.map(|pair| depth(pair) - self.travel(pair)).fold(0.0, f64::max)
    }

    /// Deepest overlap (m) of the geoms as they stand now, found by stepping a copy of the world. A soft layer
    /// counts as hard.
    pub fn overlap(&self) -> f64 {
        let world = self.stepped();
        world.narrow_phase.contact_pairs().map(depth).fold(0.0, f64::max)
    }

    /// Pairs of geoms (in the order of the scene) that may touch and overlap by more than `allowed` (m) as they stand now,
    /// and by how much. A soft layer counts as hard.
    pub fn overlaps(&self, allowed: f64) -> Vec<([usize; 2], f64)> {
        let place = |collider| self.geoms.iter().position(|&(handle, _)| handle == collider).expect("a geom");
        let world = self.stepped();
        let pairs = world.narrow_phase.contact_pairs().map(|pair| (pair, depth(pair)));
        let deep = pairs.filter(|&(_, depth)| depth > allowed);
        let mut found: Vec<_> =
            deep.map(|(pair, depth)| ([pair.collider1, pair.collider2].map(place), depth)).collect();
        found.iter_mut().for_each(|(pair, _)| pair.sort_unstable());
        found.sort_by_key(|&(pair, _)| pair);
        found
    }

    fn stepped(&self) -> PhysicsWorld {
        let mut copy = copy(&self.world);
        copy.step();
        copy
    }

    /// How far a soft layer between the two gives way (m); 0 without one.
    fn travel(&self, pair: &ContactPair) -> f64 {
        let layer = self.soft_layer.as_ref().filter(|layer| layer.between(pair.collider1, pair.collider2));
        layer.map_or(0.0, |layer| layer.pad.travel)
    }

    pub(super) fn role(&self, collider: ColliderHandle) -> Option<Role> {
        self.roles.get(collider.into_raw_parts().0 as usize).copied().flatten()
    }
}

/// Deepest overlap of a pair (m), at the start of the step that found it; negative where it is apart.
fn depth(pair: &ContactPair) -> f64 {
    let points = pair.manifolds().iter().flat_map(|manifold| &manifold.points);
    points.map(|point| -point.dist).fold(f64::NEG_INFINITY, f64::max)
}

/// The points of a manifold that the last step solved. The engine solves at most four, and none that is too far away. The others keep the
/// impulse of the step that solved them last, which no longer acts.
fn solved(manifold: &ContactManifold) -> impl Iterator<Item = &Contact> {
    let solved = &manifold.data.solver_contacts;
    let is_solved = |at: usize| solved.iter().any(|contact| contact.contact_indices() == [at as u64]);
    manifold.points.iter().enumerate().filter(move |(at, _)| is_solved(*at)).map(|(_, contact)| contact)
}

/// Whether a pair pressed on each other in the last step.
fn pressing(pair: &ContactPair) -> bool {
    pair.solver_manifolds().iter().flat_map(solved).any(|contact| contact.data.impulse > 0.0)
}

/// Copies the world field by field, because the engine's type cannot be cloned.
fn copy(world: &PhysicsWorld) -> PhysicsWorld {
    let mut copy = PhysicsWorld::new();
    copy.gravity = world.gravity;
    copy.integration_parameters = world.integration_parameters;
    copy.islands = world.islands.clone();
    copy.broad_phase = world.broad_phase.clone();
    copy.narrow_phase = world.narrow_phase.clone();
    copy.bodies = world.bodies.clone();
    copy.colliders = world.colliders.clone();
    copy.impulse_joints = world.impulse_joints.clone();
    copy.multibody_joints = world.multibody_joints.clone();
    copy.soft_bodies = world.soft_bodies.clone();
    copy
}
