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
