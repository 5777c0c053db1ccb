//! The training loop: act, step, store, update; now and then evaluate and save.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use rand_chacha::ChaCha8Rng;
use sac::{Act, Checkpoint, Replay, Sac, Transition};
use serde::{Deserialize, Serialize};
use tasks::Env;

use crate::cli;
use crate::config::RunConfig;
use crate::curves;
use crate::display::Display;
use crate::folder::{RunFolder, State};
use crate::learner_log::LearnerLog;
use crate::rollout::{Policy, evaluate, learner_view, mean};
use crate::rows::{Episode, RunId, SCHEMA, TrainingKey};
use crate::seeds::{sub_seed, training_evaluation_seed};
use crate::source::Purpose;
use crate::stop::Stop;
use crate::table::{Table, cut_after, last_step};
use crate::tensorboard::TensorBoard;

/// Actions between rows of `progress.csv`.
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
    /// A signal asked to stop; a checkpoint was written.
    Stopped,
}

/// What a checkpoint holds beside the learner. Checkpoints are taken between episodes, so
/// that no simulation state has to be saved.
#[derive(Serialize, Deserialize)]
struct Counters {
    #[serde(flatten)]
    purpose: Purpose,
    step: u64,
    episode: u64,
    best_return: Option<f64>,
    episode_stream: ChaCha8Rng,
    wall_s: f64,
}

/// What the checkpoint of the best evaluation says of itself.
#[derive(Serialize)]
struct Best {
    #[serde(flatten)]
    purpose: Purpose,
    step: u64,
    evaluation_return: f64,
}

/// A run in progress.
struct Run<'a> {
    config: &'a RunConfig,
    folder: &'a RunFolder,
    id: RunId,
    env: Env,
    evaluation_env: Env,
    sac: Sac,
    replay: Replay,
    counters: Counters,
    saved_step: u64,
    tables: Tables,
    board: Option<TensorBoard>,
    log: LearnerLog,
    started: Instant,
}

struct Tables {
    episodes: Table,
    eval: Table,
    progress: Table,
}

