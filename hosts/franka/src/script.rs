//! The built-in scripts: one action per 50 ms at the usual 20 Hz.

use aforce::host::{Host, HostSetup};
use aforce::wiper::{RoundPath, Wiper};
use aforce::{Pose, encode, pose_error};

use crate::cli::Script;

/// The running script.
pub enum Running {
    /// Stays at this pose.
    Hold(Pose),
    /// Circles, on a table or in the air.
    Round(Wiper),
}

impl Running {
    /// A script that begins at `start` (m, base frame): the middle of the circles, the tool's orientation, and the height in the air.
    pub fn new(script: Script, start: Pose) -> Self {
        match script {
            Script::Hold => Self::Hold(start),
            Script::Circle => Self::Round(Wiper::in_the_air(RoundPath::default(), start)),
            Script::Wipe => Self::Round(Wiper::from_above(RoundPath::default(), start)),
        }
    }

    /// Name of the present phase in the log.
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
