//! Writes an observation: the name, the unit and the scaling of every number beside its value.

use std::fmt::Display;

use aforce::{Vector3, Vector6};
use nalgebra::UnitQuaternion;
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

/// Collects the numbers of an observation, one after another.
///
/// The first observation of an environment also makes the list of names. Later ones only take the values: what is put
/// must therefore be the same numbers in the same order every time.
#[derive(Debug, Clone, Default)]
pub struct Observer {
    components: Vec<Component>,
    values: Vec<f32>,
    /// Whether this observation is the first.
    naming: bool,
}

impl Observer {
    /// Puts one number. A learner sees `(value - centre) * scale`: `centre` is a typical value, `scale` one over the typical
    /// deviation. `name` is unique, `unit` has the frame too where there is one.
    pub fn put(&mut self, name: impl Display, value: f64, unit: &'static str, centre: f64, scale: f64) {
        if self.naming {
            self.components.push(Component::new(name.to_string(), unit, centre, scale));
        }
        self.values.push(value as f32);
    }

    /// Puts a position or a difference of positions (m, world): `NAME_x`, `NAME_y`, `NAME_z`.
    pub fn position(&mut self, name: impl Display, value: Vector3, centre: [f64; 3], scale: f64) {
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            self.put(format_args!("{name}_{axis}"), value[i], "m, world", centre[i], scale);
        }
    }

    /// Puts an orientation (world): `NAME_x`, `NAME_y`, `NAME_z`, `NAME_w`.
    pub fn orientation(&mut self, name: impl Display, value: &UnitQuaternion<f64>) {
        for (i, axis) in ["x", "y", "z", "w"].into_iter().enumerate() {
            self.put(format_args!("{name}_{axis}"), value.coords[i], "quaternion, world", 0.0, 1.0);
        }
    }

    /// Puts a vector whose typical value is zero: `NAME_x`, `NAME_y`, `NAME_z`.
    pub(crate) fn vector(&mut self, name: &str, value: Vector3, unit: &'static str, scale: f64) {
        for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
            self.put(format_args!("{name}_{axis}"), value[i], unit, 0.0, scale);
        }
    }

    /// Puts a six-vector: `NAME_x` to `NAME_z` of translation, `NAME_rx` to `NAME_rz` of rotation, each with the unit, the
    /// centre and the scale of its kind.
    pub(crate) fn axes(
        &mut self,
        name: &str,
        value: &Vector6,
        units: [&'static str; 2],
        centres: [f64; 2],
        scales: [f64; 2],
    ) {
        for (i, axis) in ["x", "y", "z", "rx", "ry", "rz"].into_iter().enumerate() {
            let kind = i / 3;
            self.put(format_args!("{name}_{axis}"), value[i], units[kind], centres[kind], scales[kind]);
        }
    }

    /// Begins an observation.
    pub(crate) fn begin(&mut self) {
        self.naming = self.components.is_empty();
        self.values.clear();
    }

    /// The last observation; unscaled.
    pub(crate) fn values(&self) -> &[f32] {
        &self.values
    }

    /// What each number of an observation is.
    pub(crate) fn components(&self) -> &[Component] {
        &self.components
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_observation_makes_the_names_and_every_one_the_values() {
        let mut out = Observer::default();
        for height in [0.5, 0.75] {
            out.begin();
            out.position("cube", Vector3::new(1.0, 2.0, height), [0.0, 0.0, 0.8], 5.0);
            out.put("angle", 2.0 * height, "rad", 0.25, 4.0);
            assert_eq!(out.values(), [1.0, 2.0, height as f32, 2.0 * height as f32]);
            let names: Vec<&str> = out.components().iter().map(|component| component.name.as_str()).collect();
            assert_eq!(names, ["cube_x", "cube_y", "cube_z", "angle"]);
        }
        assert_eq!(out.components()[2], Component::new("cube_z", "m, world", 0.8, 5.0));
        assert_eq!(out.components()[3], Component::new("angle", "rad", 0.25, 4.0));
    }
}
