//! Errors about a part of a task, with the names of the task's class and of the part.

use aforce::record;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::de::DeserializeOwned;

use crate::keywords::table;

/// The part of a task that is being read, such as `Drawer.scene`.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// The task's class.
    pub class: &'a str,
    /// The attribute or method.
    pub name: &'a str,
}

impl Part<'_> {
    /// `ValueError` for a value that is not allowed.
    pub fn value(self, words: impl std::fmt::Display) -> PyErr {
        PyValueError::new_err(self.told(words))
    }

    /// `TypeError` for a wrong type or an unknown key.
    pub fn kind(self, words: impl std::fmt::Display) -> PyErr {
        PyTypeError::new_err(self.told(words))
    }

    fn told(self, words: impl std::fmt::Display) -> String {
        format!("{}.{}: {words:#}", self.class, self.name).replace('\n', " ")
    }

    /// Reads a dict as a value of the Rust side. `at` says in words where in the part the dict stands.
    ///
    /// # Errors
    /// `TypeError` if it is no dict or has an unknown key, `ValueError` if a value is not allowed or missing.
    pub fn read<T: DeserializeOwned>(self, value: &Bound<'_, PyAny>, at: &str) -> PyResult<T> {
        let at = if at.is_empty() { String::new() } else { format!("{at}: ") };
        let Ok(dict) = value.cast::<PyDict>() else {
            return Err(self.kind(format!("{at}a {}; a dict is wanted", value.get_type().name()?)));
        };
        let table = table(dict, 0).map_err(|error| {
            let words = format!("{at}{}", error.value(value.py()));
            if error.is_instance_of::<PyTypeError>(value.py()) { self.kind(words) } else { self.value(words) }
        })?;
        record::read(table).map_err(|problem| {
            let words = format!("{at}{problem}");
            if problem.message.starts_with("unknown key") { self.kind(words) } else { self.value(words) }
        })
    }
}
