//! The committed header is what cbindgen makes from the library. A C program is compiled with many warnings as errors against the header
//! and each of the two libraries, and compares the torques with the golden vectors.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The folder in which cargo puts the libraries of the tested profile: that of the test programs.
fn libraries() -> PathBuf {
    std::env::current_exe().unwrap().parent().unwrap().to_owned()
}

fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

fn compile(program: &str, to: &Path, link: &[String]) {
    let source = root().join("tests").join(program);
    let compiler = std::env::var_os("CC").unwrap_or("cc".into());
    let mut command = Command::new(compiler);
    command.args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-O1"]);
    run(command.arg("-I").arg(root().join("include")).arg(source).arg("-o").arg(to).args(link).arg("-lm"));
}

#[test]
fn a_c_program_gets_the_golden_torques_from_either_library() {
    let folder = tempfile::tempdir().unwrap();
    let libraries = libraries();
    let golden = root().join("../../crates/aforce/tests/golden");
    let shared = [format!("-L{0} -laforce_c -Wl,-rpath,{0}", libraries.display())];
    let shared: Vec<String> = shared[0].split(' ').map(String::from).collect();
    let fixed = [libraries.join("libaforce_c.a").display().to_string(), "-lpthread".into(), "-ldl".into()];
    for (name, link) in [("shared", shared), ("static", fixed.to_vec())] {
        let program = folder.path().join(name);
        compile("host.c", &program, &link);
        let output = run(Command::new(&program).arg(&golden));
        println!("{name}: {}", String::from_utf8_lossy(&output.stdout));
    }
}

#[test]
fn the_header_is_cpp_too() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("empty.cpp");
    std::fs::write(&source, "#include \"aforce.h\"\nint main() { return aforce_abi_version() == 0; }\n").unwrap();
    let compiler = std::env::var_os("CXX").unwrap_or("c++".into());
    let mut command = Command::new(compiler);
    command.args(["-std=c++14", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"]);
    run(command.arg(root().join("include")).arg(source));
}

/// `HEADER=write cargo test -p aforce-c --test program` writes the header anew.
#[test]
fn the_header_is_the_librarys() {
    let root = root();
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
