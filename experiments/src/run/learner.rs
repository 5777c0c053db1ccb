//! The learner of a run at the run's beginning, or where its last checkpoint left it.

use anyhow::{Context, Result};
use rand_chacha::ChaCha8Rng;
use sac::{Checkpoint, Replay, Sac};
use serde::{Deserialize, Serialize};
use tasks::Env;

use crate::config::{RunConfig, RunId};
use crate::run::checkpoint_record::CheckpointRecord;
use crate::run::clock::Spent;
use crate::run::folder::RunFolder;
use crate::run::rollout::sizes;
use crate::run::seeds::sub_seed;

/// What a checkpoint holds besides the learner. Checkpoints are taken between episodes, so that no simulation state has to be saved.
#[derive(Serialize, Deserialize)]
pub(super) struct Counters {
    pub step: u64,
    pub episode: u64,
    pub best_return: Option<f64>,
    pub episode_stream: ChaCha8Rng,
    #[serde(flatten)]
    pub spent: Spent,
}

/// The learner, its replay buffer and its counters.
pub(super) struct Learner {
    pub sac: Sac,
    pub replay: Replay,
    pub counters: Counters,
}

impl Learner {
    /// A new learner for `env`.
    pub fn new(config: &RunConfig, env: &Env) -> Result<Self> {
        let counters = Counters {
            step: 0,
            episode: 0,
            best_return: None,
            episode_stream: env.episode_stream(),
            spent: Spent::default(),
        };
        let sac = Sac::new(&config.learner, sizes(env), sub_seed(config.seed, "learner", 0))?;
        Ok(Self { sac, replay: Replay::new(&config.learner, sizes(env)), counters })
    }

    /// The learner of the folder's last checkpoint. The episodes of `env` continue from there.
    pub fn load(config: &RunConfig, folder: &RunFolder, env: &mut Env) -> Result<Self> {
        let saved = Checkpoint::load(&folder.checkpoint(), &config.learner, sizes(env))?;
        let at = || folder.checkpoint().display().to_string();
        let replay = saved.replay.with_context(|| format!("{}: no replay memory to go on with", at()))?;
        let record: CheckpointRecord = serde_json::from_value(saved.caller.clone()).with_context(at)?;
        record.belongs_to(&RunId::of(config)).with_context(at)?;
        let mut counters: Counters = serde_json::from_value(saved.caller).with_context(at)?;
        if counters.step < config.evaluate_every {
            // A run too short for a regular evaluation makes one at its end. A longer run does not make it, so its return does not count.
            counters.best_return = None;
        }
        env.set_episode_stream(counters.episode_stream.clone());
        Ok(Self { sac: saved.sac, replay, counters })
    }
}
