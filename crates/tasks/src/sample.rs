//! One control sample, for whoever looks on.

use aforce::{Controller, JointVector, Measurement};
use physics::{ContactReading, Simulation};

/// One control sample, to look at.
#[derive(Clone, Copy)]
pub struct Sample<'a> {
    /// What the controller was given.
    pub given: &'a Measurement,
    /// What pressed on the arm then.
    pub contact: &'a ContactReading,
    /// The controller after it answered.
    pub controller: &'a Controller,
    /// The torque that acted (Nm).
    pub tau: &'a JointVector,
    /// The plant after the torque acted.
    pub simulation: &'a Simulation,
}
