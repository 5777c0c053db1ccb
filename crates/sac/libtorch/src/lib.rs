//! Build-time help for packages whose programs or tests link libtorch.
//!
//! Such a package has `torch-sys` as a direct dependency (cargo passes the folder of libtorch to direct dependents only), this crate as a
//! build-dependency, and a build script of one line: `libtorch::link()`.

/// Writes the folder of libtorch into the package's programs and tests, so that they start without `LD_LIBRARY_PATH`, and exports the
/// function by which libtorch's MKL asks for the maker of the processor.
///
/// # Panics
///
/// If torch-sys is not a direct dependency of the package.
pub fn link() {
    let folder = std::env::var("DEP_TCH_LIBTORCH_LIB").expect("torch-sys must be a direct dependency");
    println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    // libtorch has to find this function in the program: see `kernels.rs` of crates/sac.
    println!("cargo::rustc-link-arg=-Wl,--export-dynamic-symbol=mkl_serv_intel_cpu_true");
}
