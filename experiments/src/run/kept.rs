//! A policy by itself: a zip archive with what of a run's folder is needed to play it, which is how `archive` keeps it.

use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, anyhow, bail, ensure};
use output::file;
use tempfile::TempDir;
use zip::write::FileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::run::folder::RunFolder;

/// What lies in it, under the names that it has in the folder.
const FILES: [&str; 4] =
    ["config.toml", "manifest.json", "checkpoints/best/state.json", "checkpoints/best/actor.safetensors"];
/// What archivers may list beside it.
const FOLDERS: [&str; 2] = ["checkpoints/", "checkpoints/best/"];
/// Longest of the files when it is unpacked (bytes).
const LONGEST: u64 = 256 << 20;

/// Whether this is the name of a kept policy.
pub fn is_kept(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zip") && !path.is_dir()
}

/// Keeps the best policy of the run in `folder` as `archive`, in place of one that is there. The same run gives the same bytes: git
/// compresses them, and no file has a time.
///
/// # Errors
/// If the run has no such policy, or the disk does not take it.
pub fn pack(folder: &Path, archive: &Path) -> Result<()> {
    let mut zip = ZipWriter::new(Cursor::new(vec![]));
    for name in FILES {
        let plain = FileOptions::default().compression_method(CompressionMethod::Stored);
        zip.start_file(name, plain.last_modified_time(DateTime::default()))?;
        zip.write_all(&fs_err::read(folder.join(name))?)?;
    }
    file::replace(archive, zip.finish()?.get_ref())
}

/// A run that can be played.
pub struct Playable {
    /// Its checkpoints lie here.
    pub folder: RunFolder,
    /// Its configuration: a file, or an archive that has it.
    pub config: PathBuf,
    /// Of a kept policy the archive, and where it is unpacked until this is dropped.
    unpacked: Option<(PathBuf, TempDir)>,
}

impl Playable {
    /// That of a run's folder or of a kept policy.
    ///
    /// # Errors
    /// If `path` is neither, or the archive is damaged or has other files.
    pub fn open(path: &Path) -> Result<Self> {
        if !is_kept(path) {
            let folder = RunFolder::open(path)?;
            return Ok(Playable { config: folder.config(), folder, unpacked: None });
        }
        let zip = fs_err::File::open(path)?;
        let to = tempfile::tempdir()?;
        unpack(zip, to.path()).with_context(|| format!("{}: not a policy that `archive` kept", path.display()))?;
        Ok(Playable { folder: RunFolder::at(to.path()), config: path.into(), unpacked: Some((path.into(), to)) })
    }

    /// An error that may name the folder to which an archive was unpacked, of which the user knows nothing.
    pub fn named(&self, error: Error) -> Error {
        match &self.unpacked {
            Some((archive, to)) => {
                anyhow!(format!("{error:#}").replace(&*to.path().to_string_lossy(), &archive.to_string_lossy()))
            }
            None => error,
        }
    }
}

fn unpack(zip: fs_err::File, to: &Path) -> Result<()> {
    let mut zip = ZipArchive::new(zip)?;
    let mut missing = FILES.to_vec();
    for at in 0..zip.len() {
        let mut file = zip.by_index(at)?;
        let name = file.name().to_string();
        if FOLDERS.contains(&name.as_str()) {
            continue;
        }
        // No other name is written to: not one with `..` in it either.
        let Some(place) = missing.iter().position(|wanted| *wanted == name) else {
            bail!("has {name:?}; wanted are {}, each once", FILES.join(", "))
        };
        let path = to.join(missing.swap_remove(place));
        let mut bytes = vec![];
        file.by_ref().take(LONGEST + 1).read_to_end(&mut bytes).with_context(|| name.clone())?;
        ensure!(bytes.len() as u64 <= LONGEST, "{name}: longer than {} MiB", LONGEST >> 20);
        fs_err::create_dir_all(path.parent().expect("below the folder"))?;
        fs_err::write(path, bytes)?;
    }
    ensure!(missing.is_empty(), "has no {}", missing.join(", no "));
    Ok(())
}
