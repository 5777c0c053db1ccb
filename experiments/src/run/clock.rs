//! Time that a run takes, summed over all processes that trained it. A process that was killed counts up to its last checkpoint.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// Time that a run has taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// Wall-clock time (s).
    pub wall_s: f64,
    /// CPU time (s), on which other programs of the machine have little effect. A run that an earlier version began lacks
    /// the CPU time before that version was replaced.
    #[serde(default)]
    pub cpu_s: f64,
}

/// Measures the time of this process, on top of what earlier processes spent.
pub struct Clock {
    before: Spent,
    started: Instant,
    cpu_at_start: f64,
}

impl Clock {
    /// Starts now.
    pub fn start() -> Self {
        Clock { before: Spent::default(), started: Instant::now(), cpu_at_start: cpu_s() }
    }

    /// The same clock, on top of what earlier processes spent.
    pub fn after(self, before: Spent) -> Self {
        Clock { before, ..self }
    }

    /// Time spent until now.
    pub fn spent(&self) -> Spent {
        Spent {
            wall_s: self.before.wall_s + self.started.elapsed().as_secs_f64(),
            cpu_s: self.before.cpu_s + cpu_s() - self.cpu_at_start,
        }
    }
}

/// CPU time of this process so far (s).
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32).as_secs_f64()
}
