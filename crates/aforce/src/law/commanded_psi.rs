//! Parameters of the adaptive law that the policy commands: the paper's "learned" psi.

use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::law::entry::clip;
use crate::law::gains::Gains;
use crate::law::psi::{DeltaSign, Psi};
use crate::law::stiffness::{Scale, StiffnessUnit};

/// Which parameters of psi are entries of an action, and for how long a choice holds.
///
/// Each parameter has two entries, one for the translational axes and one for the rotational ones, on a logarithmic scale:
/// -1 is `low`, +1 is `high`, 0 their geometric mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandedPsi {
    /// Number of actions for which a choice of psi holds. The first of them chooses; the psi entries of the others have
    /// no effect.
    pub hold: u32,
    /// The parameters, in the order of their entries.
    pub ranges: Vec<PsiRange>,
}

/// A parameter of psi and its range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PsiRange {
    /// The parameter.
    pub parameter: PsiParameter,
    /// Value that an entry of -1 means, in the parameter's unit ([`Psi`]). The three axes of a group have the same.
    pub low: Gains,
    /// Value that an entry of +1 means.
    pub high: Gains,
}

/// A parameter of psi that can be commanded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PsiParameter {
    /// gamma/beta (m, rad): beta changes, gamma stays. Where gamma is 0, beta becomes 0 and K is constant.
    Tolerance,
    /// See [`Psi`].
    Alpha,
    /// See [`Psi`]; beta changes with gamma, so that the tolerance gamma/beta stays.
    Gamma,
    /// See [`Psi`].
    Mu,
    /// See [`Psi`].
    Delta,
    /// See [`Psi`].
    KMin,
    /// See [`Psi`].
    KMax,
}

impl PsiParameter {
    fn set(self, psi: &mut Psi, axis: usize, value: f64) {
        match self {
            Self::Tolerance => psi.beta.set(axis, psi.gamma[axis] / value),
            Self::Alpha => psi.alpha.set(axis, value),
            Self::Gamma => {
                // Keeps the tolerance gamma/beta.
                let tolerance = psi.tolerance()[axis];
                psi.gamma.set(axis, value);
                psi.beta.set(axis, value / tolerance);
            }
            Self::Mu => psi.mu.set(axis, value),
            Self::Delta => psi.delta.set(axis, value),
            Self::KMin => psi.k_min.set(axis, value),
            Self::KMax => psi.k_max.set(axis, value),
        }
    }

    /// Unit of the entry of the translational (0) or rotational (1) axes, where stiffness is in `stiffness`.
    pub(crate) fn unit(self, stiffness: StiffnessUnit, group: usize) -> &'static str {
        use StiffnessUnit::{NewtonPerMetre, PerSecondSquared};
        match (self, stiffness) {
            (Self::Tolerance, _) => ["m, log", "rad, log"][group],
            (Self::Alpha | Self::Gamma, NewtonPerMetre) => ["N/(m s), log", "Nm/(rad s), log"][group],
            (Self::Alpha | Self::Gamma, PerSecondSquared) => "1/s^3, log",
            (Self::KMin | Self::KMax, NewtonPerMetre) => ["N/m, log", "Nm/rad, log"][group],
            (Self::KMin | Self::KMax, PerSecondSquared) => "1/s^2, log",
            (Self::Mu, _) => "1/s, log",
            (Self::Delta, _) => "s, log",
        }
    }

    /// Name of the entry of the translational (0) or rotational (1) axes.
    pub(crate) fn entry(self, group: usize) -> &'static str {
        let names = match self {
            Self::Tolerance => ["tolerance_translation", "tolerance_rotation"],
            Self::Alpha => ["alpha_translation", "alpha_rotation"],
            Self::Gamma => ["gamma_translation", "gamma_rotation"],
            Self::Mu => ["mu_translation", "mu_rotation"],
            Self::Delta => ["delta_translation", "delta_rotation"],
            Self::KMin => ["k_min_translation", "k_min_rotation"],
            Self::KMax => ["k_max_translation", "k_max_rotation"],
        };
        names[group]
    }
}

