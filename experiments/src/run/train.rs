//! The training loop: act, step, store, update; now and then evaluate and save.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Args;
use output::statistics::mean_of;
use output::{file, program};
use sac::{Act, Actor, Checkpoint, Replay, Sac};
use serde::Serialize;
use settings::setup;
use tasks::{Env, Episode, Outcome};

use crate::config::{RunConfig, RunId};
use crate::run::checkpoint_record::CheckpointRecord;
use crate::run::clock::Clock;
use crate::run::experience::{prior_data, step_and_store};
use crate::run::folder::{Lock, RunFolder, State};
use crate::run::learner::{Counters, Learner};
use crate::run::learner_log::LearnerLog;
use crate::run::manifest::Manifest;
use crate::run::progress_bar::RunProgress;
use crate::run::rollout::{Policy, critics_view, evaluate, sizes};
use crate::run::rows::{SCHEMA, TrainingKey};
use crate::run::seeds::{sub_seed, training_evaluation_seed};
use crate::run::stop::Stop;
use crate::run::tables::Tables;
use crate::run::tensorboard::TensorBoard;

/// Actions between rows of `progress.csv`; every evaluation has one too.
const LOG_EVERY: u64 = 2_000;

/// What a run does besides learning.
#[derive(Debug, Clone, Copy, Args)]
pub struct RunOptions {
    /// Continue the run in this folder if there is one
    #[arg(long)]
    pub resume: bool,
    /// Write TensorBoard's event files into the run folder as well
    #[arg(long)]
    pub tensorboard: bool,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// All steps are done.
    Done,
    /// A signal asked to stop; a checkpoint was written, unless the script's episodes were still played.
    Stopped,
}

/// The record in the last checkpoint.
#[derive(Serialize)]
struct LastRecord<'a> {
    #[serde(flatten)]
    run: &'a RunId,
    #[serde(flatten)]
    counters: &'a Counters,
}

/// The record in the checkpoint of the best evaluation.
#[derive(Serialize)]
struct BestRecord {
    #[serde(flatten)]
    record: CheckpointRecord,
    evaluation_return: f64,
}

/// A run in progress.
struct Run<'a> {
    config: &'a RunConfig,
    folder: &'a RunFolder,
    lock: &'a Lock,
    id: RunId,
    env: Env,
    evaluation_env: Env,
    sac: Sac,
    replay: Replay,
    prior: Option<Replay>,
    counters: Counters,
    saved_step: u64,
    /// The action at which the best policy was kept, if that is after the last checkpoint: the run was killed between the
    /// two. The resumed run repeats that evaluation, and its policy replaces the kept one even if it returns less.
    /// Otherwise `eval.csv` would lack the evaluation of the kept policy.
    best_ahead: Option<u64>,
    tables: Tables,
    board: Option<TensorBoard>,
    log: LearnerLog,
    clock: Clock,
    /// When the run began, was resumed or was last saved.
    saved: Instant,
}

/// Trains as `config` says in `folder`, until the end or until a signal asks to stop; `None` if all its steps are done
/// already. `draw` draws its curves after every evaluation.
///
/// # Errors
/// If the folder holds another run or is in use, or as [`train`].
pub fn in_folder(
    config: &RunConfig,
    folder: &RunFolder,
    options: RunOptions,
    stop: &Stop,
    draw: &dyn Fn(),
) -> Result<Option<Ending>> {
    let lock = folder.prepare(config, options.resume)?;
    program::outlive_readers();
    let mut progress = RunProgress::new(config.steps, options.quiet, draw);
    progress.line(&format!("run folder {}", folder.path().display()));
    progress.line(&setup::in_words(&config.env));
    if folder.state(config) == State::Done {
        progress.line("all its steps are done");
        return Ok(None);
    }
    let random = config.learner.random_steps;
    if config.steps <= random {
        progress.line(&format!("nothing will be learned: the first {random} actions of a run are random"));
    }

    let ending = train(config, folder, &lock, options.tensorboard, stop, &mut progress)?;
    if ending == Ending::Stopped {
        progress.line("stopped; continue with the same command and --resume");
    }
    Ok(Some(ending))
}

/// Trains as `config` says, in `folder`, going on from its checkpoint if it has one.
///
/// # Errors
/// If the folder cannot be written or is moved, a checkpoint cannot be read or the learner's numbers cease to be finite.
pub fn train(
    config: &RunConfig,
    folder: &RunFolder,
    lock: &Lock,
    tensorboard: bool,
    stop: &Stop,
    progress: &mut RunProgress,
) -> Result<Ending> {
    let Some((mut run, mut manifest)) = Run::start(config, folder, lock, tensorboard, stop)? else {
        return Ok(Ending::Stopped);
    };

    let ending = run.train(stop, progress);
    manifest.status = match ending {
        Ok(Ending::Done) => "done",
        Ok(Ending::Stopped) => "stopped",
        Err(_) => "failed",
    }
    .into();
    manifest.spent = run.clock.spent();
    let written = lock.holds().and_then(|()| folder.write_manifest(&manifest));
    let ending = ending.with_context(|| format!("{}", folder.path().display()))?;
    written?;
    if matches!(ending, Ending::Done) {
        // Written last: if this file exists, the others are complete.
        file::replace(&folder.done(), b"")?;
    }
    Ok(ending)
}

