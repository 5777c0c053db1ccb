//! One wipe: the script at 20 Hz, in an environment at 1 kHz.

use aforce::wiper::Wiper;
use aforce::{ActionSpace, ConfigError, Pose};
use anyhow::Result;
use physics::robots::RobotChoice;
use physics::wiping_tool::facing_down;
use tasks::{Disturbance, Env, EnvConfig, MarkerView, Spot, TaskName, Wipe};

use crate::record::Record;
use crate::setup::Setup;
use crate::trial::Trial;

/// Time (s) that a script may take beyond its pressing and circling before it is given up.
const PATIENCE: f64 = 12.0;

/// One wipe to be done.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    /// What is fixed.
    pub setup: &'a Setup,
    /// Where the stiffness comes from.
    pub space: &'a ActionSpace,
    /// What varies.
    pub trial: Trial,
    /// What neither the script nor the controller's model knows.
    pub disturbance: Disturbance,
}

/// Simulates one wipe.
///
/// # Errors
/// If the controller's configuration or the disturbance is not allowed.
pub fn simulate(run: &Run) -> Result<Record> {
    let mut env = run.env()?;
    let Trial { spot: [x, y], height, .. } = run.trial;
    let mut script = Wiper::new(run.setup.path(), Pose::from_parts([x, y, height].into(), facing_down()));
    let robot = env.robot().clone();
    let start_energy = env.simulation().energy();
    let mut record = Record::default();
    record.completed = loop {
        let Some(action) = script.action(env.controller(), &run.setup.controller, env.measurement()) else {
            break true;
        };
        let step = env.step_watched(&action, |sample| record.take(script.phase(), sample, &robot));
        if step.terminated || step.truncated {
            break false; // The simulation diverged or the time is over: the record keeps the samples until here.
        }
    };
    record.stored = env.simulation().energy() - start_energy;
    record.paint_left = 1.0 - env.task().progress().expect("Wipe tells its progress");
    Ok(record)
}

impl Run<'_> {
    /// The environment at the start of the wipe.
    fn env(&self) -> Result<Env, ConfigError> {
        let Run { setup, space, trial, disturbance } = self;
        let patience = PATIENCE + setup.press_time + f64::from(setup.rotations) * setup.period;
        let config = EnvConfig {
            task: TaskName::WIPE,
            space: (*space).clone(),
            robot: RobotChoice::Own(Box::new(setup.arm())),
            horizon: (patience * f64::from(setup.controller.policy_hz)) as u32,
            initial_noise: 0.0,
            disturbance: disturbance.clone(),
            sensing: setup.sensing,
            simulation: setup.simulation,
            controller: setup.controller,
            ..EnvConfig::default()
        };
        let spot = Spot {
            centre: trial.spot,
            radius: setup.spot_radius,
            height: trial.height,
            friction: if setup.lossless { 0.0 } else { trial.friction },
            wiping_force: setup.wiping_force,
            start: trial.start,
        };
        let task = Box::new(Wipe::spot(config.horizon, MarkerView::default(), spot));
        let mut env = Env::with_task(task, config, 0)?;
        env.reset(Some(trial.seed));
        Ok(env)
    }
}
