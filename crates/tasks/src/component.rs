//! What an observation consists of.

use serde::Serialize;

/// One number of an observation. A learner sees `(value - centre) * scale`, clipped to
/// +-10, when it asks for scaled observations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// Unique name.
    pub name: String,
    /// Unit, and frame where it has one.
    pub unit: &'static str,
    /// Typical value.
    pub centre: f32,
    /// One over the typical deviation.
    pub scale: f32,
}

impl Component {
    /// A component with its scaling.
    pub fn new(name: impl Into<String>, unit: &'static str, centre: f64, scale: f64) -> Self {
        Component { name: name.into(), unit, centre: centre as f32, scale: scale as f32 }
    }
}
