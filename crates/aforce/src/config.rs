//! The controller's configuration: every default beside its meaning and unit.

use serde::{Deserialize, Serialize};

use crate::action_space::{Impedance, Level, NAMED};
use crate::adaptive_impedance::AdaptiveImpedance;
use crate::error::{ConfigError, not_negative, positive, within};
use crate::force::ForceConfig;
use crate::impedance::{CommandedImpedance, Convention, FixedImpedance, ImpedanceForm};
use crate::interpolator::Interpolation;

/// Everything about the controller that is not the plant's (torque limits) or the task's (contact axis).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerConfig {
    /// Actions per second (Hz).
    pub policy_hz: u32,
    /// Control samples per second (Hz); a whole multiple of `policy_hz`. The simulation advances by one sample at a time: a
    /// slower controller makes the physics coarser too, unless it is given more substeps.
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
    /// The impedance of each action space.
    pub impedance: ImpedanceSettings,
}

impl Default for ControllerConfig {
    /// 20 Hz over 500 Hz and linear interpolation as in the paper's simulations; smaller steps than robosuite's 5 cm and
    /// 0.5 rad, with which random actions cost two to five times the energy (docs/decisions.md).
    fn default() -> Self {
        Self {
            policy_hz: 20,
            control_hz: 500,
            position_step: 0.02,
            rotation_step: 0.15,
            null_space_stiffness: 10.0,
            // Differs from the paper's 0.2: where e_dot counts the reference's velocity, a short ramp is a kick.
            interpolation: Interpolation::Linear { ramp_ratio: 1.0 },
            force: ForceConfig::default(),
            impedance: ImpedanceSettings::default(),
        }
    }
}

impl ControllerConfig {
    /// Checks every value, whichever action space is used; the stability of `aforce` is checked where it is used, in
    /// [`Controller::new`](crate::Controller::new).
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
        positive("position_step", self.position_step)?;
        positive("rotation_step", self.rotation_step)?;
        // Three entries at once turn by sqrt(3) steps: less than half a turn.
        within("rotation_step", self.rotation_step, 0.0..=1.8)?;
        not_negative("null_space_stiffness", self.null_space_stiffness)?;
        self.interpolation.validate()?;
        self.force.validate()?;
        let impedance = &self.impedance;
        impedance.aforce.validate(control_hz)?;
        impedance.variable.validate()?;
        for (source, name, _) in NAMED {
            if let Impedance::Fixed(level) = source {
                impedance.level(level).validate(name)?;
            }
        }
        Ok(())
    }

    /// How far an action entry of 1 moves the goal along (m) or about (rad) an axis, of 0 to 5.
    pub(crate) fn step(&self, axis: usize) -> f64 {
        if axis < 3 { self.position_step } else { self.rotation_step }
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

/// One impedance per action space, each with its own stiffness convention.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImpedanceSettings {
    /// `aforce`.
    pub aforce: AdaptiveImpedance,
    /// `variable`.
    pub variable: CommandedImpedance,
    /// `low`.
    pub low: FixedImpedance,
    /// `mid`.
    pub mid: FixedImpedance,
    /// `high`.
    pub high: FixedImpedance,
    /// `osc`.
    pub osc: FixedImpedance,
}

impl ImpedanceSettings {
    /// The settings of a fixed impedance.
    pub(crate) fn level(&self, level: Level) -> &FixedImpedance {
        match level {
            Level::Low => &self.low,
            Level::Mid => &self.mid,
            Level::High => &self.high,
            Level::Osc => &self.osc,
        }
    }

    /// These settings of one source of stiffness, the defaults of all others.
    #[must_use]
    pub fn only(&self, impedance: Impedance) -> Self {
        let default = Self::default();
        match impedance {
            Impedance::Adaptive => Self { aforce: self.aforce, ..default },
            Impedance::Commanded => Self { variable: self.variable, ..default },
            Impedance::Fixed(Level::Low) => Self { low: self.low, ..default },
            Impedance::Fixed(Level::Mid) => Self { mid: self.mid, ..default },
            Impedance::Fixed(Level::High) => Self { high: self.high, ..default },
            Impedance::Fixed(Level::Osc) => Self { osc: self.osc, ..default },
        }
    }
}

impl Default for ImpedanceSettings {
    fn default() -> Self {
        let physical = |translation, rotation| FixedImpedance {
            // Without it a soft arm crawls: 150 N/m move 42 kg at 4 cm/s on a leash of 4 cm.
            form: ImpedanceForm { reference_velocity: true, ..ImpedanceForm::continued(Convention::Physical) },
            translation,
            rotation,
        };
        let robosuite = ImpedanceForm::robosuite();
        Self {
            aforce: AdaptiveImpedance::shaped(),
            variable: CommandedImpedance { form: robosuite, translation: [0.0, 300.0], rotation: [0.0, 300.0] },
            // The paper does not publish its levels.
            low: physical(150.0, 10.0),
            mid: physical(500.0, 30.0),
            high: physical(1500.0, 100.0),
            osc: FixedImpedance { form: robosuite, translation: 150.0, rotation: 150.0 },
        }
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
        for text in ["positon_step = 1", "[force]\nkq = 1", "interpolation = { kind = \"linear\", ramp = 1 }"] {
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
        assert_eq!(message(|c| c.position_step = -0.1), "position_step = -0.1 is not allowed; allowed: above 0");
        assert_eq!(
            message(|c| c.interpolation = Interpolation::Linear { ramp_ratio: 1.5 }),
            "interpolation.ramp_ratio = 1.5 is not allowed; allowed: 0 to 1"
        );
        assert_eq!(message(|c| c.force.contact_off = 5.0), "force.contact_off = 5 is not allowed; allowed: 0 to 4");
        assert_eq!(
            message(|c| c.impedance.aforce.translation.stiffness_start = 500.0),
            "impedance.aforce.translation.stiffness_start = 500 is not allowed; allowed: 20 to 300"
        );
        assert_eq!(
            message(|c| c.impedance.aforce.rotation.stiffness_max = 10.0),
            "impedance.aforce.rotation.stiffness_max = 10 is not allowed; allowed: above stiffness_min = 20"
        );
        assert_eq!(
            message(|c| c.impedance.mid.form.damping_ratio = f64::NAN),
            "impedance.mid.form.damping_ratio = NaN is not allowed; allowed: 0 to 10"
        );
    }
}
