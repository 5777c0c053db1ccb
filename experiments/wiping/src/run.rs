//! The loop: the script at 20 Hz, the controller and the arm at 1 kHz.

use std::collections::VecDeque;

use aforce::{ActionSpace, Controller, JointVector, Measurement, Pose, Vector3, Wrench};
use anyhow::Result;
use physics::robots::Robot;
use physics::scenes::wipe::Wipe;
use physics::{Plant, Simulation};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tasks::Markers;

use crate::expert::Expert;
use crate::record::{Phase, Record, Sample};
use crate::sensing::{Estimator, WrenchSource};
use crate::setup::Setup;
use crate::trial::{Disturbance, Trial};

/// Time after which a script that has not come to its end is given up (s), beside its own.
const PATIENCE: f64 = 12.0;

/// One wipe to be done.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// What is fixed.
    pub setup: &'a Setup,
    /// Where the stiffness comes from.
    pub space: &'a ActionSpace,
    /// What varies.
    pub trial: Trial,
    /// What nobody knows.
    pub disturbance: Disturbance,
}

/// Simulates one wipe.
///
/// # Errors
/// If the controller's configuration is not allowed.
pub fn simulate(run: &Run) -> Result<Record> {
    let mut wiping = Wiping::new(run)?;
    let config = &run.setup.controller;
    let patience = PATIENCE + run.setup.press_time + f64::from(run.setup.rotations) * run.setup.period;
    for _ in 0..(patience * f64::from(config.policy_hz)) as u32 {
        let Some(action) = wiping.expert.action(&wiping.controller, &wiping.y) else {
            wiping.record.completed = true;
            break;
        };
        wiping.controller.set_goal(&action, &wiping.y);
        for _ in 0..config.samples_per_action() {
            if wiping.step().is_err() {
                return Ok(wiping.finish()); // Diverged: what there is, not completed.
            }
        }
        wiping.wipe();
    }
    Ok(wiping.finish())
}

/// A wipe under way.
struct Wiping<'a> {
    run: &'a Run<'a>,
    robot: Robot,
    simulation: Simulation,
    controller: Controller,
    estimator: Estimator,
    expert: Expert,
    paint: Markers,
    y: Measurement,
    /// Torques on their way to the arm.
    late: VecDeque<JointVector>,
    /// The arm's energy at the start (J).
    start_energy: f64,
    record: Record,
}

impl<'a> Wiping<'a> {
    fn new(run: &'a Run<'a>) -> Result<Self> {
        let Run { setup, space, trial, disturbance } = run;
        let robot = setup.arm();
        let plant = Plant {
            robot: robot.clone(),
            dt: setup.controller.dt(),
            config: setup.simulation,
            deviation: disturbance.deviation(),
        };
        let friction = if setup.lossless { 0.0 } else { trial.friction };
        let (mut simulation, _) = Wipe::simulate(&plant, trial.height, friction);
        simulation.reset(&trial.start);
        let y = simulation.measure();
        let mut controller = Controller::new(space, &setup.controller, &robot.arm, Vector3::z_axis())?;
        controller.reset(&y);

        let sensing = setup.sensing.worsened(disturbance.wrench_error);
        let rng = ChaCha8Rng::seed_from_u64(trial.noise_seed);
        let spot = |height| Vector3::new(trial.spot[0], trial.spot[1], height);
        Ok(Wiping {
            run,
            start_energy: simulation.energy(),
            estimator: Estimator::new(&sensing, robot.damping(), &y, rng),
            expert: Expert::new(setup, spot(trial.height)),
            paint: Markers::spot(spot(trial.height + disturbance.table_offset), setup.spot_radius),
            late: VecDeque::from(vec![y.bias; (disturbance.delay / plant.dt).round() as usize]),
            record: Record::default(),
            robot,
            simulation,
            controller,
            y,
        })
    }

    /// One control sample.
    fn step(&mut self) -> Result<(), physics::Diverged> {
        let dt = self.simulation.dt();
        let commanded = self.controller.update(&self.y);
        self.sample(dt);
        self.late.push_back(commanded);
        let tau = self.late.pop_front().expect("one was pushed");
        let before = self.y.clone();
        self.simulation.step(&tau, 0.0)?;

        self.y = self.simulation.measure();
        let estimated = self.estimator.update(&commanded, &self.y, dt);
        let contact = *self.simulation.contact();
        if self.run.setup.sensing.source == WrenchSource::Estimated {
            self.y.wrench = estimated;
        }
        self.account(&tau, &before, &contact.raw, dt);
        self.record.force_max = self.record.force_max.max(contact.hand_force());
        Ok(())
    }

    /// The energy of one sample. A torque acts over the whole of it: its work goes with the mean velocity.
    fn account(&mut self, tau: &JointVector, before: &Measurement, contact: &Wrench, dt: f64) {
        let qd = (before.qd + self.y.qd) / 2.0;
        let joints = self.robot.damping().component_mul(&qd).dot(&qd) * dt;
        let table = -contact.dot(&(before.twist + self.y.twist)) / 2.0 * dt;
        let (record, drives) = (&mut self.record, &self.robot.drives);
        record.total.add(tau, &qd, drives, dt);
        record.total_losses.add(joints, table);
        if self.expert.phase() == Phase::Wipe {
            record.energy.add(tau, &qd, drives, dt);
            record.control_energy.add(&(tau - before.bias), &qd, drives, dt);
            record.losses.add(joints, table);
        }
    }

    /// Records what the controller was given and what it made of it: before the arm moves on.
    fn sample(&mut self, dt: f64) {
        let controller = &self.controller;
        let (tool, set_point) = (self.y.pose, controller.set_point());
        let sample = Sample {
            time: self.record.samples.len() as f64 * dt,
            phase: self.expert.phase(),
            force: self.simulation.contact().filtered[2],
            measured_force: self.y.wrench[2],
            force_command: controller.force_command(),
            engagement: controller.engagement(),
            position: tool.translation.vector,
            set_point: set_point.translation.vector,
            error: aforce::pose_error(&tool, set_point),
            quaternion_error: quaternion_distance(&tool, set_point),
            stiffness: controller.stiffness(),
            feedforward: *controller.feedforward(),
            energy: self.record.energy.absolute,
            control_energy: self.record.control_energy.absolute,
        };
        self.record.samples.push(sample);
    }

    /// Takes off the paint under the tool if it presses right.
    fn wipe(&mut self) {
        let force = self.simulation.contact().sustained[2];
        let [low, high] = self.run.setup.wiping_force;
        if (low..=high).contains(&force) {
            self.paint.wipe(&self.y.pose);
        }
    }

    fn finish(mut self) -> Record {
        self.record.stored = self.simulation.energy() - self.start_energy;
        self.record.paint_left = self.paint.remaining_share();
        self.record
    }
}

/// Norm of the difference of two quaternions of the same half-sphere: 2 sin(angle/4).
fn quaternion_distance(a: &Pose, b: &Pose) -> f64 {
    2.0 * (a.rotation.angle_to(&b.rotation) / 4.0).sin()
}
