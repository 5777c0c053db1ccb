//! A script that wipes: it moves above a place, lowers the tool until the force controller is engaged, presses, and circles. The script
//! reads only the controller and its measurement, so that a simulated arm and a real one run the same script.

use std::f64::consts::TAU;

use crate::law::action::encode;
use crate::law::config::ControllerConfig;
use crate::law::controller::Controller;
use crate::spatial::{Measurement, Pose, Vector3, pose_error};

/// Height above the assumed height of the table from which the tool is lowered (m).
const CLEARANCE: f64 = 0.02;
/// Distance by which an action lowers the goal (m): 4 cm/s at 20 actions per second.
const LOWERING: f64 = 0.002;
/// Horizontal distance from the place (m) and angle (rad) below which the approach may end.
const ARRIVED: (f64, f64) = (0.01, 0.1);
/// Rotations over which the radius of the circle grows to its full size.
const RAMP: f64 = 0.5;

/// Force, time and circles of a wiping script.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundPath {
    /// Force to press with (N).
    pub force: f64,
    /// Time of pressing without motion (s).
    pub press_time: f64,
    /// Number of circles.
    pub rotations: u32,
    /// Radius of the circles (m).
    pub circle_radius: f64,
    /// Time of one circle (s).
    pub period: f64,
}

impl Default for RoundPath {
    /// The values of the wiping experiment.
    fn default() -> Self {
        RoundPath { force: 10.0, press_time: 3.0, rotations: 8, circle_radius: 0.05, period: 2.5 }
    }
}

/// Part of the script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
pub enum Phase {
    /// Moving to a place above the centre of the circles.
    Approach,
    /// Lowering the tool until the force controller is engaged.
    Lower,
    /// Pressing without motion.
    Press,
    /// Circling.
    Wipe,
}

impl Phase {
    /// The next phase; `None` after the last.
    fn next(self) -> Option<Self> {
        match self {
            Phase::Approach => Some(Phase::Lower),
            Phase::Lower => Some(Phase::Press),
            Phase::Press => Some(Phase::Wipe),
            Phase::Wipe => None,
        }
    }

    /// Name of the phase in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Phase::Approach => "approach",
            Phase::Lower => "lower",
            Phase::Press => "press",
            Phase::Wipe => "wipe",
        }
    }
}

/// The running script. It needs an action space with a commanded force, except for circles
/// [in the air](Wiper::in_the_air).
#[derive(Debug, Clone)]
pub struct Wiper {
    path: RoundPath,
    /// Centre of the circles, at the assumed height of the table, and orientation of the tool (m, world).
    middle: Pose,
    /// Whether there is a table.
    table: bool,
    phase: Phase,
    /// Actions since the phase began.
    actions: u32,
}

impl Wiper {
    /// Wipes around `middle`, a pose of the tool on the table (m, world). The tool may start anywhere.
    #[must_use]
    pub fn new(path: RoundPath, middle: Pose) -> Self {
        Wiper { path, middle, table: true, phase: Phase::Approach, actions: 0 }
    }

    /// The same, starting from a pose of the tool above the table (m, world). The table's height need not be known.
    #[must_use]
    pub fn from_above(path: RoundPath, above: Pose) -> Self {
        Wiper { phase: Phase::Lower, ..Wiper::new(path, above) }
    }

    /// Circles around `middle` (m, world), without a table.
    #[must_use]
    pub fn in_the_air(path: RoundPath, middle: Pose) -> Self {
        Wiper { table: false, phase: Phase::Wipe, ..Wiper::new(path, middle) }
    }

    /// The present phase.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The next action in [-1, 1]^n; `None` when the script is done. Call this `policy_hz` times a second. `y` is the measurement that
    /// `controller` was given last.
    pub fn action(&mut self, controller: &Controller, config: &ControllerConfig, y: &Measurement) -> Option<Vec<f64>> {
        self.actions += 1;
        let hz = f64::from(config.policy_hz);
        if self.is_over(controller, y, hz) {
            (self.phase, self.actions) = (self.phase.next()?, 0);
        }
        let goal = Pose::from_parts(self.target(controller, y, hz).into(), self.middle.rotation);
        let delta = pose_error(&goal, &controller.origin(y));
        Some(encode(controller.space(), config, &delta, if self.table { self.path.force } else { 0.0 }))
    }

