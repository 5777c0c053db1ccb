//! Which of libtorch's kernels multiply matrices, and on how many threads: fixed once per process, before its first product.
//!
//! libtorch multiplies with Intel's MKL, which asks [`mkl_serv_intel_cpu_true`] whether the processor is Intel's. If the answer is no, MKL
//! uses kernels for SSE2 or similar, whatever instructions the processor has.

use std::ffi::{CStr, c_char, c_int};
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::Error;

/// Which kernels multiply matrices.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernels {
    /// The fastest kernels for the processor's instructions, whoever made the processor.
    #[default]
    Fast,
    /// Kernels that give the same bits on every x86-64 processor (MKL's `MKL_CBWR=COMPATIBLE`): a fifth as fast as those for AVX-512.
    Portable,
}

/// The kernels of this process, and whether MKL accepted them.
static CHOSEN: OnceLock<(Kernels, Result<(), &'static str>)> = OnceLock::new();

impl Kernels {
    /// Chooses the kernels of this process. Only the first call has an effect; every call returns what the first one chose.
    ///
    /// The products use one thread: beside another busy process, threads that wait for each other slow an update about thirtyfold. Use one
    /// process per seed instead.
    pub(crate) fn choose(self) -> Result<Self, Error> {
        let (chosen, made) = CHOSEN.get_or_init(|| {
            tch::set_num_interop_threads(1);
            tch::set_num_threads(1);
            (self, self.ask_for())
        });
        made.map(|()| *chosen).map_err(|allowed| self.refused(allowed))
    }

    /// As [`choose`](Self::choose), for a learner, whose numbers depend on the kernels: an error if other kernels were chosen before.
    pub(crate) fn insist(self) -> Result<(), Error> {
        match self.choose()? {
            chosen if chosen == self => Ok(()),
            Kernels::Fast => {
                Err(self
                    .refused("fast, as this process multiplies with fast kernels already; use a process of its own"))
            }
            Kernels::Portable => Err(self.refused(
                "portable, as this process multiplies with portable kernels already; use a process of its own",
            )),
        }
    }

    fn refused(self, allowed: &'static str) -> Error {
        Error::Config { field: "kernels", value: format!("{self:?}").to_lowercase(), allowed }
    }

    fn ask_for(self) -> Result<(), &'static str> {
        /// `MKL_CBWR_COMPATIBLE`.
        const COMPATIBLE: c_int = 3;
        if self == Kernels::Fast {
            return Ok(());
        }
        let set = symbol(c"mkl_serv_cbwr_set").ok_or("fast, as this libtorch has no MKL")?;
        // SAFETY: MKL's mkl_cbwr_set, which libtorch exports under the name it has inside: int (int).
        let set: extern "C" fn(c_int) -> c_int = unsafe { std::mem::transmute(set) };
        if set(COMPATIBLE) == 0 { Ok(()) } else { Err("fast, as MKL has multiplied already or knows no such mode") }
    }
}

/// MKL calls this function to ask whether the processor is Intel's. A definition in the program replaces MKL's own. It always answers yes,
/// as MKL's kernels for AVX2 and AVX-512 work on every processor that has these instructions. The build script makes the linker export it
/// to libtorch.
#[unsafe(no_mangle)]
extern "C" fn mkl_serv_intel_cpu_true() -> c_int {
    1
}

/// MKL's version, and its name for the instructions that its kernels use, such as `Intel(R) Advanced Vector Extensions 2 (Intel(R) AVX2)
/// enabled processors`. The first learner or actor of the process chooses the kernels.
pub fn kernel() -> String {
    /// MKL's `MKLVersion`.
    #[repr(C)]
    struct Version {
        numbers: [c_int; 3],
        status: *const c_char,
        build: *const c_char,
        processor: *const c_char,
        platform: *const c_char,
    }
    let Some(get) = symbol(c"mkl_serv_get_version") else { return "not MKL".into() };
    // SAFETY: MKL's mkl_get_version, which libtorch exports under the name it has inside: void (MKLVersion *). It fills the struct with
    // pointers to strings that stay.
    unsafe {
        let get: extern "C" fn(*mut Version) = std::mem::transmute(get);
        let mut version = std::mem::zeroed();
        get(&mut version);
        let Version { numbers: [major, minor, update], processor, .. } = version;
        let processor = if processor.is_null() { c"unknown" } else { CStr::from_ptr(processor) };
        format!("MKL {major}.{minor}.{update}: {}", processor.to_string_lossy())
    }
}

/// Address of a symbol, as libtorch finds it; `None` if there is none of this name.
fn symbol(name: &CStr) -> Option<*const ()> {
    // SAFETY: looks a name up; calls nothing.
    let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    (!found.is_null()).then_some(found.cast_const().cast())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If libtorch asked MKL's own function, a processor that is not Intel's would multiply at half its speed.
    #[test]
    fn libtorch_asks_this_program_who_made_the_processor() {
        Kernels::Fast.insist().unwrap();
        assert_eq!(symbol(c"mkl_serv_intel_cpu_true"), Some(mkl_serv_intel_cpu_true as *const ()));
    }

    #[test]
    fn a_process_has_one_kind_of_kernels() {
        Kernels::Fast.insist().unwrap();
        assert_eq!(Kernels::Portable.choose().unwrap(), Kernels::Fast);
        let error = Kernels::Portable.insist().unwrap_err().to_string();
        assert_eq!(
            error,
            "kernels = portable is out of range: fast, as this process multiplies with fast kernels already; use a process of its own"
        );
    }

    /// On a processor that is not Intel's the name says nothing of AVX2, though the kernels use it.
    #[test]
    fn the_kernel_has_the_name_that_mkl_gives_it() {
        Kernels::Fast.insist().unwrap();
        let name = kernel();
        assert!(name.starts_with("MKL 20") && name.contains("Intel(R)"), "{name}");
        let is_intel = fs_err::read_to_string("/proc/cpuinfo").unwrap().contains("GenuineIntel");
        if is_intel && is_x86_feature_detected!("avx2") {
            assert!(name.contains("Advanced Vector Extensions"), "{name}");
        }
    }
}
