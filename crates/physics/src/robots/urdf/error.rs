//! Why no arm was read from a URDF.

use thiserror::Error;

/// What is wrong with a URDF: the link, joint or element, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct UrdfError(String);

impl UrdfError {
    /// An error in these words.
    pub(super) fn new(words: impl Into<String>) -> Self {
        UrdfError(words.into())
    }
}
