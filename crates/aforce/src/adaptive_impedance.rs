//! Parameters of the adaptive law: a tolerance and times instead of the paper's bare gains.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, positive, within};
use crate::impedance::{Convention, ImpedanceForm};
use crate::stability::stability_margin;

/// The sign of the delta term in eps (eq. 6), with e = x - x_d.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeltaSign {
    /// eps = e + delta e_dot: adds damping, as the laws that the paper builds on do.
    Damping,
    /// eps = e - delta e_dot: as printed; subtracts damping and can destabilise.
    Literal,
    /// eps = e.
    Off,
}

impl DeltaSign {
    /// +1, -1 or 0.
    #[must_use]
    pub fn factor(self) -> f64 {
        match self {
            Self::Damping => 1.0,
            Self::Literal => -1.0,
            Self::Off => 0.0,
        }
    }
}

/// The law of the three translational or of the three rotational axes.
///
/// Units below read translation, rotation. In the shaped convention stiffness is in 1/s^2 and feed-forward an
/// acceleration (m/s^2, rad/s^2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisLaw {
    /// Error that is tolerated without stiffening, gamma/beta (m, rad).
    pub tolerance: f64,
    /// Time in which the stiffness falls from its maximum to its minimum when there is no error (s).
    pub relaxation_time: f64,
    /// Lower bound of K (N/m, Nm/rad). The law has no floor of its own: without one K falls through zero.
    pub stiffness_min: f64,
    /// Upper bound of K (N/m, Nm/rad).
    pub stiffness_max: f64,
    /// K at the start of an episode (N/m, Nm/rad).
    pub stiffness_start: f64,
    /// Growth of the feed-forward per error, alpha (N/m/s, Nm/rad/s).
    pub feedforward_gain: f64,
    /// Leak of the feed-forward, mu (1/s): it forgets in 1/mu seconds.
    pub forgetting: f64,
    /// Weight of the error rate in eps, delta (s).
    pub delta: f64,
    /// Bound of each component of F_ff (N, Nm).
    pub feedforward_max: f64,
    /// Largest rate of K (N/m/s, Nm/rad/s).
    pub stiffness_rate_max: f64,
    /// Largest rate of F_ff (N/s, Nm/s).
    pub feedforward_rate_max: f64,
    /// Inertia for which stability is checked (kg, kg m^2): the largest apparent inertia of an axis at the tool.
    /// Used in the physical convention only; the shaped one has unit inertia by construction.
    pub nominal_inertia: f64,
}

impl AxisLaw {
    /// Stiffness gain beta = gamma/tolerance (N/m^2/s, Nm/rad^2/s).
    #[must_use]
    pub fn beta(&self) -> f64 {
        self.gamma() / self.tolerance
    }

    /// Relaxation gamma = (K_max - K_min)/relaxation_time (N/m/s, Nm/rad/s).
    #[must_use]
    pub fn gamma(&self) -> f64 {
        (self.stiffness_max - self.stiffness_min) / self.relaxation_time
    }

    fn validate(&self, group: &str, control_hz: u32) -> Result<(), ConfigError> {
        let field = |name: &str| format!("impedance.aforce.{group}.{name}");
        positive(&field("tolerance"), self.tolerance)?;
        positive(&field("relaxation_time"), self.relaxation_time)?;
        positive(&field("stiffness_min"), self.stiffness_min)?;
        positive(&field("stiffness_max"), self.stiffness_max - self.stiffness_min).map_err(|_| {
            ConfigError::OutOfRange {
                field: field("stiffness_max"),
                value: self.stiffness_max,
                allowed: format!("above stiffness_min = {}", self.stiffness_min),
            }
        })?;
        within(&field("stiffness_start"), self.stiffness_start, self.stiffness_min..=self.stiffness_max)?;
        not_negative(&field("feedforward_gain"), self.feedforward_gain)?;
        // One Euler step must not overshoot the leak's rest.
        within(&field("forgetting"), self.forgetting, 0.0..=f64::from(control_hz))?;
        not_negative(&field("delta"), self.delta)?;
        not_negative(&field("feedforward_max"), self.feedforward_max)?;
        // A lower one would make relaxation slower than `relaxation_time` says.
        positive(&field("stiffness_rate_max"), self.stiffness_rate_max - self.gamma()).map_err(|_| {
            ConfigError::OutOfRange {
                field: field("stiffness_rate_max"),
                value: self.stiffness_rate_max,
                allowed: format!("above (stiffness_max - stiffness_min)/relaxation_time = {}", self.gamma()),
            }
        })?;
        positive(&field("feedforward_rate_max"), self.feedforward_rate_max)?;
        positive(&field("nominal_inertia"), self.nominal_inertia)
    }
}

