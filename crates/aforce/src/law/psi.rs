//! psi: the parameters of the adaptive law (eqs. 4 to 6), under the paper's names.

use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::law::gains::{Gains, MAX_STIFFNESS};

/// The sign of the delta term in eps (eq. 6), with e = x - x_d.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeltaSign {
    /// eps = e + delta e_dot: adds damping, as the laws that the paper builds on do.
    Damping,
    /// eps = e - delta e_dot: as the paper prints it; subtracts damping and can destabilise.
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

/// The parameters of the adaptive law.
///
/// Units below read translation, rotation. Where stiffness is in 1/s^2, read 1/s^2 for N/m and for Nm/rad: F_ff is then an
/// acceleration (m/s^2, rad/s^2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Psi {
    /// Growth of F_ff per error, eq. 5 (N/m/s, Nm/rad/s). 0 switches the feed-forward off.
    pub alpha: Gains,
    /// Growth of K per error, eq. 4 (N/m^2/s, Nm/rad^2/s). With `gamma` 0 too, K stays where it starts.
    pub beta: Gains,
    /// Relaxation of K, eq. 4 (N/m/s, Nm/rad/s).
    pub gamma: Gains,
    /// Leak of F_ff, eq. 5 (1/s): F_ff decays with the time constant 1/mu.
    pub mu: Gains,
    /// Weight of the error rate in eps, eq. 6 (s).
    pub delta: Gains,
    /// Sign of the delta term in eps, eq. 6.
    pub delta_sign: DeltaSign,
    /// Lower bound of K (N/m, Nm/rad). Eq. 4 has none: without a bound K would fall below zero.
    pub k_min: Gains,
    /// Upper bound of K (N/m, Nm/rad).
    pub k_max: Gains,
    /// K at the start of an episode (N/m, Nm/rad).
    pub k_0: Gains,
    /// Bound of each component of F_ff (N, Nm).
    pub f_ff_max: Gains,
    /// Largest rate of K (N/m/s, Nm/rad/s); not below gamma, and finite.
    pub k_rate_max: Gains,
    /// Largest rate of F_ff (N/s, Nm/s).
    pub f_ff_rate_max: Gains,
    /// Inertia for which stability is checked (kg, kg m^2): the largest apparent inertia at the tool. The largest inertia is the least
    /// stable one while it is below K_min/mu^2 and delta is not literal; otherwise a lighter arm may be less stable ([`stability_margin`]).
    /// With stiffness in 1/s^2 the inertia is 1 by construction, and this field is not used.
    ///
    /// [`stability_margin`]: crate::stability_margin
    pub inertia: Gains,
    /// K does not grow along an axis whose spring pushes a joint further into its torque limit.
    pub anti_windup: bool,
    /// Accept parameters that the stability check refuses (to study them).
    pub allow_unstable: bool,
}

impl Psi {
    /// Largest lasting error under which K does not grow, gamma/beta (m, rad); infinite where beta is 0.
    #[must_use]
    pub fn tolerance(&self) -> Gains {
        self.gamma.map(|axis, gamma| if self.beta[axis] == 0.0 { f64::INFINITY } else { gamma / self.beta[axis] })
    }

    /// Time in which K falls from its upper to its lower bound when there is no error (s); infinite where gamma is 0.
    #[must_use]
    pub fn relaxation_time(&self) -> Gains {
        self.gamma.map(
            |axis, gamma| {
                if gamma == 0.0 { f64::INFINITY } else { (self.k_max[axis] - self.k_min[axis]) / gamma }
            },
        )
    }

    /// Time in which K rises from its lower to its upper bound under a lasting `error` (m, rad) along or about `axis` (s);
    /// infinite if the error is tolerated, as every error is where beta is 0.
    #[must_use]
    pub fn rise_time(&self, axis: usize, error: f64) -> f64 {
        if self.beta[axis] == 0.0 {
            return f64::INFINITY;
        }
        let rate = (self.beta[axis] * error - self.gamma[axis]).min(self.k_rate_max[axis]);
        if rate > 0.0 { (self.k_max[axis] - self.k_min[axis]) / rate } else { f64::INFINITY }
    }

    /// alpha/mu (N/m, Nm/rad): F_ff under a lasting error is a second spring of this stiffness beside K, as far as
    /// `f_ff_max` lets it.
    #[must_use]
    pub fn feedforward_spring(&self) -> Gains {
        self.alpha.map(|axis, alpha| if alpha == 0.0 { 0.0 } else { alpha / self.mu[axis] })
    }

    /// Checks every value; stability is checked with the space that the law acts in.
    pub(crate) fn validate(&self, control_hz: u32) -> Result<(), ConfigError> {
        let field = |name: &str| format!("stiffness.adaptive.{name}");
        self.alpha.not_negative(&field("alpha"))?;
        self.beta.not_negative(&field("beta"))?;
        self.gamma.not_negative(&field("gamma"))?;
        // One Euler step of the leak must not overshoot its equilibrium.
        self.mu.within(&field("mu"), 0.0..=f64::from(control_hz))?;
        self.delta.not_negative(&field("delta"))?;
        self.k_min.positive(&field("k_min"))?;
        self.k_max.within(&field("k_max"), 0.0..=MAX_STIFFNESS)?;
        self.k_max.at_least(&field("k_max"), &self.k_min, "k_min")?;
        self.k_0.at_least(&field("k_0"), &self.k_min, "k_min")?;
        self.k_max.at_least(&field("k_max"), &self.k_0, "k_0")?;
        self.f_ff_max.not_negative(&field("f_ff_max"))?;
        // A lower limit would make K relax more slowly than gamma says.
        self.k_rate_max.at_least(&field("k_rate_max"), &self.gamma, "gamma")?;
        // Gamma is not negative, so this check refuses infinity only.
        self.k_rate_max.not_negative(&field("k_rate_max"))?;
        self.f_ff_rate_max.positive(&field("f_ff_rate_max"))?;
        self.inertia.positive(&field("inertia"))
    }
}
