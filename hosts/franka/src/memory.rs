//! The memory of a program that has a deadline.

use anyhow::{Result, bail};
use rustix::mm::{MlockAllFlags, mlockall};

/// Keeps all of it, also what is yet to come, in the machine's memory: a page that has to be read from a disk takes milliseconds. A failure
/// is an error where the deadline is enforced, and a line elsewhere.
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
