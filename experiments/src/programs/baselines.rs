//! What needs no learning: scripted experts and random actions in every action space.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::config::cli::{self, EnvArgs, SettingArgs};
use crate::config::{RunConfig, RunId, label, sweep};
use crate::report::groups::Section;
use crate::report::run_tables::statistic;
use crate::run::rollout::Policy;
use crate::run::rows::SCHEMA;
use crate::run::seeds::evaluation_seed;
use aforce::ActionSpace;
use anyhow::{Context, Result, ensure};
use clap::{Parser, ValueEnum};
use output::file;
use output::program::{self, bad};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use show::plot::{self, Panel, Series};
use tasks::columns::{Cell, Column, Over, RunNumber, run_numbers};
use tasks::{Env, Outcome, Step, TaskName};

/// Play the evaluation episodes with the scripted expert or with random actions, and write a row per task and action
/// space. One thread per processor core, each with an environment of its own; the table does not depend on their number.
/// An episode takes about half a second of one core.
#[derive(Parser)]
#[command(name = "baselines", version = output::VERSION, after_help = "Example: baselines random --tasks lift,wipe --out random.csv")]
pub struct Arguments {
    /// Who plays
    policy: Who,
    /// Where the table goes; must not exist
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Tasks (default: the configuration's)
    #[arg(long, value_delimiter = ',', value_parser = cli::task_parser())]
    tasks: Vec<TaskName>,
    /// Action spaces (default: all)
    #[arg(long, value_delimiter = ',', value_name = "NAME|FILE", value_parser = cli::parse_space)]
    spaces: Vec<ActionSpace>,
    /// Episodes per action space
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    episodes: u32,
    #[command(flatten)]
    settings: SettingArgs,
    /// What the runs of a sweep are trained in, instead of tasks, spaces and settings: a row each, seeds apart
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tasks", "spaces", "SettingArgs"])]
    sweep: Option<PathBuf>,
    /// Joules per action, a dot per row, in FILE.svg
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Who {
    Expert,
    Random,
}

/// A row of the table: which set-up, what its columns' entries tell of the episodes, and what no column tells.
struct Row {
    task: &'static str,
    space: String,
    variant: String,
    policy: &'static str,
    position_step_m: f64,
    rotation_step_rad: f64,
    episodes: u32,
    numbers: Vec<(&'static str, Cell)>,
    commit: String,
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Row", 9 + self.numbers.len())?;
        row.serialize_field("schema", &SCHEMA)?;
        row.serialize_field("task", self.task)?;
        row.serialize_field("space", &self.space)?;
        row.serialize_field("variant", &self.variant)?;
        row.serialize_field("policy", self.policy)?;
        row.serialize_field("position_step_m", &self.position_step_m)?;
        row.serialize_field("rotation_step_rad", &self.rotation_step_rad)?;
        row.serialize_field("episodes", &self.episodes)?;
        self.numbers.iter().try_for_each(|(name, cell)| row.serialize_field(name, cell))?;
        row.serialize_field("commit", &self.commit)?;
        row.end()
    }
}

/// Runs the program; its exit code.
///
/// # Errors
/// If a setting is wrong, or the table exists or cannot be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let out = arguments.out.display();
    ensure!(!arguments.out.exists(), "{out}: exists; nothing was overwritten");
    let setups = match &arguments.sweep {
        Some(path) => of_sweep(path)?,
        None => arguments.setups()?,
    };
    let picture = arguments.plot.as_ref().map(|path| plot::files(path)[0].clone());
    if picture.as_ref() == Some(&arguments.out) {
        return Err(bad(format!("{out}: --out and --plot would both write it")));
    }
    [Some(&arguments.out), picture.as_ref()].into_iter().flatten().try_for_each(|path| file::prepare(path))?;
    // Every scene that there will be, before the first episode is played.
    for config in &setups {
        Env::new(config.env.clone(), 0).with_context(|| RunId::of(config).to_string())?;
    }
    let rows = output::parallel::map(&setups, |config| {
        let row = play(config, arguments.policy, arguments.episodes)?;
        program::say(format_args!(
            "{} {}: success {:.2}, return {:.1}",
            row.task,
            row.label(),
            row.number("success"),
            row.number("return_mean")
        ));
        Ok::<_, anyhow::Error>(row)
    })?;
    let diverged: f64 = rows.iter().map(|row| row.number("diverged_episodes")).sum();
    file::write_new_table(&arguments.out, &rows)?;
    if let Some(path) = &arguments.plot {
        plot::write(&format!("{} actions", rows[0].policy), &panels(&rows), path)?;
    }
    program::written(&[Some(&arguments.out), picture.as_ref()].into_iter().flatten().collect::<Vec<_>>());
    let (rows, episodes) = (rows.len(), u64::from(arguments.episodes) * rows.len() as u64);
    program::result(format_args!("{rows} set-ups, {episodes} episodes, {diverged} of them diverged"));
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    /// Every task with every space.
    fn setups(&self) -> Result<Vec<RunConfig>> {
        let spaces = if self.spaces.is_empty() { ActionSpace::built_in() } else { self.spaces.clone() };
        let tasks = if self.tasks.is_empty() { vec![self.settings.resolve()?.env.task] } else { self.tasks.clone() };
        let mut setups: Vec<RunConfig> = vec![];
        for (task, space) in tasks.iter().flat_map(|&task| spaces.iter().map(move |space| (task, space))) {
            let env =
                EnvArgs { settings: self.settings.clone(), task: Some(task), space: Some(space.clone()), robot: None };
            let config = env.resolve()?;
            if setups.iter().any(|other| same_setup(other, &config)) {
                return Err(bad(format!("{} with {space} is asked for twice", task.as_str())));
            }
            setups.push(config);
        }
        Ok(setups)
    }
}

/// Those of the first seed of each group of runs.
fn of_sweep(path: &Path) -> Result<Vec<RunConfig>> {
    let mut setups: Vec<RunConfig> = vec![];
    for run in sweep::read(path)?.runs {
        if !setups.iter().any(|other| same_setup(other, &run)) {
            setups.push(run);
        }
    }
    Ok(setups)
}

fn same_setup(one: &RunConfig, other: &RunConfig) -> bool {
    let name = |config: &RunConfig| RunId { seed: 0, ..RunId::of(config) };
    name(one) == name(other)
}

impl Row {
    fn label(&self) -> String {
        label(&self.space, &self.variant)
    }

