//! The committed header is what cbindgen makes of the library. `HEADER=write cargo test -p aforce-c --test header` takes a
//! change over.

use std::path::PathBuf;

#[test]
fn the_header_is_the_librarys() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new().with_src(root.join("src/lib.rs")).with_config(config).generate().unwrap();
    let mut text = Vec::new();
    bindings.write(&mut text);
    let now = String::from_utf8(text).unwrap();
    let path = root.join("include/aforce.h");
    if std::env::var_os("HEADER").is_some_and(|what| what == "write") {
        std::fs::write(&path, &now).unwrap();
    }
    assert_eq!(now, std::fs::read_to_string(&path).unwrap());
    let version = format!("#define AFORCE_ABI_VERSION {}\n", aforce_c::ABI_VERSION);
    assert!(now.contains(&version), "{version}");
}
