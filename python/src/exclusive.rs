//! What one thread uses at a time, and nobody waits for.

use std::sync::{Mutex, MutexGuard, TryLockError};

use pyo3::PyResult;
use pyo3::exceptions::PyRuntimeError;

/// A value until it is closed. A second thread that comes meanwhile is told so: who waited here would hold Python's lock.
pub struct Exclusive<T>(Mutex<Option<T>>);

impl<T> Exclusive<T> {
    /// Open.
    pub fn new(value: T) -> Self {
        Self(Mutex::new(Some(value)))
    }

    fn guard(&self) -> PyResult<MutexGuard<'_, Option<T>>> {
        self.0.try_lock().map_err(|error| {
            PyRuntimeError::new_err(match error {
                TryLockError::WouldBlock => "another thread is using this environment",
                TryLockError::Poisoned(_) => "this environment failed earlier: make a new one",
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
            None => Err(PyRuntimeError::new_err("this environment is closed")),
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