    fn number(&self, name: &str) -> f64 {
        let cell = self.numbers.iter().find(|(known, _)| *known == name).map(|(_, cell)| *cell);
        cell.and_then(Cell::number).unwrap_or(f64::NAN)
    }
}

/// A panel per task, a line of it per row, the first one on top.
fn panels(rows: &[Row]) -> Vec<Panel> {
    let of_task = |task: TaskName| -> Vec<&Row> { rows.iter().filter(|row| row.task == task.as_str()).rev().collect() };
    let tasks = TaskName::all().into_iter().map(|task| (task, of_task(task))).filter(|(_, rows)| !rows.is_empty());
    let dot = |(at, row): (usize, &&Row)| Series {
        label: row.space.clone(),
        dots: vec![(row.number("energy_per_action_j"), at as f64 + 1.0)],
        ..Series::default()
    };
    let panel = |(task, rows): (TaskName, Vec<&Row>)| Panel {
        title: Section { experiment: "", task: task.as_str() }.title(),
        x_label: "J per action".into(),
        series: rows.iter().enumerate().map(dot).collect(),
        rows: rows.iter().map(|row| row.label()).collect(),
        logarithmic: true,
        ..Panel::default()
    };
    tasks.map(panel).collect()
}

fn play(config: &RunConfig, who: Who, episodes: u32) -> Result<Row> {
    let mut env = Env::new(config.env.clone(), 0)?;
    let rule = config.env.force_penalty;
    let mut policy = if who == Who::Expert { Policy::Expert } else { Policy::random(config.seed) };
    let (mut net_absolute, mut excess, mut over_at_the_end, mut overlap) = (0.0, 0.0, 0, 0.0f64);
    let outcomes: Vec<Outcome> = (0..episodes)
        .map(|index| {
            let on_step = |_: &Env, step: &Step| {
                net_absolute += step.interval.energy.net_absolute;
                excess += (step.interval.force(rule.of).max - rule.limit).max(0.0);
                overlap = overlap.max(step.interval.overlap);
                over_at_the_end += usize::from(step.interval.hand.last > rule.limit);
                ControlFlow::Continue(())
            };
            tasks::play(&mut env, |env| policy.act(env), evaluation_seed(index), on_step).outcome()
        })
        .collect();
    let values = |name: &str| outcomes.iter().filter_map(|outcome| outcome.number(name)).collect::<Vec<f64>>();
    let (actions, penalised): (f64, f64) = (values("length").iter().sum(), values("penalised_steps").iter().sum());
    let told = |(column, number): (&'static Column, &'static RunNumber)| {
        (number.name, statistic(number.how, &values(column.name), actions))
    };
    let mut numbers: Vec<_> = run_numbers(Over::Baseline).map(told).collect();
    numbers.extend([
        ("energy_net_absolute_per_action_j", Cell::Real(net_absolute / actions)),
        ("over_limit_read_once_share", Cell::Real(over_at_the_end as f64 / actions)),
        ("mean_excess_n", (penalised > 0.0).then_some(excess / penalised).into()),
        ("deepest_overlap_mm", Cell::Real(1000.0 * overlap)),
    ]);
    Ok(Row {
        task: config.env.task.as_str(),
        space: config.env.space.name.clone(),
        variant: config.variant.clone(),
        policy: policy.name(),
        position_step_m: config.env.space.step(&config.env.controller, 0),
        rotation_step_rad: config.env.space.step(&config.env.controller, 3),
        episodes,
        numbers,
        commit: output::commit(),
    })
}
