//! A number for each of the six axes, written as one, two or six.

use std::ops::{Index, RangeInclusive};

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, positive, within};
use crate::spatial::Vector6;

/// Largest stiffness of an axis, whatever its unit: thirty times what cobots offer (3000 N/m).
pub(crate) const MAX_STIFFNESS: f64 = 1e5;

/// Names of the axes in messages and column names: three translations, three rotations.
pub(crate) const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// One number per axis, world axes, linear first. In a file it is a scalar (all axes alike), a pair (the translational
/// axes, the rotational axes) or six numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct Gains(Vector6);

impl Gains {
    /// One number for the translational axes, one for the rotational ones.
    #[must_use]
    pub fn pair(translation: f64, rotation: f64) -> Self {
        Self(Vector6::from_fn(|axis, _| if axis < 3 { translation } else { rotation }))
    }

    /// The same number for all axes.
    #[must_use]
    pub fn all(value: f64) -> Self {
        Self::pair(value, value)
    }

    /// The six numbers.
    #[must_use]
    pub fn vector(&self) -> &Vector6 {
        &self.0
    }

    /// Applies `f` to each number, with its axis.
    #[must_use]
    pub fn map(&self, mut f: impl FnMut(usize, f64) -> f64) -> Self {
        Self(Vector6::from_fn(|axis, _| f(axis, self.0[axis])))
    }

    /// Changes the number of one axis.
    pub fn set(&mut self, axis: usize, value: f64) {
        self.0[axis] = value;
    }

    /// Checks each number with `check`, which is given the field's name with its axis.
    fn each(&self, field: &str, check: impl Fn(&str, f64) -> Result<(), ConfigError>) -> Result<(), ConfigError> {
        AXES.iter().zip(self.0.iter()).try_for_each(|(axis, &value)| check(&format!("{field} (axis {axis})"), value))
    }

    /// Every number must be finite and above zero.
    pub(crate) fn positive(&self, field: &str) -> Result<(), ConfigError> {
        self.each(field, positive)
    }

    /// Every number must be finite and not negative.
    pub(crate) fn not_negative(&self, field: &str) -> Result<(), ConfigError> {
        self.each(field, not_negative)
    }

    /// Every number must lie in `range`.
    pub(crate) fn within(&self, field: &str, range: RangeInclusive<f64>) -> Result<(), ConfigError> {
        self.each(field, |field, value| within(field, value, range.clone()))
    }

    /// Every number must be at least that of `least`, which is called `name`.
    pub(crate) fn at_least(&self, field: &str, least: &Self, name: &str) -> Result<(), ConfigError> {
        for (axis, axis_name) in AXES.iter().enumerate() {
            // Not `<`: NaN is refused too.
            if !matches!(
                self.0[axis].partial_cmp(&least.0[axis]),
                Some(std::cmp::Ordering::Greater | std::cmp::Ordering::Equal)
            ) {
                return Err(ConfigError::OutOfRange {
                    field: format!("{field} (axis {axis_name})"),
                    value: self.0[axis],
                    allowed: format!("{name} = {} or above", least.0[axis]),
                });
            }
        }
        Ok(())
    }
}

impl Index<usize> for Gains {
    type Output = f64;

    fn index(&self, axis: usize) -> &f64 {
        &self.0[axis]
    }
}

/// The forms in which a file may have the numbers.
#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, a pair [translation, rotation] or six numbers")]
enum Written {
    One(f64),
    Pair([f64; 2]),
    Six([f64; 6]),
}

impl From<Written> for Gains {
    fn from(written: Written) -> Self {
        match written {
            Written::One(value) => Self::all(value),
            Written::Pair([translation, rotation]) => Self::pair(translation, rotation),
            Written::Six(six) => Self(six.into()),
        }
    }
}

impl From<Gains> for Written {
    /// The shortest of the forms.
    fn from(gains: Gains) -> Self {
        let [translation, rotation] = [gains[0], gains[3]];
        if gains != Gains::pair(translation, rotation) {
            Written::Six(gains.0.into())
        } else if translation == rotation {
            Written::One(translation)
        } else {
            Written::Pair([translation, rotation])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        k: Gains,
    }

    #[test]
    fn one_two_or_six_numbers_and_back_in_the_shortest_form() {
        for (text, six) in [
            ("k = 5.0", [5.0; 6]),
            ("k = [5.0, 2.0]", [5.0, 5.0, 5.0, 2.0, 2.0, 2.0]),
            ("k = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        ] {
            let file: File = toml::from_str(text).unwrap();
            assert_eq!(file.k.vector(), &Vector6::from(six));
            assert_eq!(toml::Value::try_from(&file).unwrap(), text.parse::<toml::Table>().unwrap().into());
        }
        assert_eq!(toml::from_str::<File>("k = 5").unwrap().k, Gains::all(5.0), "a whole number is a number");
        let error = toml::from_str::<File>("k = [1.0, 2.0, 3.0]").unwrap_err().to_string();
        assert!(error.contains("six numbers"), "{error}");
    }

    #[test]
    fn what_is_wrong_is_told_with_its_axis() {
        let mut gains = Gains::pair(1.0, 2.0);
        gains.set(4, f64::NAN);
        let error = |result: Result<(), ConfigError>| result.unwrap_err().to_string();
        assert_eq!(error(gains.positive("k")), "k (axis ry) = NaN is not allowed; allowed: above 0");
        assert!(error(gains.at_least("k", &Gains::all(0.0), "k_min")).contains("ry"));
        assert!(Gains::all(0.0).positive("k").is_err() && Gains::all(0.0).not_negative("k").is_ok());
    }
}
