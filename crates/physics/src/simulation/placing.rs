//! Puts everything in place at the start of an episode.

use aforce::{JointVector, Pose, Vector3};

use super::Simulation;
use crate::contact::ContactReading;
use crate::gripper::{INITIAL_OPENING, WIDEST, finger_at};

impl Simulation {
    /// Starts an episode: arm at rest at `q` (rad), gripper half open, no load, no push, contact readings zero. For an arm of six joints
    /// the seventh angle is ignored.
    ///
    /// Free bodies stay where they are: [`place`](Self::place) them. The engine keeps its contacts and the impulses that
    /// its solver starts from, so only a new simulation repeats an episode to the last bit.
    pub fn reset(&mut self, q: &JointVector) {
        let joints = self.model.joints();
        for (i, &q) in q.iter().enumerate().take(joints) {
            self.engine.set_coordinate(i, q, 0.0);
        }
        for i in joints..self.efforts.len() {
            self.engine.set_coordinate(i, 0.0, 0.0);
        }
        if let Some([left, right]) = self.fingers {
            self.engine.set_coordinate(left, INITIAL_OPENING, 0.0);
            self.engine.set_coordinate(right, -INITIAL_OPENING, 0.0);
        }
        self.engine.settle();
        self.look();
        if let Some(gripper) = &mut self.gripper {
            gripper.reset();
        }
        self.friction.reset();
        self.contact = ContactReading::default();
        self.contacts.fill(self.contact);
        self.loads.fill(0.0);
        self.push = Vector3::zeros();
        self.hand = None;
        self.steps = 0;
    }

    /// After a [`reset`](Self::reset): puts the finger pads `distance` (m) apart, where they stay until the gripper is commanded.
    ///
    /// # Panics
    /// If the tool has no fingers, or `distance` is not between 0 and [`WIDEST`].
    pub fn open_fingers(&mut self, distance: f64) {
        assert!((0.0..=WIDEST).contains(&distance), "{distance} m between the finger pads: 0 to {WIDEST} are possible");
        let ([left, right], gripper) = self.fingers.zip(self.gripper.as_mut()).expect("a tool with fingers");
        let coordinate = finger_at(distance);
        self.engine.set_coordinate(left, coordinate, 0.0);
        self.engine.set_coordinate(right, -coordinate, 0.0);
        self.engine.settle();
        gripper.keep(coordinate);
    }

    /// After a [`reset`](Self::reset): puts a free body into the hand, at `grip` as seen from the tool point, with the finger pads
    /// `width` (m) apart, the body's size along x of the tool. The fingers press on it until they are commanded to
    /// open. The servo of each gives 1 N for each millimetre of half the width plus 0.5 N, 20 N at most.
    ///
    /// # Panics
    /// As [`open_fingers`](Self::open_fingers); also if the body is fixed.
    pub fn put_in_hand(&mut self, body: usize, grip: &Pose, width: f64) {
        self.open_fingers(width);
        self.engine.place(body, &(self.arm.pose * grip));
        self.gripper.as_mut().expect("a tool with fingers").close();
    }

    /// After a [`reset`](Self::reset): puts joint `i` (its place in the scene, arm first) at `q` (rad or m), at rest.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn set_joint(&mut self, i: usize, q: f64) {
        self.engine.set_coordinate(i, q, 0.0);
        self.engine.settle();
        self.look();
    }

    /// Puts a free body at rest at `pose` (world), and with it what joints carry on it.
    ///
    /// # Panics
    /// If it is fixed.
    pub fn place(&mut self, body: usize, pose: &Pose) {
        self.engine.place(body, pose);
    }
}
