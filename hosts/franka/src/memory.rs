//! Locks the program's memory: the control loop has a deadline.

use anyhow::{Result, bail};
use rustix::mm::{MlockAllFlags, mlockall};

/// Keeps all present and future pages of the program in RAM, as reading a page from disk takes milliseconds. A failure is an error if the
/// deadline `is_enforced`, and otherwise a printed line.
pub fn lock(is_enforced: bool) -> Result<()> {
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
        Err(error) if is_enforced => bail!(
            "the memory cannot be locked ({error}): `ulimit -l unlimited` for this user would be right, or --no-realtime"
        ),
        Err(error) => println!("the memory is not locked: {error}"),
        Ok(()) => {}
    }
    Ok(())
}
