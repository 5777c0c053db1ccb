//! What only a critic sees: in simulation a critic may know what a policy could not measure.

use aforce::ConfigError;
use physics::{ContactReading, Simulation};
use serde::{Deserialize, Serialize};

use crate::force_sensor::in_tool_axes;
use crate::observer::Observer;

/// What a critic sees and the policy does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Privileged {
    /// What presses on the arm, as it is.
    Contact,
    /// The controller's state.
    Controller,
    /// What was drawn for the episode, of all that is disturbed.
    Disturbance,
    /// The measured force and torque at the tool.
    Force,
    /// What the task shows to a critic ([`Task::observe_privileged`](crate::Task::observe_privileged)).
    Task,
}

impl Privileged {
    /// The entry's name in a configuration.
    pub fn as_str(self) -> &'static str {
        match self {
            Privileged::Contact => "contact",
            Privileged::Controller => "controller",
            Privileged::Disturbance => "disturbance",
            Privileged::Force => "force",
            Privileged::Task => "task",
        }
    }

    /// Checks that a list has nothing twice, and nothing that the policy sees `already`.
    pub(crate) fn validate(list: &[Privileged], already: &[Privileged]) -> Result<(), ConfigError> {
        let contradiction = |reason| Err(ConfigError::Contradiction { field: "observation.critic".into(), reason });
        for (i, entry) in list.iter().enumerate() {
            let name = entry.as_str();
            if list[..i].contains(entry) {
                return contradiction(format!("{name:?} stands in it twice"));
            }
            if already.contains(entry) {
                return contradiction(format!("observation.{name} = true shows it to the policy: leave {name:?} out"));
            }
        }
        Ok(())
    }
}

/// Puts 8 numbers. Six are the wrench that presses on hand and fingers (or tool), in the tool's axes and about the tool
/// point, filtered as the controller's but without noise, bias or estimate. The seventh is 1 if anything presses there,
/// else 0. The last is the sustained force on the links short of the wrist (N).
pub(crate) fn observe_contact(simulation: &Simulation, out: &mut Observer) {
    let ContactReading { filtered, touching, links, .. } = simulation.contact();
    let wrench = in_tool_axes(&simulation.measure(), filtered);
    out.axes("contact", &wrench, ["N, tool", "Nm, tool"], [0.0; 2], [0.05, 0.5]);
    out.put("contact_touching", f64::from(*touching), "0 or 1", 0.0, 1.0);
    out.put("contact_links", links.sustained, "N", 0.0, 0.05);
}
