//! What a run costs, over all the processes that had a part in it: of one that was killed, what it had spent when it last saved itself.

use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// Time that a run has taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    /// By the clock on the wall (s).
    pub wall_s: f64,
    /// Of the processor (s): other programs at work beside it count little. Of a run begun by an earlier program the time before that is missing.
    #[serde(default)]
    pub cpu_s: f64,
}

/// Goes on from what earlier processes spent.
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

    /// The same after what earlier processes spent.
    pub fn after(self, before: Spent) -> Self {
        Clock { before, ..self }
    }

    /// Until now.
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
