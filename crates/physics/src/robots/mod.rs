//! The robots, as values: everything that sets one apart from another, and how one becomes bodies of a scene.
//!
//! One more robot is one more file here, with a function that makes its [`Robot`], and its name in [`RobotName`]. Units are
//! SI. A shape or an inertia is given in the frame of the body that has it.

mod check;
mod choice;
mod file;
pub mod fr3;
mod home;
mod iiwa14;
mod link_data;
mod name;
pub mod panda;
mod ur5e;
pub mod urdf;

use aforce::{Arm, JointVector, Pose};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

pub use choice::RobotChoice;
pub use file::{RobotFileError, is_file, read};
pub use name::RobotName;

use crate::scene::{Actuator, Air, Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at, pose};

/// The largest number of joints of an arm here: what [`JointVector`] has room for.
pub const JOINTS: usize = 7;

/// An arm of seven revolute joints, or of six, on its mount, with a flange that carries a tool.
///
/// Law, observation and tables have seven joints. In an arm of six, link 7 is welded to link 6 and carries flange and tool, the seventh
/// angle is 0, and the seventh column of the Jacobian is zero. So the six joints move as under a law for six joints (there is no null
/// space), and the observation has a few constants more. Making the number of joints a parameter of every type would have changed 30
/// files and the interface of every host, for the same torques.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// What settings and messages call it: [`RobotName::as_str`].
    pub name: String,
    /// Joints that move: 7 or 6.
    pub joints: usize,
    /// Ranges and limits of the joints, their rotors, and how fast the maker lets the tool move.
    pub arm: Arm,
    /// Shapes of the base, in the base frame.
    pub base: Vec<Geom>,
    /// Links 1 to 7: link i turns about its own z axis by joint angle i, except link 7 of an arm of six joints, which
    /// is welded.
    pub links: [Link; JOINTS],
    /// Pose of the flange's frame, `right_hand`, in the frame of link 7.
    pub flange: Pose,
    /// What is fixed to the flange whatever the tool, in the flange's frame.
    pub flange_inertial: Inertial,
    /// Mass properties of the gripper.
    pub gripper: GripperInertials,
    /// Joint angles at the start of an episode before noise (rad).
    pub home: JointVector,
    /// Motor constant times gear ratio of each joint's drive (Nm/sqrt(W)).
    pub drives: [f64; JOINTS],
    /// What the arm stands on.
    pub mount: Mount,
    /// Pairs of parts that never touch, each part by the number of joints that carry it: 0 is every fixture, 1 to 7 a link, 7
    /// also hand and tool. Two parts that the same joints carry never touch anyway.
    pub never_touch: Vec<[u8; 2]>,
    /// The air around the scene's bodies; `None`: no air. A controller does not compensate its drag.
    pub air: Option<Air>,
}

/// Gap between a column and the base on it, and between the column and the floor (m).
const GAP: f64 = 0.005;

/// A link, and the joint that moves it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Its frame in that of the link before it (of the base for link 1), with the joint at zero.
    pub frame: Pose,
    /// Mass and inertia.
    pub inertial: Inertial,
    /// Collision shapes.
    pub geoms: Vec<Geom>,
    /// Viscous damping of the joint (Nm s/rad).
    pub damping: f64,
    /// Dry friction of the joint (Nm).
    pub friction: f64,
}

/// What an arm stands on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mount {
    /// Height of the base frame above the floor (m).
    pub height: f64,
    /// Distance of the base frame from the near edge of a table around the world's origin (m).
    pub behind_table: f64,
    /// Shapes, in the base frame.
    pub geoms: Vec<Geom>,
}

impl Mount {
    /// A column below the base, whose frame is `height` above the floor and `behind_table` from the table's edge (m).
    pub fn column(height: f64, behind_table: f64) -> Self {
        // The column ends below the base frame, above which the base's own shapes begin.
        let half_length = height / 2.0 - GAP;
        let column = Geom {
            name: "pedestal_column".into(),
            shape: Shape::Cylinder { half_length, radius: 0.1 },
            pose: at([0.0, 0.0, -height / 2.0]),
            friction: 1.0,
            role: Role::Fixture,
            color: [90, 92, 98],
        };
        let geoms = if half_length > 0.0 { vec![column] } else { vec![] };
        Mount { height, behind_table, geoms }
    }
}

