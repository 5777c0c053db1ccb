//! Passes the commit to the programs at build time, because it belongs to the program and not to the time at which it runs.

use std::process::Command;

/// The sources of the programs, relative to the repository's root.
const SOURCES: [&str; 5] = ["Cargo.lock", "Cargo.toml", "rust-toolchain.toml", "crates", "experiments"];

fn main() {
    println!("cargo::rustc-env=WORKBENCH_COMMIT={}", commit());
    for file in ["HEAD", "index"] {
        if let Some(path) = git(&["rev-parse", "--path-format=absolute", "--git-path", file]) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    for source in SOURCES {
        println!("cargo::rerun-if-changed=../../{source}");
    }
}

/// Commit of this checkout, marked if its sources differ from it; `unknown` outside a git repository.
fn commit() -> String {
    let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) else {
        return "unknown".into();
    };
    let sources = SOURCES.map(|path| format!(":/{path}"));
    let mut status = vec!["status", "--porcelain", "--untracked-files=no", "--"];
    status.extend(sources.iter().map(String::as_str));
    let changed = git(&status).is_some_and(|files| !files.is_empty());
    if changed { commit + "-dirty" } else { commit }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
}
