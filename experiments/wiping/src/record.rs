//! The samples of a wipe, and the numbers that are computed from them.

use std::path::Path;

use aforce::wiper::Phase;
use aforce::{EnergyLedger, Pose, Vector3, Vector6};
use anyhow::Result;
use output::file;
use physics::robots::Robot;

/// One of so many samples is shown, in the table and in the figure of a single wipe.
pub const SAMPLES_PER_ROW: usize = 20;

/// One control sample (1 ms): what the controller was given, and what it made of it. World axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Since the start (s).
    pub time: f64,
    /// Phase of the script.
    pub phase: Phase,
    /// Force with which the table pushes the tool up (N): the simulated one, low-passed, and the one that the
    /// controller was given.
    pub force: f64,
    /// See `force`.
    pub measured_force: f64,
    /// Output of the force controller (N).
    pub force_command: f64,
    /// Share of the contact axis that force control holds.
    pub engagement: f64,
    /// Position of the tool (m).
    pub position: Vector3,
    /// Its set-point x_d (m).
    pub set_point: Vector3,
    /// Error x - x_d (m, rad).
    pub error: Vector6,
    /// Distance of the quaternions of tool and set-point.
    pub quaternion_error: f64,
    /// Stiffness (N/m, Nm/rad).
    pub stiffness: Vector6,
    /// Feed-forward wrench F_ff (N, Nm).
    pub feedforward: Vector6,
    /// Energy so far, sum of abs(tau qd) dt (J): of all of the torque, and without the compensation of gravity and
    /// Coriolis forces.
    pub energy: f64,
    /// See `energy`.
    pub control_energy: f64,
}

/// Work that the arm does not get back (J).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Losses {
    /// Heat in the joints' viscous damping.
    pub joints: f64,
    /// Work done on the table: friction, and the pad.
    pub table: f64,
}

impl Losses {
    fn add(&mut self, joints: f64, table: f64) {
        self.joints += joints;
        self.table += table;
    }
}

/// A whole wipe.
#[derive(Debug, Clone, Default)]
pub struct Record {
    /// Every control sample.
    pub samples: Vec<Sample>,
    /// Energy of the whole run, of all of the torque.
    pub total: EnergyLedger,
    /// Energy while circling, of all of the torque.
    pub energy: EnergyLedger,
    /// Energy while circling, without the compensation of gravity and Coriolis forces.
    pub control_energy: EnergyLedger,
    /// Losses of the whole run.
    pub total_losses: Losses,
    /// Losses while circling.
    pub losses: Losses,
    /// Kinetic and potential energy that the arm gained in the whole run (J).
    pub stored: f64,
    /// Largest sustained contact force (N).
    pub force_max: f64,
    /// Share of the paint that is left.
    pub paint_left: f64,
    /// Whether the script came to its end.
    pub completed: bool,
}

/// A wipe in a few numbers; errors are means over the circles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Distance of tool and set-point (m).
    pub position_error: f64,
    /// Distance of their quaternions.
    pub quaternion_error: f64,
    /// Deviation of the contact force from the desired one (N).
    pub force_error: f64,
    /// The same of the force that the controller was given (N).
    pub measured_force_error: f64,
    /// Share of the time in which the contact force is within 10 % of the desired one.
    pub force_held: f64,
    /// Share of the time in which force control is not fully engaged.
    pub contact_lost: f64,
    /// Time from contact until the force stays within 10 % for 0.1 s (s).
    pub force_reached: Option<f64>,
    /// Mean translational stiffness across the contact axis (N/m).
    pub stiffness: f64,
    /// Length of the tool's way while circling (m).
    pub path: f64,
}

/// The force counts as reached once it stays within 10 % for so long (s).
const HELD: f64 = 0.1;

impl Record {
    /// Takes in a control sample of `robot` in `phase`.
    pub(crate) fn take(&mut self, phase: Phase, sample: &tasks::Sample, robot: &Robot) {
        let dt = sample.simulation.dt();
        self.look(phase, sample, dt);
        self.account(phase, sample, robot, dt);
        self.force_max = self.force_max.max(sample.simulation.contact().hand_force());
    }

    /// Stores what the controller was given and what it computed.
    fn look(&mut self, phase: Phase, sample: &tasks::Sample, dt: f64) {
        let controller = sample.controller;
        let (tool, set_point) = (sample.given.pose, controller.set_point());
        self.samples.push(Sample {
            time: self.samples.len() as f64 * dt,
            phase,
            force: sample.contact.filtered[2],
            measured_force: sample.given.wrench[2],
            force_command: controller.force_command(),
            engagement: controller.engagement(),
            position: tool.translation.vector,
            set_point: set_point.translation.vector,
            error: aforce::pose_error(&tool, set_point),
            quaternion_error: quaternion_distance(&tool, set_point),
            stiffness: controller.stiffness(),
            feedforward: *controller.feedforward(),
            energy: self.energy.absolute,
            control_energy: self.control_energy.absolute,
        });
    }

