//! Files that are on the disk when they are written: a rename that follows must not overtake them.

use std::io::Write;
use std::path::Path;

use crate::Error;

/// Writes a file and waits until it is on the disk.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = fs_err::File::create(path)?;
    file.write_all(bytes)?;
    Ok(file.sync_all()?)
}

/// Waits until the names in `folder` are on the disk, as they are now.
pub(crate) fn names(folder: &Path) -> Result<(), Error> {
    // An empty path is the parent of a name alone.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    Ok(fs_err::File::open(folder)?.sync_all()?)
}
