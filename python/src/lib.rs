//! The part of the Python package `aforce` that is written in Rust.

mod arrays;
mod controller;
mod env;
mod episodes;
mod exclusive;
mod keywords;
mod own;
mod vector;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use tasks::TaskName;

/// An error of the Rust side as a `ValueError`.
fn value_error(error: impl std::fmt::Display) -> PyErr {
    // `#` adds the causes, after colons.
    PyValueError::new_err(format!("{error:#}").replace('\n', " "))
}

/// An error of the Rust side as a `TypeError`, for an unknown keyword.
fn type_error(error: impl std::fmt::Display) -> PyErr {
    PyTypeError::new_err(format!("{error:#}").replace('\n', " "))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("TASKS", TaskName::BUILT_IN.map(|name| name.as_str()))?;
    module.add_class::<env::Env>()?;
    module.add_class::<vector::Vector>()?;
    module.add_class::<controller::Controller>()?;
    module.add_class::<controller::Measurement>()?;
    module.add_class::<own::State>()?;
    module.add_class::<own::Place>()?;
    module.add_function(wrap_pyfunction!(controller::spaces, module)?)
}
