//! Kinematics and dynamics of the arm, computed independently of the physics engine.
//!
//! This is the model a controller would also have on a real arm: forward kinematics,
//! Jacobian, mass matrix (composite rigid bodies) and bias torque (recursive
//! Newton-Euler), after Featherstone, *Rigid Body Dynamics Algorithms*, chapters 5 and 6,
//! written in world coordinates. All arrays are on the stack.

use aforce::{Jacobian, JointMatrix, JointVector, Measurement, Pose, Vector3, Wrench};
use nalgebra::{Point3, UnitQuaternion};

use crate::gripper::INITIAL_OPENING;
use crate::scene::{Axis, Body, Inertial, Joint, Scene, at};

/// Acceleration of gravity, which acts along -z (m/s2).
pub const GRAVITY: f64 = 9.81;

/// The constant parameters of the arm.
#[derive(Debug, Clone)]
pub struct Model {
    /// Frame of link i in link i-1 (in the world for the first) at joint angle zero; the
    /// joint turns about the link's z.
    frames: [Pose; 7],
    /// Mass properties of each link with all that it carries, in the link frame.
    inertials: [Inertial; 7],
    /// Rotor inertia reflected to each joint (kg m2).
    armature: JointVector,
    /// The tool point in the frame of link 7.
    tool: Pose,
    /// Joints that move: 7, or 6 where link 7 is welded to link 6.
    joints: usize,
}

/// Entry of the mass matrix for the seventh joint that an arm of six does not have (kg m2). It couples with nothing, so any number above 0
/// will do.
const NO_JOINT: f64 = 1.0;

/// Where the links are.
#[derive(Debug, Clone, Copy)]
pub struct Kinematics {
    /// Link frames in the world.
    pub links: [Pose; 7],
    /// Unit vectors along the joints' axes in the world.
    pub axes: [Vector3; 7],
    /// The tool frame in the world.
    pub tool: Pose,
}

impl Model {
    /// Model of the arm in `scene` whose tool point lies at `offset` in the frame of the
    /// body `tool`. Fingers are welded at their initial opening: their motion of 2 cm
    /// changes the inertia of link 7 by at most 0.6 %.
    ///
    /// # Panics
    /// If the scene has no bodies link1 to link7, `tool` is not on the arm, one of links 1 to 6 has no hinge, or link 7 has neither a hinge
    /// nor a fixed joint.
    pub fn new(scene: &Scene, tool: usize, offset: [f64; 3]) -> Self {
        let links: [usize; 7] = std::array::from_fn(|i| scene.body(&format!("link{}", i + 1)));
        for (number, &link) in (1..).zip(&links) {
            let joint = &scene.bodies[link].joint;
            let fits = matches!(joint, Joint::Hinge(_)) || number == 7 && matches!(joint, Joint::Fixed);
            assert!(fits, "link{number} has {joint:?}; a hinge is wanted, and link 7 may be fixed");
        }
        let mut inertials = [Inertial::NONE; 7];
        for (index, body) in scene.bodies.iter().enumerate() {
            if let Some((link, pose)) = carrier(scene, index, &links) {
                inertials[link] = inertials[link].merged(&body.inertial.transformed(&pose));
            }
        }
        let base = scene.bodies[links[0]].parent.map_or(Pose::identity(), |b| scene.moving_root(b).1);
        let (_, tool) = carrier(scene, tool, &links).expect("the tool is carried by the arm");
        Model {
            frames: std::array::from_fn(|i| {
                let frame = scene.bodies[links[i]].pose;
                if i == 0 { base * frame } else { frame }
            }),
            inertials,
            armature: JointVector::from_fn(|i, _| axis(&scene.bodies[links[i]]).map_or(NO_JOINT, |axis| axis.armature)),
            tool: tool * at(offset),
            joints: links.iter().take_while(|&&link| axis(&scene.bodies[link]).is_some()).count(),
        }
    }

