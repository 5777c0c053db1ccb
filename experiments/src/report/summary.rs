//! One row per run: what it ended with and what it cost.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Error, Result, ensure};
use serde::Serialize;

use crate::config;
use crate::report::archive;
use crate::report::columns::Columns;
use crate::report::record::{Record, Table};
use crate::run::clock::Spent;
use crate::run::folder::RunFolder;
use crate::run::rows::SCHEMA;
use output::statistics::{mean, mean_of};

/// Evaluations at the end of a run whose mean is its final return.
const LAST: usize = 5;
/// An evaluation return that counts as solved, of at most 500.
pub const SOLVED: f64 = 450.0;

/// A row of `runs.csv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct RunSummary {
    pub schema: u32,
    pub experiment: String,
    pub task: String,
    pub space: String,
    pub variant: String,
    pub seed: u64,
    pub preset: String,
    pub position_step_m: f64,
    pub rotation_step_rad: f64,
    pub env_steps: u64,
    pub done: bool,
    pub final_return: f64,
    pub curve_return: f64,
    pub best_return: f64,
    pub final_success: f64,
    pub final_success_any: f64,
    pub sampled_return: f64,
    pub sampled_success: f64,
    pub sampled_energy_per_action_j: f64,
    pub steps_to_450: Option<u64>,
    pub wall_min_to_450: Option<f64>,
    pub cpu_min_to_450: Option<f64>,
    pub energy_per_action_j: f64,
    pub final_energy_per_action_j: f64,
    pub energy_positive_per_action_j: f64,
    pub energy_net_per_action_j: f64,
    pub squared_torque_per_action_nm2s: f64,
    pub copper_loss_per_action_j: f64,
    pub mean_stiffness: f64,
    pub penalised_episode_share: f64,
    pub penalised_action_share: f64,
    pub mean_penalty_per_episode: f64,
    pub excess_impulse_per_episode_ns: f64,
    pub diverged_episodes: Option<usize>,
    pub stiffness_translation_n_per_m: Option<f64>,
    pub stiffness_rotation_nm_per_rad: Option<f64>,
    pub at_k_min_translation: Option<f64>,
    pub at_k_max_translation: Option<f64>,
    pub at_k_min_rotation: Option<f64>,
    pub at_k_max_rotation: Option<f64>,
    pub feedforward_share_translation: Option<f64>,
    pub feedforward_share_rotation: Option<f64>,
    pub tool_work_translation_per_action_j: Option<f64>,
    pub tool_work_rotation_per_action_j: Option<f64>,
    pub final_success_held: Option<f64>,
    pub final_success_by_hand: Option<f64>,
    pub final_time_to_success_s: Option<f64>,
    pub final_energy_to_success_j: Option<f64>,
    pub final_max_force_to_success_n: Option<f64>,
    pub sampled_success_held: Option<f64>,
    pub sampled_success_by_hand: Option<f64>,
    pub sampled_success_without_hand: Option<f64>,
    pub sampled_hand_share_to_success: Option<f64>,
    pub sampled_time_to_success_s: Option<f64>,
    pub sampled_energy_to_success_j: Option<f64>,
    pub sampled_max_force_to_success_n: Option<f64>,
    pub sampled_impulse_to_success_ns: Option<f64>,
    pub sampled_fulfilled_power_w: Option<f64>,
    pub sampled_fulfilled_max_force_n: Option<f64>,
    pub sampled_arm_max_contact_force_n: Option<f64>,
    pub sampled_self_contact_time_s: Option<f64>,
    pub median_penalty_per_episode: f64,
    pub q90_penalty_per_episode: f64,
    pub median_arm_max_contact_force_n: Option<f64>,
    pub q90_arm_max_contact_force_n: Option<f64>,
    pub sampled_arm_max_contact_force_median_n: Option<f64>,
    pub sampled_arm_max_contact_force_q90_n: Option<f64>,
    pub sampled_max_force_to_success_median_n: Option<f64>,
    pub sampled_max_force_to_success_q90_n: Option<f64>,
    pub last_sampled_return: Option<f64>,
    pub last_sampled_success_by_hand: Option<f64>,
    pub stopped_episode_share: Option<f64>,
    pub final_success_before_stop: Option<f64>,
    pub sampled_success_before_stop: Option<f64>,
    pub end_return: Option<f64>,
    pub end_success: Option<f64>,
    pub end_success_held: Option<f64>,
    pub end_success_before_stop: Option<f64>,
    pub end_energy_per_action_j: Option<f64>,
    pub end_energy_to_success_j: Option<f64>,
    pub end_time_to_success_s: Option<f64>,
    pub end_arm_max_contact_force_median_n: Option<f64>,
    pub wall_s: f64,
    pub cpu_s: Option<f64>,
    pub commit: String,
}

