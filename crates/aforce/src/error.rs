//! Errors of a configuration. Each message contains the numbers.

use std::ops::RangeInclusive;

/// A configuration that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// A value lies outside its allowed range.
    #[error("{field} = {} is not allowed; allowed: {allowed}", legible(*.value))]
    OutOfRange {
        /// Dotted path of the field, as in the configuration file.
        field: String,
        /// The value found.
        value: f64,
        /// The range in words.
        allowed: String,
    },
    /// The control rate is not a whole multiple of the policy rate.
    #[error("{section}control_hz = {control_hz} is not a whole multiple of policy_hz = {policy_hz}")]
    Rates {
        /// Dotted path of the table that holds the two rates, with its last dot; empty at the top level.
        section: String,
        /// Control rate (Hz).
        control_hz: u32,
        /// Policy rate (Hz).
        policy_hz: u32,
    },
    /// The adaptive law would grow oscillations at its lowest stiffness.
    #[error(
        "{field} = {alpha} is unstable at k_min = {stiffness}: the limit is {alpha_max:.1} (inertia {inertia}, damping \
         {damping:.2}); lower it, raise k_min, or set allow_unstable = true"
    )]
    Unstable {
        /// Dotted path of alpha, with its axis.
        field: String,
        /// The feed-forward gain found (N/m/s, Nm/rad/s; 1/s^3 where stiffness is in 1/s^2).
        alpha: f64,
        /// The largest stable feed-forward gain, in the same unit.
        alpha_max: f64,
        /// The lowest stiffness (N/m, Nm/rad, or 1/s^2), where the loop is least stable.
        stiffness: f64,
        /// Inertia of the axis (kg, kg m^2; 1 where stiffness is in 1/s^2).
        inertia: f64,
        /// Damping of the axis at that stiffness (Ns/m, Nms/rad, or 1/s).
        damping: f64,
    },
    /// Two settings contradict each other.
    #[error("{field}: {reason}")]
    Contradiction {
        /// Dotted path of the field.
        field: String,
        /// What the field contradicts, and what would be right.
        reason: String,
    },
}

impl ConfigError {
    /// The same error for a configuration that is part of a larger one: `section` is put before its dotted path.
    #[must_use]
    pub fn below(mut self, section: &str) -> Self {
        let (Self::OutOfRange { field: path, .. }
        | Self::Rates { section: path, .. }
        | Self::Unstable { field: path, .. }
        | Self::Contradiction { field: path, .. }) = &mut self;
        path.insert_str(0, &format!("{section}."));
        self
    }
}

/// `value` must lie in `range`; `field` is its dotted path in the configuration file.
///
/// # Errors
/// [`ConfigError::OutOfRange`] if it does not.
pub fn within(field: &str, value: f64, range: RangeInclusive<f64>) -> Result<(), ConfigError> {
    if range.contains(&value) {
        return Ok(());
    }
    let allowed = match (*range.start(), *range.end()) {
        (f64::MIN_POSITIVE, high) => format!("above 0, at most {}", legible(high)),
        (low, high) => format!("{} to {}", legible(low), legible(high)),
    };
    Err(out_of_range(field, value, allowed))
}

/// A number as text, in scientific notation if it is very small or very large.
fn legible(value: f64) -> String {
    let is_short = value == 0.0 || (1e-6..1e12).contains(&value.abs()) || !value.is_finite();
    if is_short { value.to_string() } else { format!("{value:e}") }
}

/// `value` must be finite and above zero.
pub(crate) fn positive(field: &str, value: f64) -> Result<(), ConfigError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(out_of_range(field, value, finite(value, "above 0")))
}

/// `value` must be finite and not negative.
pub(crate) fn not_negative(field: &str, value: f64) -> Result<(), ConfigError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(out_of_range(field, value, finite(value, "0 or above")))
}

/// The text `allowed`, with "and finite" added where `value` is infinite and above the lower bound.
fn finite(value: f64, allowed: &str) -> String {
    if value == f64::INFINITY { format!("{allowed}, and finite") } else { allowed.to_owned() }
}

fn out_of_range(field: &str, value: f64, allowed: String) -> ConfigError {
    ConfigError::OutOfRange { field: field.to_owned(), value, allowed }
}
