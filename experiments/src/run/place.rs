//! Identity of a file or folder, by which a move, a deletion or a replacement is noticed.

use std::fs::{File, Metadata};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A path, and the identity of the file or folder that it led to.
#[derive(Debug)]
pub struct Place {
    path: PathBuf,
    /// Numbers of the device and of the inode.
    identity: (u64, u64),
}

impl Place {
    /// The place of an open file or folder.
    ///
    /// # Errors
    /// If the system call fails.
    pub fn of(path: &Path, file: &File) -> std::io::Result<Self> {
        Ok(Place { path: path.into(), identity: identity(&file.metadata()?) })
    }

    /// Whether the path still leads to it: it was neither moved nor deleted, and nothing took its place.
    pub fn is_there(&self) -> bool {
        std::fs::metadata(&self.path).is_ok_and(|found| identity(&found) == self.identity)
    }
}

fn identity(found: &Metadata) -> (u64, u64) {
    (found.dev(), found.ino())
}
