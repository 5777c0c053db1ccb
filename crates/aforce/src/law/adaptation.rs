//! The adaptive law: stiffness and feed-forward wrench from the tracking error.

use crate::law::psi::Psi;
use crate::spatial::Vector6;

/// The running law: K(t) and F_ff(t) of the six axes.
#[derive(Debug, Clone)]
pub struct AdaptiveLaw {
    psi: Psi,
    stiffness: Vector6,
    feedforward: Vector6,
}

impl AdaptiveLaw {
    /// The law at the start of an episode. `psi` is not checked here, but with the space that the law acts in, by
    /// [`ActionSpace::validate`](crate::ActionSpace::validate).
    #[must_use]
    pub fn new(psi: Psi) -> Self {
        Self { stiffness: *psi.k_0.vector(), feedforward: Vector6::zeros(), psi }
    }

    /// One sample of `dt` seconds, from the error e = x - x_d (m, rad; world axes) and its rate (m/s, rad/s). F_ff: its
    /// rate is limited, then integrated, then clamped. K: integrated, clamped, then its step is limited, so that K may
    /// lie outside bounds that have just been moved.
    ///
    /// `excess` is what the torque limits cut off the last sample's torque, seen at the tool: J (tau wanted - tau sent). It is no
    /// wrench, and only its signs mean something: with anti-windup K does not grow along an axis whose spring, -K e, would push
    /// further that way.
    ///
    /// # Panics
    /// If a bound or rate of psi is NaN, or a lower bound is above the upper one.
    pub fn update(&mut self, e: &Vector6, e_dot: &Vector6, excess: &Vector6, dt: f64) {
        let psi = &self.psi;
        let sign = psi.delta_sign.factor();
        for axis in 0..6 {
            let eps = e[axis] + sign * psi.delta[axis] * e_dot[axis]; // eq. 6
            let k_dot = psi.beta[axis] * eps.abs() - psi.gamma[axis]; // eq. 4
            let f_dot = psi.alpha[axis] * eps - psi.mu[axis] * self.feedforward[axis]; // eq. 5
            let at_limit = psi.anti_windup && -e[axis] * excess[axis] > 0.0;
            let k_dot = if at_limit { k_dot.min(0.0) } else { k_dot };
            let f_dot = f_dot.clamp(-psi.f_ff_rate_max[axis], psi.f_ff_rate_max[axis]);
            let k = (self.stiffness[axis] + dt * k_dot).clamp(psi.k_min[axis], psi.k_max[axis]);
            let k_step = dt * psi.k_rate_max[axis];
            self.stiffness[axis] = k.clamp(self.stiffness[axis] - k_step, self.stiffness[axis] + k_step);
            // The clamp is inside the integrator: F_ff cannot wind up beyond it.
            let f = self.feedforward[axis] + dt * f_dot;
            self.feedforward[axis] = f.clamp(-psi.f_ff_max[axis], psi.f_ff_max[axis]);
        }
    }

    /// The parameters.
    #[must_use]
    pub fn psi(&self) -> &Psi {
        &self.psi
    }

    /// The parameters, for changes between actions. K moves to new bounds at `k_rate_max`.
    pub(crate) fn psi_mut(&mut self) -> &mut Psi {
        &mut self.psi
    }

    /// Sets K to the value that acts, from which the next sample starts.
    pub(crate) fn set_stiffness(&mut self, stiffness: &Vector6) {
        self.stiffness = *stiffness;
    }

    /// K of each axis (N/m, Nm/rad; 1/s^2 in a space in that unit).
    #[must_use]
    pub fn stiffness(&self) -> &Vector6 {
        &self.stiffness
    }

    /// F_ff of each axis (N, Nm; in a space in 1/s^2 m/s^2, rad/s^2), world axes. It enters the torque law with a minus sign.
    #[must_use]
    pub fn feedforward(&self) -> &Vector6 {
        &self.feedforward
    }
}

#[cfg(test)]
mod tests;
