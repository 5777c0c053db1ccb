//! Where the stiffness comes from, and what its number means.

use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::law::entry::clip;
use crate::law::gains::{Gains, MAX_STIFFNESS};
use crate::law::operational_space::OperationalSpace;
use crate::law::psi::Psi;
use crate::spatial::{Vector6, Wrench};

/// What a stiffness number means: 150 1/s^2 are 2 to 6 kN/m along the axes of a Panda at its home pose, not 150 N/m.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StiffnessUnit {
    /// N/m and Nm/rad: a spring, as in the paper. No inertia shaping.
    #[serde(rename = "N/m")]
    NewtonPerMetre,
    /// 1/s^2: the acceleration that the spring asks for is multiplied by the operational-space inertia, translation and
    /// rotation uncoupled (robosuite).
    #[serde(rename = "1/s2")]
    PerSecondSquared,
}

impl StiffnessUnit {
    /// Unit of the stiffness of axis 0 to 5.
    #[must_use]
    pub fn name(self, axis: usize) -> &'static str {
        match self {
            Self::PerSecondSquared => "1/s^2",
            Self::NewtonPerMetre if axis < 3 => "N/m",
            Self::NewtonPerMetre => "Nm/rad",
        }
    }

    /// Unit of the feed-forward gain alpha: of the translational and of the rotational axes, where they differ.
    #[must_use]
    pub fn alpha_name(self) -> &'static str {
        match self {
            Self::NewtonPerMetre => "N/(m s), Nm/(rad s)",
            Self::PerSecondSquared => "1/s^3",
        }
    }

    /// The inertia of each axis that the spring moves: the apparent one (kg, kg m^2), or 1 where it is shaped away.
    #[must_use]
    pub fn inertia(self, apparent: &Vector6) -> Vector6 {
        match self {
            Self::NewtonPerMetre => *apparent,
            Self::PerSecondSquared => Vector6::repeat(1.0),
        }
    }

    /// Converts forces in the space's unit (N, Nm; or m/s^2, rad/s^2) to a wrench (N, Nm).
    #[must_use]
    pub fn to_wrench(self, v: &Vector6, lambda: &OperationalSpace) -> Wrench {
        match self {
            Self::NewtonPerMetre => *v,
            Self::PerSecondSquared => lambda.shape(v),
        }
    }

    /// Stiffness in N/m and Nm/rad, given the apparent inertia of each axis.
    #[must_use]
    pub fn effective(self, stiffness: &Vector6, apparent: &Vector6) -> Vector6 {
        match self {
            Self::NewtonPerMetre => *stiffness,
            Self::PerSecondSquared => stiffness.component_mul(apparent),
        }
    }
}

/// Where the stiffness comes from, in the space's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(clippy::large_enum_variant, reason = "one record holds one of it, and is not moved while it runs")]
pub enum Stiffness {
    /// From the tracking error, by the paper's law.
    Adaptive(Psi),
    /// From the policy.
    Commanded(StiffnessRange),
    /// From the record, and constant.
    Fixed(Gains),
}

/// A stiffness that the policy commands: an action entry of -1 to 1 spans `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StiffnessRange {
    /// Stiffness that an entry of -1 means, in the space's unit.
    pub low: Gains,
    /// Stiffness that an entry of +1 means, in the space's unit.
    pub high: Gains,
    /// How the entry spans the range.
    pub scale: Scale,
    /// One entry for all axes, in place of one for each.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub shared: bool,
}

/// How an entry of an action spans a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// An entry of 0 is the middle.
    Linear,
    /// An entry of 0 is the geometric mean.
    Log,
}

impl StiffnessRange {
    /// Entries of an action that command it.
    #[must_use]
    pub fn entries(&self) -> usize {
        if self.shared { 1 } else { 6 }
    }

    /// K that the `entries` of an action command; NaN asks for the middle.
    ///
    /// # Panics
    /// If there are too few entries.
    #[must_use]
    pub(crate) fn commanded(&self, entries: &[f64]) -> Vector6 {
        Vector6::from_fn(|axis, _| self.at(axis, clip(entries[if self.shared { 0 } else { axis }], 0.0)))
    }

    /// K of an axis that an entry in [-1, 1] commands.
    #[must_use]
    pub fn at(&self, axis: usize, entry: f64) -> f64 {
        self.scale.between(self.low[axis], self.high[axis], 0.5 * (entry + 1.0))
    }
}

impl Scale {
    /// The value that lies `share` of the way, 0 to 1, from `low` to `high`.
    #[must_use]
    pub fn between(self, low: f64, high: f64, share: f64) -> f64 {
        match self {
            Scale::Linear => low + share * (high - low),
            Scale::Log => low * libm::pow(high / low, share),
        }
    }
}

impl Stiffness {
    /// K at the start of an episode; where the policy commands it, what an entry of 0 means.
    #[must_use]
    pub fn at_reset(&self) -> Vector6 {
        match self {
            Self::Adaptive(psi) => *psi.k_0.vector(),
            Self::Commanded(range) => Vector6::from_fn(|axis, _| range.at(axis, 0.0)),
            Self::Fixed(k) => *k.vector(),
        }
    }

    pub(crate) fn validate(&self, control_hz: u32) -> Result<(), ConfigError> {
        match self {
            Self::Adaptive(psi) => psi.validate(control_hz),
            Self::Commanded(StiffnessRange { low, high, scale, shared: _ }) => {
                match scale {
                    Scale::Linear => low.not_negative("stiffness.commanded.low")?,
                    Scale::Log => low.positive("stiffness.commanded.low")?,
                }
                high.positive("stiffness.commanded.high")?;
                high.within("stiffness.commanded.high", 0.0..=MAX_STIFFNESS)?;
                high.at_least("stiffness.commanded.high", low, "low")
            }
            Self::Fixed(k) => k.within("stiffness.fixed", 0.0..=MAX_STIFFNESS),
        }
    }
}
