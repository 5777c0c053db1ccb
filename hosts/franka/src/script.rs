//! What the arm does by itself: one action per 50 ms.

use aforce::host::{Host, HostSetup};
use aforce::wiper::{RoundPath, Wiper};
use aforce::{Pose, encode, pose_error};

use crate::cli::Script;

/// The running script.
pub enum Running {
    /// Stays at this pose.
    Hold(Pose),
    /// Goes round, on a table or in the air.
    Round(Wiper),
}

impl Running {
    /// Begins at `start`: height and orientation in the air, middle of the circles.
    pub fn new(script: Script, start: Pose) -> Self {
        match script {
            Script::Hold => Self::Hold(start),
            Script::Circle => Self::Round(Wiper::in_the_air(RoundPath::default(), start)),
            Script::Wipe => Self::Round(Wiper::from_above(RoundPath::default(), start)),
        }
    }

    /// Name in the log of what the script is at.
    pub fn phase(&self) -> &'static str {
        match self {
            Self::Hold(_) => "hold",
            Self::Round(wiper) => wiper.phase().name(),
        }
    }

    /// The next action; `None` when all is done.
    pub fn action(&mut self, host: &Host, setup: &HostSetup) -> Option<Vec<f64>> {
        let (controller, y) = (host.controller(), host.measurement()?);
        match self {
            Self::Hold(pose) => {
                let delta = pose_error(pose, &controller.origin(y));
                Some(encode(controller.space(), &setup.controller, &delta, 0.0))
            }
            Self::Round(wiper) => wiper.action(controller, &setup.controller, y),
        }
    }
}
