//! Ctrl-C, SIGTERM and a closed terminal (SIGHUP) ask a run to save a checkpoint and end; Ctrl-C after that kills it. A
//! second SIGTERM does not: a scheduler sends one to every process of a job, and so does the sweep that started the run.

use std::io::Result;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether a signal asked to stop.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Handles the signals from now on, including those that [`hold_signals`](crate::hold_signals) has held back.
    ///
    /// # Errors
    /// If the system refuses the handlers.
    pub fn on_signals() -> Result<Self> {
        let stop = Stop::default();
        // Registered before the handlers that set the flag, so that the first Ctrl-C finds the flag unset and only sets it.
        flag::register_conditional_shutdown(SIGINT, 128 + SIGINT, Arc::clone(&stop.0))?;
        flag::register(SIGINT, Arc::clone(&stop.0))?;
        flag::register(SIGTERM, Arc::clone(&stop.0))?;
        if !ignores_hang_up() {
            flag::register(SIGHUP, Arc::clone(&stop.0))?;
        }
        set_held(libc::SIG_UNBLOCK)?;
        Ok(stop)
    }

    /// True from the first signal on.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Blocks the signals that ask to stop, or unblocks them.
fn set_held(how: libc::c_int) -> Result<()> {
    // SAFETY: plain system calls on a set of this function's own. `sigemptyset` makes it one.
    let failed = unsafe {
        let mut set = std::mem::zeroed();
        libc::sigemptyset(&raw mut set);
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            libc::sigaddset(&raw mut set, signal);
        }
        libc::pthread_sigmask(how, &raw const set, std::ptr::null_mut())
    };
    if failed == 0 { Ok(()) } else { Err(std::io::Error::from_raw_os_error(failed)) }
}

/// Holds back the signals that ask to stop, until [`Stop::on_signals`]. A program calls it before anything else, and so
/// does a pool in the child that it starts. It makes only system calls that are safe between fork and exec.
///
/// # Errors
/// If the system refuses.
pub fn hold() -> Result<()> {
    set_held(libc::SIG_BLOCK)
}

/// Has a program hold back the signals that ask to stop from its start on. Loading libtorch takes a fifth of a second
/// before `main`, in which such a signal would end the program.
#[macro_export]
macro_rules! hold_signals {
    () => {
        // SAFETY: the loader calls what this section lists, before any constructor of a library.
        #[used]
        #[unsafe(link_section = ".preinit_array")]
        static HOLD_SIGNALS: extern "C" fn() = {
            extern "C" fn hold() {
                // If the system refuses, such a signal ends the program.
                let _ = $crate::run::stop::hold();
            }
            hold
        };
    };
}

/// Whether the process was started to outlive its terminal, as `nohup` does.
fn ignores_hang_up() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask & (1 << (SIGHUP - 1)) != 0)
}