/// All runs below `root`, in folders and in archives, sorted by path and seed, each once however many links lead there; but for those
/// of a search, which was to choose and is ranked in its search.csv. One that cannot be read comes as its folder and the reason.
///
/// # Errors
/// If a folder or an archive cannot be read.
pub fn find_runs(root: &Path) -> Result<Vec<Result<Record, (RunFolder, Error)>>> {
    find_new_runs(root, &mut HashSet::new())
}

/// Those below `root` but not below a folder that was looked into already.
fn find_new_runs(root: &Path, seen: &mut HashSet<PathBuf>) -> Result<Vec<Result<Record, (RunFolder, Error)>>> {
    if !seen.insert(fs_err::canonicalize(root)?) {
        return Ok(vec![]);
    }
    let mut paths: Vec<PathBuf> = fs_err::read_dir(root)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort_by_cached_key(|path| (seed(path), path.clone()));
    let folder = RunFolder::at(root);
    if folder.episodes().is_file() || folder.done().is_file() {
        return Ok(vec![Record::of_folder(&folder).map_err(|reason| (folder, reason))]);
    }
    if root.join("search.csv").is_file() {
        return Ok(vec![]);
    }
    let mut runs = if archive::is_archive(root) { archive::read(root)?.into_iter().map(Ok).collect() } else { vec![] };
    for path in paths.into_iter().filter(|path| path.is_dir()) {
        runs.extend(find_new_runs(&path, seen)?);
    }
    Ok(runs)
}

/// Of a folder called seed_N: seed 10 comes after seed 2.
fn seed(path: &Path) -> Option<u64> {
    path.file_name()?.to_str()?.strip_prefix("seed_")?.parse().ok()
}

/// A group's name within its section: the action space, the variant, and the preset where it is none of those that tables are made with.
pub fn label(space: &str, variant: &str, preset: &str) -> String {
    let label = config::label(space, variant);
    let usual = [sac::Preset::DESKTOP, sac::Preset::SWIFT].iter().any(|usual| usual.name == preset);
    if usual { label } else { format!("{label}, {preset} preset") }
}

impl RunSummary {
    /// What tables and legends call it.
    pub fn label(&self) -> String {
        label(&self.space, &self.variant, &self.preset)
    }