/// Trains as `config` says in its folder below `out`, until the end or until a signal asks to stop, and draws the
/// learning curves.
///
/// # Errors
/// If the folder holds another run or is in use, or as [`train`].
pub fn in_folder(config: &RunConfig, out: &Path, options: RunOptions) -> Result<ExitCode> {
    let folder = RunFolder::below(out, config);
    let _lock = folder.prepare(config, options.resume)?;
    let mut display = Display::new(config.steps, options.quiet);
    display.line(&format!("run folder {}", folder.path().display()));
    if folder.state(config) == State::Done {
        display.line("all its steps are done");
        if !folder.curves().with_extension("svg").exists() {
            curves::draw(&folder)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let random = config.learner.random_steps;
    if config.steps <= random {
        display.line(&format!("nothing will be learned: the first {random} actions of a run are random"));
    }

    let ending = train(config, &folder, options.tensorboard, &Stop::on_signals()?, &mut display)?;
    if let Err(error) = curves::draw(&folder) {
        // The run is saved all the same: its exit code says how it ended.
        display.line(&format!("learning curves could not be drawn: {error:#}"));
    }
    if ending == Ending::Stopped {
        display.line("stopped; continue with the same command and --resume");
        return Ok(ExitCode::from(cli::STOPPED));
    }
    Ok(ExitCode::SUCCESS)
}

/// Trains as `config` says, in `folder`, going on from its checkpoint if it has one.
///
/// # Errors
/// If the folder cannot be written, a checkpoint cannot be read or the learner's numbers cease to be finite.
pub fn train(
    config: &RunConfig,
    folder: &RunFolder,
    tensorboard: bool,
    stop: &Stop,
    display: &mut Display,
) -> Result<Ending> {
    let mut run = Run::start(config, folder, tensorboard)?;
    let mut manifest = folder.begin_manifest(config, run.counters.step)?;
    folder.begin(config)?;

    let ending = run.train(stop, display);
    manifest.status = match ending {
        Ok(Ending::Done) => "done",
        Ok(Ending::Stopped) => "stopped",
        Err(_) => "failed",
    }
    .into();
    manifest.wall_s = run.wall_s();
    let written = folder.write_manifest(&manifest);
    let ending = ending.with_context(|| format!("{}", folder.path().display()))?;
    written.map(|()| ending)
}

impl<'a> Run<'a> {
    fn start(config: &'a RunConfig, folder: &'a RunFolder, tensorboard: bool) -> Result<Self> {
        let seed = |stream| sub_seed(config.seed, stream, 0);
        let mut env = Env::new(config.env.clone(), seed("train-env"))?;
        let evaluation_env = Env::new(config.env.clone(), 0)?;
        let (observations, actions) = (env.observation_components().len(), env.action_dim());
        let (sac, replay, counters) = if Checkpoint::exists(&folder.checkpoint()) {
            let saved = Checkpoint::load(&folder.checkpoint(), observations, actions)?;
            let at = || folder.checkpoint().display().to_string();
            let replay = saved.replay.with_context(|| format!("{}: no replay memory to go on with", at()))?;
            let mut counters: Counters = serde_json::from_value(saved.caller).with_context(at)?;
            if counters.step < config.evaluate_every {
                // Of the evaluation at the end of a run too short for any other, which a longer run does not have.
                counters.best_return = None;
            }
            env.set_episode_stream(counters.episode_stream.clone());
            (saved.sac, replay, counters)
        } else {
            let counters = Counters {
                purpose: Purpose::of(config),
                step: 0,
                episode: 0,
                best_return: None,
                episode_stream: env.episode_stream(),
                wall_s: 0.0,
            };
            let sac = Sac::new(&config.learner, observations, actions, seed("learner"))?;
            (sac, Replay::new(&config.learner, observations, actions), counters)
        };
        let evaluated = counters.step / config.evaluate_every * config.evaluate_every;
        for (path, step) in [(folder.episodes(), counters.step), (folder.eval(), evaluated)] {
            let last = last_step(&path)?;
            ensure!(
                last >= step,
                "{}: ends at action {last}, the checkpoint is of {}: rows are missing",
                path.display(),
                counters.step
            );
        }
        for (path, step) in
            [(folder.episodes(), counters.step), (folder.eval(), evaluated), (folder.progress(), counters.step)]
        {
            cut_after(&path, step)?;
        }
        Ok(Run {
            config,
            folder,
            id: RunId::of(config),
            env,
            evaluation_env,
            sac,
            replay,
            saved_step: counters.step,
            log: LearnerLog::new(counters.step),
            board: tensorboard.then(|| TensorBoard::create(folder.path(), counters.step)).transpose()?,
            counters,
            tables: Tables {
                episodes: Table::append(&folder.episodes())?,
                eval: Table::append(&folder.eval())?,
                progress: Table::append(&folder.progress())?,
            },
            started: Instant::now(),
        })
    }

    fn train(&mut self, stop: &Stop, display: &mut Display) -> Result<Ending> {
        let config = self.config;
        let scaled = config.learner.scaled_observations;
        let mut action = vec![0.0f32; self.env.action_dim()];
        let mut asked = false;
        while self.counters.step < config.steps {
            let mut episode = Episode::default();
            self.env.reset(None);
            let mut observation = learner_view(&self.env, scaled);
            loop {
                let act = if self.counters.step < config.learner.random_steps { Act::Random } else { Act::Sample };
                self.sac.act(&observation, &mut action, act);
                let wide: Vec<f64> = action.iter().map(|&a| f64::from(a)).collect();
                let step = self.env.step(&wide);
                let next = learner_view(&self.env, scaled);
                self.replay.push(&Transition {
                    observation: &observation,
                    action: &action,
                    reward: step.reward as f32,
                    next_observation: &next,
                    terminated: step.terminated,
                    truncated: step.truncated,
                })?;
                observation = next;
                self.counters.step += 1;
                episode.add(step);

                for _ in 0..config.learner.updates_after(self.counters.step) {
                    let losses = self.sac.update(&self.replay);
                    ensure!(losses.is_finite(), "the learner diverged at action {}: {losses:?}", self.counters.step);
                    self.log.add(&losses);
                }
                if self.counters.step.is_multiple_of(LOG_EVERY) {
                    self.write_progress()?;
                }
                if self.counters.step.is_multiple_of(config.evaluate_every) {
                    self.evaluate(display)?;
                }
                display.step(self.counters.step);
                if stop.requested() && !asked {
                    asked = true;
                    display.line("stopping at the end of this episode; another Ctrl-C stops at once, without saving");
                }
                if step.terminated || step.truncated {
                    break;
                }
            }
            self.finish_episode(&episode, display)?;
            if stop.requested() && self.counters.step < config.steps {
                self.save()?;
                return Ok(Ending::Stopped);
            }
            if self.counters.step - self.saved_step >= config.checkpoint_every {
                self.save()?;
            }
        }
        if self.counters.best_return.is_none() {
            // Too short a run for an evaluation on the way.
            self.evaluate(display)?;
        }
        self.save()?;
        fs_err::write(self.folder.done(), "")?;
        Ok(Ending::Done)
    }

    fn finish_episode(&mut self, episode: &Episode, display: &mut Display) -> Result<()> {
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
        if outcome.diverged {
            display.line(&format!("episode {}: the simulation diverged; counted, going on", self.counters.episode));
        }
        display.episode(outcome.total);
        if let Some(board) = &mut self.board {
            board.episode(self.counters.step, &outcome)?;
        }
        self.tables.episodes.write((key, outcome))
    }

    fn evaluate(&mut self, display: &mut Display) -> Result<()> {
        let mut policy = Policy::Actor {
            // A mean action needs no noise, hence no seed of its own.
            actor: Box::new(self.sac.policy(0)),
            act: Act::Mean,
            scaled: self.config.learner.scaled_observations,
        };
        let step = self.counters.step;
        let evaluation = step / self.config.evaluate_every;
        let starts = (0..self.config.evaluation_episodes).map(|index| training_evaluation_seed(evaluation, index));
        let table = &mut self.tables.eval;
        let outcomes = evaluate(&mut self.evaluation_env, &mut policy, starts, step, &self.id, table)?;
        let score = mean(&outcomes, |o| o.total);
        display.evaluation(step, &outcomes);
        if let Some(board) = &mut self.board {
            board.evaluation(step, &outcomes)?;
        }
        if self.counters.best_return.is_none_or(|best| score > best) {
            self.counters.best_return = Some(score);
            let note = Best { purpose: Purpose::of(self.config), step, evaluation_return: score };
            let note = serde_json::to_value(note).context("note of the best checkpoint")?;
            Checkpoint::save(&self.folder.best(), &self.sac, None, note)?;
        }
        Ok(())
    }

    fn save(&mut self) -> Result<()> {
        self.counters.episode_stream = self.env.episode_stream();
        let wall_s = self.wall_s();
        self.started = Instant::now();
        self.counters.wall_s = wall_s;
        let caller = serde_json::to_value(&self.counters).context("checkpoint counters")?;
        Checkpoint::save(&self.folder.checkpoint(), &self.sac, Some(&self.replay), caller)?;
        self.saved_step = self.counters.step;
        Ok(())
    }

    fn wall_s(&self) -> f64 {
        self.counters.wall_s + self.started.elapsed().as_secs_f64()
    }

    fn write_progress(&mut self) -> Result<()> {
        let row = self.log.row(self.counters.step, self.sac.updates(), self.replay.len(), self.wall_s());
        if let Some(board) = &mut self.board {
            board.progress(&row)?;
        }
        self.tables.progress.write(row)
    }
}
