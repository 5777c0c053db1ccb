//! The plant as a controller sees it: measure, apply torque, repeat.

use std::fmt;

use aforce::{JointVector, Measurement, Pose, Twist, Vector3, Wrench};
use thiserror::Error;

use crate::contact::ContactReading;
use crate::engine::{Engine, Surfaces};
use crate::friction::DryFriction;
use crate::gripper::{FINGER_JOINTS, Gripper};
use crate::model::{GRAVITY, Model};
use crate::plant::Plant;
use crate::scene::Scene;
use crate::solid::Solid;
use crate::stop::ArmStops;

mod placing;

/// The state of a simulation stopped being finite or plausible.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("the simulation diverged")]
pub struct Diverged;

/// Two geoms that overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// Their names.
    pub geoms: [String; 2],
    /// How deep one is in the other (m).
    pub depth: f64,
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b] = &self.geoms;
        write!(f, "geoms {a:?} and {b:?} overlap by {:.3} mm", 1e3 * self.depth)
    }
}

/// An external force on a moving body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// Index of the body.
    pub body: usize,
    /// Where it acts (m, in the body's frame): the point moves with the body.
    pub point: Vector3,
    /// N, world.
    pub force: Vector3,
}

/// Longest step of the engine (s). The joints' end stops and the contacts are too stiff for a longer one: it creates energy.
const LONGEST_STEP: f64 = 0.002;

/// A joint faster than this (rad/s) counts as a divergence: it is more than ten times the limit of any built-in robot.
const MAX_JOINT_SPEED: f64 = 100.0;

/// An arm with its tool in a scene.
pub struct Simulation {
    engine: Engine,
    model: Model,
    stops: ArmStops,
    friction: DryFriction,
    solids: Vec<Solid>,
    /// Length of a step (s), and the number of the engine's steps in it.
    dt: f64,
    parts: usize,
    /// Cut-offs of the filtered and the sustained wrench (Hz).
    cutoffs: [f64; 2],
    gripper: Option<Gripper>,
    /// Places of the left and the right finger among the engine's joints.
    fingers: Option<[usize; 2]>,
    /// The arm after the last step, no wrench on it.
    arm: Measurement,
    contact: ContactReading,
    /// Readings after each of the engine's steps in the last step.
    contacts: Vec<ContactReading>,
    /// External efforts (Nm or N), one per joint of the engine.
    loads: Vec<f64>,
    /// External force on the controlled point (N, world).
    push: Vector3,
    /// Another external force, on any moving body.
    hand: Option<Push>,
    /// The body that carries the controlled point.
    tool: usize,
    /// Mass of the payload at the controlled point, which the model does not know (kg).
    payload: f64,
    /// Work space: one effort per joint of the engine.
    efforts: Vec<f64>,
    /// Steps since the last reset.
    steps: u64,
}

impl Simulation {
    /// Simulates `scene`, whose controlled point lies at `offset` in the body `tool`, one step being
    /// `plant.dt` long.
    ///
    /// # Panics
    /// If `plant.dt` is not above 0 and finite, the scene is wrong ([`Scene::check`] says so without a panic), or `tool` is not
    /// on the arm; as [`Model::new`].
    pub fn new(scene: &Scene, tool: usize, offset: [f64; 3], plant: &Plant) -> Self {
        assert!(plant.dt > 0.0 && plant.dt.is_finite(), "a step of {} s", plant.dt);
        scene.check().unwrap_or_else(|wrong| panic!("{wrong}"));
        let config = plant.config;
        let parts = (plant.dt / LONGEST_STEP).ceil() as usize;
        let scene_as_it_is = plant.deviation.of(scene, tool, offset);
        let engine_dt = plant.dt / parts as f64;
        let mut engine = Engine::new(&scene_as_it_is, engine_dt, config.substeps);
        let place = |joint: &str| engine.axes().iter().position(|axis| axis.name == joint);
        let [left, right] = FINGER_JOINTS.map(place);
        let fingers = left.zip(right).map(|(left, right)| [left, right]);
        let model = Model::new(scene, tool, offset);
        let inertias = engine.inertias();
        let resting = JointVector::zeros();
        Simulation {
            arm: model.measure(resting, resting, Wrench::zeros()),
            loads: vec![0.0; engine.axes().len()],
            push: Vector3::zeros(),
            hand: None,
            tool: scene.moving_root(tool).0.expect("the tool is carried by the arm"),
            payload: plant.deviation.payload,
            efforts: vec![0.0; engine.axes().len()],
            friction: DryFriction::new(engine.axes(), &inertias, model.joints(), engine_dt),
            stops: ArmStops::new(&model, engine.axes(), engine_dt),
            engine,
            model,
            solids: scene_as_it_is.solids(),
            dt: plant.dt,
            parts,
            cutoffs: [config.force_cutoff_hz, config.sustained_cutoff_hz],
            gripper: fingers.map(|_| Gripper::default()),
            fingers,
            contact: ContactReading::default(),
            contacts: vec![ContactReading::default(); parts],
            steps: 0,
        }
    }

