//! What a motion costs, by the definitions in use.

use serde::{Deserialize, Serialize};

use crate::spatial::JointVector;

/// Motor constant times gear ratio of a Panda's joints (Nm/sqrt(W)): estimates for frameless motors of this size behind 100:1
/// gears, the first four joints and the last three. No published figures exist; use copper losses for ratios, not for values.
/// Joint 5 is the real arm's, of 12 Nm: where a parameter set allows it 80 Nm (robosuite's), it weighs too much.
const DRIVES: [f64; 7] = {
    const LARGE: f64 = 0.10 * 100.0;
    const SMALL: f64 = 0.04 * 100.0;
    [LARGE, LARGE, LARGE, LARGE, SMALL, SMALL, SMALL]
};

/// Sums over control samples and joints, with tau the commanded torque (gravity compensation included) and qd the
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
    /// sum R_i (tau_i/(k_i N_i))^2 dt (J): heat in the windings, with estimates of a Panda's drive constants.
    pub copper_loss: f64,
}

impl EnergyLedger {
    /// One control sample: torque (Nm), joint velocity (rad/s), duration (s).
    ///
    /// Of a torque that acts over the whole sample the velocity is the mean of those before and after it: kinetic energy
    /// grows by just that work, whatever the travel that an integrator makes of the sample. Where the engine takes several steps in
    /// a sample (a control rate below 500 Hz), it is that up to the error of this mean.
    pub fn add(&mut self, tau: &JointVector, qd: &JointVector, dt: f64) {
        let mut net = 0.0;
        for i in 0..7 {
            let power = tau[i] * qd[i];
            net += power;
            self.absolute += power.abs() * dt;
            self.positive += power.max(0.0) * dt;
            self.squared_torque += tau[i] * tau[i] * dt;
            self.copper_loss += (tau[i] / DRIVES[i]).powi(2) * dt;
        }
        self.net += net * dt;
        self.net_absolute += net.abs() * dt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn by_hand() {
        // Powers 10 * 0.5 = 5 W, 4 * -2 = -8 W and 2 * 1 = 2 W (joint 6) for 0.1 s.
        let tau = JointVector::from([10.0, 4.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
        let qd = JointVector::from([0.5, -2.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        let mut ledger = EnergyLedger::default();
        ledger.add(&tau, &qd, 0.1);
        assert_relative_eq!(ledger.absolute, 1.5);
        assert_relative_eq!(ledger.positive, 0.7);
        assert_relative_eq!(ledger.net, -0.1);
        assert_relative_eq!(ledger.net_absolute, 0.1);
        assert_relative_eq!(ledger.squared_torque, 12.0);
        // (10/10)^2 + (4/10)^2 + (2/4)^2 = 1.41 W
        assert_relative_eq!(ledger.copper_loss, 0.141);

        ledger.add(&(-tau), &qd, 0.1);
        assert_relative_eq!(ledger.absolute, 3.0);
        assert_relative_eq!(ledger.positive, 1.5);
        assert_relative_eq!(ledger.net, 0.0);
    }
}
