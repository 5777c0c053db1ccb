//! What happened during one action: energy, force, stiffness.

use aforce::{Controller, EnergyLedger, JointVector};
use physics::ContactReading;

/// Record of one 20 Hz action, summed or averaged over its control samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Interval {
    /// Control samples taken in.
    pub samples: u32,
    /// Energy in every definition.
    pub energy: EnergyLedger,
    /// Sum over samples of the torque of each joint, gravity compensation included (Nm).
    pub sum_torque: JointVector,
    /// Net work of each joint (J): the integral of tau_i qd_i.
    pub joint_work: JointVector,
    /// Largest norm of the sustained contact force (N).
    pub max_force: f64,
    /// Sum over samples of the norm of the sustained contact force (N).
    pub sum_force: f64,
    /// Largest norm of the raw contact force (N).
    pub max_raw_force: f64,
    /// Integral of the sustained force above the limit (N s).
    pub excess_impulse: f64,
    /// Time with contact beyond the wrist (s).
    pub contact_time: f64,
    /// Sum over samples of the mean translational stiffness, in the unit of the action
    /// space's own convention (1/s2 or N/m).
    pub sum_stiffness: f64,
    /// Sum over samples of the share of joints whose torque was limited.
    pub sum_saturated: f64,
}

impl Interval {
    /// Takes in one control sample of `dt` seconds: the torque that acted, the mean joint velocity meanwhile (the work of a
    /// torque that acts over the whole sample goes with it), and the contact after it.
    pub fn add(
        &mut self,
        tau: &JointVector,
        qd: &JointVector,
        contact: &ContactReading,
        controller: &Controller,
        force_limit: f64,
        dt: f64,
    ) {
        let force = contact.sustained_force();
        self.samples += 1;
        self.energy.add(tau, qd, dt);
        self.sum_torque += tau;
        self.joint_work += tau.component_mul(qd) * dt;
        self.max_force = self.max_force.max(force);
        self.sum_force += force;
        self.max_raw_force = self.max_raw_force.max(contact.raw.fixed_rows::<3>(0).norm());
        self.excess_impulse += (force - force_limit).max(0.0) * dt;
        self.contact_time += if contact.touching { dt } else { 0.0 };
        self.sum_stiffness += controller.own_stiffness().fixed_rows::<3>(0).mean();
        self.sum_saturated += controller.saturated().iter().filter(|&&limited| limited).count() as f64 / 7.0;
    }

    /// Mean translational stiffness (1/s2 or N/m: the action space's own convention).
    pub fn mean_stiffness(&self) -> f64 {
        self.sum_stiffness / f64::from(self.samples.max(1))
    }

    /// Mean torque of each joint (Nm).
    pub fn mean_torque(&self) -> JointVector {
        self.sum_torque / f64::from(self.samples.max(1))
    }

    /// Mean norm of the sustained contact force (N).
    pub fn mean_force(&self) -> f64 {
        self.sum_force / f64::from(self.samples.max(1))
    }

    /// Share of joint torques that were limited.
    pub fn saturated(&self) -> f64 {
        self.sum_saturated / f64::from(self.samples.max(1))
    }
}
