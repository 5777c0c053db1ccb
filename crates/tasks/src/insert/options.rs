//! The options of Insert.

use aforce::{ConfigError, within};
use physics::scenes::insert::{FORGE, Profile, Sizes};
use serde::{Deserialize, Serialize};

use crate::env_config::EnvConfig;

/// Largest clearance of a square peg (mm).
const WIDEST_SQUARE: f64 = 3.5;
/// Smallest chamfer but 0 (mm). With one of 1e-10 mm no hull is found for some wedges, whose corners then differ by
/// rounding errors only.
const NARROWEST_CHAMFER: f64 = 0.01;

/// What stands below `env.options`; by default FORGE's peg and hole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// Width of the hole less that of the peg (mm); at most 5, and 3.5 for a square peg.
    pub clearance_mm: f64,
    /// Width and depth of the chamfer at the rim (mm); 0: a sharp rim, else at least 0.01.
    pub chamfer_mm: f64,
    /// Sliding friction of peg, hole and table.
    pub friction: f64,
    /// Length of the peg (mm).
    pub length_mm: f64,
    /// Mean height of the peg's end above the rim at the start (mm); an episode's differs by up to 10 mm.
    pub start_mm: f64,
    /// The cross-section of peg and hole.
    pub profile: Profile,
    /// Whether the reward takes off the environment's force penalty as well.
    pub penalty: bool,
}

impl Default for Options {
    fn default() -> Self {
        let Sizes { length, clearance, chamfer, friction, profile } = FORGE;
        Options {
            clearance_mm: 1e3 * clearance,
            chamfer_mm: 1e3 * chamfer,
            friction,
            length_mm: 1e3 * length,
            start_mm: 14.6,
            profile,
            penalty: false,
        }
    }
}

impl Options {
    /// The options of a configuration.
    ///
    /// # Errors
    /// The first that is not allowed, with its range.
    pub fn of(config: &EnvConfig) -> Result<Self, ConfigError> {
        let options: Options = config.own_options()?;
        // Below 0.05 mm the engine's own rounding decides what enters. Above 5 mm a peg on the base may stand further from the axis than an
        // inserted one may.
        within("env.options.clearance_mm", options.clearance_mm, 0.05..=5.0)?;
        // A square peg in a corner of its hole is further from the axis than one at a wall, by the square root of 2.
        if options.profile == Profile::Square && options.clearance_mm > WIDEST_SQUARE {
            let allowed = format!("0.05 to {WIDEST_SQUARE} with profile = \"square\"");
            return Err(out_of_range("clearance_mm", options.clearance_mm, allowed));
        }
        if options.chamfer_mm != 0.0 && !(NARROWEST_CHAMFER..=5.0).contains(&options.chamfer_mm) {
            let allowed = format!("0, or {NARROWEST_CHAMFER} to 5");
            return Err(out_of_range("chamfer_mm", options.chamfer_mm, allowed));
        }
        within("env.options.friction", options.friction, 0.0..=2.0)?;
        // With a shorter peg the fingers meet the rim before the peg is in.
        within("env.options.length_mm", options.length_mm, 50.0..=200.0)?;
        // From a lower mean height some pegs would start in the rim, as the height varies by 10 mm.
        within("env.options.start_mm", options.start_mm, 11.0..=150.0)?;
        Ok(options)
    }

    /// In metres, as the scene has them.
    pub fn sizes(&self) -> Sizes {
        Sizes {
            length: 1e-3 * self.length_mm,
            clearance: 1e-3 * self.clearance_mm,
            chamfer: 1e-3 * self.chamfer_mm,
            friction: self.friction,
            profile: self.profile,
        }
    }
}

/// The error for the option `key`, whose allowed values are `allowed`.
fn out_of_range(key: &str, value: f64, allowed: String) -> ConfigError {
    ConfigError::OutOfRange { field: format!("env.options.{key}"), value, allowed }
}
