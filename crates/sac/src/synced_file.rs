//! Writes files and waits until they are on the disk, so that a rename that follows cannot reach the disk first.

use std::io::Write;
use std::path::Path;

use crate::Error;

/// Writes a file and waits until it is on the disk.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = fs_err::File::create(path)?;
    file.write_all(bytes)?;
    Ok(file.sync_all()?)
}

/// Waits until the directory entries of `folder` are on the disk.
pub(crate) fn names(folder: &Path) -> Result<(), Error> {
    // The parent of a bare file name is an empty path.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    Ok(fs_err::File::open(folder)?.sync_all()?)
}