    /// Adds the energy of one sample. The torque is constant over the sample, so its work is that with the mean velocity.
    fn account(&mut self, phase: Phase, sample: &tasks::Sample, robot: &Robot, dt: f64) {
        let (before, after, tau) = (sample.given, sample.simulation.measure(), sample.tau);
        let qd = (before.qd + after.qd) / 2.0;
        let joints = robot.damping().component_mul(&qd).dot(&qd) * dt;
        let contact = &sample.simulation.contact().raw;
        let table = -contact.dot(&(before.twist + after.twist)) / 2.0 * dt;
        self.total.add(tau, &qd, &robot.drives, dt);
        self.total_losses.add(joints, table);
        if phase == Phase::Wipe {
            self.energy.add(tau, &qd, &robot.drives, dt);
            self.control_energy.add(&(tau - before.bias), &qd, &robot.drives, dt);
            self.losses.add(joints, table);
        }
    }

    /// Samples of one part of the script.
    pub fn during(&self, phase: Phase) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(move |sample| sample.phase == phase)
    }

    /// Time of the first contact (s).
    pub fn contact(&self) -> Option<f64> {
        self.samples.iter().find(|sample| sample.engagement > 0.0).map(|sample| sample.time)
    }

    /// Time at which `force` (N) is reached (s).
    pub fn force_reached(&self, force: f64) -> Option<f64> {
        let mut since = None;
        for sample in &self.samples {
            let within = (sample.force - force).abs() < 0.1 * force;
            since = if within { since.or(Some(sample.time)) } else { None };
            if since.is_some_and(|since| sample.time - since >= HELD) {
                return since;
            }
        }
        None
    }

    /// The wipe in numbers; `force` is the desired one (N). Without circles errors are NaN.
    pub fn outcome(&self, force: f64) -> Outcome {
        let wiping: Vec<&Sample> = self.during(Phase::Wipe).collect();
        let mean = |of: &dyn Fn(&Sample) -> f64| wiping.iter().map(|s| of(s)).sum::<f64>() / wiping.len() as f64;
        Outcome {
            position_error: mean(&|s| s.error.fixed_rows::<3>(0).norm()),
            quaternion_error: mean(&|s| s.quaternion_error),
            force_error: mean(&|s| (s.force - force).abs()),
            measured_force_error: mean(&|s| (s.measured_force - force).abs()),
            contact_lost: mean(&|s| f64::from(u8::from(s.engagement < 1.0))),
            force_held: mean(&|s| f64::from(u8::from((s.force - force).abs() < 0.1 * force))),
            force_reached: self.force_reached(force).zip(self.contact()).map(|(reached, contact)| reached - contact),
            stiffness: mean(&|s| (s.stiffness[0] + s.stiffness[1]) / 2.0),
            path: wiping.windows(2).map(|pair| (pair[1].position - pair[0].position).norm()).sum(),
        }
    }

    /// Work that is not accounted for, as a share of all work done.
    pub fn ledger_gap(&self) -> f64 {
        (self.total.net - self.stored - self.total_losses.joints - self.total_losses.table).abs() / self.total.absolute
    }

    /// Writes every twentieth sample to a CSV file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
        let mut header: Vec<String> =
            ["time_s", "phase", "force_n", "measured_force_n", "force_command_n", "engagement"]
                .map(String::from)
                .into();
        for (name, axes, unit) in [
            ("position", 3, "_m"),
            ("set_point", 3, "_m"),
            ("error", 6, ""),
            ("stiffness", 6, ""),
            ("feedforward", 6, ""),
        ] {
            header.extend(AXES[..axes].iter().map(|axis| format!("{name}_{axis}{unit}")));
        }
        header.extend(["quaternion_error", "energy_j", "control_energy_j"].map(String::from));

        let mut table = csv::Writer::from_writer(vec![]);
        table.write_record(header)?;
        for s in self.samples.iter().step_by(SAMPLES_PER_ROW) {
            let mut row = vec![format!("{:.3}", s.time), s.phase.name().into()];
            let numbers = [s.force, s.measured_force, s.force_command, s.engagement];
            let vectors = [&s.position, &s.set_point].map(|v| v.as_slice());
            let six = [&s.error, &s.stiffness, &s.feedforward].map(|v| v.as_slice());
            let rest = [s.quaternion_error, s.energy, s.control_energy];
            let all = numbers.iter().chain(vectors.into_iter().flatten()).chain(six.into_iter().flatten()).chain(&rest);
            row.extend(all.map(|value| format!("{value:.6}")));
            table.write_record(row)?;
        }
        file::replace(path, &table.into_inner()?)
    }
}

/// Norm of the difference of two quaternions of the same half-sphere: 2 sin(angle/4).
fn quaternion_distance(a: &Pose, b: &Pose) -> f64 {
    2.0 * (a.rotation.angle_to(&b.rotation) / 4.0).sin()
}
