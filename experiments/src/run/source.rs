//! What plays, and where: a trained run, the scripted expert or random actions.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{ArgGroup, Args};
use output::program::bad;
use sac::{Act, Actor, Checkpoint};
use settings::spaces;
use tasks::Env;

use crate::config::cli::{EnvArgs, SettingArgs};
use crate::config::{RunConfig, RunId};
use crate::run::checkpoint_record::CheckpointRecord;
use crate::run::folder::RunFolder;
use crate::run::kept;
use crate::run::playable::Playable;
use crate::run::rollout::Policy;
use crate::run::which::Which;

/// Whose episodes are played.
#[derive(Debug, Clone, Args)]
#[group(skip)]
#[command(group = ArgGroup::new("who").required(true))]
pub struct SourceArgs {
    /// Folder of a run whose trained policy plays, or the .zip in which `archive` kept it
    #[arg(long, value_name = "DIR|FILE.zip", group = "who")]
    pub run: Option<PathBuf>,
    /// Which of the run's checkpoints [default: best, or the one that a .zip has]
    #[arg(long, conflicts_with_all = ["expert", "random"])]
    pub checkpoint: Option<Which>,
    /// Sample from the policy instead of taking its mean action
    #[arg(long, conflicts_with_all = ["expert", "random"])]
    pub sample: bool,
    /// The task's scripted expert plays
    #[arg(long, group = "who")]
    pub expert: bool,
    /// Uniformly random actions (others with another --set seed=N)
    #[arg(long, group = "who")]
    pub random: bool,
    /// The environment.
    #[command(flatten)]
    pub env: EnvArgs,
}

/// Who plays, and where.
pub struct Player {
    /// Environment and learner.
    pub config: RunConfig,
    /// The environment.
    pub env: Env,
    /// Who chooses the actions.
    pub policy: Policy,
    /// Which checkpoint of a run it is.
    pub checkpoint: Option<Which>,
    /// Training actions after which the policy was saved.
    pub step: u64,
    /// The first setting that differs from training, in words.
    pub changed: Option<String>,
}

impl SourceArgs {
    /// The player of a second episode. If `what` names an action space, the same script or random actions play in it.
    /// Otherwise the trained policy of the run folder or kept policy `what` plays.
    ///
    /// # Errors
    /// If `what` is neither, or a trained policy is asked to play in another action space.
    pub fn beside(&self, what: &str) -> Result<SourceArgs> {
        let mut other = self.clone();
        match spaces::named(what, Path::new("")) {
            Ok(_) if self.run.is_some() => {
                let hint = "a trained policy plays in one action space; name another run";
                return Err(bad(format!("--beside {what}: {hint}")));
            }
            Ok(space) => other.env.space = Some(space),
            Err(not_a_space) => {
                let is_run = kept::is_kept(Path::new(what)) || RunFolder::open(Path::new(what)).is_ok();
                if !is_run {
                    let problem = format!("neither a run folder nor an action space ({not_a_space:#})");
                    return Err(bad(format!("--beside {what}: {problem}")));
                }
                (other.run, other.expert, other.random) = (Some(what.into()), false, false);
                // A run has its own configuration; what --set says of the environment holds for both.
                let mut settings = SettingArgs { config: None, ..self.env.settings.clone() };
                settings.overrides.retain(|(key, _)| key.starts_with("env."));
                other.env = EnvArgs { settings, ..EnvArgs::default() };
            }
        }
        Ok(other)
    }

    /// Who plays, in words.
    pub fn describe(&self) -> String {
        match &self.run {
            Some(run) if self.sample => format!("{}, sampled actions", run.display()),
            Some(run) => run.display().to_string(),
            None if self.expert => "scripted expert".into(),
            None => "random actions".into(),
        }
    }

