//! What stops the arm's joints at the ends of their travel: MuJoCo's joint limit, with its default parameters.
//!
//! MuJoCo 3.2.7, documentation, Computation, "Constraint model" and "Parameters". Beyond its range a joint is to
//! accelerate back with a = -b v - k r, r being the overshoot. Of the acceleration that everything else gives the joint,
//! the stop leaves a small share, 1 - d. So the stop is hard at rest and critically damped on impact, whatever the joint's inertia.

use aforce::{JointMatrix, JointVector, Measurement};

use crate::model::Model;
use crate::scene::{Axis, Stop};

/// Time constant (s) of the way back.
const TIME_CONSTANT: f64 = 0.02;
/// d at the end of the range, and from [`WIDTH`] beyond it on.
const IMPEDANCE: [f64; 2] = [0.9, 0.95];
/// Overshoot at which d reaches its second value (rad).
const WIDTH: f64 = 1e-3;
/// Passes over the joints: their stops act on one another through the inertia.
const PASSES: usize = 50;

/// The stops of the arm's joints. An arm of six joints has none in the seventh place.
pub(crate) struct ArmStops {
    /// Range of each joint (rad); infinite for a joint without such a stop.
    range: [[f64; 2]; 7],
    /// Diagonal of M^-1 at joint angles zero (1/(kg m2)): scale of MuJoCo's regularisation (1 - d)/d.
    compliance: JointVector,
    /// Time constant of the way back (s).
    time_constant: f64,
}

impl ArmStops {
    /// Stops of the arm `model`, whose joints are the first of `axes`, for steps of `dt` (s).
    pub fn new(model: &Model, axes: &[Axis], dt: f64) -> Self {
        ArmStops {
            range: std::array::from_fn(|i| match axes.iter().take(model.joints()).nth(i) {
                Some(Axis { stop: Stop::Constraint, range, .. }) => *range,
                _ => [f64::NEG_INFINITY, f64::INFINITY],
            }),
            compliance: inverse(&model.mass(&model.kinematics(&JointVector::zeros()))).diagonal(),
            // A shorter time constant would be unstable.
            time_constant: TIME_CONSTANT.max(2.0 * dt),
        }
    }

    /// Torques (Nm) of the stops on the joints in the state `arm`, which are driven by `tau` (Nm). Stops push and never pull.
    pub fn torque(&self, arm: &Measurement, tau: &JointVector) -> JointVector {
        // Sign of the direction into the range, and the overshoot (rad).
        let beyond: [Option<(f64, f64)>; 7] = std::array::from_fn(|i| match self.range[i] {
            [lower, _] if arm.q[i] < lower => Some((1.0, lower - arm.q[i])),
            [_, upper] if arm.q[i] > upper => Some((-1.0, arm.q[i] - upper)),
            _ => None,
        });
        let mut stops = JointVector::zeros();
        if beyond.iter().all(Option::is_none) {
            return stops;
        }
        let mobility = inverse(&arm.mass);
        let driven = mobility * (tau - arm.bias);
        for _ in 0..PASSES {
            for (i, (inwards, overshoot)) in beyond.iter().enumerate().filter_map(|(i, b)| Some((i, (*b)?))) {
                let d = impedance(overshoot);
                let wanted = self.way_back(d, overshoot, inwards * arm.qd[i]);
                let now = inwards * (driven[i] + (mobility.row(i) * stops)[0]);
                let given_way = (1.0 - d) / d * self.compliance[i];
                let torque = inwards * stops[i];
                let missing = (wanted - now - given_way * torque) / (mobility[(i, i)] + given_way);
                stops[i] = inwards * (torque + missing).max(0.0);
            }
        }
        stops
    }

    /// Wanted acceleration into the range (rad/s2), at an overshoot (rad) and a velocity into the range (rad/s).
    fn way_back(&self, d: f64, overshoot: f64, velocity: f64) -> f64 {
        let rate = 1.0 / (IMPEDANCE[1] * self.time_constant);
        d * rate * rate * overshoot - 2.0 * rate * velocity
    }
}

/// MuJoCo's d: two parabolas that meet in the middle of the width.
fn impedance(overshoot: f64) -> f64 {
    let x = (overshoot / WIDTH).min(1.0);
    let rise = if x < 0.5 { 2.0 * x * x } else { 1.0 - 2.0 * (1.0 - x) * (1.0 - x) };
    IMPEDANCE[0] + (IMPEDANCE[1] - IMPEDANCE[0]) * rise
}

fn inverse(mass: &JointMatrix) -> JointMatrix {
    mass.cholesky().expect("a mass matrix").inverse()
}
