//! One environment and the episodes that are played in it.

use std::path::PathBuf;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rand::rngs::SysRng;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use show::Playback;
use tasks::{Component, Description, Env, Step};

use crate::keywords::env_config;
use crate::own::{self, Trouble};
use crate::value_error;

/// A number of info: its name, and how it is read from a step.
type Number = (&'static str, fn(&Step) -> f64);

/// The numbers that info holds of an action.
pub const NUMBERS: [Number; 7] = [
    // Sum over joints of |tau qd| dt (J).
    ("energy", |step| step.interval.energy.absolute),
    // Largest sustained contact force of the whole arm, and beyond the wrist (N).
    ("force", |step| step.interval.arm.max),
    ("hand_force", |step| step.interval.hand.max),
    // Largest speed of a joint, as a share of its limit.
    ("joint_speed", |step| step.interval.max_speed_share),
    // Force penalty, unscaled, whether or not the task takes it off its reward.
    ("penalty", |step| step.penalty),
    // Reward lost to the price of motion.
    ("motion_cost", |step| step.motion_cost),
    // Reward lost to the price of a stop.
    ("stop_cost", |step| step.stop_cost),
];

/// An environment with Gymnasium's seeding, and what is recorded of the present episode.
pub struct Episodes {
    /// The environment.
    pub env: Env,
    /// Exception that a method of a Python task raised.
    trouble: Trouble,
    /// Whether observations are scaled.
    scaled: bool,
    /// Source of the seeds of episodes that are reset without one.
    stream: ChaCha8Rng,
    /// Seed of the present episode; `None` while there is none.
    seed: Option<u64>,
    /// Whether episodes are recorded.
    pub records: bool,
    /// What is recorded of the present episode; `None` if nothing is.
    pub playback: Option<Playback>,
}

impl Episodes {
    /// `task` is the name of a built-in task, or a callable that makes a Python task. Until a seed is given, every new object has other
    /// episodes, also in a forked process: the operating system seeds its generator, as a forked process has a copy of any other one.
    ///
    /// # Errors
    /// `ValueError`, as [`Env::new`]; `TypeError` for an unknown keyword; what a Python task raises.
    pub fn new(
        task: &Bound<'_, PyAny>,
        config: Option<PathBuf>,
        keywords: &Bound<'_, PyDict>,
        scaled: bool,
    ) -> PyResult<Self> {
        let (env, trouble) = match task.extract::<String>() {
            Ok(name) => (Env::new(env_config(&name, config, keywords)?, 0).map_err(value_error)?, Trouble::default()),
            Err(_) => own::env(task, config, keywords)?,
        };
        let stream = ChaCha8Rng::try_from_rng(&mut SysRng).map_err(value_error)?;
        Ok(Self { env, trouble, scaled, stream, seed: None, records: false, playback: None })
    }

    /// Starts the episode of `seed`, which also fixes the later episodes that are reset without a seed.
    pub fn reset(&mut self, seed: Option<u64>) {
        if let Some(seed) = seed {
            self.stream = ChaCha8Rng::seed_from_u64(seed);
        }
        let seed = seed.unwrap_or_else(|| self.stream.next_u64());
        match self.env.try_reset(Some(seed)) {
            Ok(_) => self.seed = Some(seed),
            Err(no_room) => self.trouble.keep(value_error(no_room)),
        }
        self.playback = self.records.then(|| Playback::begin(&self.env));
    }

    /// Raises what a task's method raised, or that there was no room for a start. The episode is over then.
    ///
    /// # Errors
    /// `ValueError` if there was no room for a start; else what the method raised.
    pub fn check(&mut self) -> PyResult<()> {
        self.trouble.check().inspect_err(|_| self.seed = None)
    }

    /// As [`check`](Self::check), after a query that leaves the episode as it is: the episode goes on.
    ///
    /// # Errors
    /// What a task's method raised.
    pub fn check_query(&self) -> PyResult<()> {
        self.trouble.check()
    }

    /// Takes one action.
    ///
    /// # Panics
    /// If the action has not the environment's length.
    pub fn step(&mut self, action: &[f64]) -> Step {
        let Some(playback) = &mut self.playback else { return self.env.step(action) };
        let observation = self.env.observation().to_vec();
        let step = self.env.step(action);
        playback.add(&self.env, &observation, action, &step);
        step
    }

    /// Seed of the present episode.
    ///
    /// # Errors
    /// `RuntimeError` before the first reset.
    pub fn seed(&self) -> PyResult<u64> {
        self.seed.ok_or_else(|| PyRuntimeError::new_err("call reset first: no episode has begun"))
    }

    /// The environment's description, as JSON.
    ///
    /// # Errors
    /// `ValueError` if it cannot be written.
    pub fn describe(&self) -> PyResult<String> {
        serde_json::to_string(&Description::of(&self.env)).map_err(value_error)
    }

    /// What a policy sees now.
    pub fn observation(&self) -> Vec<f32> {
        self.scaled(self.env.observation(), self.env.observation_components())
    }

    /// What a critic sees besides the observation; empty unless `observation.critic` is set.
    pub fn privileged(&self) -> Vec<f32> {
        self.scaled(self.env.privileged(), self.env.privileged_components())
    }

    fn scaled(&self, values: &[f32], components: &[Component]) -> Vec<f32> {
        let mut values = values.to_vec();
        if self.scaled {
            tasks::scale(components, &mut values);
        }
        values
    }
}
