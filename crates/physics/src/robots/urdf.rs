//! An arm from its URDF: the seven joints between the base and a tool, as a scene without shapes.
//!
//! The file may have any serial arm of seven revolute joints. What it does not know is given beside it ([`Drives`]). Joints off
//! the way to the tool, a gripper's for instance, are welded at zero.

use std::collections::HashSet;

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use thiserror::Error;
use urdf_rs::{Joint as UrdfJoint, JointType, Robot};

use crate::scene::{Actuator, Axis, Body, Inertial, Joint, Scene, Stop};

/// What a URDF leaves out.
#[derive(Debug, Clone, Copy)]
pub struct Drives {
    /// Rotor inertia reflected to each joint (kg m2).
    pub armature: [f64; 7],
}

/// Why a text is no arm for this project.
#[derive(Debug, Error)]
pub enum UrdfError {
    /// Not a URDF.
    #[error("no URDF: {0}")]
    Text(#[from] urdf_rs::UrdfError),
    /// A link that is not there, or not below the base.
    #[error("no link {link:?}; there are {known}")]
    Link {
        /// The name given.
        link: String,
        /// All names.
        known: String,
    },
    /// Joints that are no tree.
    #[error("link {link:?} is moved by two joints, or is below itself; the joints of a URDF are a tree")]
    NoTree {
        /// Its name.
        link: String,
    },
    /// Not seven joints, or not revolute ones.
    #[error("the way to {tool:?} has {found}; allowed are seven revolute joints")]
    Joints {
        /// The tool's link.
        tool: String,
        /// What moves on the way.
        found: String,
    },
    /// A link that is called as one of the arm's here.
    #[error(
        "two links would be called {name:?}: the seven that the joints move are link1 to link7 here; rename the other"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// An axis without direction.
    #[error("joint {joint:?} has the axis {axis:?}")]
    NoAxis {
        /// Its name.
        joint: String,
        /// As found.
        axis: [f64; 3],
    },
    /// A dry friction that drives its joint.
    #[error("joint {joint:?} has a dry friction of {friction}; it must be finite and at least 0")]
    Friction {
        /// Its name.
        joint: String,
        /// As found (Nm).
        friction: f64,
    },
}

/// The arm whose tool is the link `tool`; also the place of the tool's body in the scene. Links on the way are called `link1` to
/// `link7` there, as their joints keep their names; bodies are turned so that each joint turns about its own z.
///
/// # Errors
/// If the text is no URDF, its joints are no tree, there is no such link, the way to it has other joints than seven revolute ones, or a link that they
/// do not move is called `link1` to `link7`.
pub fn arm(text: &str, tool: &str, drives: &Drives) -> Result<(Scene, usize), UrdfError> {
    let robot = urdf_rs::read_from_string(text)?;
    let way = way_to(&robot, tool)?;
    let moving: Vec<&str> = way.iter().filter(|joint| is_hinge(joint)).map(|joint| joint.name.as_str()).collect();
    let others = way.iter().any(|joint| !is_hinge(joint) && joint.joint_type != JointType::Fixed);
    if moving.len() != 7 || others {
        let found: Vec<String> =
            way.iter().map(|joint| format!("{} ({:?})", joint.name, joint.joint_type).to_lowercase()).collect();
        return Err(UrdfError::Joints { tool: tool.into(), found: found.join(", ") });
    }
    let root = way.first().map_or(tool, |joint| joint.parent.link.as_str());
    let mut builder = Builder { robot: &robot, moving, tool, drives, scene: Scene::default(), found: 0 };
    builder.add(root, None, Pose::identity(), UnitQuaternion::identity(), None)?;
    Ok((builder.scene, builder.found))
}

/// The joints from the root to `tool`, in order.
fn way_to<'a>(robot: &'a Robot, tool: &str) -> Result<Vec<&'a UrdfJoint>, UrdfError> {
    if !robot.links.iter().any(|link| link.name == tool) {
        let known: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
        return Err(UrdfError::Link { link: tool.into(), known: known.join(", ") });
    }
    let no_tree = |link: &str| UrdfError::NoTree { link: link.into() };
    let mut moved = HashSet::new();
    if let Some(joint) = robot.joints.iter().find(|joint| !moved.insert(&joint.child.link)) {
        return Err(no_tree(&joint.child.link));
    }
    let mut way = vec![];
    let mut link = tool;
    while let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == link) {
        // Longer than all joints: it goes round.
        if way.len() == robot.joints.len() {
            return Err(no_tree(link));
        }
        way.push(joint);
        link = &joint.parent.link;
    }
    way.reverse();
    Ok(way)
}

