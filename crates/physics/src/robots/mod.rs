//! The robots, as values: everything that sets one apart from another, and how one becomes bodies of a scene.
//!
//! One more robot is one more file here, with a function that makes its [`Robot`], and its name in [`RobotName`]. Units are
//! SI. A shape or an inertia is given in the frame of the body that has it.

pub mod fr3;
pub mod panda;
pub mod urdf;

use std::str::FromStr;

use aforce::{Arm, JointVector, Pose};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::scene::{Actuator, Air, Axis, Body, Geom, Inertial, Joint, Scene, Stop, pose};

/// The number of joints of every arm here: what [`JointVector`] has room for.
pub const JOINTS: usize = 7;

/// An arm of seven revolute joints on its mount, with a flange that carries a tool.
#[derive(Debug, Clone)]
pub struct Robot {
    /// What settings and messages call it: [`RobotName::as_str`].
    pub name: String,
    /// Ranges and limits of the joints, their rotors, and how fast the maker lets the tool move.
    pub arm: Arm,
    /// Shapes of the base, in the base frame.
    pub base: Vec<Geom>,
    /// Links 1 to 7: link i turns about its own z axis by joint angle i.
    pub links: [Link; JOINTS],
    /// Pose of the flange's frame, `right_hand`, in the frame of link 7.
    pub flange: Pose,
    /// What is fixed to the flange whatever the tool, in the flange's frame.
    pub flange_inertial: Inertial,
    /// What the gripper weighs.
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
    /// What the scene's bodies move through; `None`: nothing. Its drag is no part of what a controller compensates.
    pub air: Option<Air>,
}

/// What one joint moves.
#[derive(Debug, Clone)]
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
#[derive(Debug, Clone)]
pub struct Mount {
    /// Height of the base frame above the floor (m).
    pub height: f64,
    /// Distance of the base frame from the near edge of a table around the world's origin (m).
    pub behind_table: f64,
    /// Shapes, in the base frame.
    pub geoms: Vec<Geom>,
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
            let joint = format!("joint{}", i + 1);
            parent = scene.add(Body {
                name: format!("link{}", i + 1),
                parent: Some(parent),
                pose: link.frame,
                joint: Joint::Hinge(Axis {
                    name: joint.clone(),
                    direction: Vector3::z_axis(),
                    range: self.arm.range[i],
                    damping: link.damping,
                    friction: link.friction,
                    armature: self.arm.rotor_inertia[i],
                    spring: 0.0,
                    rest: 0.0,
                    stop: Stop::Constraint,
                }),
                inertial: link.inertial,
                geoms: link.geoms.clone(),
            });
            scene.actuators.push(Actuator { joint, max_effort: self.arm.torque_max[i] });
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

/// What a gripper weighs. Shapes, travel and servos are the same on every robot here: all carry the maker's hand.
#[derive(Debug, Clone)]
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

/// The robots by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RobotName {
    /// A Panda with the round numbers of robosuite: results are comparable with what is published for its tasks.
    #[default]
    Robosuite,
    /// A Panda with parameters that were identified on a real arm.
    Identified,
    /// A Franka Research 3 with its maker's parameters.
    Fr3,
}

impl RobotName {
    /// All robots.
    pub const ALL: [RobotName; 3] = [RobotName::Robosuite, RobotName::Identified, RobotName::Fr3];

    /// The name used in files and on command lines.
    pub fn as_str(self) -> &'static str {
        match self {
            RobotName::Robosuite => "robosuite",
            RobotName::Identified => "identified",
            RobotName::Fr3 => "fr3",
        }
    }

    /// The robot itself.
    pub fn robot(self) -> Robot {
        match self {
            RobotName::Robosuite => panda::robosuite(),
            RobotName::Identified => panda::identified(),
            RobotName::Fr3 => fr3::fr3(),
        }
    }
}

impl FromStr for RobotName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = Self::ALL.map(Self::as_str).join(", ");
        let known = Self::ALL.into_iter().find(|robot| robot.as_str() == text);
        known.ok_or_else(|| format!("no robot is called {text:?}; known are {names}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_goes_by_its_name() {
        for name in RobotName::ALL {
            assert_eq!(name.robot().name, name.as_str());
            assert_eq!(name.as_str().parse(), Ok(name));
        }
        let error = "ur5".parse::<RobotName>().unwrap_err();
        assert_eq!(error, "no robot is called \"ur5\"; known are robosuite, identified, fr3");
    }

    /// Masses and moments of inertia that matter can have, and a home between the ends of the joints.
    #[test]
    fn every_robot_can_be_built() {
        for robot in RobotName::ALL.map(RobotName::robot) {
            for (i, (link, [low, high])) in robot.links.iter().zip(robot.arm.range).enumerate() {
                let moments = link.inertial.inertia.symmetric_eigenvalues();
                assert!(link.inertial.mass > 0.0 && moments.min() > 0.0, "{} link {}", robot.name, i + 1);
                assert!((low..=high).contains(&robot.home[i]), "{} joint {}", robot.name, i + 1);
            }
        }
    }
}
