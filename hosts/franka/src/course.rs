//! Time, energy and lost packets of an episode so far.

use std::fmt::{self, Display, Formatter};

use aforce::host::{ArmState, CompensatedBy, HostSetup};
use aforce::{Arm, EnergyLedger, JointVector};

/// The robot reports which share of this many latest commands has arrived.
const WINDOW: u64 = 100;

/// Time and energy of the cycles so far.
pub struct Course {
    /// Time since the first cycle (s).
    pub time: f64,
    pub cycles: u64,
    /// Time at which the script or policy is asked next (s).
    pub next_action: f64,
    /// Energy of the whole torque.
    pub energy: EnergyLedger,
    /// Energy of the torque without the compensation of gravity and Coriolis forces.
    pub control_energy: EnergyLedger,
    /// Number of lost states of the robot.
    lost: u64,
    /// Smallest share so far of 100 successive commands that reached the robot.
    arrived: f64,
    last_qd: Option<JointVector>,
}

impl Default for Course {
    fn default() -> Self {
        Self {
            time: 0.0,
            cycles: 0,
            next_action: 0.0,
            energy: EnergyLedger::default(),
            control_energy: EnergyLedger::default(),
            lost: 0,
            arrived: 1.0,
            last_qd: None,
        }
    }
}

impl Course {
    /// Adds a cycle that began `dt` (s) after the previous one. `arrived` is the share of arrived commands that the robot reports.
    pub fn add(&mut self, arm: &ArmState, setup: &HostSetup, dt: f64, arrived: f64) {
        // The torque `arm.tau` has acted since the last cycle, so its power counts at the mean speed of that time.
        let qd = 0.5 * (self.last_qd.replace(arm.qd).unwrap_or(arm.qd) + arm.qd);
        let law_coriolis =
            if setup.interface.coriolis == CompensatedBy::Law { arm.coriolis } else { JointVector::zeros() };
        self.energy.add(&(arm.tau + arm.gravity), &qd, &Arm::FRANKA_DRIVES, dt);
        self.control_energy.add(&(arm.tau - law_coriolis), &qd, &Arm::FRANKA_DRIVES, dt);
        self.time += dt;
        self.cycles += 1;
        self.lost += (dt / setup.controller.dt()).round().max(1.0) as u64 - 1;
        if self.cycles > WINDOW {
            self.arrived = self.arrived.min(arrived);
        }
    }
}

impl Display for Course {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Self { time, cycles, lost, .. } = self;
        let (arrived, energy) = (100.0 * self.arrived, self.control_energy.absolute);
        write!(
            f,
            "{time:.1} s, {cycles} cycles, {lost} states lost, of 100 commands at least {arrived:.0} arrived, {energy:.2} J"
        )
    }
}
