//! The adaptive law: stiffness and feed-forward wrench from the tracking error.

use crate::adaptive_impedance::{AdaptiveImpedance, AxisLaw};
use crate::spatial::Vector6;

/// The running law: K(t) and F_ff(t) of the six axes.
#[derive(Debug, Clone)]
pub struct AdaptiveLaw {
    config: AdaptiveImpedance,
    stiffness: Vector6,
    feedforward: Vector6,
}

impl AdaptiveLaw {
    /// The law at its start.
    #[must_use]
    pub fn new(config: AdaptiveImpedance) -> Self {
        let mut law = Self { config, stiffness: Vector6::zeros(), feedforward: Vector6::zeros() };
        law.reset();
        law
    }

    /// K = K(0) and F_ff = 0, as at the start of an episode.
    pub fn reset(&mut self) {
        self.stiffness = Vector6::from_fn(|axis, _| self.axis(axis).stiffness_start);
        self.feedforward = Vector6::zeros();
    }

    /// One sample of `dt` seconds, from the error e (m, rad) and its rate (m/s, rad/s): limit the rates, integrate, clamp.
    pub fn update(&mut self, e: &Vector6, e_dot: &Vector6, dt: f64) {
        let sign = self.config.sign.factor();
        for axis in 0..6 {
            let law = *self.axis(axis);
            let eps = e[axis] + sign * law.delta * e_dot[axis]; // eq. 6
            let k_dot = law.beta() * eps.abs() - law.gamma(); // eq. 4
            let f_dot = law.feedforward_gain * eps - law.forgetting * self.feedforward[axis]; // eq. 5
            let k_dot = k_dot.clamp(-law.stiffness_rate_max, law.stiffness_rate_max);
            let f_dot = f_dot.clamp(-law.feedforward_rate_max, law.feedforward_rate_max);
            let k = self.stiffness[axis] + dt * k_dot;
            let f = self.feedforward[axis] + dt * f_dot;
            self.stiffness[axis] = k.clamp(law.stiffness_min, law.stiffness_max);
            // The clamp is inside the integrator: F_ff cannot wind up beyond it.
            self.feedforward[axis] = f.clamp(-law.feedforward_max, law.feedforward_max);
        }
    }

    /// K of each axis (N/m, Nm/rad; shaped: 1/s^2).
    #[must_use]
    pub fn stiffness(&self) -> &Vector6 {
        &self.stiffness
    }

    /// F_ff of each axis (N, Nm; shaped: m/s^2, rad/s^2), world axes. It enters the torque law with a minus sign.
    #[must_use]
    pub fn feedforward(&self) -> &Vector6 {
        &self.feedforward
    }

    /// Axes 0-2 translate, 3-5 rotate.
    fn axis(&self, axis: usize) -> &AxisLaw {
        if axis < 3 { &self.config.translation } else { &self.config.rotation }
    }
}

#[cfg(test)]
mod tests;