    /// The environment and the policy that plays in it.
    ///
    /// # Errors
    /// If the run or its checkpoint is missing, damaged or made for something else.
    pub fn open(&self) -> Result<Player> {
        let Some(path) = &self.run else {
            let config = self.env.resolve()?;
            let env = Env::new(config.env.clone(), 0)?;
            let policy = if self.expert { Policy::Expert } else { Policy::random(config.seed) };
            return Ok(Player { config, env, policy, checkpoint: None, step: 0, changed: None });
        };
        let run = Trained::open(path, self.checkpoint)?;
        let config = on_top_of(&run.run.config, &self.env)?;
        let env = Env::new(config.env.clone(), 0)?;
        let act = if self.sample { Act::Sample } else { Act::Mean };
        let (policy, step) = run.policy(&env, &RunId::of(&config), act)?;
        let changed = run.config.difference(&config);
        Ok(Player { config, env, policy, checkpoint: Some(run.which), step, changed })
    }
}

/// A run whose trained policy plays.
pub struct Trained {
    path: PathBuf,
    run: Playable,
    /// Its configuration.
    pub config: RunConfig,
    /// Which of its checkpoints plays.
    which: Which,
}

impl Trained {
    /// Opens a run's folder or a kept policy with its checkpoint `which`, by default the best one, or the one that was kept.
    ///
    /// # Errors
    /// If the run or its checkpoint is missing or damaged.
    pub fn open(path: &Path, which: Option<Which>) -> Result<Self> {
        let run = Playable::open(path)?;
        let which = which.or(run.kept).unwrap_or(Which::Best);
        let config = RunConfig::resolve(Some(&run.config), &[])?;
        let trained = Trained { path: path.into(), run, config, which };
        let (at, exists) = (path.display(), Checkpoint::exists(&trained.checkpoint()));
        match which {
            _ if trained.run.kept.is_some_and(|kept| kept != which) => {
                bail!("{at}: --checkpoint {}: it keeps the other one", which.name())
            }
            Which::Best if !exists => bail!(
                "{at}: no best checkpoint: a run under way has one from its first evaluation on (before: --checkpoint last), \
                 and of the runs in results/ those that results/README.md lists"
            ),
            Which::Last if !exists => bail!("{at}: no last checkpoint: a run has one from its first save on"),
            _ => Ok(trained),
        }
    }

    /// The folder of its checkpoint.
    fn checkpoint(&self) -> PathBuf {
        match self.which {
            Which::Best => self.run.folder.best(),
            Which::Last => self.run.folder.checkpoint(),
        }
    }

    /// The policy, to be played in `env`, the environment of the run `id`; and the training actions after which it was saved.
    ///
    /// # Errors
    /// If the policy is damaged or was trained for another task or space.
    pub fn policy(&self, env: &Env, id: &RunId, act: Act) -> Result<(Policy, u64)> {
        let sizes = (env.observation_components().len(), env.action_dim());
        let (actor, record) = Actor::load(&self.checkpoint(), sizes.0, sizes.1, self.config.seed)
            .map_err(|error| self.run.named(error.into()))?;
        let at = || self.path.join("checkpoints").join(self.which.name()).display().to_string();
        let record: CheckpointRecord = serde_json::from_value(record)
            .with_context(|| format!("{}: does not say what it was trained for", at()))?;
        record.belongs_to(id).with_context(at)?;
        let scaled = self.config.learner.scaled_observations;
        Ok((Policy::Actor { actor: Box::new(actor), act, scaled }, record.step))
    }
}

/// The configuration of an existing run with flags on top.
///
/// # Errors
/// As [`EnvArgs::resolve`]; also if a flag names a file or a key that is not the environment's, because the run has its
/// own configuration.
fn on_top_of(of_run: &Path, env: &EnvArgs) -> Result<RunConfig> {
    if env.settings.config.is_some() {
        return Err(bad("--config cannot be combined with --run: the run has its own configuration".into()));
    }
    if let Some((key, _)) = env.settings.overrides.iter().find(|(key, _)| !key.starts_with("env.")) {
        return Err(bad(format!("--set {key} cannot be combined with --run: of a run only env. can be changed")));
    }
    RunConfig::resolve(Some(of_run), &env.overrides())
}
