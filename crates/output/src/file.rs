//! Files that appear whole or not at all.

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use fs_err as fs;
use serde::Serialize;

/// Writes a file; whoever looks meanwhile sees the old one, and so does who looks after a power loss.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    ensure!(!path.is_dir(), "{} is a folder", path.display());
    let write = || {
        let mut file = fs::File::create(unfinished(path))?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(unfinished(path), path)
    };
    // A full disk keeps the old file, and nothing of the new one.
    write().inspect_err(|_| drop(fs::remove_file(unfinished(path))))?;
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
    ensure!(!path.is_dir() && path.file_name().is_some(), "{} is a folder", path.display());
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(unfinished(path), "")?;
    fs::remove_file(unfinished(path))?;
    Ok(())
}

/// Where a file is written before it is there.
pub fn unfinished(path: &Path) -> PathBuf {
    with_suffix(path, ".tmp")
}

/// `Path::with_extension` would cut "seed_0.5" at its dot.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}
