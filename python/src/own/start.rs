//! What a task draws for an episode: where bodies and joints start, the arm's posture, what the fingers hold.

use std::collections::BTreeMap;

use aforce::JointVector;
use physics::gripper::WIDEST;
use physics::robots::Robot;
use physics::scene::{Joint, Scene};
use serde::Deserialize;
use tasks::{Fingers, Start};

use super::bodies::pose;

/// What `reset` returned.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Drawn {
    /// Pose of a body in its parent's frame, by name.
    poses: BTreeMap<String, Vec<f64>>,
    /// Position of a joint (rad or m), by name.
    joints: BTreeMap<String, f64>,
    /// Joint angles of the arm (rad).
    arm: Option<[f64; 7]>,
    /// Distance of the finger pads (m).
    fingers: Option<f64>,
    holding: Option<Holding>,
}

/// A body in the hand.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Holding {
    body: String,
    /// Its pose as seen from the tool point.
    #[serde(default)]
    grip: Vec<f64>,
    /// Its size along x of the tool (m).
    width: f64,
}

/// A joint and its position (rad or m).
pub type Position = (usize, f64);

impl Drawn {
    /// Puts the poses into `scene`. Returns how arm and fingers start, and where joints start.
    ///
    /// # Errors
    /// A message with the name of what is wrong.
    pub fn lay_out(
        self,
        scene: &mut Scene,
        first: usize,
        robot: &Robot,
        fingers: bool,
    ) -> Result<(Start, Vec<Position>), String> {
        let find = |scene: &Scene, name: &str| {
            let own = scene.bodies[first..].iter().position(|body| body.name == name);
            let known = || scene.bodies[first..].iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join(", ");
            own.map(|i| first + i).ok_or_else(|| format!("the scene has no body {name:?}; known are {}", known()))
        };
        for (name, numbers) in &self.poses {
            let body = find(scene, name)?;
            scene.bodies[body].pose = pose(numbers).map_err(|words| format!("poses: {name:?}: {words}"))?;
        }
        let mut joints = vec![];
        for (name, &position) in &self.joints {
            joints.push((joint_place(scene, first, name, position)?, position));
        }
        let mut start = Start::at(self.arm.map_or(robot.home, JointVector::from));
        for (i, (q, [low, high])) in start.q.iter().zip(robot.arm.range).enumerate() {
            if !(low..=high).contains(q) {
                return Err(format!("arm: joint {} at {q} rad; {low} to {high} are allowed", i + 1));
            }
        }
        let (word, width) = match (self.fingers, &self.holding) {
            (Some(_), Some(_)) => return Err("fingers and holding; one of them is wanted, holding has a width".into()),
            (width, None) => ("fingers", width),
            (None, Some(holding)) => ("holding: width", Some(holding.width)),
        };
        if let Some(width) = width {
            if !fingers {
                return Err(format!("{word}: the tool has no fingers"));
            }
            if !(0.0..=WIDEST).contains(&width) {
                return Err(format!("{word} {width} m; 0 to {WIDEST} are allowed"));
            }
            start.fingers = Fingers::Apart(width);
        }
        if let Some(Holding { body, grip, width }) = self.holding {
            let place = find(scene, &body)?;
            if scene.bodies[place].joint != Joint::Free {
                return Err(format!("holding: {body:?} is not free; a free body is wanted"));
            }
            let grip = pose(&grip).map_err(|words| format!("holding: grip: {words}"))?;
            start.fingers = Fingers::Holding { body: place, grip, width };
        }
        scene.check().map_err(|wrong| wrong.to_string())?;
        Ok((start, joints))
    }
}

/// Index of one of the task's joints among all joints of the scene; checks that `position` is in the joint's range.
fn joint_place(scene: &Scene, first: usize, name: &str, position: f64) -> Result<usize, String> {
    let mut known = vec![];
    for body in &scene.bodies[first..] {
        let (Joint::Hinge(axis) | Joint::Slide(axis)) = &body.joint else { continue };
        if axis.name == name {
            let [low, high] = axis.range;
            if !position.is_finite() || !(low..=high).contains(&position) {
                return Err(format!("joints: {name:?} at {position}; {low} to {high} are allowed"));
            }
            return Ok(scene.joint(name));
        }
        known.push(axis.name.as_str());
    }
    Err(format!(
        "the scene has no joint {name:?}; known are {}",
        if known.is_empty() { "none".into() } else { known.join(", ") }
    ))
}
