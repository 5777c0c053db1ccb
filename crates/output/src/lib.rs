//! What programs share: work on all cores, statistics, files that appear whole, the command and commit that made them,
//! and how errors are reported.
//!
//! This is a crate of its own, so that programs without a learner need no libtorch.

pub mod file;
pub mod parallel;
pub mod program;
pub mod rank_test;
pub mod statistics;
pub mod survival;

use std::path::Path;

/// Commit of which this program was built, marked `-dirty` if its sources differed from it;
/// `unknown` outside a git repository.
pub fn commit() -> String {
    env!("WORKBENCH_COMMIT").into()
}

/// Version and commit, which every program prints with `--version`.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (commit ", env!("WORKBENCH_COMMIT"), ")");

/// The command line with the program's bare name, as it would be typed elsewhere.
pub fn command() -> Vec<String> {
    // Bytes that are not Unicode are replaced.
    let mut command: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(program) = command.first_mut() {
        *program = Path::new(&*program).file_name().unwrap_or_default().to_string_lossy().into_owned();
    }
    command
}
