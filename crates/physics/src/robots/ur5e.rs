//! Universal Robots UR5e: six joints.
//!
//! Frames, masses, inertias and limits are those of Universal_Robots_ROS2_Description 2.4.5 (Universal Robots A/S; BSD-3-Clause):
//! `default_kinematics.yaml`, `physical_parameters.yaml` and `joint_limits.yaml` of `config/ur5e`. Rotor inertia, damping, friction and
//! drives are not in the package and are the FR3's here, except that all three wrist joints have the rotor inertia of the FR3's small
//! drives. The capsules follow the radii that the same package gives for the links.

use std::f64::consts::PI;

use aforce::{Arm, Pose};

use super::link_data::Turn::RollPitchYaw;
use super::link_data::{LinkData, NEIGHBOURS};
use super::panda::capsule;
use super::{JOINTS, Link, Mount, Robot, fr3};
use crate::scene::{Inertial, Role, at};

/// Moments of a cylinder across and along its axis (kg m2): shoulder, upper arm, forearm, first and second wrist, third wrist.
const SHOULDER: [f64; 2] = [0.010_267_5, 0.00666];
const UPPER_ARM: [f64; 2] = [0.133_885_835_416_666_65, 0.015_107_4];
const FOREARM: [f64; 2] = [0.031_209_367_583_333_33, 0.004_095];
const WRIST: [f64; 2] = [0.002_559_9, 0.002_194_2];
const LAST: [f64; 2] = [9.890_414_008_333_333e-5, 0.000_132_117_187_5];

const LINKS: [LinkData; 6] = [
    LinkData {
        // The base's frame is turned by half a turn to the arm's first.
        position: [0.0, 0.0, 0.1625],
        turn: RollPitchYaw([0.0, 0.0, PI]),
        mass: 3.761,
        com: [0.0, -0.00193, -0.02561],
        moments: [SHOULDER[0], SHOULDER[0], SHOULDER[1]],
        capsules: &[([0.0, 0.0, -0.05], [0.0, 0.0, 0.0], 0.06), ([0.0, 0.0, 0.0], [0.0, -0.05, 0.0], 0.06)],
    },
    LinkData {
        position: [0.0, 0.0, 0.0],
        turn: RollPitchYaw([PI / 2.0, 0.0, 0.0]),
        mass: 8.058,
        com: [-0.2125, 0.0, 0.11336],
        // Its cylinder lies along x.
        moments: [UPPER_ARM[1], UPPER_ARM[0], UPPER_ARM[0]],
        capsules: &[
            ([0.0, 0.0, 0.138], [-0.425, 0.0, 0.138], 0.056),
            ([-0.425, 0.0, 0.138], [-0.425, 0.0, 0.06], 0.056),
        ],
    },
    LinkData {
        position: [-0.425, 0.0, 0.0],
        turn: RollPitchYaw([0.0, 0.0, 0.0]),
        mass: 2.846,
        com: [-0.2422, 0.0, 0.0265],
        moments: [FOREARM[1], FOREARM[0], FOREARM[0]],
        capsules: &[([0.0, 0.0, 0.007], [-0.3922, 0.0, 0.007], 0.05)],
    },
    LinkData {
        position: [-0.3922, 0.0, 0.1333],
        turn: RollPitchYaw([0.0, 0.0, 0.0]),
        mass: 1.37,
        com: [0.0, -0.01634, -0.0018],
        moments: [WRIST[0], WRIST[0], WRIST[1]],
        capsules: &[([0.0, 0.0, -0.06], [0.0, 0.0, 0.0], 0.045), ([0.0, 0.0, 0.0], [0.0, -0.05, 0.0], 0.045)],
    },
    LinkData {
        position: [0.0, -0.0997, 0.0],
        turn: RollPitchYaw([PI / 2.0, 0.0, 0.0]),
        mass: 1.3,
        com: [0.0, 0.01634, -0.0018],
        moments: [WRIST[0], WRIST[0], WRIST[1]],
        capsules: &[([0.0, 0.0, -0.045], [0.0, 0.0, 0.0], 0.045), ([0.0, 0.0, 0.0], [0.0, 0.045, 0.0], 0.045)],
    },
    LinkData {
        position: [0.0, 0.0996, 0.0],
        turn: RollPitchYaw([PI / 2.0, PI, PI]),
        mass: 0.365,
        com: [0.0, 0.0, -0.001159],
        moments: [LAST[0], LAST[0], LAST[1]],
        capsules: &[([-0.01, 0.0, -0.03], [0.01, 0.0, -0.03], 0.03)],
    },
];

/// A UR5e with Franka's hand.
pub fn ur5e() -> Robot {
    let other = fr3::fr3();
    let none = Link { frame: Pose::identity(), inertial: Inertial::NONE, geoms: vec![], damping: 0.0, friction: 0.0 };
    let link = |i: usize| LINKS.get(i).map_or_else(|| none.clone(), |data| data.link(i, &other.links[i]));
    Robot {
        name: "ur5e".into(),
        joints: 6,
        arm: Arm {
            // The elbow turns by half a turn either way, the others by a whole one.
            range: [2.0, 2.0, 1.0, 2.0, 2.0, 2.0, 1.0].map(|half_turns: f64| [-half_turns * PI, half_turns * PI]),
            speed_max: [PI; JOINTS],
            torque_max: [150.0, 150.0, 150.0, 28.0, 28.0, 28.0, 1.0],
            rotor_inertia: [0.606, 0.606, 0.462, 0.206, 0.206, 0.206, 1.0],
            // Universal Robots gives no limits for the tool; these are a Panda's.
            cartesian: Arm::PANDA.cartesian,
            ..Arm::FR3
        },
        base: vec![capsule("link0", 0, Role::Fixture, [0.0, 0.0, 0.07], [0.0, 0.0, 0.075], 0.065)],
        links: std::array::from_fn(link),
        // `tool0`, and an adapter of 3.5 cm: the hand reaches 2.6 cm behind its flange.
        flange: at([0.0, 0.0, 0.035]),
        home: HOME.into(),
        // Lower than the Panda's: with the forearm level, pressing down does not pull the hand towards the base.
        mount: Mount::column(0.74, 0.1),
        never_touch: NEIGHBOURS.into(),
        ..other
    }
}

/// The flange where the Panda's is, the elbow up: the home that is found for a URDF without one. With the shoulder on the other side
/// (-0.37 rad) the script with `osc` gets stuck in two of twelve wipes.
const HOME: [f64; JOINTS] = [-2.77077, -1.70331, -1.62083, 1.87203, -1.52479, 1.938_40, 0.0];
