//! Files that appear whole or not at all.

use std::ffi::OsString;
use std::fs::Permissions;
use std::io::ErrorKind::NotFound;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use fs_err as fs;
use serde::Serialize;
use tempfile::NamedTempFile;

/// Writes a file. Until the new one is whole on the disk, readers find the old one, after a power loss too.
///
/// # Errors
/// If `path` is a folder or no file, its folder is missing, or the disk does not take it.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = unfinished(path)?;
    file.write_all(bytes).with_context(|| path.display().to_string())?;
    finish(file, path)
}

/// Gives a temporary file the name `path`, in place of the file that has it, once the disk has its bytes.
///
/// # Errors
/// As [`replace`].
pub fn finish(file: NamedTempFile, path: &Path) -> Result<()> {
    let path = &behind_links(path)?;
    file.as_file().sync_all().with_context(|| path.display().to_string())?;
    file.persist(path).with_context(|| path.display().to_string())?;
    sync_names(path)
}

/// Gives a temporary file the name `path`, which no file may have yet, once the disk has its bytes.
///
/// # Errors
/// If there is a file of this name, which stays as it is, or the disk does not take it.
pub fn finish_new(file: NamedTempFile, path: &Path) -> Result<()> {
    file.as_file().sync_all().with_context(|| path.display().to_string())?;
    file.persist_noclobber(path).with_context(|| format!("{}: nothing was overwritten", path.display()))?;
    sync_names(path)
}

/// Waits until the disk has the names in the folder of a file.
fn sync_names(path: &Path) -> Result<()> {
    Ok(fs::File::open(folder_of(path))?.sync_all()?)
}

/// The folder in which a file lies.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Writes a CSV table, its header from the names of the rows' fields. The cell of a number that is not finite is empty. Without rows the
/// file is empty too.
///
/// # Errors
/// As [`replace`], or if a row is not one of numbers and words.
pub fn write_table(path: &Path, rows: &[impl Serialize]) -> Result<()> {
    replace(path, &table(rows)?)
}

/// As [`replace`], but for a name that no file may have yet.
///
/// # Errors
/// As [`replace`], or if there is a file of this name, which stays as it is.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = unfinished(path)?;
    file.write_all(bytes).with_context(|| path.display().to_string())?;
    finish_new(file, path)
}

/// The text of a CSV table with these rows. The cell of a number that is not finite is empty.
///
/// # Errors
/// If a row cannot be written as a row of a table.
pub fn table(rows: &[impl Serialize]) -> Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(vec![]);
    for row in rows {
        table.serialize(row)?;
    }
    let written = table.into_inner()?;
    let mut table = csv::Writer::from_writer(vec![]);
    for record in csv::ReaderBuilder::new().has_headers(false).from_reader(written.as_slice()).records() {
        table
            .write_record(record?.iter().map(|cell| if matches!(cell, "NaN" | "inf" | "-inf") { "" } else { cell }))?;
    }
    Ok(table.into_inner()?)
}

/// Makes the folder of a file that will be written later. Fails now if the file could not be written.
///
/// # Errors
/// As [`replace`], or if the folder cannot be made.
pub fn prepare(path: &Path) -> Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    unfinished(path).map(drop)
}

/// A temporary file in the folder of `path`, which [`finish`] renames to `path` once it is complete. Dropped before, it
/// is deleted.
///
/// # Errors
/// As [`replace`].
pub fn unfinished(path: &Path) -> Result<NamedTempFile> {
    let path = &behind_links(path)?;
    let name = path.file_name().with_context(|| format!("{} is a folder", path.display()))?;
    let folder = folder_of(path);
    let mut builder = tempfile::Builder::new();
    // Permissions as those of any new file: the user's umask applies.
    builder.prefix(name).suffix(".tmp").permissions(Permissions::from_mode(0o666));
    builder.tempfile_in(folder).with_context(|| path.display().to_string())
}

/// The absolute path of a file, with links resolved, so that different paths to a file give the same result. The file need
/// not exist, its folder must.
///
/// # Errors
/// If `path` is a folder or a device, or its folder is missing.
pub fn place(path: &Path) -> Result<PathBuf> {
    let path = behind_links(path)?;
    let name = path.file_name().with_context(|| format!("{} is a folder", path.display()))?;
    Ok(fs::canonicalize(folder_of(&path))?.join(name))
}

/// The path at which a file of this name is written: for a link the file that it leads to, so that the link stays.
fn behind_links(path: &Path) -> Result<PathBuf> {
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => bail!("{} is a folder", path.display()),
        Ok(there) if !there.is_file() => bail!("{} is no file, but a device or the like", path.display()),
        Ok(_) if path.is_symlink() => Ok(fs::canonicalize(path)?),
        Err(error) if error.kind() == NotFound && path.is_symlink() => {
            bail!("{}: a link that leads nowhere", path.display())
        }
        _ => Ok(path.into()),
    }
}

/// The path with `suffix` behind its whole name. `Path::with_extension` would cut "seed_0.5" at its dot.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_link_leads_to_is_written_and_what_is_no_file_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, lost, socket] = ["file", "link", "lost", "socket"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        std::os::unix::fs::symlink(folder.path().join("nowhere"), &lost).unwrap();
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        replace(&link, b"new").unwrap();
        assert!(link.is_symlink() && fs::read_to_string(&file).unwrap() == "new");
        for (path, word) in [(&lost, "leads nowhere"), (&socket, "is no file"), (&folder.path().into(), "is a folder")]
        {
            let problems = [prepare(path), replace(path, b"new")].map(|done| done.unwrap_err().to_string());
            assert!(problems.iter().all(|problem| problem.contains(word)), "{problems:?}");
        }
        assert!(socket.exists());
    }

    #[test]
    fn what_is_no_finite_number_leaves_its_cell_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        write_table(&path, &[(1.5, f64::NAN, f64::INFINITY, f64::NEG_INFINITY)]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "1.5,,,\n");
    }
}
