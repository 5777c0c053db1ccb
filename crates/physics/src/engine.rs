//! The Rapier world behind a simulation. Only this module and `scene/hull.rs` use the engine's types: the latter finds
//! convex hulls with the engine's geometry library.

mod contacts;
mod convert;
mod drag;
#[cfg(test)]
mod insertion;
mod pad;
mod rays;
mod surfaces;

use aforce::{Pose, Twist, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use rapier3d_f64::dynamics::{
    GenericJointBuilder, IntegrationParameters, JointAxesMask, MassProperties, MultibodyJointHandle, RigidBodyBuilder,
    RigidBodyHandle, SpringCoefficients,
};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle};
use rapier3d_f64::math as rapier;
use rapier3d_f64::pipeline::PhysicsWorld;
use rapier3d_f64::prelude::CoefficientCombineRule;

pub(crate) use self::contacts::ArmContacts;
use self::convert::{coordinates, from_engine, groups, matrix, shared_shape, to_engine, vector};
use self::drag::Mover;
use self::pad::SoftLayer;
pub use self::surfaces::Surfaces;
pub(crate) use self::surfaces::ground_below;
use crate::model::GRAVITY;
use crate::scene::{Axis, Inertial, Joint, Role, Scene};

/// Approach speed up to which a contact is foreseen (m/s), unless the scene gives a distance. The Panda's flange
/// reaches 1.7. Bodies that approach faster overlap for a step.
const FASTEST_APPROACH: f64 = 2.0;
/// A body this fast (m/s) shows that the simulation has diverged.
const MAX_BODY_SPEED: f64 = 1000.0;

/// Hard surfaces: a firm grasp penetrates by less than 0.1 mm.
const SOFTNESS: SpringCoefficients<f64> = SpringCoefficients { natural_frequency: 200.0, damping_ratio: 5.0 };

/// A joint of the scene in the engine.
#[derive(Clone, Copy)]
struct EngineJoint {
    handle: MultibodyJointHandle,
    child: RigidBodyHandle,
    /// `None` when the parent is the world.
    parent: Option<RigidBodyHandle>,
    /// Coordinate index in the engine: 0 for slides, 3 for hinges.
    coordinate: usize,
    /// Joint axis in the child's frame.
    direction: Vector3,
    /// Whether the joint moves a shape of the arm or its tool ([`Scene::is_arm_joint`]).
    is_arm: bool,
}

impl EngineJoint {
    /// Which part of a velocity or a load its coordinate is: 0 linear, 1 rotation.
    fn part(&self) -> usize {
        usize::from(self.coordinate == 3)
    }
}

/// A simulated scene.
pub(crate) struct Engine {
    world: PhysicsWorld,
    /// The rigid body of each moving scene body.
    bodies: Vec<Option<RigidBodyHandle>>,
    /// In the order of [`Engine::axes`].
    joints: Vec<EngineJoint>,
    axes: Vec<Axis>,
    /// Position (rad or m) and velocity of each joint, as the engine has them: looking them up there costs more.
    coordinates: Vec<(f64, f64)>,
    /// Collider and colour of each geom, in the order of the scene.
    geoms: Vec<(ColliderHandle, [u8; 3])>,
    /// Role by raw collider index.
    roles: Vec<Option<Role>>,
    /// The bodies that the air slows down.
    movers: Vec<Mover>,
    /// The soft layer of the tool, if it has one.
    soft_layer: Option<SoftLayer>,
}

