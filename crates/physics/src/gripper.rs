//! robosuite's Panda gripper: two fingers on slides, driven by position servos whose
//! target is advanced by the sign of the command.
//!
//! The tool point lies between the pads. In its frame z points out of the hand, x is the axis along which the fingers open, y lies
//! along the pads. The hand is a box of 20.4 cm along x, 6.3 cm along y and 9.2 cm along z, whose lower face is 3.1 cm above the tool
//! point. A command has a sign and no size: -1 opens to 7.9 cm between the pads, +1 closes, with 20 N at most.

use aforce::Vector3;
use nalgebra::{Matrix3, Vector3 as V3};

use crate::robots::{GripperInertials, Robot, tool_pose};
use crate::scene::{Actuator, Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at, pose};

/// Centre of the grip in the gripper frame (m): the point that the arm controls.
pub const GRIP_SITE: [f64; 3] = [0.0, 0.0, 0.097];
/// Names of the left and the right finger's joint.
pub const FINGER_JOINTS: [&str; 2] = ["left_finger_joint", "right_finger_joint"];
/// Finger travel (m).
const TRAVEL: f64 = 0.04;
/// Finger opening at the start of an episode (m).
pub const INITIAL_OPENING: f64 = 0.020833;
/// Distance of a pad's inner face from its finger's coordinate, towards the other pad (m).
const PAD_FACE: f64 = 0.0005;
/// Largest distance between the pads (m).
pub const WIDEST: f64 = 2.0 * (TRAVEL - PAD_FACE);
/// Stiffness of the finger servo (N/m).
const SERVO_STIFFNESS: f64 = 1000.0;
/// Largest servo force (N).
const MAX_FORCE: f64 = 20.0;
/// Rate of the internal command, full swing being 2 (1/s): 0.01 in 2 ms, as in robosuite.
const COMMAND_RATE: f64 = 0.01 / 0.002;

/// Adds the robot's gripper below `right_hand`; returns the body that carries the grip site.
pub fn add_gripper(scene: &mut Scene, robot: &Robot, right_hand: usize) -> usize {
    let gripper = scene.add(Body {
        name: "gripper".into(),
        parent: Some(right_hand),
        pose: tool_pose(0.0),
        joint: Joint::Fixed,
        inertial: robot.gripper.palm,
        geoms: vec![Geom {
            name: "hand".into(),
            shape: Shape::Box(Vector3::new(0.1022, 0.0316, 0.04595)),
            pose: at([0.0018, 0.0, 0.02005]),
            friction: 1.0,
            role: Role::Hand,
            color: [60, 62, 68],
        }],
    });
    add_finger(scene, gripper, &robot.gripper, "left", 1.0);
    add_finger(scene, gripper, &robot.gripper, "right", -1.0);
    gripper
}

/// `side` is +1 for the left finger, whose joint coordinate grows as it opens, and -1
/// for the right one, whose coordinate falls.
fn add_finger(scene: &mut Scene, gripper: usize, inertials: &GripperInertials, name: &str, side: f64) {
    const Q: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, side, 1.0));
    let mirrored =
        |part: &Inertial| Inertial { com: mirror * part.com, inertia: mirror * part.inertia * mirror, ..*part };
    let finger = scene.add(Body {
        name: format!("{name}_finger"),
        parent: Some(gripper),
        pose: pose([0.0, 0.0, 0.0524], [Q, 0.0, 0.0, Q]),
        joint: Joint::Slide(Axis {
            name: format!("{name}_finger_joint"),
            direction: V3::y_axis(),
            range: if side > 0.0 { [0.0, TRAVEL] } else { [-TRAVEL, 0.0] },
            damping: 100.0,
            friction: 1.0,
            armature: 1.0,
            spring: 0.0,
            rest: 0.0,
            stop: Stop::Spring { stiffness: 20_000.0, damping: 100.0 },
        }),
        inertial: mirrored(&inertials.finger),
        geoms: vec![Geom {
            name: format!("{name}_shell"),
            // Its inner face stays 1 mm behind the pad's: the pad alone may grasp.
            shape: Shape::Box(Vector3::new(0.0105, 0.01295, 0.0269)),
            pose: at([0.0, 0.01345 * side, 0.0269]),
            friction: 1.0,
            role: Role::Hand,
            color: [120, 122, 128],
        }],
    });
    scene.add(Body {
        name: format!("{name}_tip"),
        parent: Some(finger),
        pose: at([0.0, 0.0085 * side, 0.056]),
        joint: Joint::Fixed,
        inertial: mirrored(&inertials.tip),
        geoms: vec![Geom {
            name: format!("{name}_pad"),
            shape: Shape::Box(Vector3::new(0.008, 0.004, 0.008)),
            pose: at([0.0, -0.005 * side, -0.015]),
            friction: 2.0,
            role: Role::Pad,
            color: [40, 40, 44],
        }],
    });
    scene.actuators.push(Actuator { joint: format!("{name}_finger_joint"), max_effort: MAX_FORCE });
}

/// Distance (m) between the pads of fingers with these coordinates (m), the left one's first.
pub fn pads_apart([left, right]: [f64; 2]) -> f64 {
    left - right - 2.0 * PAD_FACE
}

/// Coordinate (m) of the left finger, whose pad then stands `distance` (m) from the right one's.
pub(crate) fn finger_at(distance: f64) -> f64 {
    distance / 2.0 + PAD_FACE
}

/// The finger servos with the opening that they aim at, advanced with every step of the engine.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gripper {
    /// Where the servos aim: -1 closed, +1 open; 0 at the start of an episode.
    opening: f64,
}

impl Gripper {
    /// Starts an episode: the servos aim at the middle.
    pub fn reset(&mut self) {
        self.opening = 0.0;
    }

    /// Starts an episode with the command that keeps the left finger at `coordinate` (m).
    pub(crate) fn keep(&mut self, coordinate: f64) {
        self.opening = 2.0 * coordinate / TRAVEL - 1.0;
    }

    /// Starts an episode with the command that closes.
    pub(crate) fn close(&mut self) {
        self.opening = -1.0;
    }

    /// Servo forces (N) of the left and right finger for one step of `dt` seconds.
    /// Only the sign of `action` counts: -1 opens, +1 closes; 0 and NaN hold. `q` are the finger
    /// coordinates (m; left positive, right negative when open).
    pub fn update(&mut self, action: f64, q: [f64; 2], dt: f64) -> [f64; 2] {
        let direction = f64::from(i8::from(action > 0.0) - i8::from(action < 0.0));
        self.opening = (self.opening - COMMAND_RATE * dt * direction).clamp(-1.0, 1.0);
        let opening = 0.5 * TRAVEL * (1.0 + self.opening);
        let servo = |target: f64, q: f64| (SERVO_STIFFNESS * (target - q)).clamp(-MAX_FORCE, MAX_FORCE);
        [servo(opening, q[0]), servo(-opening, q[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_sign_of_the_action_counts_and_nan_has_none() {
        let after = |actions: &[f64]| {
            let mut gripper = Gripper::default();
            actions.iter().map(|&action| gripper.update(action, [0.5 * TRAVEL, -0.5 * TRAVEL], 1e-3)).last().unwrap()
        };
        assert_eq!(after(&[0.3]), after(&[1.0]));
        assert!(after(&[-1.0])[0] > after(&[0.0])[0] && after(&[1.0])[0] < after(&[0.0])[0]);
        assert_eq!(after(&[1.0, f64::NAN]), after(&[1.0, 0.0]));
    }
}
