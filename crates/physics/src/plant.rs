//! What a simulation needs besides a scene.

use aforce::{ConfigError, within};
use serde::{Deserialize, Serialize};

use crate::deviation::Deviation;
use crate::robots::Robot;

/// The robot, the control rate, the engine settings, and the deviation from the controller's model.
#[derive(Debug, Clone)]
pub struct Plant {
    /// The robot.
    pub robot: Robot,
    /// Length of one control sample (s). One longer than 2 ms is simulated in several equal parts.
    pub dt: f64,
    /// Engine settings.
    pub config: SimulationConfig,
    /// What the controller's model does not know.
    pub deviation: Deviation,
}

/// Settings of the engine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimulationConfig {
    /// Engine substeps inside one control sample, or inside each part of a sample longer than 2 ms. At 2 ms, one has the
    /// accuracy of MuJoCo's Euler integrator at the same step, two halve the error and cost a third more time.
    pub substeps: usize,
    /// Cut-off of the low-pass on the contact wrench that the controller reads (Hz).
    pub force_cutoff_hz: f64,
    /// Cut-off of the low-pass that makes the sustained force ([`ContactReading::sustained`](crate::ContactReading::sustained)) (Hz).
    pub sustained_cutoff_hz: f64,
}

impl Default for SimulationConfig {
    fn default() -> Self {
        SimulationConfig { substeps: 1, force_cutoff_hz: 100.0, sustained_cutoff_hz: 12.0 }
    }
}

impl SimulationConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field (below `simulation`) and range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let Self { substeps, force_cutoff_hz, sustained_cutoff_hz } = *self;
        within("simulation.substeps", substeps as f64, 1.0..=64.0)?;
        within("simulation.force_cutoff_hz", force_cutoff_hz, 0.1..=1e4)?;
        within("simulation.sustained_cutoff_hz", sustained_cutoff_hz, 0.1..=1e4)
    }
}
