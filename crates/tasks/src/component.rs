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

/// Components `prefix_x`, `prefix_y`, `prefix_z` of a position or a difference of positions.
pub(crate) fn xyz(prefix: &str, centre: [f64; 3], scale: f64) -> impl Iterator<Item = Component> {
    let names = ["x", "y", "z"].map(|axis| format!("{prefix}_{axis}"));
    names.into_iter().zip(centre).map(move |(name, c)| Component::new(name, "m, world", c, scale))
}

/// Components of translation, `NAME_x` to `NAME_z`, and of rotation, `NAME_rx` to `NAME_rz`.
pub(crate) fn axes(
    name: &str,
    units: [&'static str; 2],
    centres: [f64; 2],
    scales: [f64; 2],
) -> impl Iterator<Item = Component> {
    let axis = move |i: usize| format!("{name}_{}", ["x", "y", "z", "rx", "ry", "rz"][i]);
    (0..6).map(move |i| Component::new(axis(i), units[i / 3], centres[i / 3], scales[i / 3]))
}

/// Components of an orientation.
pub(crate) fn xyzw(prefix: &str) -> impl Iterator<Item = Component> {
    let names = ["x", "y", "z", "w"].map(|axis| format!("{prefix}_{axis}"));
    names.into_iter().map(|name| Component::new(name, "quaternion, world", 0.0, 1.0))
}
