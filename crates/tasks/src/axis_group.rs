//! Stiffness, forces and work of three axes during one action.

use std::ops::AddAssign;

use aforce::{Controller, Vector6};

/// What three axes, the translational or the rotational ones, did during one action.
///
/// Stiffness is in N/m or Nm/rad whatever the action space's unit. That of the contact axis is included even while a force controller
/// holds this axis. Forces are in N or Nm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AxisGroup {
    /// Sum over samples of the mean stiffness of the three axes.
    pub sum_stiffness: f64,
    /// Sum over samples of the mean of alpha/mu, the stiffness that F_ff adds under a lasting error.
    pub sum_feedforward_spring: f64,
    /// Sum over samples of the share of the axes whose stiffness is at its lower bound.
    pub sum_at_min: f64,
    /// Sum over samples of the share of the axes whose stiffness is at its upper bound.
    pub sum_at_max: f64,
    /// Sum over samples of the norm of F_ff.
    pub sum_feedforward: f64,
    /// Sum over samples of the norm of K e.
    pub sum_spring: f64,
    /// Sum over samples of the norm of D e_dot.
    pub sum_damper: f64,
    /// Integral of abs(force x velocity), or abs(moment x angular velocity), of the wrench that the controller asks for (J).
    pub work: f64,
}

impl AxisGroup {
    /// Adds one control sample of `dt` seconds; `first` is the group's first axis, 0 or 3.
    pub(crate) fn add(&mut self, first: usize, controller: &Controller, dt: f64) {
        let mean = |v: &Vector6| v.fixed_rows::<3>(first).mean();
        let norm = |v: &Vector6| v.fixed_rows::<3>(first).norm();
        self.sum_stiffness += mean(&controller.stiffness());
        self.sum_feedforward_spring += mean(&controller.feedforward_spring());
        for axis in first..first + 3 {
            let k = controller.own_stiffness()[axis];
            let [low, high] = controller.stiffness_bounds(axis).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            self.sum_at_min += if k <= low { 1.0 / 3.0 } else { 0.0 };
            self.sum_at_max += if k >= high { 1.0 / 3.0 } else { 0.0 };
        }
        self.sum_feedforward += norm(controller.feedforward());
        self.sum_spring += norm(&controller.spring_wrench());
        self.sum_damper += norm(controller.damper_wrench());
        self.work += controller.power()[first / 3].abs() * dt;
    }

    /// Share of F_ff in the sum of spring, damper and F_ff, 0 to 1; 0 if all are zero.
    pub fn feedforward_share(&self) -> f64 {
        let all = self.sum_feedforward + self.sum_spring + self.sum_damper;
        if all > 0.0 { self.sum_feedforward / all } else { 0.0 }
    }
}

impl AddAssign for AxisGroup {
    fn add_assign(&mut self, other: Self) {
        self.sum_stiffness += other.sum_stiffness;
        self.sum_feedforward_spring += other.sum_feedforward_spring;
        self.sum_at_min += other.sum_at_min;
        self.sum_at_max += other.sum_at_max;
        self.sum_feedforward += other.sum_feedforward;
        self.sum_spring += other.sum_spring;
        self.sum_damper += other.sum_damper;
        self.work += other.work;
    }
}
