//! Every tenth cycle as CSV: the columns of the wiping experiment, and columns that only a host has.

use std::cell::Cell;
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use aforce::host::{Command, Host, Status};
use aforce::{EnergyLedger, JointVector, Pose, Vector3, Vector6, pose_error};
use anyhow::{Context, Result, anyhow};

use crate::protocol::Fingers;

/// Largest number of rows that wait for the disk.
const WAITING: usize = 4096;
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// One cycle.
pub struct Row {
    time: f64,
    phase: &'static str,
    force: [f64; 3],
    tool: Pose,
    set_point: Pose,
    stiffness: Vector6,
    feedforward: Vector6,
    energy: [f64; 2],
    tank: f64,
    /// Status of the law, or `fault` if the program stops the law for a fault of its own.
    pub status: &'static str,
    limited: u32,
    tau: JointVector,
    episode: u32,
    fingers: Option<Fingers>,
}

impl Row {
    /// The host's latest cycle; `None` before the host has read a state. `energies` are those of the whole torque, and of the torque
    /// without the compensation of gravity and Coriolis forces. Forces are components along `contact_axis`. The last argument is the
    /// episode's number and the state of the gripper, if there is one.
    pub fn new(
        time: f64,
        phase: &'static str,
        host: &Host,
        command: &Command,
        energies: [&EnergyLedger; 2],
        contact_axis: &Vector3,
        (episode, fingers): (u32, Option<Fingers>),
    ) -> Option<Self> {
        let (controller, y) = (host.controller(), host.measurement()?);
        let (status, limited) = match command.status {
            Status::Running => ("running", 0),
            Status::Limited(limited) => ("limited", limited.bits()),
            Status::Fault(_) => ("fault", 0),
            Status::Stopped => ("stopped", 0),
        };
        Some(Self {
            time,
            phase,
            force: [y.wrench.fixed_rows::<3>(0).dot(contact_axis), controller.force_command(), controller.engagement()],
            tool: y.pose,
            set_point: *controller.set_point(),
            stiffness: host.effective_stiffness(),
            feedforward: *controller.feedforward(),
            energy: energies.map(|energy| energy.absolute),
            tank: host.tank(),
            status,
            limited,
            tau: command.tau,
            episode,
            fingers,
        })
    }

    fn header() -> Vec<String> {
        let names = ["time_s", "phase", "force_n", "measured_force_n", "force_command_n", "engagement"];
        let mut header: Vec<String> = names.map(String::from).into();
        for (name, axes, unit) in [
            ("position", 3, "_m"),
            ("set_point", 3, "_m"),
            ("error", 6, ""),
            ("stiffness", 6, ""),
            ("feedforward", 6, ""),
        ] {
            header.extend(AXES.iter().take(axes).map(|axis| format!("{name}_{axis}{unit}")));
        }
        header.extend(
            ["quaternion_error", "energy_j", "control_energy_j", "tank_j", "status", "limited"].map(String::from),
        );
        header.extend((1..=7).map(|joint| format!("tau_{joint}_nm")));
        header.extend(["episode", "gripper_width_m", "gripper_grasped"].map(String::from));
        header
    }

    fn cells(&self) -> Vec<String> {
        let error = pose_error(&self.tool, &self.set_point);
        // `force_n`, the true contact force, stays empty: only a simulator knows it.
        let mut cells = vec![format!("{:.3}", self.time), self.phase.into(), String::new()];
        let vectors: [&[f64]; 6] = [
            &self.force,
            self.tool.translation.vector.as_slice(),
            self.set_point.translation.vector.as_slice(),
            error.as_slice(),
            self.stiffness.as_slice(),
            self.feedforward.as_slice(),
        ];
        cells.extend(vectors.into_iter().flatten().map(|value| format!("{value:.6}")));
        // Norm of the difference of two quaternions: 2 sin(angle / 4).
        let quaternion_error = 2.0 * (self.tool.rotation.angle_to(&self.set_point.rotation) / 4.0).sin();
        cells.extend([quaternion_error, self.energy[0], self.energy[1], self.tank].map(|value| format!("{value:.6}")));
        cells.extend([self.status.to_owned(), self.limited.to_string()]);
        cells.extend(self.tau.iter().map(|tau| format!("{tau:.6}")));
        let [width, grasped] = self.fingers.map_or_else(Default::default, |fingers| {
            [format!("{:.5}", fingers.width), u8::from(fingers.grasped).to_string()]
        });
        cells.extend([self.episode.to_string(), width, grasped]);
        cells
    }
}

/// Writes rows in a thread of its own, so that the control loop does not wait for the disk.
pub struct Log {
    rows: SyncSender<Row>,
    /// Number of rows that were dropped because the queue was full.
    lost: Cell<u64>,
    writer: JoinHandle<Result<()>>,
}

impl Log {
    /// Creates the file; an existing file is an error. A file that gets no row is removed in the end.
    pub fn create(path: &Path) -> Result<Self> {
        let file = std::fs::File::create_new(path).with_context(|| path.display().to_string())?;
        let (rows, received) = sync_channel::<Row>(WAITING);
        let path = path.to_owned();
        let writer = std::thread::spawn(move || {
            let mut table = csv::Writer::from_writer(file);
            table.write_record(Row::header())?;
            let mut is_empty = true;
            for row in received {
                is_empty = false;
                table.write_record(row.cells())?;
                table.flush()?;
            }
            if is_empty {
                std::fs::remove_file(path)?;
            }
            Ok(())
        });
        Ok(Self { rows, lost: Cell::new(0), writer })
    }

    /// Queues a row, or drops it if the queue is full.
    pub fn add(&self, row: Row) {
        if self.rows.try_send(row).is_err() {
            self.lost.set(self.lost.get() + 1);
        }
    }

    /// Waits until all is written. Returns the number of rows that were dropped because the disk was too slow.
    ///
    /// # Errors
    /// If a row could not be written.
    pub fn finish(self) -> Result<u64> {
        drop(self.rows);
        self.writer.join().map_err(|_| anyhow!("the log's thread has died"))?.context("the log")?;
        Ok(self.lost.get())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn the_measured_force_is_along_the_contact_axis() {
        let (mut host, (mut arm, _)) = (testing::host(), testing::panda());
        // The arm reports the wrench that the tool exerts on the environment.
        arm.wrench = -Vector6::new(1.0, 2.0, 3.0, 0.0, 0.0, 0.0);
        let command = host.update(&arm, 0.001);
        let energy = EnergyLedger::default();
        let column = Row::header().iter().position(|name| name == "measured_force_n").unwrap();
        for (axis, force) in [([0.0, 0.0, 1.0], 3.0), ([-1.0, 0.0, 0.0], -1.0), ([0.0, 0.6, 0.8], 3.6)] {
            let row = Row::new(0.0, "hold", &host, &command, [&energy, &energy], &axis.into(), (1, None)).unwrap();
            assert_eq!(row.cells()[column], format!("{force:.6}"));
        }
    }
}
