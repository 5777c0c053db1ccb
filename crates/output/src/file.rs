//! Files that appear whole or not at all.

use std::ffi::OsString;
use std::fs::Permissions;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use fs_err as fs;
use serde::Serialize;
use tempfile::NamedTempFile;

/// Writes a file; whoever looks meanwhile sees the old one, and so does who looks after a power loss.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = unfinished(path)?;
    file.write_all(bytes).with_context(|| path.display().to_string())?;
    finish(file, path)
}

/// Gives a file its name, in place of the one that has it, once the disk has its bytes.
pub fn finish(file: NamedTempFile, path: &Path) -> Result<()> {
    file.as_file().sync_all().with_context(|| path.display().to_string())?;
    file.persist(path).with_context(|| path.display().to_string())?;
    Ok(())
}

/// Gives a file its name, which no other may have, once the disk has its bytes.
pub fn finish_new(file: NamedTempFile, path: &Path) -> Result<()> {
    file.as_file().sync_all().with_context(|| path.display().to_string())?;
    file.persist_noclobber(path).with_context(|| format!("{}: nothing was overwritten", path.display()))?;
    Ok(())
}

/// Writes a CSV table, its header from the names of the rows' fields; what is not a number leaves its cell empty.
pub fn write_table(path: &Path, rows: &[impl Serialize]) -> Result<()> {
    let mut table = csv::Writer::from_writer(vec![]);
    for row in rows {
        table.serialize(row)?;
    }
    let written = table.into_inner()?;
    let mut table = csv::Writer::from_writer(vec![]);
    for record in csv::ReaderBuilder::new().has_headers(false).from_reader(written.as_slice()).records() {
        table.write_record(record?.iter().map(|cell| if cell == "NaN" { "" } else { cell }))?;
    }
    replace(path, &table.into_inner()?)
}

/// Makes the folder of a file that is to come; fails now if the file could not be written then.
pub fn prepare(path: &Path) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    unfinished(path).map(drop)
}

/// A file that is to have this name once it is complete: beside it, with a name of its own, gone when it is dropped.
pub fn unfinished(path: &Path) -> Result<NamedTempFile> {
    let name = path.file_name().filter(|_| !path.is_dir());
    let name = name.with_context(|| format!("{} is a folder", path.display()))?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    // As of any new file: what others may do with it, the user's mask says.
    builder.prefix(name).suffix(".tmp").permissions(Permissions::from_mode(0o666));
    builder.tempfile_in(folder).with_context(|| path.display().to_string())
}

/// `Path::with_extension` would cut "seed_0.5" at its dot.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}