/// After how many actions the best policy in the folder was kept; `None` if there is none.
///
/// # Errors
/// If it cannot be read.
fn best_step(folder: &RunFolder, env: &Env) -> Result<Option<u64>> {
    if !Checkpoint::exists(&folder.best()) {
        return Ok(None);
    }
    let sizes = sizes(env);
    let (_, record) = Actor::load(&folder.best(), sizes.observation, sizes.action, 0)?;
    let record: CheckpointRecord =
        serde_json::from_value(record).with_context(|| folder.best().display().to_string())?;
    Ok(Some(record.step))
}

impl<'a> Run<'a> {
    /// Begins or resumes a run. Nothing in the folder changes before all that the run needs has been read. `None` if a
    /// stop is requested meanwhile.
    fn start(
        config: &'a RunConfig,
        folder: &'a RunFolder,
        lock: &'a Lock,
        tensorboard: bool,
        stop: &Stop,
    ) -> Result<Option<(Self, Manifest)>> {
        let clock = Clock::start();
        let mut env = Env::new(config.env.clone(), sub_seed(config.seed, "train-env", 0))?;
        let evaluation_env = Env::new(config.env.clone(), 0)?;
        let Learner { sac, replay, mut counters } = if Checkpoint::exists(&folder.checkpoint()) {
            Learner::load(config, folder, &mut env)?
        } else {
            Learner::new(config, &env)?
        };
        let prior = (config.learner.prior_episodes > 0).then(|| prior_data(config, stop)).transpose()?;
        if prior.is_some() && stop.requested() {
            return Ok(None);
        }
        Tables::can_go_on(folder, config, counters.step, counters.episode)?;
        let best = best_step(folder, &env)
            .context("the best policy so far; remove its folder, and the next evaluation keeps its policy")?;
        if best.is_none() {
            counters.best_return = None;
        }
        let best_ahead = best.filter(|&step| step > counters.step);
        let manifest = folder.begin_manifest(config, counters.step)?;
        folder.begin(config)?;
        let run = Run {
            config,
            folder,
            lock,
            id: RunId::of(config),
            prior,
            env,
            evaluation_env,
            sac,
            replay,
            saved_step: counters.step,
            best_ahead,
            log: LearnerLog::new(counters.step),
            board: tensorboard.then(|| TensorBoard::create(folder.path(), counters.step)).transpose()?,
            clock: clock.after(counters.spent),
            tables: Tables::going_on(folder, config, counters.step)?,
            counters,
            saved: Instant::now(),
        };
        Ok(Some((run, manifest)))
    }

    fn train(&mut self, stop: &Stop, progress: &mut RunProgress) -> Result<Ending> {
        while self.counters.step < self.config.steps {
            let began = Instant::now();
            let episode = self.play_episode(stop, progress)?;
            self.finish_episode(&episode, progress)?;
            if stop.requested() && self.counters.step < self.config.steps {
                self.save()?;
                return Ok(Ending::Stopped);
            }
            if self.is_time_to_save(began.elapsed()) {
                self.save()?;
            }
        }
        if self.counters.best_return.is_none() {
            // The run was too short for a regular evaluation.
            self.evaluate(progress)?;
        }
        self.save()?;
        Ok(Ending::Done)
    }

    /// Plays an episode, and learns, logs and evaluates meanwhile.
    fn play_episode(&mut self, stop: &Stop, progress: &mut RunProgress) -> Result<Episode> {
        let scaled = self.config.learner.scaled_observations;
        let mut action = vec![0.0f32; self.env.action_dim()];
        // The policy sees only the first numbers of what the critics see.
        let seen = self.sac.sizes().observation;
        let mut told_to_stop = false;
        let mut episode = Episode::default();
        self.env.reset(None);
        self.sac.begin_episode();
        let mut observation = critics_view(&self.env, scaled);
        loop {
            let act = if self.counters.step < self.config.learner.random_steps { Act::Random } else { Act::Sample };
            self.sac.act(&observation[..seen], &mut action, act);
            let step = step_and_store(&mut self.env, &mut observation, &action, &mut self.replay, scaled)?;
            self.counters.step += 1;
            episode.add(step);
            self.learn()?;
            let evaluates = self.counters.step.is_multiple_of(self.config.evaluate_every);
            // Reports take an evaluation's time from the row for the same action, so the row is written first.
            if evaluates || self.counters.step.is_multiple_of(LOG_EVERY) {
                self.write_progress()?;
            }
            if evaluates {
                self.evaluate(progress)?;
            }
            progress.step(self.counters.step);
            if stop.requested() && !told_to_stop {
                told_to_stop = true;
                progress.line("stopping at the end of this episode; another Ctrl-C stops at once, without saving");
            }
            if step.terminated || step.truncated {
                return Ok(episode);
            }
        }
    }

