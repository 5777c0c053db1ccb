//! Puts the policies that `policies.txt` names, runs below `results/`, into the program.

use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=policies.txt");
    let here = env::var("CARGO_MANIFEST_DIR").expect("cargo says it");
    let results = Path::new(&here).join("../results").canonicalize().expect("results/ beside this package");
    let mut list = String::from("[\n");
    for run in fs::read_to_string("policies.txt").expect("policies.txt").lines() {
        let config = results.join(run).join("config.toml");
        let weights = results.join(run).join("checkpoints/best/actor.safetensors");
        for file in [&config, &weights] {
            assert!(file.is_file(), "policies.txt: {run} has no {}", file.display());
            println!("cargo::rerun-if-changed={}", file.display());
        }
        writeln!(list, "(\"{run}\", include_str!({config:?}), include_bytes!({weights:?}).as_slice()),")
            .expect("memory");
    }
    let out = env::var("OUT_DIR").expect("cargo says it");
    fs::write(Path::new(&out).join("policies.rs"), list + "]").expect("a folder to write to");
}
