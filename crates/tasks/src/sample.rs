//! One control sample, for a caller that watches an episode.

use aforce::{Controller, JointVector, Measurement};
use physics::{ContactReading, Simulation};

/// One control sample.
#[derive(Clone, Copy)]
pub struct Sample<'a> {
    /// The measurement that the controller was given.
    pub given: &'a Measurement,
    /// The contact at the time of this measurement.
    pub contact: &'a ContactReading,
    /// The controller after its update.
    pub controller: &'a Controller,
    /// The torque that acted (Nm).
    pub tau: &'a JointVector,
    /// The plant after the torque acted.
    pub simulation: &'a Simulation,
}
