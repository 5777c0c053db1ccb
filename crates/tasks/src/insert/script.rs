//! The script of Insert. It moves the peg above the believed hole and presses it down. If the peg meets the rim, the script taps along a
//! spiral until the peg drops into the hole.

use aforce::{Measurement, Pose, Vector3, pose_error};
use nalgebra::{Translation3, UnitQuaternion, Vector2};

use crate::task::Waypoint;

/// Height above the believed rim to which the peg goes first (m): several standard deviations of the belief.
const HOVER: f64 = 0.005;
/// Height above the felt rim at which the peg moves from one tap to the next (m).
const HOP: f64 = 0.001;
/// The peg goes down once it is within this distance of its place (m) ...
const PLACED: f64 = 7e-4;
/// ... and within this angle of upright (rad), ...
const UPRIGHT: f64 = 0.03;
/// ... or after so many actions.
const LONGEST_MOVE: u32 = 60;
/// Force with which the script presses (N).
const PRESS: f64 = 8.0;
/// Force from which the peg is in contact (N).
const CONTACT: f64 = 1.5;
/// How far each action moves the goal down for each newton that is missing to [`PRESS`] (m/N), and at most (m). How
/// fast the peg may sink above the rim and in the hole (m/s).
const DEEPER: f64 = 5e-4;
const MOST_DEEPER: f64 = 1e-3;
const SINKING: [f64; 2] = [0.01, 0.02];
/// Distance of the points of the spiral from each other (m).
const SPACING: f64 = 1.65e-3;
/// Number of points after which the spiral begins again in the middle.
const POINTS: u32 = 30;
/// The peg's end is in the hole once it is this far below the highest place where it pressed (m).
const DROP: f64 = 3.5e-4;
/// Distance to the goal, as a multiple of the distance that is left: the joints' friction holds a soft spring back.
const BEYOND: f64 = 2.5;
/// Share of the remaining distance that each action adds to an integrator. Without it friction would keep the hand away from its place.
const INTEGRATION: f64 = 0.2;
/// The integrator of the distance changes only while less than this is left sideways (m) and the peg is not in contact.
const NEAR: f64 = 0.003;
/// A hand slower than this counts as at rest (m/s).
const AT_REST: f64 = 0.03;
/// Largest integral along each axis, and largest depth of the goal below the peg's end (m).
const MOST: f64 = 0.04;
/// Largest integral about each axis (rad).
const MOST_LEANING: f64 = 0.02;
/// How far the goal goes in the direction in which a wall pushes (m/N), and at most (m).
const YIELD: f64 = 5e-4;
const MOST_YIELD: f64 = 2e-3;
/// A peg that gets less than this deeper in an action is stuck (m). Its goal then goes around in a circle of this
/// radius (m), by this angle per action (rad).
const STUCK: f64 = 5e-5;
const WIGGLE: f64 = 6e-4;
const TURN: f64 = 1.0;
/// Actions after which a peg that is stuck on the rim goes to the next point.
const PATIENCE: u32 = 3;
/// Actions after which a peg that is stuck in the hole is jammed. It is pulled towards a goal so far above it (m), then
/// pushed again.
const JAMMED: u32 = 10;
const RELIEF: f64 = 0.004;

/// Where peg and hole are, as the script knows them (m, world).
pub struct Seen {
    /// The peg's end.
    pub end: Vector3,
    /// The middle of the rim, believed.
    pub rim: Vector3,
    /// Rotation of a hand whose peg stands upright and fits.
    pub upright: UnitQuaternion<f64>,
    /// Whether the peg is in.
    pub done: bool,
}

/// What the script remembers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Script {
    phase: Phase,
    /// Integrator of the remaining distance (m, world); its gain is [`INTEGRATION`].
    missing: Vector3,
    /// Integrator of the rotation that is left to the upright hand (rad, world); its gain is [`INTEGRATION`].
    leaning: Vector3,
    /// Index of the present point of the spiral.
    point: u32,
    /// How far below the peg's end its goal is (m).
    depth: f64,
    /// Greatest height of the peg's end where it pressed on something (m).
    touched: Option<f64>,
    /// Height of the peg's end after the last action (m).
    height: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// The peg goes to its place above the point, for so many actions so far.
    Move(u32),
    /// The peg is pressed down, and was stuck in so many actions so far.
    Press(u32),
}

impl Default for Phase {
    fn default() -> Self {
        Phase::Move(0)
    }
}

/// A point of the spiral, about as far from its neighbours on the same turn as from those on the next.
fn spiral(point: u32) -> Vector2<f64> {
    // Of an Archimedean spiral: way = pitch angle^2 / (4 pi).
    let angle = (4.0 * std::f64::consts::PI * f64::from(point)).sqrt();
    let (sin, cos) = libm::sincos(angle);
    Vector2::new(cos, sin) * (SPACING * angle / std::f64::consts::TAU)
}

