//! A value for one thread at a time. A second thread gets an error and does not wait.

use std::sync::{Mutex, MutexGuard, TryLockError};

use pyo3::PyResult;
use pyo3::exceptions::PyRuntimeError;

/// A value until it is closed. A second user gets an error instead of waiting, because a waiting thread would hold Python's global lock.
pub struct Exclusive<T>(Mutex<Option<T>>);

impl<T> Exclusive<T> {
    /// An open value.
    pub fn new(value: T) -> Self {
        Self(Mutex::new(Some(value)))
    }

    fn guard(&self) -> PyResult<MutexGuard<'_, Option<T>>> {
        self.0.try_lock().map_err(|error| {
            PyRuntimeError::new_err(match error {
                TryLockError::WouldBlock => {
                    "this object is in use, by another thread or by the task's method that called it: one at a time"
                }
                TryLockError::Poisoned(_) => "this object failed earlier: make a new one",
            })
        })
    }

    /// Calls `use_it` on the value.
    ///
    /// # Errors
    /// `RuntimeError` if it is closed or in use.
    pub fn with<R>(&self, use_it: impl FnOnce(&mut T) -> PyResult<R>) -> PyResult<R> {
        match self.guard()?.as_mut() {
            Some(value) => use_it(value),
            None => Err(PyRuntimeError::new_err("this object is closed: make a new one")),
        }
    }

    /// Drops the value; a second time nothing happens.
    ///
    /// # Errors
    /// `RuntimeError` if it is in use.
    pub fn close(&self) -> PyResult<()> {
        *self.guard()? = None;
        Ok(())
    }
}
