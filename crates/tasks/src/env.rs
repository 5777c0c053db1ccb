//! The environment: its construction, the start of an episode, and accessors.

use std::collections::HashSet;

use aforce::{ActionEntry, ConfigError, Controller, Measurement, Vector3, stable_on};
use physics::robots::Robot;
use physics::{Deviation, Plant, Simulation};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drawn::Drawn;
use crate::env_config::EnvConfig;
use crate::expert;
use crate::force_sensor::ForceSensor;
use crate::interval::Interval;
use crate::motion::Motion;
use crate::observer::Observer;
use crate::placing::{LARGEST_OVERLAP, draw_start, overlapping, put, start_of};
use crate::reward_terms::RewardTerms;
use crate::sensing::Estimator;
use crate::task::Task;

mod observing;
mod stepping;
mod tuning;

/// A task, an arm and an action space.
///
/// Gymnasium's conventions: call [`Env::reset`], then [`Env::step`] until the episode is
/// terminated or truncated. An episode is a function of its seed and its actions, to the last bit, whatever
/// instructions the processor offers. Two options are exceptions, as they call the platform's mathematics. Jerk-limited
/// set-points come from a library that takes sin, cos, acos, atan2 and cbrt from it. The noise of an estimated wrench
/// takes exp and ln in its tails.
pub struct Env {
    config: EnvConfig,
    task: Box<dyn Task>,
    plant: Plant,
    simulation: Simulation,
    controller: Controller,
    /// What disturbs the running episode.
    drawn: Drawn,
    /// Estimates the external wrench; `None` if the exact wrench is measured.
    estimator: Option<Estimator>,
    /// The last measurement, with noise, bias or estimate. `simulation.measure()` is exact.
    y: Measurement,
    /// The tool's last velocities, from which its jerk is computed.
    motion: Motion,
    /// The tared force-torque sensor that a policy or a critic may observe.
    sensor: ForceSensor,
    /// The last action, each entry with its name; zeros after a reset.
    last_action: Vec<(&'static str, f64)>,
    observer: Observer,
    /// What a critic sees in addition.
    privileged: Observer,
    /// The terms of the task's reward, each 0.
    nothing_earned: RewardTerms,
    /// Seeds the episodes that are not given a seed.
    episodes: ChaCha8Rng,
    elapsed: u32,
    /// The action under way.
    running: Running,
    /// How long the task has stood fulfilled (s).
    held: f64,
}

/// An action under way.
#[derive(Default)]
struct Running {
    /// Gripper command, of which the sign counts: -1 opens, +1 closes.
    grip: f64,
    /// Control samples that are left.
    left: u32,
    interval: Interval,
    diverged: bool,
}

impl Env {
    /// An environment whose unseeded episodes follow from `seed`.
    ///
    /// # Errors
    /// As [`Env::with_task`].
    pub fn new(config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        config.validate()?;
        Env::begin_with(config.create_task()?, config, seed)
    }

    /// As [`Env::new`], with a task that need not be registered. `config.task` says which disturbances and options are allowed.
    ///
    /// # Errors
    /// As [`EnvConfig::validate`], if the arm overlaps the scene or itself at its start, and if two observed numbers or two terms of the
    /// reward have the same name.
    ///
    /// # Panics
    /// If the scene lacks the body or joint of one of the task's own disturbances.
    pub fn with_task(task: Box<dyn Task>, config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        config.validate()?;
        Env::begin_with(task, config, seed)
    }

    /// As [`Env::with_task`], of a configuration that has been checked.
    fn begin_with(mut task: Box<dyn Task>, config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        let robot = config.robot.robot();
        let controller = Controller::new(&config.space, &config.controller, &robot.arm, Vector3::z_axis())?;
        let drawn = config.disturbance.draw(0, config.task.kind().own_disturbances);
        let deviation = config.disturbance.highest_table();
        let table_height = deviation.table_height;
        let plant = Plant { robot, dt: config.controller.dt(), config: config.simulation, deviation };
        let mut simulation = task.reset(&plant, &mut ChaCha8Rng::seed_from_u64(0));
        let start = start_of(task.as_ref(), &plant.robot)?;
        put(&mut simulation, task.as_ref(), &start, &start.q);
        if simulation.overlap() >= LARGEST_OVERLAP {
            let as_modelled = Plant { deviation: Deviation::default(), ..plant.clone() };
            let mut lower = task.reset(&as_modelled, &mut ChaCha8Rng::seed_from_u64(0));
            put(&mut lower, task.as_ref(), &start, &start.q);
            let raised = table_height > 0.0 && lower.overlap() < LARGEST_OVERLAP;
            let field = if raised { "env.disturbance.table_height_m" } else { "env.task" };
            let reason = if raised {
                format!("{table_height} m raise the table into the arm at its start; lower it")
            } else {
                let parts = overlapping(&simulation);
                let (task, robot) = (task.name(), &plant.robot.name);
                format!("{parts} overlap at the start of {task}, with the arm {robot}")
            };
            return Err(ConfigError::Contradiction { field: field.into(), reason });
        }
        let y = simulation.measure();
        stable_on(&config.space, &y).map_err(|error| error.below("env.space"))?;
        let nothing_earned = task.reward(&simulation, &y, None).terms.zeroed();
        let mut env = Env {
            config,
            task,
            plant,
            simulation,
            controller,
            drawn,
            estimator: None,
            motion: Motion::default(),
            y,
            sensor: ForceSensor::default(),
            last_action: vec![],
            observer: Observer::default(),
            privileged: Observer::default(),
            nothing_earned,
            episodes: ChaCha8Rng::seed_from_u64(seed),
            elapsed: 0,
            running: Running::default(),
            held: 0.0,
        };
        env.last_action = env.action_entries().iter().map(|entry| (entry.name, 0.0)).collect();
        env.try_reset(Some(0))?;
        env.has_each_name_once()?;
        env.shows_what_is_asked()?;
        Ok(env)
    }

