//! Energy and effort of a motion, by the definitions in use.

use serde::{Deserialize, Serialize};

use crate::spatial::JointVector;

/// Sums over control samples and joints, with tau the torque that acts (gravity compensation included) and qd the
/// joint velocity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnergyLedger {
    /// sum |tau_i qd_i| dt (J): mechanical work, braking costing as much as driving. The headline number.
    pub absolute: f64,
    /// sum max(tau_i qd_i, 0) dt (J): work done by the motors, without regeneration.
    pub positive: f64,
    /// sum tau^T qd dt (J): net work; equals the change of energy plus the losses.
    pub net: f64,
    /// sum |tau^T qd| dt (J): the joints may exchange power, the arm as a whole may not regenerate.
    pub net_absolute: f64,
    /// sum tau^T tau dt ((Nm)^2 s): effort, not energy.
    pub squared_torque: f64,
    /// sum (tau_i / drives_i)^2 dt (J): heat in the windings, with drives = k N / sqrt(R) of torque constant k, gear ratio N and winding
    /// resistance R.
    pub copper_loss: f64,
}

impl EnergyLedger {
    /// One control sample: torque (Nm), joint velocity (rad/s), motor constant times gear ratio of each joint's drive (Nm/sqrt(W)),
    /// duration (s).
    ///
    /// Give as `qd` the mean of the velocities before and after the sample: then the work is exactly the kinetic energy gained. Where the
    /// physics engine takes several steps in a sample (a control rate below 500 Hz), this holds approximately.
    pub fn add(&mut self, tau: &JointVector, qd: &JointVector, drives: &[f64; 7], dt: f64) {
        let mut net = 0.0;
        for i in 0..7 {
            let power = tau[i] * qd[i];
            net += power;
            self.absolute += power.abs() * dt;
            self.positive += power.max(0.0) * dt;
            self.squared_torque += tau[i] * tau[i] * dt;
            self.copper_loss += (tau[i] / drives[i]).powi(2) * dt;
        }
        self.net += net * dt;
        self.net_absolute += net.abs() * dt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use approx::assert_relative_eq;

    #[test]
    fn by_hand() {
        // Powers 10 * 0.5 = 5 W, 4 * -2 = -8 W and 2 * 1 = 2 W (joint 6) for 0.1 s.
        let tau = JointVector::from([10.0, 4.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
        let qd = JointVector::from([0.5, -2.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        let mut ledger = EnergyLedger::default();
        ledger.add(&tau, &qd, &Arm::FRANKA_DRIVES, 0.1);
        assert_relative_eq!(ledger.absolute, 1.5);
        assert_relative_eq!(ledger.positive, 0.7);
        assert_relative_eq!(ledger.net, -0.1);
        assert_relative_eq!(ledger.net_absolute, 0.1);
        assert_relative_eq!(ledger.squared_torque, 12.0);
        // (10/10)^2 + (4/10)^2 + (2/4)^2 = 1.41 W
        assert_relative_eq!(ledger.copper_loss, 0.141);

        ledger.add(&(-tau), &qd, &Arm::FRANKA_DRIVES, 0.1);
        assert_relative_eq!(ledger.absolute, 3.0);
        assert_relative_eq!(ledger.positive, 1.5);
        assert_relative_eq!(ledger.net, 0.0);
    }
}