    /// From the tables of a run found below `root`.
    ///
    /// # Errors
    /// If one is missing or damaged, or the run was never evaluated.
    pub fn of(run: &Record, root: &Path) -> Result<Self> {
        let Record { config, manifest, done, .. } = run;
        let (training, eval) = (run.columns(Table::Episodes)?, run.evaluations("mean")?);
        let lengths = training.values("length")?;
        ensure!(!lengths.is_empty(), "{}: no training episode", run.path.display());
        let returns = eval.mean_by_step("return")?;
        ensure!(!returns.is_empty(), "{}: no evaluation", run.path.display());
        // The last evaluations: of a number that not every episode has, those of their episodes that have it.
        let before = returns.len().checked_sub(LAST + 1).map_or(0.0, |i| returns[i].0);
        let eval = eval.after(before)?;
        let at_end = |column: &str| eval.mean(column);
        let sampled_eval = run.evaluations("sampled")?.after(before)?;
        ensure!(!sampled_eval.is_empty(), "{}: no evaluation with sampled actions", run.path.display());
        let sampled = |column: &str| sampled_eval.mean(column);
        // A cell may be empty in every row.
        let known = |value: f64| (!value.is_nan()).then_some(value);
        let last_but_one = returns.len().checked_sub(2).map_or(0.0, |i| returns[i].0);
        let last_sampled = sampled_eval.clone().after(last_but_one)?;
        let last_policy = run.csv(Table::End)?.map(Columns::of).transpose()?;
        let end = |of: &dyn Fn(&Columns) -> Result<f64>| {
            Ok::<_, Error>(last_policy.as_ref().map(of).transpose()?.and_then(known))
        };
        let solved = returns.iter().find(|p| p.1 >= SOLVED).map(|p| p.0);
        let progress = run.columns(Table::Progress)?;
        let minutes_to_450 = |clock: &str| {
            let clock = progress.points(clock)?;
            Ok::<_, Error>(solved.and_then(|at| clock.iter().find(|p| p.0 >= at)).map(|p| p.1 / 60.0))
        };
        let actions: f64 = lengths.iter().sum();
        let per_action = |column: &str| Ok::<_, Error>(training.values(column)?.iter().sum::<f64>() / actions);
        let with = |column: &str| {
            let values = training.values(column)?;
            let known = values.iter().any(|value| !value.is_nan());
            Ok::<_, Error>(known.then(|| values.iter().filter(|&&value| value > 0.0).count()))
        };
        // The manifest is written when a run ends; of one that has not, the last row of its progress tells.
        let so_far = |clock: &str| Ok::<_, Error>(progress.points(clock)?.last().map_or(0.0, |point| point.1));
        let spent = if *done { manifest.spent } else { Spent { wall_s: so_far("wall_s")?, cpu_s: so_far("cpu_s")? } };
        Ok(RunSummary {
            schema: SCHEMA,
            experiment: run.experiment(root),
            task: config.env.task.as_str().into(),
            space: config.env.space.name.clone(),
            variant: config.variant.clone(),
            seed: config.seed,
            preset: config.preset.name.into(),
            position_step_m: config.env.space.step(&config.env.controller, 0),
            rotation_step_rad: config.env.space.step(&config.env.controller, 3),
            env_steps: training.values("step")?.last().map_or(0, |&step| step as u64),
            done: *done,
            final_return: at_end("return")?,
            curve_return: mean_of(&returns, |p| p.1),
            best_return: returns.iter().map(|p| p.1).fold(f64::MIN, f64::max),
            final_success: at_end("success")?,
            final_success_any: at_end("success_any")?,
            sampled_return: sampled("return")?,
            sampled_success: sampled("success")?,
            sampled_energy_per_action_j: sampled("energy_per_action_j")?,
            steps_to_450: solved.map(|step| step as u64),
            wall_min_to_450: minutes_to_450("wall_s")?,
            cpu_min_to_450: minutes_to_450("cpu_s")?,
            energy_per_action_j: per_action("energy_j")?,
            final_energy_per_action_j: at_end("energy_per_action_j")?,
            energy_positive_per_action_j: per_action("energy_positive_j")?,
            energy_net_per_action_j: per_action("energy_net_j")?,
            squared_torque_per_action_nm2s: per_action("squared_torque_nm2s")?,
            copper_loss_per_action_j: per_action("copper_loss_j")?,
            mean_stiffness: mean(&training.values("mean_stiffness")?),
            penalised_episode_share: with("penalised_steps")?.map_or(f64::NAN, |n| n as f64) / lengths.len() as f64,
            penalised_action_share: per_action("penalised_steps")?,
            mean_penalty_per_episode: mean(&training.values("penalty")?),
            excess_impulse_per_episode_ns: mean(&training.values("excess_impulse_ns")?),
            diverged_episodes: with("diverged")?,
            stiffness_translation_n_per_m: known(mean(&training.values("stiffness_translation_n_per_m")?)),
            stiffness_rotation_nm_per_rad: known(mean(&training.values("stiffness_rotation_nm_per_rad")?)),
            at_k_min_translation: known(mean(&training.values("at_k_min_translation")?)),
            at_k_max_translation: known(mean(&training.values("at_k_max_translation")?)),
            at_k_min_rotation: known(mean(&training.values("at_k_min_rotation")?)),
            at_k_max_rotation: known(mean(&training.values("at_k_max_rotation")?)),
            feedforward_share_translation: known(mean(&training.values("feedforward_share_translation")?)),
            feedforward_share_rotation: known(mean(&training.values("feedforward_share_rotation")?)),
            tool_work_translation_per_action_j: known(per_action("tool_work_translation_j")?),
            tool_work_rotation_per_action_j: known(per_action("tool_work_rotation_j")?),
            final_success_held: known(at_end("success_held")?),
            final_success_by_hand: known(eval.success_by_hand()?),
            final_time_to_success_s: known(at_end("time_to_success_s")?),
            final_energy_to_success_j: known(at_end("energy_to_success_j")?),
            final_max_force_to_success_n: known(at_end("max_force_to_success_n")?),
            sampled_success_held: known(sampled("success_held")?),
            sampled_success_by_hand: known(sampled_eval.success_by_hand()?),
            sampled_success_without_hand: known(sampled("success_without_hand")?),
            sampled_hand_share_to_success: known(sampled("hand_share_to_success")?),
            sampled_time_to_success_s: known(sampled("time_to_success_s")?),
            sampled_energy_to_success_j: known(sampled("energy_to_success_j")?),
            sampled_max_force_to_success_n: known(sampled("max_force_to_success_n")?),
            sampled_impulse_to_success_ns: known(sampled("impulse_to_success_ns")?),
            sampled_fulfilled_power_w: known(sampled("fulfilled_energy_j")? / sampled("fulfilled_time_s")?),
            sampled_fulfilled_max_force_n: known(sampled_eval.fulfilled_max_force()?),
            sampled_arm_max_contact_force_n: known(sampled("arm_max_contact_force_n")?),
            sampled_self_contact_time_s: known(sampled("self_contact_time_s")?),
            median_penalty_per_episode: training.quantile("penalty", 0.5)?,
            q90_penalty_per_episode: training.quantile("penalty", 0.9)?,
            median_arm_max_contact_force_n: known(training.quantile("arm_max_contact_force_n", 0.5)?),
            q90_arm_max_contact_force_n: known(training.quantile("arm_max_contact_force_n", 0.9)?),
            sampled_arm_max_contact_force_median_n: known(sampled_eval.quantile("arm_max_contact_force_n", 0.5)?),
            sampled_arm_max_contact_force_q90_n: known(sampled_eval.quantile("arm_max_contact_force_n", 0.9)?),
            sampled_max_force_to_success_median_n: known(sampled_eval.quantile("max_force_to_success_n", 0.5)?),
            sampled_max_force_to_success_q90_n: known(sampled_eval.quantile("max_force_to_success_n", 0.9)?),
            last_sampled_return: known(last_sampled.mean("return")?),
            last_sampled_success_by_hand: known(last_sampled.success_by_hand()?),
            stopped_episode_share: known(training.stopped_share()?),
            final_success_before_stop: known(at_end("success_before_stop")?),
            sampled_success_before_stop: known(sampled("success_before_stop")?),
            end_return: end(&|last| last.mean("return"))?,
            end_success: end(&|last| last.mean("success"))?,
            end_success_held: end(&|last| last.mean("success_held"))?,
            end_success_before_stop: end(&|last| last.mean("success_before_stop"))?,
            end_energy_per_action_j: end(&|last| last.mean("energy_per_action_j"))?,
            end_energy_to_success_j: end(&|last| last.mean("energy_to_success_j"))?,
            end_time_to_success_s: end(&|last| last.mean("time_to_success_s"))?,
            end_arm_max_contact_force_median_n: end(&|last| last.quantile("arm_max_contact_force_n", 0.5))?,
            wall_s: spent.wall_s,
            cpu_s: (spent.cpu_s > 0.0).then_some(spent.cpu_s),
            commit: manifest.commits(),
        })
    }
}

#[cfg(test)]
pub(crate) mod tests;