    /// Starts an episode and returns its first observation. `Some(seed)` fixes this
    /// episode; `None` takes the next seed of the environment's own sequence.
    ///
    /// # Panics
    /// If the task's start is out of a joint's range, or its scene has no room for the arm there. If the scene lacks
    /// the body or joint of one of the task's own disturbances. If the task observes more or fewer numbers than at
    /// first.
    pub fn reset(&mut self, seed: Option<u64>) -> &[f32] {
        self.try_reset(seed).unwrap_or_else(|error| panic!("{error}"));
        self.observation()
    }

    /// As [`Env::reset`], for a task that may draw scenes without room.
    ///
    /// # Errors
    /// If the task's start is out of a joint's range, or its scene has no room for the arm there. No episode has begun
    /// then: reset again.
    ///
    /// # Panics
    /// As [`Env::reset`], in the other cases.
    pub fn try_reset(&mut self, seed: Option<u64>) -> Result<&[f32], ConfigError> {
        let seed = seed.unwrap_or_else(|| self.episodes.next_u64());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.drawn = self.config.disturbance.draw(seed, self.config.task.kind().own_disturbances);
        self.plant.deviation = self.drawn.deviation.clone();
        self.simulation = self.task.reset(&self.plant, &mut rng);
        let noise = self.config.initial_noise;
        draw_start(&mut self.simulation, self.task.as_ref(), &self.plant.robot, noise, &mut rng)?;
        self.y = self.drawn.sense(&self.simulation);
        self.estimator = self.config.sensing.estimator(seed, self.plant.robot.damping(), &self.y);
        self.controller.reset(&self.y);
        self.controller.set_contact_axis(self.task.contact_normal(&self.simulation, &self.y));
        self.drawn.begin(&self.y.bias, self.plant.dt);
        self.motion = Motion::default();
        self.elapsed = 0;
        self.running = Running::default();
        self.held = 0.0;
        self.sensor = ForceSensor::tared(self.task.feel(), &self.y);
        self.last_action.iter_mut().for_each(|(_, entry)| *entry = 0.0);
        self.observe();
        if let Some(estimator) = &self.estimator {
            // The first reading is exact. Every later one has the estimator's bias, which the tare takes off too.
            self.sensor.add_to_tare(&self.y, estimator.bias());
        }
        Ok(self.observation())
    }

    /// Checks that no two numbers of the observation, and no two terms of the reward, have the same name.
    fn has_each_name_once(&self) -> Result<(), ConfigError> {
        let observed = self.observation_components().iter().map(|component| component.name.as_str());
        for (what, names) in [
            ("numbers of its observation", observed.collect::<Vec<_>>()),
            ("terms of its reward", self.reward_terms().collect()),
        ] {
            let mut seen = HashSet::new();
            if let Some(twice) = names.into_iter().find(|name| !seen.insert(*name)) {
                let reason =
                    format!("two {what} are called {twice:?} in {}; each needs a name of its own", self.task.name());
                return Err(ConfigError::Contradiction { field: "env.task".into(), reason });
            }
        }
        Ok(())
    }

    /// Names of the terms of the reward, in the order of [`Step::reward_terms`](crate::Step::reward_terms).
    pub fn reward_terms(&self) -> impl Iterator<Item = &'static str> {
        self.nothing_earned.names()
    }

    /// What each entry of an action means, in order: the controller's, then the gripper's.
    pub fn action_entries(&self) -> Vec<ActionEntry> {
        let mut entries = self.config.space.entries(&self.config.controller);
        if self.task.has_gripper() {
            let (unit, frame) = ("sign", "-1 opens, +1 closes");
            entries.push(ActionEntry { name: "gripper", unit, frame, low: -1.0, high: 1.0 });
        }
        entries
    }

    /// Numbers in an action: the controller's, then the gripper's.
    pub fn action_dim(&self) -> usize {
        self.config.space.dim() + usize::from(self.task.has_gripper())
    }

    /// The configuration.
    pub fn config(&self) -> &EnvConfig {
        &self.config
    }

    /// The task.
    pub fn task(&self) -> &dyn Task {
        self.task.as_ref()
    }

    /// The robot.
    pub fn robot(&self) -> &Robot {
        &self.plant.robot
    }

    /// The simulated plant.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The controller.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The last measurement, as controller, policy and script are given it: with noise, bias or estimate. The exact one
    /// is [`Simulation::measure`] of [`Env::simulation`].
    pub fn measurement(&self) -> &Measurement {
        &self.y
    }

    /// The scripted expert's action in the present state.
    pub fn expert_action(&self) -> Vec<f64> {
        let waypoint = self.task.expert(&self.simulation, &self.y);
        let mut action = expert::action_towards(
            &waypoint,
            &self.controller,
            &self.config.controller,
            &self.y,
            self.task.contact_normal(&self.simulation, &self.y),
        );
        if self.task.has_gripper() {
            action.push(waypoint.grip);
        }
        action
    }

    /// State of the random stream that seeds the unseeded episodes, to be saved.
    pub fn episode_stream(&self) -> ChaCha8Rng {
        self.episodes.clone()
    }

    /// Continues a saved sequence of episode seeds.
    pub fn set_episode_stream(&mut self, stream: ChaCha8Rng) {
        self.episodes = stream;
    }
}

#[cfg(test)]
mod tests;
