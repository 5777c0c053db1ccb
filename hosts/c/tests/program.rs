//! C programs against the header and both libraries: compiled with every warning, run, and held against the golden vectors.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Where cargo puts the libraries of the profile that is tested: beside the tests.
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