    /// The updates that follow the last action.
    fn learn(&mut self) -> Result<()> {
        for _ in 0..self.config.learner.updates_after(self.counters.step) {
            let losses = match &self.prior {
                Some(prior) => self.sac.update_with_prior(&self.replay, prior),
                None => self.sac.update(&self.replay),
            };
            ensure!(losses.is_finite(), "the learner diverged at action {}: {losses:?}", self.counters.step);
            self.log.add(&losses);
        }
        Ok(())
    }

    fn finish_episode(&mut self, episode: &Episode, progress: &mut RunProgress) -> Result<()> {
        self.counters.episode += 1;
        let key = TrainingKey {
            schema: SCHEMA,
            task: self.id.task.clone(),
            space: self.id.space.clone(),
            seed: self.id.seed,
            step: self.counters.step,
            episode: self.counters.episode,
        };
        let outcome = episode.outcome();
        if outcome.flag("diverged") {
            progress.line(&format!("episode {}: the simulation diverged; counted, going on", self.counters.episode));
        }
        progress.episode(total(&outcome));
        if let Some(board) = &mut self.board {
            board.episode(self.counters.step, &outcome)?;
        }
        self.tables.episodes.write((key, outcome))
    }

    /// Plays the same starts with mean and with sampled actions of the averaged policy, so that the two can be compared.
    fn evaluate(&mut self, progress: &mut RunProgress) -> Result<()> {
        let step = self.counters.step;
        let evaluation = step / self.config.evaluate_every;
        let mut play = |act| {
            let noise = sub_seed(self.config.seed, "evaluation-noise", evaluation);
            let mut policy = Policy::Actor {
                actor: Box::new(self.sac.policy(noise)),
                act,
                scaled: self.config.learner.scaled_observations,
            };
            let starts = (0..self.config.evaluation_episodes).map(|index| training_evaluation_seed(evaluation, index));
            let table = &mut self.tables.eval;
            let write = |key, outcome: &Outcome| table.write((key, outcome));
            evaluate(&mut self.evaluation_env, &mut policy, starts, step, &self.id, write)
        };
        let outcomes = play(Act::Mean)?;
        play(Act::Sample)?;
        let score = mean_of(&outcomes, total);
        progress.evaluation(step, &outcomes);
        if let Some(board) = &mut self.board {
            board.evaluation(step, &outcomes)?;
        }
        if self.best_ahead == Some(step) || self.counters.best_return.is_none_or(|best| score > best) {
            self.best_ahead = None;
            self.counters.best_return = Some(score);
            let record =
                BestRecord { record: CheckpointRecord { run: self.id.clone(), step }, evaluation_return: score };
            let record = serde_json::to_value(record).context("record of the best checkpoint")?;
            self.lock.holds()?;
            Checkpoint::save(&self.folder.best(), &self.sac, None, record)?;
        }
        Ok(())
    }

    /// Whether to save now, at the end of an episode that took the time `episode`: the end of the next one may be too late.
    fn is_time_to_save(&self, episode: Duration) -> bool {
        self.counters.step - self.saved_step >= self.config.checkpoint_every
            || (self.saved.elapsed() + episode).as_secs_f64() > 60.0 * self.config.checkpoint_minutes
    }

    fn save(&mut self) -> Result<()> {
        self.lock.holds()?;
        // Rows reach the disk before the checkpoint: a checkpoint whose rows were lost in a power cut could not be resumed.
        self.tables.sync()?;
        self.counters.episode_stream = self.env.episode_stream();
        self.counters.spent = self.clock.spent();
        self.saved = Instant::now();
        let record = LastRecord { run: &self.id, counters: &self.counters };
        let record = serde_json::to_value(record).context("record of the last checkpoint")?;
        Checkpoint::save(&self.folder.checkpoint(), &self.sac, Some(&self.replay), record)?;
        self.saved_step = self.counters.step;
        Ok(())
    }

    fn write_progress(&mut self) -> Result<()> {
        let row = self.log.row(self.counters.step, self.sac.updates(), self.replay.len(), self.clock.spent());
        if let Some(board) = &mut self.board {
            board.progress(&row)?;
        }
        self.tables.progress.write(row)
    }
}

/// The sum of an episode's rewards.
fn total(outcome: &Outcome) -> f64 {
    outcome.number("return").unwrap_or(f64::NAN)
}
