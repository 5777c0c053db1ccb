//! What `evaluate` and `replay` play: a run's folder, or a kept policy.

use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, anyhow};
use tempfile::TempDir;

use crate::run::folder::RunFolder;
use crate::run::kept;
use crate::run::which::Which;

/// A run that can be played.
pub struct Playable {
    /// Its checkpoints lie here.
    pub folder: RunFolder,
    /// Its configuration: a file, or an archive that has it.
    pub config: PathBuf,
    /// For a kept policy, which of its run's checkpoints it is.
    pub kept: Option<Which>,
    /// For a kept policy, the zip file and the folder to which it is unpacked until this is dropped.
    unpacked: Option<(PathBuf, TempDir)>,
}

impl Playable {
    /// Opens a run's folder or a kept policy.
    ///
    /// # Errors
    /// If `path` is neither, or the archive is damaged or has other files.
    pub fn open(path: &Path) -> Result<Self> {
        if !kept::is_kept(path) {
            let folder = RunFolder::open(path)?;
            return Ok(Playable { config: folder.config(), folder, kept: None, unpacked: None });
        }
        let zip = fs_err::File::open(path)?;
        let to = tempfile::tempdir()?;
        let which = kept::unpack(zip, to.path())
            .with_context(|| format!("{}: not a policy that `archive` kept", path.display()))?;
        let folder = RunFolder::at(to.path());
        Ok(Playable { folder, config: path.into(), kept: Some(which), unpacked: Some((path.into(), to)) })
    }

    /// The error with the zip file's name in place of the temporary folder to which it was unpacked, which the user does not know.
    pub fn named(&self, error: Error) -> Error {
        match &self.unpacked {
            Some((archive, to)) => {
                anyhow!(format!("{error:#}").replace(&*to.path().to_string_lossy(), &archive.to_string_lossy()))
            }
            None => error,
        }
    }
}
