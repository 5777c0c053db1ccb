//! Plays episodes in many set-ups without learning: scripted experts, random actions and trained policies.

mod map;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::config::cli::{self, EnvArgs, SettingArgs};
use crate::config::{RunConfig, RunId, label, sweep};
use crate::report::groups::Section;
use crate::report::run_tables::statistic;
use crate::run::csv_writer::{DIGITS, rounded};
use crate::run::packed;
use crate::run::rollout::Policy;
use crate::run::rows::SCHEMA;
use crate::run::seeds::evaluation_seed;
use crate::run::source::Trained;
use crate::run::which::Which;
use aforce::{ActionSpace, DeltaSign};
use anyhow::{Context, Result, ensure};
use clap::Parser;
use output::file;
use output::program::{self, bad};
use sac::Act;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use show::plot::{self, Panel, Series};
use tasks::columns::{Cell, Column, Over, RunNumber, run_numbers};
use tasks::{Env, Outcome, Step, TaskName};

/// Play the evaluation episodes with the scripted expert, with random actions or with a trained policy, and write a row per
/// task and action space. One thread per processor core, each with an environment of its own; the table does not depend on their number.
/// An episode takes about half a second of one core.
#[derive(Parser)]
#[command(name = "baselines", version = output::VERSION, after_help = "Example: baselines random --tasks lift,wipe --out random.csv")]
pub struct Arguments {
    /// Who plays: expert, random, or the folder of a run (or the .zip in which `archive` kept its policy), whose policy
    /// plays with mean actions, in those set-ups of --sweep that have its task and the name of its space
    #[arg(value_parser = Who::parse)]
    policy: Who,
    /// Which of a run's checkpoints [default: best, or the one that a .zip has]
    #[arg(long)]
    checkpoint: Option<Which>,
    /// Where the table goes, compressed if the name ends in .zst; must not exist
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
    /// Joules per action, a dot per row, in FILE.svg, which must not exist
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// For rows of the adaptive law: success before a stop and energy by lowest stiffness, tolerance and sign of delta, in FILE.svg, which must not exist
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

#[derive(Debug, Clone, PartialEq)]
enum Who {
    Expert,
    Random,
    Run(PathBuf),
}

impl Who {
    fn parse(word: &str) -> Result<Self, String> {
        match word {
            "expert" => Ok(Who::Expert),
            "random" => Ok(Who::Random),
            path if Path::new(path).exists() => Ok(Who::Run(path.into())),
            _ => Err("neither expert, random nor a run that is there".into()),
        }
    }
}

/// A row of the table: the set-up, numbers over its episodes (those with an entry in `tasks::columns`, and four more), and the commit.
struct Row {
    task: &'static str,
    space: String,
    variant: String,
    policy: &'static str,
    position_step_m: f64,
    rotation_step_rad: f64,
    /// `None` if the stiffness does not adapt.
    law: Option<Law>,
    episodes: u32,
    numbers: Vec<(&'static str, Cell)>,
    commit: String,
}

/// The parameters of the adaptive law that matter most.
#[derive(Clone, Copy)]
struct Law {
    k_min_n_per_m: f64,
    k_min_nm_per_rad: f64,
    tolerance_m: f64,
    tolerance_rad: f64,
    feedforward_spring_translation_n_per_m: f64,
    delta_s: f64,
    delta_sign: DeltaSign,
}

impl Law {
    /// The parameters along x and about x; `None` if the stiffness of the space does not adapt.
    fn of(space: &ActionSpace) -> Option<Self> {
        let psi = space.psi()?;
        let tolerance = psi.tolerance();
        Some(Law {
            k_min_n_per_m: psi.k_min[0],
            k_min_nm_per_rad: psi.k_min[3],
            tolerance_m: tolerance[0],
            tolerance_rad: tolerance[3],
            feedforward_spring_translation_n_per_m: psi.feedforward_spring()[0],
            delta_s: psi.delta[0],
            delta_sign: psi.delta_sign,
        })
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Row", 16 + self.numbers.len())?;
        row.serialize_field("schema", &SCHEMA)?;
        row.serialize_field("task", self.task)?;
        row.serialize_field("space", &self.space)?;
        row.serialize_field("variant", &self.variant)?;
        row.serialize_field("policy", self.policy)?;
        row.serialize_field("position_step_m", &self.position_step_m)?;
        row.serialize_field("rotation_step_rad", &self.rotation_step_rad)?;
        let law = self.law.as_ref();
        row.serialize_field("k_min_n_per_m", &law.map(|law| law.k_min_n_per_m))?;
        row.serialize_field("k_min_nm_per_rad", &law.map(|law| law.k_min_nm_per_rad))?;
        row.serialize_field("tolerance_m", &law.map(|law| law.tolerance_m))?;
        row.serialize_field("tolerance_rad", &law.map(|law| law.tolerance_rad))?;
        row.serialize_field(
            "feedforward_spring_translation_n_per_m",
            &law.map(|law| law.feedforward_spring_translation_n_per_m),
        )?;
        row.serialize_field("delta_s", &law.map(|law| law.delta_s))?;
        row.serialize_field("delta_sign", &law.map(|law| law.delta_sign))?;
        row.serialize_field("episodes", &self.episodes)?;
        self.numbers.iter().try_for_each(|(name, cell)| row.serialize_field(name, cell))?;
        row.serialize_field("commit", &self.commit)?;
        row.end()
    }
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a setting is wrong, or a file exists or cannot be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let stems = [&arguments.plot, &arguments.map].map(|path| path.as_deref().map(plot::without_picture_extension));
    let pictures = stems.each_ref().map(|stem| stem.as_ref().map(|stem| plot::files(stem)[0].clone()));
    let files: Vec<&PathBuf> = [&arguments.out].into_iter().chain(pictures.iter().flatten()).collect();
    for file in &files {
        ensure!(!file.exists(), "{}: exists; nothing was overwritten", file.display());
    }
    let trained = match &arguments.policy {
        Who::Run(path) => Some(Trained::open(path, arguments.checkpoint)?),
        Who::Expert | Who::Random if arguments.checkpoint.is_some() => {
            return Err(bad("--checkpoint: the expert and random actions have none".into()));
        }
        Who::Expert | Who::Random => None,
    };
    let mut setups = match &arguments.sweep {
        Some(path) => of_sweep(path)?,
        None => arguments.setups()?,
    };
    if let Some(run) = &trained {
        if arguments.sweep.is_none() {
            return Err(bad("a trained policy plays in the set-ups of a sweep: name it with --sweep".into()));
        }
        let of = |config: &RunConfig| (config.env.task, config.env.space.name.clone());
        setups.retain(|config| of(config) == of(&run.config));
        if setups.is_empty() {
            let RunId { task, space, .. } = RunId::of(&run.config);
            return Err(bad(format!("no set-up is {task} with {space}, for which the policy was trained")));
        }
    }
    files.iter().try_for_each(|path| file::prepare(path))?;
    let places = files.iter().map(|path| file::place(path)).collect::<Result<Vec<_>>>()?;
    if let Some((_, twice)) = places.iter().enumerate().find(|(at, place)| places[..*at].contains(place)) {
        return Err(bad(format!("{}: two of --out, --plot and --map would write it", twice.display())));
    }
    if arguments.map.is_some() && setups.iter().all(|config| config.env.space.psi().is_none()) {
        return Err(bad("--map: in none of these action spaces the stiffness adapts".into()));
    }
    // Every set-up is built once before the first episode is played, so that a wrong setting is an error at once.
    for config in &setups {
        Env::new(config.env.clone(), 0).with_context(|| RunId::of(config).to_string())?;
    }
    let rows = output::parallel::map(&setups, |config| {
        let row = play(config, &arguments.policy, trained.as_ref(), arguments.episodes)?;
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
    file::write_new(&arguments.out, &packed::packed(&arguments.out, file::table(&rows)?)?)?;
    let [dots, map] = &stems;
    if let Some(stem) = dots {
        plot::write(&format!("{} actions", rows[0].policy), &panels(&rows), stem)?;
    }
    if let Some(stem) = map {
        plot::write_heat_map(&map::map(&rows), stem)?;
    }
    program::written(&files);
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

/// The set-ups of a sweep: of runs that differ in their seed alone, the first.
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

/// A fraction with as many digits as in the tables of a run.
fn short(cell: Cell) -> Cell {
    match cell {
        Cell::Real(value) => Cell::Real(rounded(&format!("{value:?}"), DIGITS).parse().expect("a number")),
        other => other,
    }
}

/// A panel per task with a line per row of the table, the first row on top.
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

fn play(config: &RunConfig, who: &Who, trained: Option<&Trained>, episodes: u32) -> Result<Row> {
    let mut env = Env::new(config.env.clone(), 0)?;
    let rule = config.env.force_penalty;
    let mut policy = match trained {
        Some(run) => run.policy(&env, &RunId { seed: run.config.seed, ..RunId::of(config) }, Act::Mean)?.0,
        None if *who == Who::Expert => Policy::Expert,
        None => Policy::random(config.seed),
    };
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
        (number.name, short(statistic(number.how, &values(column.name), actions)))
    };
    let mut numbers: Vec<_> = run_numbers(Over::Baseline).map(told).collect();
    numbers.extend([
        ("energy_net_absolute_per_action_j", short(Cell::Real(net_absolute / actions))),
        ("over_limit_read_once_share", short(Cell::Real(over_at_the_end as f64 / actions))),
        ("mean_excess_n", short((penalised > 0.0).then_some(excess / penalised).into())),
        ("deepest_overlap_mm", short(Cell::Real(1000.0 * overlap))),
    ]);
    Ok(Row {
        task: config.env.task.as_str(),
        space: config.env.space.name.clone(),
        variant: config.variant.clone(),
        policy: policy.name(),
        position_step_m: config.env.space.step(&config.env.controller, 0),
        rotation_step_rad: config.env.space.step(&config.env.controller, 3),
        law: Law::of(&config.env.space),
        episodes,
        numbers,
        commit: output::commit(),
    })
}
