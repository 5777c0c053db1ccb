//! What needs no learning: scripted experts and random actions in every action space.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use aforce::ActionSpace;
use anyhow::{Result, ensure};
use clap::{Parser, ValueEnum};
use experiments::config::RunConfig;
use experiments::config::cli::{self, SettingArgs};
use experiments::run::rollout::Policy;
use experiments::run::seeds::evaluation_seed;
use output::file;
use output::program::{self, bad};
use output::statistics::{deviation, mean_of};
use serde::Serialize;
use tasks::{Env, Outcome, Step, TaskName};

/// Play the evaluation episodes with the scripted expert or with random actions, and write a row per task and action
/// space. One thread per processor core, each with an environment of its own; the table does not depend on their number.
/// An episode takes about half a second of one core.
#[derive(Parser)]
#[command(version)]
struct Arguments {
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
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Who {
    Expert,
    Random,
}

#[derive(Serialize)]
struct Row {
    schema: u32,
    task: &'static str,
    space: String,
    policy: &'static str,
    position_step_m: f64,
    rotation_step_rad: f64,
    episodes: u32,
    success: f64,
    success_any: f64,
    success_held: f64,
    success_without_hand: f64,
    time_to_success_s: Option<f64>,
    energy_to_success_j: Option<f64>,
    max_force_to_success_n: Option<f64>,
    return_mean: f64,
    return_std: Option<f64>,
    energy_per_action_j: f64,
    energy_net_absolute_per_action_j: f64,
    penalised_episode_share: f64,
    penalised_action_share: f64,
    over_limit_read_once_share: f64,
    mean_excess_n: Option<f64>,
    penalty: f64,
    saturated_fraction: f64,
    diverged_episodes: usize,
    deepest_overlap_mm: f64,
    commit: String,
}

fn main() -> ExitCode {
    program::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let out = arguments.out.display();
    ensure!(!arguments.out.exists(), "{out}: exists; nothing was overwritten");
    let config = arguments.settings.resolve(None)?;
    let all = ActionSpace::built_in;
    let spaces = if arguments.spaces.is_empty() { all() } else { arguments.spaces.clone() };
    let tasks = if arguments.tasks.is_empty() { vec![config.env.task] } else { arguments.tasks.clone() };
    let pairs: Vec<_> = tasks.iter().flat_map(|&task| spaces.iter().map(move |space| (task, space))).collect();
    for (at, (task, space)) in pairs.iter().enumerate() {
        if pairs[..at].iter().any(|other| (other.0, &other.1.name) == (*task, &space.name)) {
            return Err(bad(format!("{} with {space} is asked for twice", task.as_str())));
        }
    }
    file::prepare(&arguments.out)?;
    let rows = output::parallel::map(&pairs, |&(task, space)| {
        let mut config = arguments.settings.resolve(Some(space))?;
        config.env.task = task;
        let row = play(&config, arguments.policy, arguments.episodes)?;
        println!("{} {space}: success {:.2}, return {:.1}", row.task, row.success, row.return_mean);
        Ok::<_, anyhow::Error>(row)
    })?;
    file::write_table(&arguments.out, &rows)?;
    program::written(&[&arguments.out]);
    Ok(ExitCode::SUCCESS)
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
    let sum = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).sum::<f64>();
    let mean = |of: fn(&Outcome) -> f64| mean_of(&outcomes, of);
    // Over the episodes that succeed.
    let if_any = |of: fn(&Outcome) -> Option<f64>| {
        let values: Vec<f64> = outcomes.iter().filter_map(of).collect();
        (!values.is_empty()).then(|| mean_of(&values, |&value| value))
    };
    let actions = sum(|o| o.length as f64);
    let penalised = sum(|o| o.penalised_steps as f64);
    let returns: Vec<f64> = outcomes.iter().map(|o| o.total).collect();
    Ok(Row {
        schema: 3,
        task: config.env.task.as_str(),
        space: config.env.space.name.clone(),
        policy: policy.name(),
        position_step_m: config.env.controller.position_step,
        rotation_step_rad: config.env.controller.rotation_step,
        episodes,
        success: mean(|o| f64::from(u8::from(o.success))),
        success_any: mean(|o| f64::from(u8::from(o.success_any))),
        success_held: mean(|o| f64::from(u8::from(o.success_held))),
        success_without_hand: mean(|o| f64::from(u8::from(o.success_without_hand))),
        time_to_success_s: if_any(|o| o.time_to_success_s),
        energy_to_success_j: if_any(|o| o.energy_to_success_j),
        max_force_to_success_n: if_any(|o| o.max_force_to_success_n),
        return_mean: mean(|o| o.total),
        return_std: (episodes > 1).then(|| deviation(&returns)),
        energy_per_action_j: sum(|o| o.energy_j) / actions,
        energy_net_absolute_per_action_j: net_absolute / actions,
        penalised_episode_share: mean(|o| f64::from(u8::from(o.penalised_steps > 0))),
        penalised_action_share: penalised / actions,
        over_limit_read_once_share: over_at_the_end as f64 / actions,
        mean_excess_n: (penalised > 0.0).then_some(excess / penalised),
        penalty: mean(|o| o.penalty),
        saturated_fraction: mean(|o| o.saturated_fraction),
        diverged_episodes: outcomes.iter().filter(|o| o.diverged).count(),
        deepest_overlap_mm: 1000.0 * overlap,
        commit: output::commit(),
    })
}
