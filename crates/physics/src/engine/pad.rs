//! The soft layer of a tool. Within the layer's travel the force is computed here; beyond it the engine's contact acts.
//!
//! The engine has one softness for all contacts. Its solver is therefore given a distance between tool and surface that is
//! larger than the true one by the travel of the layer.

use aforce::Vector3;
use rapier3d_f64::geometry::{ColliderHandle, ContactManifold};
use rapier3d_f64::math as rapier;
use rapier3d_f64::pipeline::{ActiveHooks, ContactModificationContext, PhysicsHooks};

use super::Engine;
use super::convert::{coordinates, vector};
use crate::scene::{Pad, Role};

/// The friction of a point that slides slowly is viscous: in a step it stops at most this mass (kg). For eight points
/// together that is less than the effective mass of any arm at its tool, so that friction does not reverse the motion.
const RUBBED_MASS: f64 = 0.2;

/// A [`Pad`] in the engine.
pub(super) struct SoftLayer {
    pub pad: Pad,
    geoms: Vec<ColliderHandle>,
    surface: ColliderHandle,
    /// Memory for a step's touches, kept so that a step allocates none.
    touches: Vec<SoftTouch>,
}

impl SoftLayer {
    /// Whether the two are a geom of the tool and the surface.
    pub fn between(&self, a: ColliderHandle, b: ColliderHandle) -> bool {
        (self.surface == a && self.geoms.contains(&b)) || (self.surface == b && self.geoms.contains(&a))
    }
}

impl PhysicsHooks for SoftLayer {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        if !self.between(context.collider1, context.collider2) {
            return;
        }
        if let Some(manifold) = context.rigid_mut() {
            manifold.solver_contacts.iter_mut().for_each(|contact| contact.dist += self.pad.travel);
        }
    }
}

/// A point at which the layer gives way.
pub(super) struct SoftTouch {
    pub geom: ColliderHandle,
    /// World (m).
    pub point: Vector3,
    /// On the tool, world (N).
    pub force: Vector3,
}

impl Engine {
    /// Puts `pad` on the geoms of the tool. To be called when all geoms have been added.
    pub(super) fn add_soft_layer(&mut self, pad: &Pad) -> SoftLayer {
        let geoms = self.geoms.iter().map(|&(handle, _)| handle);
        let geoms: Vec<ColliderHandle> = geoms.filter(|&handle| self.role(handle) == Some(Role::Tool)).collect();
        for &geom in &geoms {
            self.world.colliders[geom].set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        }
        SoftLayer { pad: *pad, geoms, surface: self.geoms[pad.surface].0, touches: vec![] }
    }

    /// Applies the layer's forces to the tool in the next step.
    pub(super) fn push_on_soft_layer(&mut self) {
        let Some(layer) = &mut self.soft_layer else { return };
        let mut touches = std::mem::take(&mut layer.touches);
        touches.clear();
        touches.extend(self.soft_touches());
        for touch in &touches {
            let body = self.world.colliders[touch.geom].parent().expect("a tool is carried by the arm");
            self.world.bodies[body].add_force_at_point(vector(&touch.force), vector(&touch.point), true);
        }
        if let Some(layer) = &mut self.soft_layer {
            layer.touches = touches;
        }
    }

    /// The layer's forces at the present poses, at the points that the engine found in its last step.
    pub(super) fn soft_touches(&self) -> impl Iterator<Item = SoftTouch> {
        self.soft_layer.iter().flat_map(move |layer| {
            layer.geoms.iter().flat_map(move |&geom| {
                let pair = self.world.narrow_phase.contact_pair(geom, layer.surface);
                let manifolds = pair.into_iter().flat_map(move |pair| {
                    let tool_first = pair.collider1 == geom;
                    pair.manifolds().iter().map(move |manifold| (tool_first, manifold))
                });
                manifolds.flat_map(move |(tool_first, manifold)| self.touches_of(layer, geom, tool_first, manifold))
            })
        })
    }

    fn touches_of(
        &self,
        layer: &SoftLayer,
        geom: ColliderHandle,
        tool_first: bool,
        manifold: &ContactManifold,
    ) -> impl Iterator<Item = SoftTouch> {
        let colliders = &self.world.colliders;
        let (tool, surface) = (&colliders[geom], &colliders[layer.surface]);
        let body = &self.world.bodies[tool.parent().expect("a tool is carried by the arm")];
        let frame = *body.position() * *tool.position_wrt_parent().expect("it has a parent");
        let away = surface.rotation() * if tool_first { manifold.local_n2 } else { manifold.local_n1 };
        let friction = tool.friction().max(surface.friction());
        let (pad, dt) = (layer.pad, self.world.integration_parameters.dt);
        manifold.points.iter().filter_map(move |contact| {
            let (on_tool, on_surface) =
                if tool_first { (contact.local_p1, contact.local_p2) } else { (contact.local_p2, contact.local_p1) };
            let point = frame * on_tool;
            let depth = (*surface.position() * on_surface - point).dot(away);
            // The engine's velocity of a link is a step old (`Engine::motion`), the depth is of now. So the pad's damping and friction come a
            // step late.
            let velocity = body.velocity_at_point(point);
            let approach = -velocity.dot(away);
            let normal = if depth > 0.0 { pad.stiffness * depth + pad.damping * approach } else { 0.0 };
            let slip: rapier::Vector = velocity + away * approach;
            let drag = (RUBBED_MASS / dt).min(friction * normal / slip.length());
            (normal > 0.0).then(|| SoftTouch {
                geom,
                point: coordinates(point),
                force: coordinates(away * normal - slip * drag),
            })
        })
    }
}