/// The rotation that makes the hand upright (rad, world).
fn leaning(seen: &Seen, y: &Measurement) -> Vector3 {
    let upright = Pose::from_parts(y.pose.translation, seen.upright);
    pose_error(&upright, &y.pose).fixed_rows::<3>(3).into()
}

impl Script {
    /// Updates the script's memory with the outcome of an action.
    pub fn advance(&mut self, seen: &Seen, y: &Measurement) {
        let velocity = y.twist.fixed_rows::<3>(0);
        let up = y.wrench.z;
        if up > CONTACT {
            self.touched = Some(self.touched.map_or(seen.end.z, |touched| touched.max(seen.end.z)));
        }
        let inside = self.is_inside(seen);
        let (aim, before) = (self.above(seen), self.phase);
        self.phase = match self.phase {
            Phase::Move(actions) => {
                let turn = y.pose.rotation.angle_to(&seen.upright);
                let aside = (aim - seen.end).xy().norm();
                let placed = aside < PLACED && turn < UPRIGHT && (seen.end.z - aim.z).abs() < HOVER;
                let settled = placed && velocity.norm() < AT_REST;
                if settled || actions > LONGEST_MOVE { Phase::Press(0) } else { Phase::Move(actions + 1) }
            }
            Phase::Press(stuck) if up < CONTACT || self.height - seen.end.z > STUCK => Phase::Press(stuck),
            Phase::Press(stuck) if !inside && stuck > PATIENCE => {
                self.point = (self.point + 1) % POINTS;
                Phase::Move(0)
            }
            Phase::Press(stuck) if stuck > JAMMED => {
                self.depth = -RELIEF;
                Phase::Press(0)
            }
            Phase::Press(stuck) => Phase::Press(stuck + 1),
        };
        self.height = seen.end.z;
        if !matches!((before, self.phase), (Phase::Press(_), Phase::Press(_))) {
            self.depth = 0.0;
        }
        let left = self.above(seen) - seen.end;
        if up < CONTACT && left.xy().norm() < NEAR {
            let sum = self.missing + INTEGRATION * left;
            self.missing = sum.map(|sum| sum.clamp(-MOST, MOST));
        }
        let sum = self.leaning + INTEGRATION * leaning(seen, y);
        self.leaning = sum.map(|sum| sum.clamp(-MOST_LEANING, MOST_LEANING));
        match self.phase {
            Phase::Move(_) => {}
            Phase::Press(_) => {
                self.missing.z = 0.0;
                let fastest = SINKING[usize::from(inside)];
                let deeper = if -velocity.z > fastest { -MOST_DEEPER } else { DEEPER * (PRESS - up) };
                self.depth = (self.depth + deeper.clamp(-MOST_DEEPER, MOST_DEEPER)).clamp(-MOST, MOST);
            }
        }
    }

    /// Whether the peg's end is in the hole: more than [`DROP`] below the highest place where it pressed.
    fn is_inside(&self, seen: &Seen) -> bool {
        self.touched.is_some_and(|touched| seen.end.z < touched - DROP)
    }

    /// Where the peg's end goes between taps (m, world).
    fn above(&self, seen: &Seen) -> Vector3 {
        let place = seen.rim.xy() + spiral(self.point);
        let height = self.touched.map_or(seen.rim.z + HOVER, |touched| touched + HOP);
        Vector3::new(place.x, place.y, height)
    }

    /// Where the tool is to go.
    pub fn waypoint(&self, seen: &Seen, y: &Measurement) -> Waypoint {
        let way = match self.phase {
            Phase::Move(_) => {
                let way = BEYOND * (self.above(seen) - seen.end) + self.missing;
                // Up first, because the peg may still be between the hole's walls.
                let free = self.touched.is_none_or(|touched| seen.end.z > touched + HOP / 4.0);
                if free { way } else { Vector3::z() * way.z }
            }
            Phase::Press(_) if seen.done => Vector3::zeros(),
            Phase::Press(_) if y.wrench.z < CONTACT && !self.is_inside(seen) => {
                let aside = BEYOND * (self.above(seen) - seen.end) + self.missing;
                Vector3::new(aside.x, aside.y, -self.depth)
            }
            Phase::Press(stuck) => {
                let felt = YIELD * y.wrench.xy();
                let mut sideways = felt * (MOST_YIELD / felt.norm().max(MOST_YIELD));
                if stuck > 0 {
                    let (sin, cos) = libm::sincos(TURN * f64::from(stuck));
                    sideways += WIGGLE * Vector2::new(cos, sin);
                }
                Vector3::new(sideways.x, sideways.y, -self.depth)
            }
        };
        let to = Translation3::from(y.pose.translation.vector + way);
        // A peg that leans by 0.01 rad jams in a hole that is 1 % wider.
        let turn = (BEYOND - 1.0) * leaning(seen, y) + self.leaning;
        let rotation = UnitQuaternion::from_scaled_axis(turn) * seen.upright;
        Waypoint { pose: Pose::from_parts(to, rotation), grip: 1.0, force: 0.0 }
    }
}