    /// Length of one step (s).
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Index of the body that carries the controlled point.
    pub fn tool(&self) -> usize {
        self.tool
    }

    /// Time since the last reset (s): the clock of a script.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.dt
    }

    /// The arm's own rigid-body model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Loads joint `i` (its place in the scene, arm first) with an external effort (Nm or N), until it is set again or the
    /// simulation is reset.
    ///
    /// # Panics
    /// If there is no such joint. Likewise every method that takes the place of a joint, a geom or a body.
    pub fn set_load(&mut self, i: usize, effort: f64) {
        self.loads[i] = effort;
    }

    /// Pushes the controlled point with `force` (N, world) until it is set again or the simulation is reset.
    pub fn set_push(&mut self, force: &Vector3) {
        self.push = *force;
    }

    /// Pushes any moving body, besides [`set_push`](Self::set_push), until it is set again or the simulation is reset.
    ///
    /// # Panics
    /// In the next step, if the body is fixed.
    pub fn set_hand(&mut self, push: Option<Push>) {
        self.hand = push;
    }

    /// Joint angles (rad) and velocities (rad/s) of the arm.
    pub fn joints(&self) -> (JointVector, JointVector) {
        (self.arm.q, self.arm.qd)
    }

    /// Position and velocity of any joint (rad, rad/s or m, m/s), by its place in the scene (arm first): [`Scene::joint`].
    pub fn joint(&self, i: usize) -> (f64, f64) {
        self.engine.coordinate(i)
    }

    /// Position (m) and velocity (m/s) of the left and the right finger; `None` for an arm without a gripper.
    pub fn fingers(&self) -> Option<[(f64, f64); 2]> {
        self.fingers.map(|fingers| fingers.map(|finger| self.engine.coordinate(finger)))
    }

    /// What the controller reads. The wrench is the filtered one.
    pub fn measure(&self) -> Measurement {
        Measurement { wrench: self.contact.filtered, ..self.arm.clone() }
    }

    /// Velocity of the tool point (m/s, world).
    pub fn tool_velocity(&self) -> Vector3 {
        self.arm.twist.fixed_rows::<3>(0).into()
    }

    /// Kinetic and potential energy of the arm and of the payload that it carries (J); the potential energy is zero at z = 0.
    pub fn energy(&self) -> f64 {
        let Measurement { q, qd, pose, twist, .. } = &self.arm;
        let speed = twist.fixed_rows::<3>(0).norm();
        let payload = self.payload * (0.5 * speed * speed + GRAVITY * pose.translation.z);
        self.model.energy(q, qd) + payload
    }

    /// Updates the arm's measurement from the engine's joint positions and velocities.
    fn look(&mut self) {
        let joints = self.model.joints();
        let joint = |i, _| if i < joints { self.engine.coordinate(i) } else { (0.0, 0.0) };
        let (q, qd) = (JointVector::from_fn(|i, j| joint(i, j).0), JointVector::from_fn(|i, j| joint(i, j).1));
        self.arm = self.model.measure(q, qd, Wrench::zeros());
    }

    /// Advances by one step under joint torques `tau` (Nm); the gripper follows the sign
    /// of `grip` (-1 opens, +1 closes).
    ///
    /// # Errors
    /// If the state stops being finite or a joint of the arm turns at 100 rad/s or faster. The engine may have removed bodies then:
    /// build a new simulation.
    pub fn step(&mut self, tau: &JointVector, grip: f64) -> Result<(), Diverged> {
        for part in 0..self.parts {
            self.advance(tau, grip, self.dt / self.parts as f64)?;
            self.contacts[part] = self.contact;
        }
        self.steps += 1;
        Ok(())
    }

    /// Advances by one of the engine's steps, of `dt` seconds.
    fn advance(&mut self, tau: &JointVector, grip: f64, dt: f64) -> Result<(), Diverged> {
        self.efforts.fill(0.0);
        let joints = self.model.joints();
        self.efforts[..joints].copy_from_slice(&tau.as_slice()[..joints]);
        if let (Some(gripper), Some(fingers)) = (&mut self.gripper, self.fingers) {
            let efforts = gripper.update(grip, fingers.map(|finger| self.engine.coordinate(finger).0), dt);
            for (finger, effort) in fingers.into_iter().zip(efforts) {
                self.efforts[finger] = effort;
            }
        }
        for (i, effort) in self.efforts.iter_mut().enumerate() {
            let axis = &self.engine.axes()[i];
            let (q, qd) = self.engine.coordinate(i);
            *effort += self.loads[i] + axis.stop.effort(axis.range, q, qd) + axis.spring_effort(q);
        }
        self.engine.add_drag(&mut self.efforts);
        if !self.efforts.iter().all(|e| e.is_finite()) {
            return Err(Diverged);
        }
        let driven = JointVector::from_fn(|i, _| if i < joints { self.efforts[i] } else { 0.0 });
        let stopped = driven + self.stops.torque(&self.arm, &driven);
        self.efforts[..joints].copy_from_slice(&stopped.as_slice()[..joints]);
        self.friction.apply(&self.arm, |i| self.engine.coordinate(i).1, &mut self.efforts);
        if self.push != Vector3::zeros() {
            self.engine.push(self.tool, &self.push, &self.arm.pose.translation.vector);
        }
        if let Some(Push { body, point, force }) = self.hand {
            let pose = self.engine.pose(body);
            self.engine.push(body, &force, &(pose.translation.vector + pose.rotation * point));
        }
        self.engine.step(&self.efforts);
        self.look();
        self.friction.learn(|i| self.engine.coordinate(i).1);

        let plausible = self.arm.qd.iter().all(|qd| qd.abs() < MAX_JOINT_SPEED);
        if !self.engine.is_plausible() || !plausible {
            return Err(Diverged);
        }
        let contacts = self.engine.arm_contacts(&self.arm.pose.translation.vector);
        self.contact.update(&contacts, self.cutoffs, dt);
        Ok(())
    }

    /// The contact reading at the end of the last step.
    pub fn contact(&self) -> &ContactReading {
        &self.contact
    }

    /// Contact readings after each of the equally long engine steps in the last step. At control rates of 500 Hz and
    /// above there is one.
    pub fn contacts(&self) -> &[ContactReading] {
        &self.contacts
    }

    /// World pose of a moving body.
    ///
    /// # Panics
    /// If it is fixed.
    pub fn body_pose(&self, body: usize) -> Pose {
        self.engine.pose(body)
    }

    /// Velocity of a moving body (m/s, rad/s; world axes), linear at its centre of mass.
    pub fn body_velocity(&self, body: usize) -> Twist {
        self.engine.velocity(body)
    }

    /// Velocity of a moving body (m/s, rad/s; world axes), linear at its point that is now at `point` (m, world).
    pub fn body_velocity_at(&self, body: usize, point: &Vector3) -> Twist {
        self.engine.velocity_at(body, point)
    }

    /// Whether two geoms (by their place in the scene) press on each other.
    pub fn touching(&self, a: usize, b: usize) -> bool {
        self.contact_points(a, b) > 0
    }

    /// Number of points at which two geoms (by their place in the scene) press on each other.
    pub fn contact_points(&self, a: usize, b: usize) -> usize {
        self.engine.contact_points(a, b)
    }

    /// Deepest overlap of geoms in contact (m), at the start of the engine's last step. The travel of a soft layer does
    /// not count.
    pub fn deepest_penetration(&self) -> f64 {
        self.engine.deepest_penetration()
    }

    /// Deepest overlap of any two geoms that may touch (m), as they stand now. A soft layer counts as hard.
    pub fn overlap(&self) -> f64 {
        self.engine.overlap()
    }

    /// Geoms that may touch and overlap by more than `allowed` (m) as they stand now. A task's start should have none, because the
    /// engine pushes such geoms apart with forces that no robot has. A soft layer counts as hard.
    pub fn overlaps(&self, allowed: f64) -> Vec<Overlap> {
        let name = |geom: usize| self.solids[geom].name.clone();
        let found = self.engine.overlaps(allowed).into_iter();
        found.map(|(geoms, depth)| Overlap { geoms: geoms.map(name), depth }).collect()
    }

    /// Every collision shape, for drawing; [`Simulation::body_pose`] gives the pose of its body.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// Every collision shape at its present pose, for ray casting.
    pub fn surfaces(&self) -> Surfaces<'_> {
        self.engine.surfaces()
    }
}