impl CommandedPsi {
    /// Entries of an action that command psi.
    pub(crate) fn dim(&self) -> usize {
        2 * self.ranges.len()
    }

    /// Changes `psi` as the entries ask for: each is clipped to [-1, 1], and NaN counts as 0.
    ///
    /// # Panics
    /// If there are fewer entries than [`dim`](Self::dim).
    pub(crate) fn apply(&self, entries: &[f64], psi: &mut Psi) {
        for (range, pair) in self.ranges.iter().zip(entries.as_chunks::<2>().0) {
            for axis in 0..6 {
                let share = 0.5 * (clip(pair[axis / 3], 0.0) + 1.0);
                let value = Scale::Log.between(range.low[axis], range.high[axis], share);
                range.parameter.set(psi, axis, value);
            }
        }
    }

    /// Checks the ranges, and calls `check` with psi at every corner of them: what holds at all corners holds between them, as the
    /// stability limit and the bounds of K are monotone in each parameter. With delta's literal sign the limit is not monotone in mu, which
    /// is then refused unless `allow_unstable` is set.
    pub(crate) fn validate(
        &self,
        psi: &Psi,
        check: impl Fn(&Psi) -> Result<(), ConfigError>,
    ) -> Result<(), ConfigError> {
        if self.hold == 0 || self.ranges.is_empty() {
            return Err(ConfigError::Contradiction {
                field: "commanded_psi".into(),
                reason: "hold must be 1 or above, and ranges must name a parameter".into(),
            });
        }
        for (at, range) in self.ranges.iter().enumerate() {
            let field = format!("commanded_psi.ranges[{at}]");
            range.low.positive(&format!("{field}.low"))?;
            range.high.positive(&format!("{field}.high"))?;
            for (name, gains) in [("low", &range.low), ("high", &range.high)] {
                let alike = |group: usize| (1..3).all(|axis| gains[3 * group + axis] == gains[3 * group]);
                if !alike(0) || !alike(1) {
                    let reason = "one entry commands three axes: their numbers must be the same".into();
                    return Err(ConfigError::Contradiction { field: format!("{field}.{name}"), reason });
                }
            }
            range.high.at_least(&format!("{field}.high"), &range.low, "low")?;
            if self.ranges[..at].iter().any(|other| other.parameter == range.parameter) {
                let reason = format!("{} is commanded twice", range.parameter.entry(0));
                return Err(ConfigError::Contradiction { field, reason });
            }
            let literal = psi.delta_sign == DeltaSign::Literal && !psi.allow_unstable;
            if literal && range.parameter == PsiParameter::Mu {
                let reason = "mu, with delta_sign = \"literal\": the law may be less stable between two stable ends; take \
                              another sign, command another parameter, or set allow_unstable = true";
                return Err(ConfigError::Contradiction { field, reason: reason.into() });
            }
        }
        self.corners(psi).try_for_each(|corner| check(&corner)).map_err(at_a_corner)
    }

    /// `psi` with every entry of an action at one end of its range or the other.
    pub(crate) fn corners<'a>(&'a self, psi: &'a Psi) -> impl Iterator<Item = Psi> + 'a {
        (0..1usize << self.dim()).map(|corner| {
            let entries: Vec<f64> = (0..self.dim()).map(|i| if corner >> i & 1 == 1 { 1.0 } else { -1.0 }).collect();
            let mut psi = *psi;
            self.apply(&entries, &mut psi);
            // The record's K(0) may lie outside of a corner's bounds, so it is not checked. At run time K moves into the bounds.
            psi.k_0 = psi.k_min;
            psi
        })
    }
}

/// Turns an error in psi at a corner of the ranges into one that names the ranges, because the record's own psi may be right.
fn at_a_corner(error: ConfigError) -> ConfigError {
    let told = error.to_string();
    match error {
        ConfigError::OutOfRange { field, .. }
        | ConfigError::Unstable { field, .. }
        | ConfigError::Contradiction { field, .. }
            if field.starts_with("stiffness.adaptive") =>
        {
            let reason = format!("with every entry at an end of its range: {told}");
            ConfigError::Contradiction { field: "commanded_psi".into(), reason }
        }
        other => other,
    }
}
