//! A file or a folder as itself, whatever bears its name later.

use std::fs::{File, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// What was found under a name.
#[derive(Debug)]
pub struct Place {
    path: PathBuf,
    /// Drive and number on it.
    identity: (u64, u64),
}

impl Place {
    /// That of an open file or folder.
    ///
    /// # Errors
    /// If the system does not tell.
    pub fn of(path: &Path, file: &File) -> std::io::Result<Self> {
        Ok(Place { path: path.into(), identity: identity(&file.metadata()?) })
    }

    /// Whether its name still leads to it: it was neither moved nor deleted, and nothing took its place.
    pub fn is_there(&self) -> bool {
        std::fs::metadata(&self.path).is_ok_and(|found| identity(&found) == self.identity)
    }
}

fn identity(found: &Metadata) -> (u64, u64) {
    (found.dev(), found.ino())
}
