//! One row per run: what it ended with and what it cost.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::columns::Columns;
use crate::config::RunConfig;
use crate::folder::RunFolder;
use output::statistics::mean;

/// Evaluations at the end of a run whose mean is its final return.
const LAST: usize = 5;
/// An evaluation return that counts as solved, of at most 500.
const SOLVED: f64 = 450.0;

/// A row of `runs.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in results/README.md")]
pub struct RunSummary {
    pub schema: u32,
    pub task: String,
    pub space: String,
    pub seed: u64,
    pub preset: String,
    pub position_step_m: f64,
    pub rotation_step_rad: f64,
    pub env_steps: u64,
    pub final_return: f64,
    pub best_return: f64,
    pub final_success: f64,
    pub final_success_any: f64,
    pub sampled_return: f64,
    pub sampled_success: f64,
    pub steps_to_450: Option<u64>,
    pub wall_min_to_450: Option<f64>,
    pub energy_per_action_j: f64,
    pub final_energy_per_action_j: f64,
    pub energy_positive_per_action_j: f64,
    pub energy_net_per_action_j: f64,
    pub squared_torque_per_action_nm2s: f64,
    pub copper_loss_per_action_j: f64,
    pub penalised_episode_share: f64,
    pub mean_penalty_per_episode: f64,
    pub excess_impulse_per_episode_ns: f64,
    pub diverged_episodes: usize,
    pub wall_s: f64,
    pub commit: String,
}

/// All run folders below `root` in which an episode has ended, sorted by path.
///
/// # Errors
/// If a folder cannot be read.
pub fn find_runs(root: &Path) -> Result<Vec<RunFolder>> {
    let mut paths: Vec<PathBuf> = fs_err::read_dir(root)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort();
    if let Some(folder) = RunFolder::open(root).ok().filter(|folder| folder.episodes().is_file()) {
        return Ok(vec![folder]);
    }
    let mut runs = vec![];
    for path in paths.into_iter().filter(|path| path.is_dir()) {
        runs.extend(find_runs(&path)?);
    }
    Ok(runs)
}

/// Mean of each evaluation from the tables of a run, over thousands of steps.
///
/// # Errors
/// If `eval.csv` is missing or damaged.
fn evaluations(run: &RunFolder, column: &str) -> Result<Vec<(f64, f64)>> {
    Ok(Columns::read(&run.eval())?.mean_by_step(column))
}

impl RunSummary {
    /// From the tables of a run.
    ///
    /// # Errors
    /// If one is missing or damaged, or the run was never evaluated.
    pub fn of(run: &RunFolder) -> Result<Self> {
        let config = RunConfig::resolve(Some(&run.config()), &[])?;
        let manifest = run.manifest()?;
        let training = Columns::read(&run.episodes())?;
        ensure!(!training.values("return").is_empty(), "{}: no training episode", run.path().display());
        let returns = evaluations(run, "return")?;
        let last = returns.last().with_context(|| format!("{}: no evaluation", run.path().display()))?;
        let at_end = |column: &str| -> Result<f64> {
            let values: Vec<f64> = evaluations(run, column)?.iter().rev().take(LAST).map(|p| p.1).collect();
            Ok(mean(&values))
        };
        let first_late = returns.len().checked_sub(LAST + 1).map_or(0.0, |i| returns[i].0);
        let sampled = |column: &str| {
            let all = training.values(column);
            let late: Vec<f64> = training.points(column).iter().filter(|p| p.0 > first_late).map(|p| p.1).collect();
            // Very long episodes: none may have ended since.
            mean(if late.is_empty() { &all } else { &late })
        };
        let solved = returns.iter().find(|p| p.1 >= SOLVED).map(|p| p.0);
        let clock = Columns::read(&run.progress())?.points("wall_s");
        let actions: f64 = training.values("length").iter().sum();
        let per_action = |column: &str| training.values(column).iter().sum::<f64>() / actions;
        let penalties = training.values("penalty");
        Ok(RunSummary {
            schema: 2,
            task: config.env.task.as_str().into(),
            space: config.env.space.name().into(),
            seed: config.seed,
            preset: format!("{:?}", config.preset).to_lowercase(),
            position_step_m: config.env.controller.position_step,
            rotation_step_rad: config.env.controller.rotation_step,
            env_steps: in_steps(last.0),
            final_return: at_end("return")?,
            best_return: returns.iter().map(|p| p.1).fold(f64::MIN, f64::max),
            final_success: at_end("success")?,
            final_success_any: at_end("success_any")?,
            sampled_return: sampled("return"),
            sampled_success: sampled("success"),
            steps_to_450: solved.map(in_steps),
            wall_min_to_450: solved.and_then(|at| clock.iter().find(|p| p.0 >= at)).map(|p| p.1 / 60.0),
            energy_per_action_j: mean(&training.values("energy_per_action_j")),
            final_energy_per_action_j: at_end("energy_per_action_j")?,
            energy_positive_per_action_j: per_action("energy_positive_j"),
            energy_net_per_action_j: per_action("energy_net_j"),
            squared_torque_per_action_nm2s: per_action("squared_torque_nm2s"),
            copper_loss_per_action_j: per_action("copper_loss_j"),
            penalised_episode_share: mean(&penalties.iter().map(|&p| f64::from(u8::from(p > 0.0))).collect::<Vec<_>>()),
            mean_penalty_per_episode: mean(&penalties),
            excess_impulse_per_episode_ns: mean(&training.values("excess_impulse_ns")),
            diverged_episodes: training.values("diverged").iter().filter(|&&d| d > 0.0).count(),
            wall_s: manifest.wall_s,
            commit: manifest.commits(),
        })
    }
}

fn in_steps(thousands: f64) -> u64 {
    (thousands * 1000.0).round() as u64
}
