//! Ctrl-C, SIGTERM and a terminal that goes away (SIGHUP) ask a run to save itself; Ctrl-C after that kills it. A second SIGTERM
//! does not: a scheduler sends one to every process of a job, and so does the sweep that started the run.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use output::program;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether somebody asked to stop.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Listens from now on. Nor does a reader of the output that goes away end the program any more: Ctrl-C also ends the `tee`
    /// behind it, before it has saved itself.
    ///
    /// # Errors
    /// If the system refuses the handlers.
    pub fn on_signals() -> std::io::Result<Self> {
        let stop = Stop::default();
        program::outlive_readers();
        // Before the next two: the first signal finds the flag unset and only sets it.
        flag::register_conditional_shutdown(SIGINT, 128 + SIGINT, Arc::clone(&stop.0))?;
        flag::register(SIGINT, Arc::clone(&stop.0))?;
        flag::register(SIGTERM, Arc::clone(&stop.0))?;
        if !ignores_hang_up() {
            flag::register(SIGHUP, Arc::clone(&stop.0))?;
        }
        Ok(stop)
    }

    /// True from the first signal on.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Whether the process was started to outlive its terminal, as `nohup` does.
fn ignores_hang_up() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask & (1 << (SIGHUP - 1)) != 0)
}