/// The `aforce` action space's impedance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveImpedance {
    /// Units, damping, error rate and reference.
    pub form: ImpedanceForm,
    /// Sign of the delta term.
    pub sign: DeltaSign,
    /// Accept parameters that the stability check refuses (to study them).
    pub allow_unstable: bool,
    /// Law of the translational axes.
    pub translation: AxisLaw,
    /// Law of the rotational axes.
    pub rotation: AxisLaw,
}

impl AdaptiveImpedance {
    /// Stiffness in 1/s^2, multiplied by Lambda (the default), with robosuite's ceiling of 300. Feed-forward and limits of
    /// the rates are the physical set's, divided by a nominal 5 kg.
    #[must_use]
    pub fn shaped() -> Self {
        let translation = AxisLaw {
            // Less than half the leash: at full speed K settles between its bounds instead of at the upper one.
            tolerance: 0.015,
            relaxation_time: 2.0,
            stiffness_min: 20.0,
            stiffness_max: 300.0,
            stiffness_start: 100.0,
            feedforward_gain: 20.0,
            forgetting: 1.0,
            delta: 0.05,
            feedforward_max: 3.0,
            stiffness_rate_max: 1000.0,
            feedforward_rate_max: 200.0,
            nominal_inertia: 1.0,
        };
        let rotation = AxisLaw { tolerance: 0.11, ..translation };
        Self {
            form: ImpedanceForm::continued(Convention::Shaped),
            sign: DeltaSign::Damping,
            allow_unstable: false,
            translation,
            rotation,
        }
    }

    /// Stiffness in N/m and Nm/rad: the paper's law.
    #[must_use]
    pub fn physical() -> Self {
        let translation = AxisLaw {
            tolerance: 0.005,
            relaxation_time: 1.0,
            stiffness_min: 50.0,
            stiffness_max: 800.0,
            stiffness_start: 200.0,
            feedforward_gain: 100.0,
            forgetting: 1.0,
            delta: 0.05,
            feedforward_max: 15.0,
            stiffness_rate_max: 5000.0,
            feedforward_rate_max: 1000.0,
            nominal_inertia: 42.0, // Vertical, robosuite's Panda with its large rotor inertia.
        };
        let rotation = AxisLaw {
            tolerance: 0.05,
            relaxation_time: 1.0,
            stiffness_min: 5.0,
            stiffness_max: 50.0,
            stiffness_start: 20.0,
            feedforward_gain: 5.0,
            forgetting: 1.0,
            delta: 0.05,
            feedforward_max: 3.0,
            stiffness_rate_max: 500.0,
            feedforward_rate_max: 500.0,
            nominal_inertia: 3.0,
        };
        Self {
            form: ImpedanceForm { reference_velocity: true, ..ImpedanceForm::continued(Convention::Physical) },
            sign: DeltaSign::Damping,
            allow_unstable: false,
            translation,
            rotation,
        }
    }

    /// Stability of translation and rotation at the lowest stiffness.
    #[must_use]
    pub fn margins(&self) -> [crate::StabilityMargin; 2] {
        [&self.translation, &self.rotation].map(|law| {
            let inertia = self.inertia(law);
            let damping = self.form.damping.of_axis(law.stiffness_min, inertia, self.form.damping_ratio);
            stability_margin(law, self.sign, inertia, damping)
        })
    }

    fn inertia(&self, law: &AxisLaw) -> f64 {
        match self.form.convention {
            Convention::Shaped => 1.0,
            Convention::Physical => law.nominal_inertia,
        }
    }

    pub(crate) fn validate(&self, control_hz: u32) -> Result<(), ConfigError> {
        self.form.validate("impedance.aforce")?;
        self.translation.validate("translation", control_hz)?;
        self.rotation.validate("rotation", control_hz)
    }

    /// Refuses parameters under which small oscillations grow, unless they are asked for.
    ///
    /// # Errors
    /// [`ConfigError::Unstable`] with the numbers, if either group's margin is exceeded and
    /// `allow_unstable` is not set.
    pub fn check_stability(&self) -> Result<(), ConfigError> {
        let [translation, rotation] = self.margins();
        for (group, law, margin) in
            [("translation", &self.translation, translation), ("rotation", &self.rotation, rotation)]
        {
            if !margin.is_stable() && !self.allow_unstable {
                return Err(ConfigError::Unstable {
                    group: format!("impedance.aforce.{group}"),
                    alpha: margin.alpha,
                    alpha_max: margin.alpha_max,
                    stiffness: law.stiffness_min,
                    inertia: self.inertia(law),
                    damping: margin.damping,
                });
            }
        }
        Ok(())
    }
}
