//! How far an episode is, and what it has cost.

use std::fmt::{self, Display, Formatter};

use aforce::host::{ArmState, CompensatedBy, HostSetup};
use aforce::{Arm, EnergyLedger, JointVector};

/// The robot reports the share that arrived of so many commands.
const WINDOW: u64 = 100;

/// Time and energy of the cycles so far.
pub struct Course {
    /// Since the first one (s).
    pub time: f64,
    pub cycles: u64,
    /// When whoever acts is asked next (s).
    pub next_action: f64,
    /// Of all of the torque.
    pub energy: EnergyLedger,
    /// Without the compensation of gravity and Coriolis forces.
    pub control_energy: EnergyLedger,
    /// States of the robot that did not come.
    lost: u64,
    /// The least share of the last 100 commands that reached the robot.
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
    /// Takes in a cycle that began `dt` (s) after the one before; `arrived` is the robot's share of commands.
    pub fn add(&mut self, arm: &ArmState, setup: &HostSetup, dt: f64, arrived: f64) {
        // Of the torque that has acted since the last cycle.
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