    fn is_over(&self, controller: &Controller, y: &Measurement, hz: f64) -> bool {
        match self.phase {
            Phase::Approach => {
                let middle = self.middle.translation.vector;
                let distance = (y.pose.translation.vector - middle).xy().norm();
                let arrived = distance < ARRIVED.0 && y.pose.rotation.angle_to(&self.middle.rotation) < ARRIVED.1;
                arrived && y.pose.translation.z < middle.z + 1.5 * CLEARANCE || controller.engagement() > 0.0
            }
            Phase::Lower => controller.engagement() >= 1.0,
            Phase::Press => f64::from(self.actions) / hz >= self.path.press_time,
            Phase::Wipe => self.rotations(hz) >= f64::from(self.path.rotations),
        }
    }

    /// The tool's next target (m, world).
    fn target(&self, controller: &Controller, y: &Measurement, hz: f64) -> Vector3 {
        let mut target = self.middle.translation.vector;
        if self.phase == Phase::Wipe {
            let rotations = self.rotations(hz);
            let radius = self.path.circle_radius * (rotations / RAMP).min(1.0);
            let (sin, cos) = libm::sincos(TAU * rotations);
            target += radius * Vector3::new(cos, sin, 0.0);
        }
        if !self.table {
            return target;
        }
        // Once force control is engaged, it keeps the height, and the goal stays with the tool. Without contact the goal is lowered to find
        // the table. While force control engages the goal rests: a goal that follows the tool would throw a stiff arm back into the air.
        let goal = controller.goal().translation.z;
        target.z = match self.phase {
            Phase::Approach => target.z + CLEARANCE,
            _ if controller.engagement() >= 1.0 => y.pose.translation.z,
            _ if controller.engagement() > 0.0 => goal,
            _ => goal - LOWERING,
        };
        target
    }

    /// Rotations since circling began.
    fn rotations(&self, hz: f64) -> f64 {
        f64::from(self.actions) / (hz * self.path.period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Arm;
    use crate::testing::gantry;

    const PATH: RoundPath = RoundPath { force: 10.0, press_time: 1.0, rotations: 2, circle_radius: 0.05, period: 2.5 };

    /// The first `most` goals of `wiper` (m), for a tool that begins at `start` and reaches each goal at once.
    fn way(mut wiper: Wiper, space: &str, start: Pose, most: usize) -> Vec<Vector3> {
        let config = ControllerConfig::default();
        let mut y = Measurement { pose: start, ..gantry([1.0; 6]) };
        let mut controller = Controller::new(&space.parse().unwrap(), &config, &Arm::PANDA, Vector3::z_axis()).unwrap();
        controller.reset(&y);
        let mut way = vec![];
        while let Some(action) = wiper.action(&controller, &config, &y).filter(|_| way.len() < most) {
            controller.set_goal(&action, &y);
            y.pose = *controller.goal();
            way.push(y.pose.translation.vector);
        }
        way
    }

    #[test]
    fn circles_in_the_air_are_round_and_come_to_an_end() {
        let middle = Pose::translation(0.4, 0.1, 0.3);
        let way = way(Wiper::in_the_air(PATH, middle), "low", middle, 1000);
        assert_eq!(way.len(), 99, "two rotations of 50 actions, the last of which would be the end");
        for (i, at) in way.iter().enumerate() {
            let rotations = (i + 1) as f64 / 50.0;
            let (radius, angle) = (0.05 * (2.0 * rotations).min(1.0), TAU * rotations);
            let expected = middle.translation.vector + radius * Vector3::new(angle.cos(), angle.sin(), 0.0);
            assert!((at - expected).norm() < 1e-9, "{at} after {rotations} rotations");
        }
    }

    /// The tool first moves above the place, then down at 4 cm/s for as long as there is no contact.
    #[test]
    fn without_a_table_the_tool_is_lowered_for_ever() {
        let middle = Pose::translation(0.4, 0.1, 0.3);
        let way = way(Wiper::new(PATH, middle), "low-force", Pose::translation(0.3, 0.1, 0.5), 100);
        let arrived =
            way.iter().position(|at| (at - Vector3::new(0.4, 0.1, 0.32)).norm() < 1e-9).expect("above the place");
        let down = &way[arrived + 1..];
        assert!(down.len() > 50);
        for (i, at) in down.iter().enumerate() {
            let expected = Vector3::new(0.4, 0.1, 0.32 - 0.002 * (i + 1) as f64);
            assert!((at - expected).norm() < 1e-9, "{at}");
        }
    }
}