impl Engine {
    /// `scene` in steps of `dt` (s), each of `substeps` substeps.
    pub fn new(scene: &Scene, dt: f64, substeps: usize) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = rapier::Vector::new(0.0, 0.0, -GRAVITY);
        world.integration_parameters = IntegrationParameters {
            dt,
            num_solver_iterations: substeps,
            // A sweep over all contacts leaves about half of the error. The first pass also corrects positions. The
            // second pass solves for velocities alone and takes out the momentum of an impact: with one sweep in it a
            // cube that falls flat lands spinning and slides 0.3 mm. With fewer sweeps a hand pressed on a table
            // chatters.
            num_internal_pgs_iterations: 4,
            num_internal_stabilization_iterations: 6,
            // Pairs that will not meet in this step need no constraint.
            normalized_prediction_distance: scene.prediction.unwrap_or(FASTEST_APPROACH * dt),
            contact_softness: SOFTNESS,
            static_contact_softness: SOFTNESS,
            // Recycled contacts let a grasped object creep by 0.7 mm/s.
            contact_recycling: false,
            ..IntegrationParameters::default()
        };
        let mut engine = Engine {
            world,
            bodies: vec![None; scene.bodies.len()],
            joints: vec![],
            axes: vec![],
            coordinates: vec![],
            geoms: vec![],
            roles: vec![],
            movers: vec![],
            soft_layer: None,
        };
        for index in 0..scene.bodies.len() {
            engine.add_body(scene, index);
        }
        engine.finish_multibodies();
        engine.read_coordinates();
        engine.movers = engine.movers(scene);
        engine.soft_layer = scene.pad.as_ref().map(|pad| engine.add_soft_layer(pad));
        engine
    }

    fn add_body(&mut self, scene: &Scene, index: usize) {
        let body = &scene.bodies[index];
        match &body.joint {
            Joint::Fixed => {}
            Joint::Free => {
                self.bodies[index] = Some(self.insert_dynamic(&body.pose, &scene.merged_inertial(index)));
            }
            Joint::Hinge(axis) => self.add_axis(scene, index, axis, JointAxesMask::LOCKED_REVOLUTE_AXES, 3),
            Joint::Slide(axis) => self.add_axis(scene, index, axis, JointAxesMask::LOCKED_PRISMATIC_AXES, 0),
        }
        let (root, root_pose) = scene.moving_root(index);
        let parent = root.map(|root| self.bodies[root].expect("parents come first"));
        for geom in &body.geoms {
            let collider = ColliderBuilder::new(shared_shape(&geom.shape))
                .position(to_engine(&(root_pose * geom.pose)))
                .density(0.0)
                .friction(geom.friction)
                .friction_combine_rule(CoefficientCombineRule::Max)
                .collision_groups(groups(geom.role, &scene.never_touch));
            let handle = self.world.insert_collider(collider, parent);
            self.geoms.push((handle, geom.color));
            let raw = handle.into_raw_parts().0 as usize;
            self.roles.resize(self.roles.len().max(raw + 1), None);
            self.roles[raw] = Some(geom.role);
        }
    }

    fn insert_dynamic(&mut self, pose: &Pose, inertial: &Inertial) -> RigidBodyHandle {
        let com = inertial.com;
        let properties = MassProperties::with_inertia_matrix(vector(&com), inertial.mass, matrix(&inertial.inertia));
        let body =
            RigidBodyBuilder::dynamic().pose(to_engine(pose)).additional_mass_properties(properties).can_sleep(false);
        self.world.insert_body(body)
    }

    fn add_axis(&mut self, scene: &Scene, index: usize, axis: &Axis, locked: JointAxesMask, coordinate: usize) {
        let body = &scene.bodies[index];
        let child = self.insert_dynamic(&Pose::identity(), &scene.merged_inertial(index));
        let (root, pose) = match body.parent {
            Some(parent) => scene.moving_root(parent),
            None => (None, Pose::identity()),
        };
        // A mechanism that stands on the world gets a root of its own: bodies that share
        // one become one multibody, and its cost grows with the square of its joints.
        let parent = root.map(|root| self.bodies[root].expect("parents come first"));
        let anchor = parent.unwrap_or_else(|| self.world.insert_body(RigidBodyBuilder::fixed()));
        let align = UnitQuaternion::rotation_between(&Vector3::x(), &axis.direction)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
        let joint = GenericJointBuilder::new(locked)
            .local_frame1(to_engine(&(pose * body.pose * align)))
            .local_frame2(to_engine(&Pose::from_parts(Translation3::identity(), align)))
            .build();
        let handle = self.world.insert_multibody_joint(anchor, child, joint).expect("scenes are trees");
        self.bodies[index] = Some(child);
        let direction = axis.direction.into_inner();
        let is_arm = scene.is_arm_joint(index);
        self.joints.push(EngineJoint { handle, child, parent, coordinate, direction, is_arm });
        self.axes.push(axis.clone());
    }

    /// Joint parameters can be written only once mass and degrees of freedom are known.
    fn finish_multibodies(&mut self) {
        let PhysicsWorld { bodies, colliders, multibody_joints, .. } = &mut self.world;
        for handle in self.bodies.iter().flatten() {
            bodies[*handle].recompute_mass_properties_from_colliders(colliders);
        }
        for joint in &self.joints {
            let (multibody, _) = multibody_joints.get_mut(joint.handle).expect("inserted above");
            multibody.forward_kinematics(bodies, true);
            multibody.update_rigid_bodies(bodies, true);
            multibody.set_self_contacts_enabled(false);
        }
        // Parts of the arm collide with each other as their roles say; a door does not collide with its handle. The
        // flag is set at each joint of the arm that moves a shape, because the last joint may move none.
        for joint in self.joints.iter().filter(|joint| joint.is_arm) {
            let (multibody, _) = multibody_joints.get_mut(joint.handle).expect("inserted above");
            multibody.set_self_contacts_enabled(true);
        }
        // Dry friction is added to the efforts, in `friction.rs`.
        for (joint, axis) in self.joints.iter().zip(&self.axes) {
            let (multibody, link) = multibody_joints.get_mut(joint.handle).expect("inserted above");
            let dof = multibody.link(link).expect("inserted above").assembly_id();
            // By default the engine damps the rotation of a free body that carries joints. A scene has no such damping.
            let of_root = multibody.root().joint().ndofs();
            multibody.damping_mut().rows_mut(0, of_root).fill(0.0);
            multibody.damping_mut()[dof] = axis.damping;
            multibody.armature_mut()[dof] = axis.armature;
        }
    }

    /// The joints, in the order in which coordinates and efforts are given.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Position (rad or m) and velocity of joint `i`.
    pub fn coordinate(&self, i: usize) -> (f64, f64) {
        self.coordinates[i]
    }

    /// Inertia (kg m2 or kg) of each joint as the bodies stand, 1/(M^-1)_ii: all other joints are free to move.
    pub fn inertias(&mut self) -> Vec<f64> {
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        let inertia = |joint: &EngineJoint| {
            let (multibody, link) = multibody_joints.get_mut(joint.handle).expect("never removed");
            let dof = multibody.link(link).expect("never removed").assembly_id();
            1.0 / multibody.dof_inverse_inertia(bodies)[dof]
        };
        self.joints.iter().map(inertia).collect()
    }

    fn read_coordinates(&mut self) {
        let Engine { world, joints, coordinates, .. } = self;
        coordinates.clear();
        coordinates.extend(joints.iter().map(|joint| {
            let (multibody, link) = world.multibody_joints.get(joint.handle).expect("never removed");
            let link = multibody.link(link).expect("never removed");
            (link.joint().coords()[joint.coordinate], multibody.generalized_velocity()[link.assembly_id()])
        }));
    }

    /// Puts joint `i` at `q`, moving with `qd`. Call [`Engine::settle`] after the last.
    pub fn set_coordinate(&mut self, i: usize, q: f64, qd: f64) {
        let joint = self.joints[i];
        let (multibody, id) = self.world.multibody_joints.get_mut(joint.handle).expect("never removed");
        let link = multibody.link_mut(id).expect("never removed");
        let dof = link.assembly_id();
        let now = link.joint.coords()[joint.coordinate];
        link.joint.apply_displacement(&[q - now]);
        multibody.generalized_velocity_mut()[dof] = qd;
    }

    /// Moves the bodies to the poses that the joints' positions give.
    pub fn settle(&mut self) {
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        for joint in &self.joints {
            let (multibody, _) = multibody_joints.get_mut(joint.handle).expect("never removed");
            multibody.forward_kinematics(bodies, false);
            multibody.update_rigid_bodies(bodies, true);
        }
        self.read_coordinates();
    }

    /// World pose of a moving scene body.
    pub fn pose(&self, body: usize) -> Pose {
        from_engine(self.world.bodies[self.bodies[body].expect("a moving body")].position())
    }

    /// Velocity of a moving scene body, world axes; linear at the body's point that is now at `point` (world).
    pub fn velocity_at(&self, body: usize, point: &Vector3) -> Twist {
        let [at, v, omega] = self.motion(self.bodies[body].expect("a moving body"));
        let v = v + omega.cross(&(point - at));
        Twist::new(v.x, v.y, v.z, omega.x, omega.y, omega.z)
    }

    /// Velocity of a moving scene body, world axes; linear at its centre of mass.
    pub fn velocity(&self, body: usize) -> Twist {
        let handle = self.bodies[body].expect("a moving body");
        let com = coordinates(self.world.bodies[handle].center_of_mass());
        self.velocity_at(body, &com)
    }

    /// A point of a body (m), its velocity (m/s) and the angular velocity (rad/s), world axes. For a body on a joint
    /// they are computed from the joints' velocities, because the engine's own are a step old there.
    fn motion(&self, body: RigidBodyHandle) -> [Vector3; 3] {
        let Some(i) = self.joints.iter().position(|joint| joint.child == body) else {
            return self.free_motion(body);
        };
        let joint = &self.joints[i];
        let pose = from_engine(self.world.bodies[body].position());
        let origin = pose.translation.vector;
        let mut velocity = joint.parent.map_or([Vector3::zeros(); 2], |parent| {
            let [at, v, omega] = self.motion(parent);
            [v + omega.cross(&(origin - at)), omega]
        });
        velocity[joint.part()] += pose.rotation * joint.direction * self.coordinate(i).1;
        [origin, velocity[0], velocity[1]]
    }

    /// As [`motion`](Self::motion), of a body that moves freely. One that carries joints is the root of a multibody, of
    /// which the first six velocities are the body's: linear and angular, world axes. The engine moves the body's origin
    /// with the linear one. The velocity that the engine keeps with such a body is a step old.
    fn free_motion(&self, body: RigidBodyHandle) -> [Vector3; 3] {
        let multibodies = &self.world.multibody_joints;
        let rigid = &self.world.bodies[body];
        let Some(link) = multibodies.rigid_body_link(body) else {
            return [rigid.center_of_mass(), rigid.linvel(), rigid.angvel()].map(coordinates);
        };
        let v = multibodies.get_multibody(link.multibody).expect("never removed").generalized_velocity();
        [coordinates(rigid.translation()), Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5])]
    }

    /// Puts a free body at rest at `pose`, and with it what joints carry on it.
    pub fn place(&mut self, body: usize, pose: &Pose) {
        let handle = self.bodies[body].expect("a moving body");
        let PhysicsWorld { bodies, multibody_joints, .. } = &mut self.world;
        let body = &mut bodies[handle];
        body.set_position(to_engine(pose), true);
        body.set_linvel(rapier::Vector::ZERO, true);
        body.set_angvel(rapier::Vector::ZERO, true);
        let Some(link) = multibody_joints.rigid_body_link(handle).copied() else { return };
        let multibody = multibody_joints.get_multibody_mut(link.multibody).expect("never removed");
        multibody.generalized_velocity_mut().fill(0.0);
        multibody.forward_kinematics(bodies, true);
        multibody.update_rigid_bodies(bodies, true);
        self.read_coordinates();
    }

    /// Advances by one step with `efforts` (Nm or N) on the joints.
    ///
    /// An effort acts as equal and opposite torques (or forces along one line) on child
    /// and parent: the engine has no generalized forces, and this yields exactly the
    /// effort on that coordinate and nothing on the others.
    pub fn step(&mut self, efforts: &[f64]) {
        let bodies = &mut self.world.bodies;
        for (joint, &effort) in self.joints.iter().zip(efforts) {
            let child = &mut bodies[joint.child];
            let push = child.rotation() * vector(&joint.direction) * effort;
            if joint.coordinate == 3 {
                child.add_torque(push, true);
                if let Some(parent) = joint.parent {
                    bodies[parent].add_torque(-push, true);
                }
            } else {
                let at = child.center_of_mass();
                child.add_force(push, true);
                if let Some(parent) = joint.parent {
                    bodies[parent].add_force_at_point(-push, at, true);
                }
            }
        }
        self.push_on_soft_layer();
        match &self.soft_layer {
            Some(layer) => self.world.step_with_events(layer, &()),
            None => self.world.step(),
        }
        for handle in self.bodies.iter().flatten() {
            let body = &mut self.world.bodies[*handle];
            body.reset_forces(false);
            body.reset_torques(false);
        }
        self.read_coordinates();
    }

    /// Pushes a moving body at `point` with `force` (N; both world) in the next step.
    pub fn push(&mut self, body: usize, force: &Vector3, point: &Vector3) {
        let body = &mut self.world.bodies[self.bodies[body].expect("a moving body")];
        body.add_force_at_point(vector(force), vector(point), true);
    }

    /// Whether every body still has a finite state and a plausible speed.
    pub fn is_plausible(&self) -> bool {
        self.world.quarantine().is_empty()
            && self.bodies.iter().flatten().all(|&handle| {
                let body = &self.world.bodies[handle];
                body.is_enabled()
                    && body.translation().is_finite()
                    && body.rotation().is_finite()
                    && body.linvel().length() < MAX_BODY_SPEED
                    && body.angvel().is_finite()
            })
    }
}
