//! Compares the torque that the arm reports with the torques that it was sent.

use crate::host::status::Fault;
use crate::spatial::JointVector;

/// Number of sent torques that are remembered. An arm that has lost as many commands in a row has stopped by itself.
const REMEMBERED: usize = 20;
/// Time for which the arm may report a torque that it was not sent (s); longer is a fault.
const PATIENCE: f64 = 0.02;
/// Tolerance of the comparison (Nm): an arm may round a torque to single precision.
const ROUNDING: f64 = 1e-3;

/// The torques sent last. After a lost command an earlier torque still acts. The torque rate is therefore limited relative to the torque
/// that the arm reports, as long as that torque may be one that was sent.
#[derive(Debug, Clone)]
pub(crate) struct Sent {
    torques: [JointVector; REMEMBERED],
    next: usize,
    /// Time since the arm last reported a torque that it had been sent (s).
    strange: f64,
}

impl Sent {
    /// Starts with `torque` (Nm) as the one that acts.
    pub(crate) fn new(torque: &JointVector) -> Self {
        Self { torques: [*torque; REMEMBERED], next: 0, strange: 0.0 }
    }

    pub(crate) fn add(&mut self, torque: &JointVector) {
        self.torques[self.next] = *torque;
        self.next = (self.next + 1) % REMEMBERED;
    }

    /// The torque relative to which the torque rate is limited: `told`, the reported torque, if at each joint it lies between the least and
    /// the largest torque remembered; otherwise `None`.
    ///
    /// # Errors
    /// If the arm has reported a torque that it was not sent for too long: the field `tau` is not filled, or holds something else.
    pub(crate) fn taken(&mut self, told: &JointVector, dt: f64) -> Result<Option<JointVector>, Fault> {
        for joint in 0..7 {
            let of = |f: fn(f64, f64) -> f64, from: f64| self.torques.iter().map(|sent| sent[joint]).fold(from, f);
            let (low, high) = (of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY));
            if !(low - ROUNDING..=high + ROUNDING).contains(&told[joint]) {
                self.strange += dt;
                if self.strange <= PATIENCE {
                    return Ok(None);
                }
                let sent = self.torques[(self.next + REMEMBERED - 1) % REMEMBERED][joint];
                return Err(Fault::TorqueTaken { joint: joint + 1, told: told[joint], sent });
            }
        }
        self.strange = 0.0;
        Ok(Some(*told))
    }
}
