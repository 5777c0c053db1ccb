//! Numbers by name, as a task's methods return them.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt, PyString};

use super::answer::Part;
use crate::arrays::real;

/// A name and its numbers.
pub type Entry = (String, Vec<f64>);

/// The numbers of a dict, each name with one or several.
///
/// # Errors
/// `TypeError` for what is no dict of numbers, `ValueError` for a number that is not finite.
pub fn entries(part: Part<'_>, value: &Bound<'_, PyAny>) -> PyResult<Vec<Entry>> {
    let Ok(dict) = value.cast::<PyDict>() else {
        return Err(
            part.kind(format!("it returned a {}; a dict of names and numbers is wanted", value.get_type().name()?))
        );
    };
    dict.iter()
        .map(|(name, value)| {
            let Ok(name) = name.extract::<String>() else {
                return Err(part.kind(format!("the name {} is no string", name.repr()?)));
            };
            let numbers = several(&value).ok().filter(|_| !value.is_none()).ok_or_else(|| {
                part.kind(format!("{name:?} is {}; a number or an array of numbers is wanted", short(&value)))
            })?;
            // Observations are float32.
            if let Some(number) = numbers.iter().find(|number| !(**number as f32).is_finite()) {
                let words = "finite numbers of at most 3.4e38 are wanted";
                return Err(part.value(format!("{name:?} holds {}; {words}", in_python(*number))));
            }
            Ok((name, numbers))
        })
        .collect()
}

/// A finite number.
///
/// # Errors
/// As [`entries`].
pub fn number(part: Part<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let number = single(value).ok_or_else(|| part.kind(format!("{name:?} is {}; a number is wanted", short(value))))?;
    if number.is_finite() {
        return Ok(number);
    }
    Err(part.value(format!("{name:?} is {}; a finite number is wanted", in_python(number))))
}

/// A number of Python or numpy; `None` for anything else.
fn single(value: &Bound<'_, PyAny>) -> Option<f64> {
    if value.is_instance_of::<PyString>() {
        return None;
    }
    value.extract().ok()
}

fn several(value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>() {
        return Ok(vec![value.extract()?]);
    }
    Ok(real(value)?.as_array().iter().copied().collect())
}

fn short(value: &Bound<'_, PyAny>) -> String {
    let text = value.repr().map_or_else(|_| "?".into(), |text| text.to_string());
    if text.chars().count() > 60 { format!("{}..", text.chars().take(60).collect::<String>()) } else { text }
}

fn in_python(number: f64) -> String {
    match number {
        number if number.is_nan() => "nan".into(),
        number if number.abs() >= 1e16 => format!("{number:e}"),
        number => number.to_string(),
    }
}