fn is_hinge(joint: &UrdfJoint) -> bool {
    matches!(joint.joint_type, JointType::Revolute | JointType::Continuous)
}

struct Builder<'a> {
    robot: &'a Robot,
    /// The seven joints, by name and in order.
    moving: Vec<&'a str>,
    tool: &'a str,
    drives: &'a Drives,
    scene: Scene,
    /// The tool's place.
    found: usize,
}

impl Builder<'_> {
    /// Adds `link` and all below it. `turn` is the rotation from the link's frame in the file to that of its body, about whose z
    /// it moves.
    fn add(
        &mut self,
        link: &str,
        parent: Option<usize>,
        pose: Pose,
        turn: UnitQuaternion<f64>,
        joint: Option<&UrdfJoint>,
    ) -> Result<(), UrdfError> {
        let place = joint.and_then(|joint| self.moving.iter().position(|name| *name == joint.name));
        let back = Pose::from_parts(Translation3::identity(), turn.inverse());
        let moves = match (place, joint) {
            (Some(place), Some(joint)) => self.hinge(place, joint)?,
            _ => Joint::Fixed,
        };
        let name = place.map_or_else(|| link.to_owned(), |place| format!("link{}", place + 1));
        if self.scene.bodies.iter().any(|body| body.name == name) {
            return Err(UrdfError::Name { name });
        }
        let index = self.scene.add(Body {
            name,
            parent,
            pose,
            joint: moves,
            inertial: self.inertial(link).transformed(&back),
            geoms: vec![],
        });
        if link == self.tool {
            self.found = index;
        }
        let robot = self.robot;
        for child in robot.joints.iter().filter(|joint| joint.parent.link == link) {
            let turn =
                if self.moving.contains(&child.name.as_str()) { to_z(child)? } else { UnitQuaternion::identity() };
            let pose = back * origin(&child.origin) * Pose::from_parts(Translation3::identity(), turn);
            self.add(&child.child.link, Some(index), pose, turn, Some(child))?;
        }
        Ok(())
    }

    fn hinge(&mut self, place: usize, joint: &UrdfJoint) -> Result<Joint, UrdfError> {
        self.scene.actuators.push(Actuator { joint: joint.name.clone(), max_effort: joint.limit.effort });
        let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
        if !(friction >= 0.0 && friction.is_finite()) {
            return Err(UrdfError::Friction { joint: joint.name.clone(), friction });
        }
        let endless = joint.joint_type == JointType::Continuous;
        let range = if endless { [-100.0, 100.0] } else { [joint.limit.lower, joint.limit.upper] };
        Ok(Joint::Hinge(Axis {
            name: joint.name.clone(),
            direction: Vector3::z_axis(),
            range,
            damping,
            friction,
            armature: self.drives.armature[place],
            spring: 0.0,
            stop: Stop::Constraint,
        }))
    }

    fn inertial(&self, link: &str) -> Inertial {
        let Some(link) = self.robot.links.iter().find(|l| l.name == link) else { return Inertial::NONE };
        let i = &link.inertial.inertia;
        let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
        Inertial { mass: link.inertial.mass.value, com: Vector3::zeros(), inertia }
            .transformed(&origin(&link.inertial.origin))
    }
}

/// A rotation whose z is the joint's axis.
fn to_z(joint: &UrdfJoint) -> Result<UnitQuaternion<f64>, UrdfError> {
    let axis = Vector3::from(*joint.axis.xyz);
    let no_axis = || UrdfError::NoAxis { joint: joint.name.clone(), axis: *joint.axis.xyz };
    let axis = axis.try_normalize(1e-9).ok_or_else(no_axis)?;
    // Opposite to z any half turn about an axis across will do.
    Ok(UnitQuaternion::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI)))
}

fn origin(pose: &urdf_rs::Pose) -> Pose {
    let [roll, pitch, yaw] = *pose.rpy;
    let position = Vector3::from(*pose.xyz);
    Pose::from_parts(position.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}