    /// Joints that move: 7, or 6. The seventh joint of an arm of six stands still: its column of the Jacobian and its bias torque are
    /// zero, and in the mass matrix it has nothing but a number on the diagonal. A controller of seven joints then does with the six what a
    /// controller of six would do, and asks the seventh for no torque.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Forward kinematics.
    pub fn kinematics(&self, q: &JointVector) -> Kinematics {
        let mut frame = Pose::identity();
        let links = std::array::from_fn(|i| {
            frame = frame * self.frames[i] * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q[i]);
            frame
        });
        let axes = links.map(|link: Pose| link.rotation * Vector3::z());
        Kinematics { links, axes, tool: frame * self.tool }
    }

    /// Geometric Jacobian at the tool point in world axes: twist = J qd.
    pub fn jacobian(&self, k: &Kinematics) -> Jacobian {
        let mut jacobian = Jacobian::zeros();
        for (i, (link, z)) in k.links.iter().zip(&k.axes).enumerate().take(self.joints) {
            let arm = k.tool.translation.vector - link.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&z.cross(&arm));
            jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(z);
        }
        jacobian
    }

    /// Joint mass matrix (kg m2), rotor inertia on its diagonal.
    pub fn mass(&self, k: &Kinematics) -> JointMatrix {
        self.mass_of(k, &self.moved(k))
    }

    /// The links' mass properties in world axes, where the links are.
    fn moved(&self, k: &Kinematics) -> [Inertial; 7] {
        std::array::from_fn(|i| self.inertials[i].transformed(&k.links[i]))
    }

    fn mass_of(&self, k: &Kinematics, bodies: &[Inertial; 7]) -> JointMatrix {
        let mut mass = JointMatrix::from_diagonal(&self.armature);
        let mut composite = Inertial::NONE;
        for i in (0..7).rev() {
            composite = composite.merged(&bodies[i]);
            if i >= self.joints {
                continue;
            }
            let z = k.axes[i];
            // Force and moment (about the centre of mass) that accelerate everything from
            // link i outwards with qdd_i = 1.
            let force = composite.mass * z.cross(&(composite.com - k.links[i].translation.vector));
            let moment = composite.inertia * z;
            for j in 0..=i {
                let arm = composite.com - k.links[j].translation.vector;
                let m = k.axes[j].dot(&(moment + arm.cross(&force)));
                mass[(i, j)] += m;
                if i != j {
                    mass[(j, i)] += m;
                }
            }
        }
        mass
    }

    /// Gravity, centrifugal and Coriolis torque (Nm): what holds the motion at qdd = 0.
    /// Joint damping and friction are not in it.
    pub fn bias(&self, k: &Kinematics, qd: &JointVector) -> JointVector {
        bias_of(k, &self.moved(k), qd, self.joints)
    }

    /// Kinetic plus potential energy of the arm (J) at `q` (rad) and `qd` (rad/s). At z = 0 the potential energy is 0.
    pub fn energy(&self, q: &JointVector, qd: &JointVector) -> f64 {
        let k = self.kinematics(q);
        let potential: f64 = (0..7)
            .map(|i| {
                let com = k.links[i] * Point3::from(self.inertials[i].com);
                self.inertials[i].mass * GRAVITY * com.z
            })
            .sum();
        0.5 * qd.dot(&(self.mass(&k) * qd)) + potential
    }

    /// All that a controller reads, for joint angles `q` (rad), velocities `qd` (rad/s) and the `wrench` that the
    /// environment exerts on the tool (N, Nm; world axes, at the tool point).
    pub fn measure(&self, q: JointVector, qd: JointVector, wrench: Wrench) -> Measurement {
        let k = self.kinematics(&q);
        let bodies = self.moved(&k);
        let jacobian = self.jacobian(&k);
        Measurement {
            q,
            qd,
            pose: k.tool,
            twist: jacobian * qd,
            jacobian,
            mass: self.mass_of(&k, &bodies),
            bias: bias_of(&k, &bodies, &qd, self.joints),
            wrench,
        }
    }
}

fn bias_of(k: &Kinematics, bodies: &[Inertial; 7], qd: &JointVector, joints: usize) -> JointVector {
    // Outwards: velocity and acceleration, the base accelerating against gravity.
    let mut omega = Vector3::zeros();
    let mut alpha = Vector3::zeros();
    let mut acceleration = Vector3::new(0.0, 0.0, GRAVITY);
    let mut origin = Vector3::zeros();
    let mut forces = [Vector3::zeros(); 7];
    let mut moments = [Vector3::zeros(); 7];
    for i in 0..7 {
        let link = &k.links[i];
        let z = k.axes[i];
        let arm = link.translation.vector - origin;
        acceleration += alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
        origin = link.translation.vector;
        alpha += omega.cross(&z) * qd[i];
        omega += z * qd[i];

        let body = &bodies[i];
        let com = body.com - origin;
        let com_acceleration = acceleration + alpha.cross(&com) + omega.cross(&omega.cross(&com));
        forces[i] = body.mass * com_acceleration;
        moments[i] = body.inertia * alpha + omega.cross(&(body.inertia * omega)) + com.cross(&forces[i]);
    }
    // Inwards: moments about each joint.
    let mut tau = JointVector::zeros();
    let (mut force, mut moment, mut at) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    for i in (0..7).rev() {
        let origin = k.links[i].translation.vector;
        moment += (at - origin).cross(&force) + moments[i];
        force += forces[i];
        at = origin;
        if i < joints {
            tau[i] = moment.dot(&k.axes[i]);
        }
    }
    tau
}

/// The arm link that carries body `index`, and the body's pose in it; `None` for bodies
/// that are not on the arm.
fn carrier(scene: &Scene, index: usize, links: &[usize; 7]) -> Option<(usize, Pose)> {
    if let Some(link) = links.iter().position(|&l| l == index) {
        return Some((link, Pose::identity()));
    }
    let body = &scene.bodies[index];
    let (link, pose) = carrier(scene, body.parent?, links)?;
    let slid = match &body.joint {
        Joint::Slide(axis) => {
            let open = if axis.range[1] > 0.0 { INITIAL_OPENING } else { -INITIAL_OPENING };
            at((axis.direction.into_inner() * open).into())
        }
        _ => Pose::identity(),
    };
    Some((link, pose * body.pose * slid))
}

fn axis(body: &Body) -> Option<&Axis> {
    match &body.joint {
        Joint::Hinge(axis) | Joint::Slide(axis) => Some(axis),
        Joint::Fixed | Joint::Free => None,
    }
}
