//! A robot from its URDF: lengths, masses, ranges and limits of the seven joints between the base and a tool.
//!
//! The file may have any serial arm of seven revolute joints, about any axes. Joints off the way to the tool, a gripper's for
//! instance, are welded at zero. Shapes are not read.

use std::collections::HashSet;

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use thiserror::Error;
use urdf_rs::{Joint as UrdfJoint, JointType, Robot as File};

use super::{JOINTS, Link, Robot};
use crate::scene::Inertial;

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

/// The arm whose flange is the link `tool`. Its links are turned so that each joint turns about its own z. What the file does not
/// say is as in `rest`: rotors, rates of torques, speed of the tool, drives, gripper, home, mount, air.
///
/// # Errors
/// If the text is no URDF, its joints are no tree, there is no such link, the way to it has other joints than seven revolute ones,
/// or one of them has no axis or a dry friction that is negative or not finite.
pub fn robot(text: &str, tool: &str, rest: &Robot) -> Result<Robot, UrdfError> {
    let file = urdf_rs::read_from_string(text)?;
    let way = way_to(&file, tool)?;
    let moving: Vec<&UrdfJoint> = way.iter().copied().filter(|joint| joint.joint_type != JointType::Fixed).collect();
    let hinges = <[&UrdfJoint; JOINTS]>::try_from(moving).ok();
    let Some(hinges) = hinges.filter(|hinges| hinges.iter().all(|joint| is_hinge(joint))) else {
        let found = way.iter().map(|joint| format!("{} ({:?})", joint.name, joint.joint_type).to_lowercase());
        return Err(UrdfError::Joints { tool: tool.into(), found: found.collect::<Vec<_>>().join(", ") });
    };
    let mut robot = Robot { name: file.name.clone(), base: vec![], flange_inertial: Inertial::NONE, ..rest.clone() };
    let mut turns = [UnitQuaternion::identity(); JOINTS];
    for (i, joint) in hinges.into_iter().enumerate() {
        turns[i] = to_z(joint)?;
        let endless = joint.joint_type == JointType::Continuous;
        robot.arm.range[i] = if endless { [-100.0, 100.0] } else { [joint.limit.lower, joint.limit.upper] };
        (robot.arm.speed_max[i], robot.arm.torque_max[i]) = (joint.limit.velocity, joint.limit.effort);
        let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
        if !(friction >= 0.0 && friction.is_finite()) {
            return Err(UrdfError::Friction { joint: joint.name.clone(), friction });
        }
        robot.links[i] = Link { frame: Pose::identity(), inertial: Inertial::NONE, geoms: vec![], damping, friction };
    }
    let root = way.first().map_or(tool, |joint| joint.parent.link.as_str());
    let mut tree = Tree { file: &file, hinges: hinges.map(|joint| joint.name.as_str()), turns, tool, robot };
    tree.take_in(root, None, Pose::identity());
    Ok(tree.robot)
}

/// The joints from the root to `tool`, in order.
fn way_to<'a>(file: &'a File, tool: &str) -> Result<Vec<&'a UrdfJoint>, UrdfError> {
    if !file.links.iter().any(|link| link.name == tool) {
        let known: Vec<&str> = file.links.iter().map(|link| link.name.as_str()).collect();
        return Err(UrdfError::Link { link: tool.into(), known: known.join(", ") });
    }
    let no_tree = |link: &str| UrdfError::NoTree { link: link.into() };
    let mut moved = HashSet::new();
    if let Some(joint) = file.joints.iter().find(|joint| !moved.insert(&joint.child.link)) {
        return Err(no_tree(&joint.child.link));
    }
    let mut way = vec![];
    let mut link = tool;
    while let Some(joint) = file.joints.iter().find(|joint| joint.child.link == link) {
        // Longer than all joints: it goes round.
        if way.len() == file.joints.len() {
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

struct Tree<'a> {
    file: &'a File,
    /// The seven joints, by name and in order.
    hinges: [&'a str; JOINTS],
    /// Rotation of each link of the robot, about whose z it turns, in the frame of its link in the file.
    turns: [UnitQuaternion<f64>; JOINTS],
    tool: &'a str,
    /// What has been read.
    robot: Robot,
}

impl Tree<'_> {
    /// Adds `link` of the file, and all below it, to the link `carrier` of the robot (`None`: the base), in which it has pose `pose`.
    fn take_in(&mut self, link: &str, carrier: Option<usize>, pose: Pose) {
        let file = self.file;
        if let Some(carrier) = carrier {
            let inertial = &mut self.robot.links[carrier].inertial;
            *inertial = inertial.merged(&inertial_of(file, link).transformed(&pose));
        }
        if link == self.tool {
            self.robot.flange = pose;
        }
        for child in file.joints.iter().filter(|joint| joint.parent.link == link) {
            let pose = pose * origin(&child.origin);
            if let Some(i) = self.hinges.iter().position(|name| *name == child.name) {
                let turn = self.turns[i];
                self.robot.links[i].frame = pose * turn;
                let back = Pose::from_parts(Translation3::identity(), turn.inverse());
                self.take_in(&child.child.link, Some(i), back);
            } else {
                self.take_in(&child.child.link, carrier, pose);
            }
        }
    }
}

/// Mass properties of a link in its own frame.
fn inertial_of(file: &File, link: &str) -> Inertial {
    let Some(link) = file.links.iter().find(|l| l.name == link) else { return Inertial::NONE };
    let i = &link.inertial.inertia;
    let inertia = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    Inertial { mass: link.inertial.mass.value, com: Vector3::zeros(), inertia }
        .transformed(&origin(&link.inertial.origin))
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
