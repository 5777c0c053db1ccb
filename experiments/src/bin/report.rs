//! Run folders to tables and pictures.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;
use experiments::config::cli;
use experiments::report::comparable::comparable;
use experiments::report::comparison::comparison;
use experiments::report::curves;
use experiments::report::disturbed::disturbed;
use experiments::report::energy_ratio::energy_ratios;
use experiments::report::groups::{Section, groups, sections, summary};
use experiments::report::markdown;
use experiments::report::scatter;
use experiments::report::summary::{RunSummary, find_runs};
use experiments::report::text;
use experiments::report::tournament::TournamentRow;
use experiments::report::verdicts::{NO_RUNS, judge};
use output::{file, plot, program};
use serde::Serialize;

/// Summarise all runs below a folder.
///
/// Writes runs.csv (a row per run), summary.csv (each metric over seeds), comparison.csv (every space against aforce),
/// tournament.csv (what each run reached after 3, 6, 12 and 24 minutes of CPU time, where its tables tell that time),
/// robustness.csv (what disturbances cost, where `evaluate --disturb` left a disturbed.csv in the folders of runs),
/// and, in the folder of each experiment, tables_TASK.md (the paper's table, beside what others published), curves_TASK
/// (learning curves with every seed) and energy_return (a dot per run); and NAME from every NAME.j2 in these folders: text
/// that people wrote, with figures from the tables. Where the folder has an energy_ratio.toml, energy_ratio.csv and a plot of
/// it are the ratios of energy that it asks for. Runs are compared within the folder that holds their tasks: an
/// experiment. A sweep that is still going on is reported as far as it has come. A finished run that cannot be read is left
/// out and named, and the exit code is 3.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Folder with run folders somewhere below it
    runs: PathBuf,
    /// Where to write (default: the same folder)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What was expected before the runs: writes verdicts.csv (repeatable; each file is corrected by itself)
    #[arg(long, value_name = "FILE")]
    hypotheses: Vec<PathBuf>,
    /// Only fill in the texts (NAME.j2) of this folder and those below it, but for folders that have a report of their own
    #[arg(long, conflicts_with_all = ["hypotheses"])]
    pages: bool,
}

