//! The bounds that a host sets on the law, each with its meaning, unit and default.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, within};
use crate::host::hold::HoldConfig;
use crate::host::tank::TankConfig;

/// Bounds between the law and an arm. Pairs are translation, rotation. Infinity means no bound; `period_max`, margins
/// and stiffness must be finite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HostLimits {
    /// Longest time between two cycles (s); a longer one is a fault. For the torque rate, a cycle that is longer than nominal counts as
    /// nominal: an arm that has lost packets compares a torque with the last one that it received.
    pub period_max: f64,
    /// Longest time between two actions (s); a longer silence is a fault.
    pub silence_max: f64,
    /// Largest error that spring and adaptation see (m, rad).
    pub error_max: [f64; 2],
    /// Largest wrench that the law asks of the tool (N, Nm).
    pub wrench_max: [f64; 2],
    /// Largest rate of that wrench (N/s, Nm/s).
    pub wrench_rate_max: [f64; 2],
    /// Largest wrench that the environment may exert on the tool (N, Nm); a larger one is a fault. The force that an action
    /// may ask for, [`ForceConfig::force_max`](crate::ForceConfig::force_max), must stay at four fifths of it or below.
    pub external_max: [f64; 2],
    /// Goals are moved into this box (m, base frame): its lower and its upper corner.
    pub workspace: [[f64; 3]; 2],
    /// The tool may be this far outside of the workspace (m); further is a fault.
    pub workspace_margin: f64,
    /// A joint nearer than this to an end of its range is pushed back (rad).
    pub joint_margin: f64,
    /// Stiffness that pushes a joint back from an end of its range (Nm/rad).
    pub joint_stiffness: [f64; 7],
    /// Distance into lost contact over which F_cmd fades to nothing (m).
    pub contact_loss: f64,
    /// Largest difference of the arm's reported pose from the model's at the start (m, rad).
    pub kinematics_tolerance: [f64; 2],
    /// Factor, 1 or above, on the tolerances in `agreement.rs` by which parts of the arm's state may disagree. It does not apply to the
    /// symmetry and the least inertia of the mass matrix. Infinite: nothing is compared.
    pub disagreement_max: f64,
    /// Energy that growing stiffness, F_ff and F_cmd may put into the arm.
    pub tank: TankConfig,
    /// How the arm holds its posture when the law does not act.
    pub hold: HoldConfig,
}

impl Default for HostLimits {
    /// `wrench_max` and `wrench_rate_max` are those of MIOS (github rr-aa-cl/mios), a published framework for the Panda. `external_max` is
    /// half of the force that MIOS allows, and less than half of its moment. The workspace is in front of and above a base that stands on a
    /// table.
    fn default() -> Self {
        Self {
            period_max: 0.020,
            silence_max: 0.25,
            error_max: [0.1, 0.5],
            wrench_max: [100.0, 50.0],
            wrench_rate_max: [1000.0, 500.0],
            external_max: [50.0, 20.0],
            workspace: [[0.2, -0.6, -0.1], [0.8, 0.6, 0.9]],
            workspace_margin: 0.05,
            joint_margin: 0.1,
            joint_stiffness: [100.0, 100.0, 100.0, 100.0, 50.0, 50.0, 50.0],
            contact_loss: 0.01,
            kinematics_tolerance: [0.002, 0.01],
            disagreement_max: 1.0,
            tank: TankConfig::default(),
            hold: HoldConfig::default(),
        }
    }
}

impl HostLimits {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        within("period_max", self.period_max, 1e-4..=0.1)?;
        within("silence_max", self.silence_max, 1e-3..=f64::INFINITY)?;
        for (name, pair) in [
            ("error_max", self.error_max),
            ("wrench_max", self.wrench_max),
            ("wrench_rate_max", self.wrench_rate_max),
            ("external_max", self.external_max),
            ("kinematics_tolerance", self.kinematics_tolerance),
        ] {
            for value in pair {
                within(name, value, f64::MIN_POSITIVE..=f64::INFINITY)?;
            }
        }
        for (low, high) in self.workspace[0].into_iter().zip(self.workspace[1]) {
            within("workspace (lower corner)", low, f64::NEG_INFINITY..=f64::INFINITY)?;
            within("workspace (upper corner)", high, low..=f64::INFINITY)?;
        }
        not_negative("workspace_margin", self.workspace_margin)?;
        not_negative("joint_margin", self.joint_margin)?;
        for (joint, value) in self.joint_stiffness.into_iter().enumerate() {
            within(&format!("joint_stiffness (joint {})", joint + 1), value, 0.0..=1000.0)?;
        }
        within("contact_loss", self.contact_loss, f64::MIN_POSITIVE..=f64::INFINITY)?;
        within("disagreement_max", self.disagreement_max, 1.0..=f64::INFINITY)?;
        self.tank.validate()?;
        self.hold.validate()
    }
}
