//! Settings of the controller that all action spaces share.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, within};
use crate::law::force::ForceConfig;
use crate::law::interpolator::Interpolation;

/// The settings of the controller, apart from those of the arm (torque limits), the task (contact axis) and the action space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Actions per second (Hz).
    pub policy_hz: u32,
    /// Control samples per second (Hz); a whole multiple of `policy_hz`. Each is a step of the simulation, or several where it
    /// is longer than 2 ms.
    pub control_hz: u32,
    /// Position delta of an action entry of 1 (m).
    pub position_step: f64,
    /// Rotation delta of an action entry of 1 (rad, about a world axis).
    pub rotation_step: f64,
    /// k of the null-space posture (1/s^2), damped critically.
    pub null_space_stiffness: f64,
    /// How the set-point travels to the goal.
    pub interpolation: Interpolation,
    /// Force control, for the action spaces that command a force.
    pub force: ForceConfig,
}

impl Default for ControllerConfig {
    /// 20 Hz over 500 Hz, linear interpolation and robosuite's action steps, as in the paper's simulations.
    fn default() -> Self {
        Self {
            policy_hz: 20,
            control_hz: 500,
            position_step: 0.05,
            rotation_step: 0.5,
            null_space_stiffness: 10.0,
            // The paper has 0.2. Where e_dot contains the set-point's velocity, a short ramp causes torque peaks.
            interpolation: Interpolation::Linear { ramp_ratio: 1.0 },
            force: ForceConfig::default(),
        }
    }
}

impl ControllerConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field and its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let Self { policy_hz, control_hz, .. } = *self;
        within("policy_hz", f64::from(policy_hz), 1.0..=1000.0)?;
        within("control_hz", f64::from(control_hz), 1.0..=10_000.0)?;
        if !control_hz.is_multiple_of(policy_hz) {
            return Err(ConfigError::Rates { section: String::new(), control_hz, policy_hz });
        }
        // No arm here reaches much further than a Panda, 0.855 m: a larger step is probably in a wrong unit.
        within("position_step", self.position_step, f64::MIN_POSITIVE..=1.0)?;
        // Three entries of 1 turn by sqrt(3) steps: less than half a turn.
        within("rotation_step", self.rotation_step, f64::MIN_POSITIVE..=1.8)?;
        within("null_space_stiffness", self.null_space_stiffness, 0.0..=1000.0)?;
        self.interpolation.validate()?;
        self.force.validate()
    }

    /// Control samples per action.
    #[must_use]
    pub fn samples_per_action(&self) -> u32 {
        self.control_hz / self.policy_hz
    }

    /// Duration of a control sample (s).
    #[must_use]
    pub fn dt(&self) -> f64 {
        1.0 / f64::from(self.control_hz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_survive_a_file() {
        let config = ControllerConfig::default();
        config.validate().unwrap();
        assert_eq!((config.samples_per_action(), config.dt()), (25, 0.002));
        let text = toml::to_string(&config).unwrap();
        assert_eq!(toml::from_str::<ControllerConfig>(&text).unwrap(), config);
        assert_eq!(toml::from_str::<ControllerConfig>("").unwrap(), config);
    }

    #[test]
    fn parts_can_be_overridden() {
        let text = "position_step = 0.03\n[force]\nki = 2.0";
        let config: ControllerConfig = toml::from_str(text).unwrap();
        assert_eq!((config.position_step, config.force.ki, config.force.kp), (0.03, 2.0, 0.3));
    }

    #[test]
    fn unknown_keys_are_refused() {
        for text in ["positon_step = 1", "[force]\nkq = 1", "interpolation = { linear = { ramp = 1 } }"] {
            assert!(toml::from_str::<ControllerConfig>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn errors_name_field_value_and_range() {
        let message = |change: fn(&mut ControllerConfig)| {
            let mut config = ControllerConfig::default();
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        assert_eq!(message(|c| c.policy_hz = 30), "control_hz = 500 is not a whole multiple of policy_hz = 30");
        assert_eq!(message(|c| c.policy_hz = 0), "policy_hz = 0 is not allowed; allowed: 1 to 1000");
        assert_eq!(
            message(|c| c.position_step = -0.1),
            "position_step = -0.1 is not allowed; allowed: above 0, at most 1"
        );
        assert_eq!(
            message(|c| c.position_step = 100.0),
            "position_step = 100 is not allowed; allowed: above 0, at most 1"
        );
        assert_eq!(
            message(|c| c.null_space_stiffness = 1e6),
            "null_space_stiffness = 1000000 is not allowed; allowed: 0 to 1000"
        );
        assert_eq!(
            message(|c| c.interpolation = Interpolation::Linear { ramp_ratio: 1.5 }),
            "interpolation.linear.ramp_ratio = 1.5 is not allowed; allowed: above 0, at most 1"
        );
        let told = "force.contact_off = 0 is not allowed; allowed: above 0, at most 4";
        assert_eq!(message(|c| c.force.contact_off = 0.0), told, "contact would not end in free air");
        assert_eq!(message(|c| c.force.contact_off = 5.0), told.replace("= 0", "= 5"));
    }
}