fn main() -> ExitCode {
    program::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    if arguments.pages {
        return pages(&arguments.runs, arguments.out.as_ref().unwrap_or(&arguments.runs));
    }
    let found = find_runs(&arguments.runs)?;
    ensure!(
        !found.is_empty(),
        "{}: no run folder below it that is not a search's (search.csv)",
        arguments.runs.display()
    );
    let out = arguments.out.as_ref().unwrap_or(&arguments.runs);
    fs_err::create_dir_all(out)?;

    let (mut runs, mut rows) = (vec![], vec![]);
    let mut ending = ExitCode::SUCCESS;
    for found in found {
        let read = found.map_err(|(folder, reason)| (folder.path().to_path_buf(), folder.done().exists(), reason));
        let summed_up = read.and_then(|run| match RunSummary::of(&run, &arguments.runs) {
            Ok(row) => Ok((run, row)),
            Err(reason) => Err((run.path, run.done, reason)),
        });
        match summed_up {
            Ok((run, row)) => {
                if !run.done {
                    program::tell(format_args!("{}: not done, {} steps so far", run.path.display(), row.env_steps));
                }
                rows.push(row);
                runs.push(run);
            }
            Err((path, done, reason)) => {
                program::tell(format_args!("left out: {}: {reason:#}", path.display()));
                if done {
                    ending = ExitCode::from(cli::SOME_FAILED);
                }
            }
        }
    }
    ensure!(!rows.is_empty(), "{}: no run has been evaluated yet", arguments.runs.display());
    comparable(&runs, &rows)?;
    let groups = groups(&rows);
    let (summary, comparison) = (summary(&groups), comparison(&groups));
    let timed = runs.iter().zip(&rows).map(|(run, row)| TournamentRow::of(run, row)).collect::<Result<Vec<_>>>()?;
    let timed: Vec<_> = timed.into_iter().flatten().collect();
    let mut robustness = vec![];
    for group in &groups {
        match disturbed(group, &runs, &rows) {
            Ok(of_group) => robustness.extend(of_group),
            Err(reason) => {
                program::tell(format_args!("left out: {reason:#}"));
                ending = ExitCode::from(cli::SOME_FAILED);
            }
        }
    }
    let verdicts_table = out.join("verdicts.csv");
    ensure!(
        !arguments.hypotheses.is_empty() || !verdicts_table.exists(),
        "{}: would speak of earlier runs: name with --hypotheses what it was made from, or remove it; nothing was written",
        verdicts_table.display()
    );
    let hypotheses = arguments.hypotheses.iter().map(|path| file::place(path)).collect::<Result<Vec<_>>>()?;
    for (at, file) in hypotheses.iter().enumerate() {
        ensure!(!hypotheses[..at].contains(file), "{}: its hypotheses are named twice", file.display());
    }
    let verdicts = arguments.hypotheses.iter().map(|file| judge(file, &rows)).collect::<Result<Vec<_>>>()?.concat();
    for row in verdicts.iter().filter(|row| row.verdict == NO_RUNS) {
        let (name, task, space, against) = (&row.hypothesis, &row.task, &row.space, &row.against);
        program::tell(format_args!("no runs yet of {name:?}: {} {task}, {space} against {against}", row.experiment));
    }
    let wanted_ratios = arguments.runs.join("energy_ratio.toml");
    let (ratios, forest) = if wanted_ratios.exists() { energy_ratios(&wanted_ratios, &rows)? } else { <_>::default() };
    let tables = [
        "runs.csv",
        "summary.csv",
        "comparison.csv",
        "tournament.csv",
        "robustness.csv",
        "verdicts.csv",
        "energy_ratio.csv",
    ];
    let tables = tables.map(|name| out.join(name));
    tables.iter().try_for_each(|table| is_ours(table))?;
    let [
        runs_table,
        summary_table,
        comparison_table,
        tournament_table,
        robustness_table,
        verdicts_table,
        energy_ratio_table,
    ] = &tables;
    write_or_remove(runs_table, &rows)?;
    write_or_remove(summary_table, &summary)?;
    write_or_remove(comparison_table, &comparison)?;
    write_or_remove(tournament_table, &timed)?;
    write_or_remove(robustness_table, &robustness)?;
    write_or_remove(verdicts_table, &verdicts)?;
    write_or_remove(energy_ratio_table, &ratios)?;
    let mut written: Vec<PathBuf> = tables.into_iter().filter(|table| table.exists()).collect();

    if !ratios.is_empty() {
        let picture = out.join("energy_ratio");
        plot::write_forest(&forest, &picture)?;
        written.push(picture.with_extension("svg"));
    }

    let sections = sections(&groups);
    for section in &sections {
        let of_section: Vec<_> = runs.iter().zip(&rows).filter(|(_, row)| Section::of(row) == *section).collect();
        let commits: BTreeSet<&str> = of_section.iter().map(|(_, row)| row.commit.as_str()).collect();
        if commits.len() > 1 {
            let list = commits.into_iter().collect::<Vec<_>>().join(", ");
            program::tell(format_args!(
                "{} {}: runs of programs of several commits: {list}",
                section.experiment, section.task
            ));
        }
        let out = out.join(section.experiment);
        fs_err::create_dir_all(&out)?;
        let curves = out.join(format!("curves_{}", section.task));
        plot::write(&section.name(), &curves::of_runs(&of_section)?, &curves)?;
        let tables = out.join(format!("tables_{}.md", section.task));
        file::replace(&tables, markdown::tables(*section, &groups, &comparison).as_bytes())?;
        written.extend([tables, curves.with_extension("svg")]);
    }
    for experiment in sections.iter().map(|section| section.experiment).collect::<BTreeSet<_>>() {
        let panels = scatter::energy_and_return(experiment, &sections, &groups);
        let dots = out.join(experiment).join("energy_return");
        plot::write(experiment, &panels, &dots)?;
        written.push(dots.with_extension("svg"));
    }
    for template in text::find_templates(&arguments.runs)? {
        let filled = out.join(template.strip_prefix(&arguments.runs)?).with_extension("");
        file::prepare(&filled)?;
        file::replace(&filled, text::fill(&template, &filled, &rows, &comparison)?.as_bytes())?;
        written.push(filled);
    }
    program::say(format_args!("{} runs in {} tables of a task", rows.len(), sections.len()));
    program::written(&written);
    Ok(ending)
}

/// Texts whose tables are there already.
fn pages(root: &Path, out: &Path) -> Result<ExitCode> {
    let mut written = vec![];
    for template in text::find_templates(root)? {
        let has_report =
            |folder: &Path| folder != root && folder.join("runs.csv").exists() && folder.join("summary.csv").exists();
        let between = template.ancestors().skip(1).take_while(|folder| folder.starts_with(root));
        if between.into_iter().any(has_report) {
            continue;
        }
        let filled = out.join(template.strip_prefix(root)?).with_extension("");
        file::prepare(&filled)?;
        file::replace(&filled, text::fill(&template, &filled, &[], &[])?.as_bytes())?;
        written.push(filled);
    }
    ensure!(!written.is_empty(), "{}: no NAME.j2 there or below", root.display());
    program::written(&written);
    Ok(ExitCode::SUCCESS)
}

/// A table without rows is none: an earlier one would speak of other runs.
fn write_or_remove(table: &Path, rows: &[impl Serialize]) -> Result<()> {
    match rows {
        [] if table.exists() => Ok(fs_err::remove_file(table)?),
        [] => Ok(()),
        rows => file::write_table(table, rows),
    }
}

/// An earlier report is replaced, somebody else's table is not.
fn is_ours(table: &Path) -> Result<()> {
    let text = if table.exists() { fs_err::read_to_string(table)? } else { String::new() };
    let columns: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let ours = text.is_empty() || columns.contains(&"task") && columns.contains(&"space");
    ensure!(ours, "{}: not a table of ours; nothing was overwritten: give another folder with --out", table.display());
    Ok(())
}
