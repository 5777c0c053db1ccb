//! Numbers from Python. Errors about a wrong shape or type name the argument.

use numpy::{AllowTypeChange, PyArray1, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// The numbers of an array-like of the given shape, row by row.
///
/// # Errors
/// `TypeError` if it is no array of numbers, `ValueError` if its shape is another one.
pub fn numbers(value: &Bound<'_, PyAny>, name: &str, shape: &[usize]) -> PyResult<Vec<f64>> {
    // The usual action, an array of float32, is read without a detour through numpy.
    if let Ok(array) = value.cast::<PyArray1<f32>>() {
        check_shape(name, array.shape(), shape)?;
        return Ok(array.readonly().as_array().iter().map(|&v| f64::from(v)).collect());
    }
    let no_numbers = |cause: PyErr| {
        let error = PyTypeError::new_err(format!("{name} must be an array of numbers"));
        error.set_cause(value.py(), Some(cause));
        error
    };
    let array = real(value).map_err(no_numbers)?;
    check_shape(name, array.shape(), shape)?;
    Ok(array.as_array().iter().copied().collect())
}

/// An array-like of real numbers: numpy itself would read strings as numbers too, and drop imaginary parts.
///
/// # Errors
/// `TypeError` if it holds something else.
pub fn real<'py>(value: &Bound<'py, PyAny>) -> PyResult<PyArrayLikeDyn<'py, f64, AllowTypeChange>> {
    let array = value.py().import("numpy")?.call_method1("asarray", (value,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    // Booleans, whole numbers of both kinds, floating-point numbers, and objects that float() takes.
    if !["b", "i", "u", "f", "O"].contains(&kind.as_str()) {
        return Err(PyTypeError::new_err(format!("an array of {}", array.getattr("dtype")?)));
    }
    array.extract()
}

/// An action, or several: finite numbers.
///
/// # Errors
/// As [`numbers`], and `ValueError` for NaN or infinity.
pub fn action(value: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    let action = numbers(value, "action", shape)?;
    match action.iter().position(|v| !v.is_finite()) {
        Some(at) => {
            Err(PyValueError::new_err(format!("action: entry {at} is {}, must be a finite number", action[at])))
        }
        None => Ok(action),
    }
}

fn check_shape(name: &str, found: &[usize], wanted: &[usize]) -> PyResult<()> {
    if found == wanted {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} has shape {}, must have {}", tuple(found), tuple(wanted))))
}

/// A shape as Python writes a tuple.
fn tuple(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        all => format!("({})", all.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}
