//! Embeds the policies of the runs below `results/` that `policies.txt` names into the program.

use std::fmt::Write;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::{env, io};

use zip::ZipArchive;

fn main() {
    println!("cargo::rerun-if-changed=policies.txt");
    let folder = |name: &str| env::var(name).expect("cargo says it");
    let results = Path::new(&folder("CARGO_MANIFEST_DIR")).join("../results");
    let out = folder("OUT_DIR");
    let mut list = String::from("[\n");
    for (number, run) in fs::read_to_string("policies.txt").expect("policies.txt").lines().enumerate() {
        let kept = results.join(format!("{run}.zip"));
        println!("cargo::rerun-if-changed={}", kept.display());
        let unpacked = ["config.toml", "checkpoints/best/actor.safetensors"].map(|name| {
            let bytes = read(&kept, name).unwrap_or_else(|problem| panic!("policies.txt: {run}: {name}: {problem}"));
            let to = Path::new(&out).join(format!("{number}-{}", name.replace('/', "-")));
            fs::write(&to, bytes).expect("a folder to write to");
            to
        });
        let [config, weights] = unpacked;
        writeln!(list, "(\"{run}\", include_str!({config:?}), include_bytes!({weights:?}).as_slice()),")
            .expect("memory");
    }
    fs::write(Path::new(&out).join("policies.rs"), list + "]").expect("a folder to write to");
}

/// A file of an archive.
fn read(archive: &Path, name: &str) -> io::Result<Vec<u8>> {
    let mut bytes = vec![];
    ZipArchive::new(File::open(archive)?)?.by_name(name)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}
