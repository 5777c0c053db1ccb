//! What an observation consists of.

/// One number of an observation. A learner sees `(value - centre) * scale`, clipped to
/// +-10, when it asks for scaled observations.
#[derive(Debug, Clone, PartialEq)]
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

/// Components `prefix_x`, `prefix_y`, `prefix_z` of a position or a difference of positions.
pub(crate) fn xyz(prefix: &str, centre: [f64; 3], scale: f64) -> impl Iterator<Item = Component> {
    let names = ["x", "y", "z"].map(|axis| format!("{prefix}_{axis}"));
    names.into_iter().zip(centre).map(move |(name, c)| Component::new(name, "m, world", c, scale))
}

/// Components of an orientation.
pub(crate) fn xyzw(prefix: &str) -> impl Iterator<Item = Component> {
    let names = ["x", "y", "z", "w"].map(|axis| format!("{prefix}_{axis}"));
    names.into_iter().map(|name| Component::new(name, "quaternion, world", 0.0, 1.0))
}
