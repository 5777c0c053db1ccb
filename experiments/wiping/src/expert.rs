//! The script: above the spot, down to contact, press, circle. One action per 50 ms.

use aforce::{Controller, Measurement, Pose, Vector3, encode, pose_error};
use nalgebra::Translation3;
use physics::wiping_tool::facing_down;

use crate::record::Phase;
use crate::setup::Setup;

/// Height above the believed table from which the tool is lowered (m).
const CLEARANCE: f64 = 0.02;
/// Distance by which an action lowers the goal (m): 4 cm/s.
const LOWERING: f64 = 0.002;
/// Distance from the waypoint and angle at which the approach ends (m, rad).
const ARRIVED: (f64, f64) = (0.01, 0.1);
/// Rotations over which the radius of the circle grows to its full size.
const RAMP: f64 = 0.5;

/// The running script.
pub(crate) struct Expert {
    setup: Setup,
    /// Middle of the spot on the table, as believed (m, world).
    spot: Vector3,
    phase: Phase,
    /// Actions since the phase began.
    actions: u32,
}

impl Expert {
    pub fn new(setup: &Setup, spot: Vector3) -> Self {
        Expert { setup: setup.clone(), spot, phase: Phase::Approach, actions: 0 }
    }

    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The next action in [-1, 1]^7; `None` when all is done.
    pub fn action(&mut self, controller: &Controller, y: &Measurement) -> Option<Vec<f64>> {
        self.actions += 1;
        if self.is_over(controller, y) {
            (self.phase, self.actions) = (self.phase.next()?, 0);
        }
        let config = &self.setup.controller;
        let goal = Pose::from_parts(Translation3::from(self.target(controller, y)), facing_down());
        let delta = pose_error(&goal, &controller.origin(y));
        Some(encode(controller.space(), config, &delta, self.setup.force))
    }

    fn is_over(&self, controller: &Controller, y: &Measurement) -> bool {
        let time = f64::from(self.actions) / f64::from(self.setup.controller.policy_hz);
        match self.phase {
            Phase::Approach => {
                let distance = (y.pose.translation.vector - self.spot).xy().norm();
                let arrived = distance < ARRIVED.0 && y.pose.rotation.angle_to(&facing_down()) < ARRIVED.1;
                arrived && y.pose.translation.z < self.spot.z + 1.5 * CLEARANCE || controller.engagement() > 0.0
            }
            Phase::Lower => controller.engagement() >= 1.0,
            Phase::Press => time >= self.setup.press_time,
            Phase::Wipe => self.rotations() >= f64::from(self.setup.rotations),
        }
    }

    /// Where the tool is to be next (m, world).
    fn target(&self, controller: &Controller, y: &Measurement) -> Vector3 {
        let mut target = self.spot;
        if self.phase == Phase::Wipe {
            let radius = self.setup.circle_radius * (self.rotations() / RAMP).min(1.0);
            let (sin, cos) = (std::f64::consts::TAU * self.rotations()).sin_cos();
            target += radius * Vector3::new(cos, sin, 0.0);
        }
        // On the table force control has the height and the goal stays with the tool; off it, look for the table. In
        // between the goal rests: one that follows the tool would throw a stiff arm back into the air.
        let goal = controller.goal().translation.z;
        target.z = match self.phase {
            Phase::Approach => self.spot.z + CLEARANCE,
            _ if controller.engagement() >= 1.0 => y.pose.translation.z,
            _ if controller.engagement() > 0.0 => goal,
            _ => goal - LOWERING,
        };
        target
    }

    /// Rotations since circling began.
    fn rotations(&self) -> f64 {
        f64::from(self.actions) / (f64::from(self.setup.controller.policy_hz) * self.setup.period)
    }
}
