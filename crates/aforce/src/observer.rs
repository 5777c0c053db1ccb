//! Estimates the contact wrench from joint torques, for an arm that does not report it.

use crate::spatial::{JointVector, Measurement, Wrench};

/// A generalized-momentum observer (De Luca et al., IROS 2006): what changes the momentum p = M qd besides the
/// commanded torque, gravity, Coriolis forces and the joints' damping is an external torque. It needs no acceleration.
///
/// ```text
/// p_dot = tau + C^T qd - g - d qd + tau_ext        r_dot = k (tau_ext - r)
/// ```
///
/// The residual r follows tau_ext through a first-order low-pass with the cut-off k. The update is exact for a tau_ext that is constant
/// over a sample, so it is stable at any rate. A force that the model lacks, such as a payload's weight, counts as contact.
#[derive(Debug, Clone)]
pub struct MomentumObserver {
    /// k (1/s).
    gain: f64,
    /// Viscous damping of each joint (Nm s/rad), as the model has it.
    damping: JointVector,
    /// The previous sample.
    previous: Measurement,
    /// r (Nm).
    residual: JointVector,
}

impl MomentumObserver {
    /// An observer with the given cut-off (Hz) and viscous joint damping (Nm s/rad) that starts from `y`, without
    /// external torque.
    #[must_use]
    pub fn new(cutoff_hz: f64, damping: JointVector, y: &Measurement) -> Self {
        MomentumObserver {
            gain: std::f64::consts::TAU * cutoff_hz,
            damping,
            previous: y.clone(),
            residual: JointVector::zeros(),
        }
    }

    /// Takes the sample `y`, `dt` seconds (above 0) after the last one. In between the torque `tau` (Nm) acted.
    pub fn update(&mut self, tau: &JointVector, y: &Measurement, dt: f64) {
        let last = &self.previous;
        let qd = (last.qd + y.qd) / 2.0;
        let change = y.mass * y.qd - last.mass * last.qd;
        // dt (C^T qd - g) = dt M_dot qd - dt (C qd + g), where dt M_dot is the change of M.
        let drift = (y.mass - last.mass) * qd - last.bias * dt;
        let external = (change - drift) / dt - tau + self.damping.component_mul(&qd);
        self.residual += (1.0 - libm::exp(-self.gain * dt)) * (external - self.residual);
        self.previous.clone_from(y);
    }

    /// The wrench on the tool that explains the external torque best (N, Nm; world axes, at the tool point):
    /// least squares of the torques. With seven joints one direction of the torques is explained by no wrench. Towards
    /// a singular posture the estimate grows without bound along the direction that is lost, because the model's errors
    /// are divided by a singular value of the Jacobian that goes to zero. Zero where J J^T cannot be factorised.
    #[must_use]
    pub fn wrench(&self) -> Wrench {
        let jacobian = &self.previous.jacobian;
        let normal = (jacobian * jacobian.transpose()).cholesky();
        normal.map_or_else(Wrench::zeros, |factor| factor.solve(&(jacobian * self.residual)))
    }
}
