//! Errors, each with a message in one line that names the field or file.

use std::path::PathBuf;

/// An error of this crate. Its message is one line and says what to look at.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A setting is outside its range.
    #[error("{field} = {value} is out of range: {allowed}")]
    Config {
        /// Name of the field in [`Config`](crate::Config).
        field: &'static str,
        /// Its value, as text.
        value: String,
        /// The values that are allowed.
        allowed: &'static str,
    },
    /// A transition holds a NaN or an infinity; learning from it would ruin every weight.
    #[error("{what}[{index}] is {value}: not stored")]
    NotFinite {
        /// Part of the transition.
        what: &'static str,
        /// Index within that part.
        index: usize,
        /// The value found.
        value: f32,
    },
    /// A file or folder could not be read or written. The message names the path.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A file of a checkpoint is damaged, or does not fit.
    #[error("{}: {problem}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
}

impl Error {
    pub(crate) fn checkpoint(path: &std::path::Path, problem: impl ToString) -> Self {
        Self::Checkpoint { path: path.to_owned(), problem: problem.to_string() }
    }
}