impl Robot {
    /// Viscous damping of each joint (Nm s/rad).
    pub fn damping(&self) -> JointVector {
        JointVector::from_fn(|i, _| self.links[i].damping)
    }

    /// Dry friction of each joint (Nm).
    pub fn friction(&self) -> JointVector {
        JointVector::from_fn(|i, _| self.links[i].friction)
    }

    /// The same robot with a viscous damping of `damping` in every joint (Nm s/rad).
    #[must_use]
    pub fn with_damping(mut self, damping: f64) -> Self {
        self.links.iter_mut().for_each(|link| link.damping = damping);
        self
    }

    /// The same robot with a dry friction of `friction` in every joint (Nm).
    #[must_use]
    pub fn with_friction(mut self, friction: f64) -> Self {
        self.links.iter_mut().for_each(|link| link.friction = friction);
        self
    }

    /// Adds the base, at `pose` in the world, and the seven links to `scene`. Returns the index of `right_hand`, the body at
    /// the flange that carries a tool. Air and pairs that never touch become the scene's.
    pub fn add_to(&self, scene: &mut Scene, pose: Pose) -> usize {
        scene.air = self.air;
        scene.never_touch.clone_from(&self.never_touch);
        let mut parent = scene.add(Body {
            name: "link0".into(),
            parent: None,
            pose,
            joint: Joint::Fixed,
            inertial: Inertial::NONE,
            geoms: self.base.clone(),
        });
        for (i, link) in self.links.iter().enumerate() {
            let name = format!("joint{}", i + 1);
            let joint = if i < self.joints {
                scene.actuators.push(Actuator { joint: name.clone(), max_effort: self.arm.torque_max[i] });
                Joint::Hinge(Axis {
                    name,
                    direction: Vector3::z_axis(),
                    range: self.arm.range[i],
                    damping: link.damping,
                    friction: link.friction,
                    armature: self.arm.rotor_inertia[i],
                    spring: 0.0,
                    rest: 0.0,
                    stop: Stop::Constraint,
                })
            } else {
                Joint::Fixed
            };
            parent = scene.add(Body {
                name: format!("link{}", i + 1),
                parent: Some(parent),
                pose: link.frame,
                joint,
                inertial: link.inertial,
                geoms: link.geoms.clone(),
            });
        }
        scene.add(Body {
            name: "right_hand".into(),
            parent: Some(parent),
            pose: self.flange,
            joint: Joint::Fixed,
            inertial: self.flange_inertial,
            geoms: vec![],
        })
    }
}

/// Mass properties of a gripper. Shapes, travel and servos are the same on every robot here: all carry Franka's hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GripperInertials {
    /// The gripper without its fingers, in the gripper frame.
    pub palm: Inertial,
    /// One finger without its tip, in its own frame; the left one (the right is its mirror image).
    pub finger: Inertial,
    /// The tip of a finger, in its own frame.
    pub tip: Inertial,
}

/// Rotation from the flange's frame, `right_hand`, to the frame of the tool below it: robosuite's, for gripper and wiping tool
/// alike.
pub fn tool_rotation() -> UnitQuaternion<f64> {
    const Q: f64 = std::f64::consts::FRAC_1_SQRT_2;
    pose([0.0; 3], [Q, 0.0, 0.0, -Q]).rotation
}

/// Pose of a tool in the frame `right_hand`, `distance` from the flange (m).
pub fn tool_pose(distance: f64) -> Pose {
    Pose::from_parts(Translation3::new(0.0, 0.0, distance), tool_rotation())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Masses and moments of inertia are positive, and the home is within the joints' ranges.
    #[test]
    fn every_robot_can_be_built() {
        for robot in RobotName::ALL.map(RobotName::robot) {
            for (i, (link, [low, high])) in robot.links.iter().zip(robot.arm.range).enumerate().take(robot.joints) {
                let moments = link.inertial.inertia.symmetric_eigenvalues();
                assert!(link.inertial.mass > 0.0 && moments.min() > 0.0, "{} link {}", robot.name, i + 1);
                assert!((low..=high).contains(&robot.home[i]), "{} joint {}", robot.name, i + 1);
            }
        }
    }
}
