//! What the arm does by itself: one action per 50 ms, by the phases of the wiping experiment.

use aforce::host::{Host, HostSetup};
use aforce::{Pose, Vector3, encode, pose_error};

use crate::cli::Script;

/// Circles, their radius (m) and the time of one (s).
const ROTATIONS: f64 = 8.0;
const RADIUS: f64 = 0.05;
const PERIOD: f64 = 2.5;
/// Rotations over which the radius grows to its full size.
const RAMP: f64 = 0.5;
/// Distance by which an action lowers the goal (m): 4 cm/s.
const LOWERING: f64 = 0.002;
/// Force to press with (N), and the time of pressing without motion (s).
const FORCE: f64 = 10.0;
const PRESS_TIME: f64 = 3.0;

/// Part of a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Stays.
    Hold,
    /// Down until the force controller is engaged.
    Lower,
    /// Presses without motion.
    Press,
    /// Circles.
    Wipe,
}

impl Phase {
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Lower => "lower",
            Self::Press => "press",
            Self::Wipe => "wipe",
        }
    }
}

/// The running script.
pub struct Running {
    script: Script,
    phase: Phase,
    /// Where it began: height and orientation in the air, middle of the circles.
    start: Pose,
    /// Actions since the phase began, and their rate (Hz).
    actions: u32,
    hz: f64,
}

impl Running {
    pub fn new(script: Script, setup: &HostSetup, start: Pose) -> Self {
        let phase = match script {
            Script::Hold => Phase::Hold,
            Script::Circle => Phase::Wipe,
            Script::Wipe => Phase::Lower,
        };
        Self { script, phase, start, actions: 0, hz: f64::from(setup.controller.policy_hz) }
    }

    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The next action; `None` when all is done.
    pub fn action(&mut self, host: &Host, setup: &HostSetup) -> Option<Vec<f64>> {
        self.actions += 1;
        let (controller, y) = (host.controller(), host.measurement()?);
        let next = match self.phase {
            Phase::Lower if controller.engagement() >= 1.0 => Some(Phase::Press),
            Phase::Press if f64::from(self.actions) >= PRESS_TIME * self.hz => Some(Phase::Wipe),
            Phase::Wipe if self.rotations() >= ROTATIONS => return None,
            _ => None,
        };
        if let Some(next) = next {
            (self.phase, self.actions) = (next, 0);
        }
        let mut target: Vector3 = self.start.translation.vector;
        if self.phase == Phase::Wipe {
            let radius = RADIUS * (self.rotations() / RAMP).min(1.0);
            let (sin, cos) = (std::f64::consts::TAU * self.rotations()).sin_cos();
            target += radius * Vector3::new(cos, sin, 0.0);
        }
        if self.script == Script::Wipe {
            // On the table force control has the height and the goal stays with the tool; off it, look for the table.
            target.z = match controller.engagement() {
                share if share >= 1.0 => y.pose.translation.z,
                share if share > 0.0 => controller.goal().translation.z,
                _ => controller.goal().translation.z - LOWERING,
            };
        }
        let goal = Pose::from_parts(target.into(), self.start.rotation);
        let delta = pose_error(&goal, &controller.origin(y));
        let force = if self.script == Script::Wipe { FORCE } else { 0.0 };
        Some(encode(controller.space(), &setup.controller, &delta, force))
    }

    /// Rotations since circling began.
    fn rotations(&self) -> f64 {
        f64::from(self.actions) / (self.hz * PERIOD)
    }
}
