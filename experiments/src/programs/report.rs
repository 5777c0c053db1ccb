//! Makes tables and pictures from run folders.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::config::cli;
use crate::report::comparable::comparable;
use crate::report::comparison::{ComparisonRow, comparison};
use crate::report::curves;
use crate::report::derived::{Derived, derived};
use crate::report::disturbed::{DisturbedRow, disturbed, heat_map};
use crate::report::energy_ratio::energy_ratios;
use crate::report::groups::{Group, Section, groups, sections, summary};
use crate::report::markdown;
use crate::report::outside::is_outside;
use crate::report::over_tasks::{aggregates, profiles};
use crate::report::pooled::pooled;
use crate::report::reached::reached;
use crate::report::record::Record;
use crate::report::summary::{RunSummary, find_runs};
use crate::report::text;
use crate::report::tournament::TournamentRow;
use crate::report::verdicts::{NO_RUNS, VerdictRow, judge_all};
use anyhow::{Result, ensure};
use clap::Parser;
use output::{file, program};
use serde::Serialize;
use show::plot;

/// Summarise all runs below a folder.
///
/// Writes runs.csv (a row per run), summary.csv (each metric over seeds), comparison.csv (every space against aforce),
/// tournament.csv (what each run reached after 3, 6, 12 and 24 minutes of CPU time, where its tables tell that time),
/// reached.csv (actions until an evaluation returns 450, with runs that never come there), profiles.csv (the share of runs above each return),
/// aggregates.csv (interquartile means over robosuite's tasks of a space), robustness.csv (what disturbances cost, where `evaluate --disturb` left a disturbed.csv in the folders of runs) with a picture of it, with
/// --hypotheses verdicts.csv and pooled.csv (hypotheses judged one by one, and over experiments that ask the same),
/// tables.md (the paper's table of each experiment and task, beside what others published), in the folder of each experiment
/// curves_TASK (learning curves, at most four spaces in a panel); and NAME from every NAME.j2 in these folders: text
/// that people wrote, with figures from the tables, and from those that a derived.toml beside it asks for. Where the folder has an energy_ratio.toml, energy_ratio.csv and a plot of
/// it are the ratios of energy that it asks for. Runs are compared within the folder that holds their tasks: an
/// experiment. A sweep that is still going on is reported as far as it has come. A finished run that cannot be read is left
/// out and named, as is a disturbed.csv, and the exit code is 3. Curves of Stable-Baselines3 are read as well, from a folder TASK/SPACE,LEARNER/seed_N with an
/// evaluations.npz and perhaps a monitor.csv.
#[derive(Parser)]
#[command(name = "report", version = output::VERSION, after_help = "Example: report runs/table-1")]
pub struct Arguments {
    /// Folder with run folders somewhere below it
    runs: PathBuf,
    /// Where to write (default: the same folder)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// What was expected before the runs: writes verdicts.csv (repeatable; p is corrected within each task of a file)
    #[arg(long, value_name = "FILE")]
    hypotheses: Vec<PathBuf>,
    /// Only fill in the texts (NAME.j2) of this folder and those below it, but for folders that have a report of their own
    #[arg(long, conflicts_with_all = ["hypotheses"])]
    pages: bool,
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a file is wrong, no run is there, or a table cannot be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let root = &arguments.runs;
    let out = arguments.out.as_ref().unwrap_or(root);
    if arguments.pages {
        return pages(root, out);
    }
    let mut found = find(root)?;
    comparable(&found.runs, &found.rows)?;
    let groups = groups(&found.rows);
    let comparison = comparison(&groups);
    let (robustness, all_read) = robustness(&groups, &found);
    found.all_read &= all_read;
    let verdicts = verdicts(&arguments.hypotheses, out, &found.rows)?;
    let wanted_ratios = root.join("energy_ratio.toml");
    let (ratios, forest) =
        if wanted_ratios.exists() { energy_ratios(&wanted_ratios, &found.rows)? } else { <_>::default() };
    let timed = found.runs.iter().zip(&found.rows).map(|(run, row)| TournamentRow::of(run, row));
    let timed: Vec<_> = timed.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();

    let mut report = Report::new(out)?;
    report.table("runs.csv", &found.rows)?;
    report.table("summary.csv", &summary(&groups))?;
    report.table("comparison.csv", &comparison)?;
    report.table("tournament.csv", &timed)?;
    report.table("robustness.csv", &robustness)?;
    report.table("verdicts.csv", &verdicts)?;
    report.table("pooled.csv", &pooled(&verdicts))?;
    report.table("aggregates.csv", &aggregates(&groups))?;
    report.table("profiles.csv", &profiles(&groups))?;
    report.table("reached.csv", &reached(&groups))?;
    report.table("energy_ratio.csv", &ratios)?;
    report.picture("robustness", !robustness.is_empty(), |path| plot::write_heat_map(&heat_map(&robustness), path))?;
    report.picture("energy_ratio", !ratios.is_empty(), |path| plot::write_forest(&forest, path))?;
    let sections = sections(&groups);
    report.experiments(&found, &groups, &sections, &comparison)?;
    let derived = derived(root, out)?;
    for template in text::find_templates(root)? {
        let filled = out.join(template.strip_prefix(root)?).with_extension("");
        report.text(&template, filled, &found.rows, &comparison, &derived)?;
    }
    program::written(&report.written);
    program::result(format_args!(
        "{} runs in {} tables of a task, {} verdicts",
        found.rows.len(),
        sections.len(),
        verdicts.len()
    ));
    Ok(if found.all_read { ExitCode::SUCCESS } else { ExitCode::from(cli::SOME_FAILED) })
}

/// The runs below a folder, each with its numbers.
struct Found {
    runs: Vec<Record>,
    rows: Vec<RunSummary>,
    /// Whether every run that is done could be read.
    all_read: bool,
}

/// The runs that can be read. Prints the names of the others.
fn find(root: &Path) -> Result<Found> {
    let all = find_runs(root)?;
    ensure!(!all.is_empty(), "{}: no run folder below it that is not a search's (search.csv)", root.display());
    let mut found = Found { runs: vec![], rows: vec![], all_read: true };
    for run in all {
        let read = run.map_err(|(folder, reason)| {
            (folder.path().to_path_buf(), folder.done().exists() || is_outside(folder.path()), reason)
        });
        let summed_up = read.and_then(|run| match RunSummary::of(&run, root) {
            Ok(row) => Ok((run, row)),
            Err(reason) => Err((run.path, run.done, reason)),
        });
        match summed_up {
            Ok((run, row)) => {
                if !run.done {
                    program::tell(format_args!("{}: not done, {} steps so far", run.path.display(), row.env_steps));
                }
                found.rows.push(row);
                found.runs.push(run);
            }
            Err((path, done, reason)) => {
                program::tell(format_args!("left out: {}: {reason:#}", path.display()));
                found.all_read &= !done;
            }
        }
    }
    ensure!(!found.rows.is_empty(), "{}: no run has been evaluated yet", root.display());
    Ok(found)
}

/// What disturbances cost every group, and whether every table of them could be read.
fn robustness(groups: &[Group], found: &Found) -> (Vec<DisturbedRow>, bool) {
    let (mut rows, mut all_read) = (vec![], true);
    for group in groups {
        match disturbed(group, &found.runs, &found.rows) {
            Ok(of_group) => rows.extend(of_group),
            Err(reason) => {
                program::tell(format_args!("left out: {reason:#}"));
                all_read = false;
            }
        }
    }
    (rows, all_read)
}

/// The verdicts on the hypotheses in `files`. Prints the hypotheses that have no runs.
fn verdicts(files: &[PathBuf], out: &Path, rows: &[RunSummary]) -> Result<Vec<VerdictRow>> {
    let table = out.join("verdicts.csv");
    ensure!(
        !files.is_empty() || !table.exists(),
        "{}: would speak of earlier runs: name with --hypotheses what it was made from, or remove it; nothing was written",
        table.display()
    );
    let places = files.iter().map(|path| file::place(path)).collect::<Result<Vec<_>>>()?;
    for (at, file) in places.iter().enumerate() {
        ensure!(!places[..at].contains(file), "{}: its hypotheses are named twice", file.display());
    }
    let verdicts = judge_all(files, rows)?;
    for row in verdicts.iter().filter(|row| row.verdict == NO_RUNS) {
        let (name, task, space, against) = (&row.hypothesis, &row.task, &row.space, &row.against);
        program::tell(format_args!("no runs yet of {name:?}: {} {task}, {space} against {against}", row.experiment));
    }
    Ok(verdicts)
}

/// The tables of a report.
const TABLES: [&str; 11] = [
    "runs.csv",
    "summary.csv",
    "comparison.csv",
    "tournament.csv",
    "robustness.csv",
    "verdicts.csv",
    "pooled.csv",
    "aggregates.csv",
    "profiles.csv",
    "reached.csv",
    "energy_ratio.csv",
];

/// A report: its folder, and the files that were written.
struct Report<'a> {
    out: &'a Path,
    written: Vec<PathBuf>,
}

impl<'a> Report<'a> {
    /// A report in the folder `out`. Fails if a table of another program lies there under the name of one of the report's.
    fn new(out: &'a Path) -> Result<Self> {
        fs_err::create_dir_all(out)?;
        TABLES.iter().try_for_each(|name| is_ours(&out.join(name)))?;
        Ok(Report { out, written: vec![] })
    }

    /// Writes a table. If there are no rows, it removes an earlier table of this name, which would show other runs.
    fn table(&mut self, name: &str, rows: &[impl Serialize]) -> Result<()> {
        let table = self.out.join(name);
        match rows {
            [] if table.exists() => fs_err::remove_file(table)?,
            [] => {}
            rows => {
                file::write_table(&table, rows)?;
                self.written.push(table);
            }
        }
        Ok(())
    }

    /// Draws the picture of a table that has rows. Otherwise it removes an earlier picture, which would show other runs.
    fn picture(&mut self, name: &str, has_rows: bool, draw: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let path = self.out.join(name);
        let picture = path.with_extension("svg");
        if has_rows {
            draw(&path)?;
            self.written.push(picture);
        } else if picture.exists() {
            fs_err::remove_file(picture)?;
        }
        Ok(())
    }

    /// The tables and pictures of every experiment.
    fn experiments(
        &mut self,
        found: &Found,
        groups: &[Group],
        sections: &[Section],
        comparison: &[ComparisonRow],
    ) -> Result<()> {
        let mut tables = vec![];
        for section in sections {
            let of_section: Vec<_> =
                found.runs.iter().zip(&found.rows).filter(|(_, row)| Section::of(row) == *section).collect();
            tell_commits(section, of_section.iter().map(|(_, row)| row.commit.as_str()).collect());
            let out = self.out.join(section.experiment);
            fs_err::create_dir_all(&out)?;
            let mut pictures = vec![];
            for figure in curves::figures(&of_section)? {
                let curves = out.join(format!("curves_{}{}", section.task, figure.suffix));
                plot::write(&figure.title, &figure.panels, &curves)?;
                pictures.push(file::with_suffix(&curves, ".svg"));
            }
            let names: Vec<_> = pictures.iter().filter_map(|path| path.strip_prefix(self.out).ok()?.to_str()).collect();
            tables.push(markdown::tables(*section, groups, comparison, &names));
            self.written.extend(pictures);
        }
        let path = self.out.join("tables.md");
        self.forget_curves(&path)?;
        file::replace(&path, tables.join("\n").as_bytes())?;
        self.written.push(path);
        Ok(())
    }

    /// Removes the curves that an earlier report showed in the tables `at` and that were not drawn now: they would show other runs.
    ///
    /// # Errors
    /// If `report` did not write the file `at`, which is then not replaced.
    fn forget_curves(&self, at: &Path) -> Result<()> {
        if !at.exists() {
            return Ok(());
        }
        let earlier = fs_err::read_to_string(at).unwrap_or_default();
        let is_ours = earlier.starts_with("# ") && earlier.contains("\n| space |");
        ensure!(is_ours, "{}: not of report, and not replaced; move it away", at.display());
        let names = earlier.lines().filter_map(|line| line.strip_prefix("![Learning curves](")?.strip_suffix(')'));
        for picture in names.map(|name| at.with_file_name(name)) {
            if picture.exists() && !self.written.contains(&picture) {
                fs_err::remove_file(picture)?;
            }
        }
        Ok(())
    }

    /// Writes the text `filled` from its template.
    fn text(
        &mut self,
        template: &Path,
        filled: PathBuf,
        rows: &[RunSummary],
        comparison: &[ComparisonRow],
        derived: &Derived,
    ) -> Result<()> {
        file::prepare(&filled)?;
        file::replace(&filled, text::fill(template, &filled, rows, comparison, derived)?.as_bytes())?;
        self.written.push(filled);
        Ok(())
    }
}

/// Prints the commits if the runs of a table are of several.
fn tell_commits(section: &Section, mut commits: BTreeSet<&str>) {
    // The commit of another library's run is not known.
    commits.remove("");
    if commits.len() > 1 {
        let list = commits.into_iter().collect::<Vec<_>>().join(", ");
        program::tell(format_args!(
            "{} {}: runs of programs of several commits: {list}",
            section.experiment, section.task
        ));
    }
}

/// Fills in texts from existing tables.
fn pages(root: &Path, out: &Path) -> Result<ExitCode> {
    let mut report = Report { out, written: vec![] };
    let has_report =
        |folder: &Path| folder != root && folder.join("runs.csv").exists() && folder.join("summary.csv").exists();
    let is_ours = |file: &PathBuf| {
        let between = file.ancestors().skip(1).take_while(|folder| folder.starts_with(root));
        !between.into_iter().any(has_report)
    };
    let derived = derived(root, out)?;
    for template in text::find_templates(root)?.into_iter().filter(is_ours) {
        let filled = out.join(template.strip_prefix(root)?).with_extension("");
        report.text(&template, filled, &[], &[], &derived)?;
    }
    ensure!(!report.written.is_empty(), "{}: no NAME.j2 there or below", root.display());
    program::written(&report.written);
    Ok(ExitCode::SUCCESS)
}

/// Fails if `report` did not write the table: only an earlier report is replaced.
fn is_ours(table: &Path) -> Result<()> {
    let text = if table.exists() { fs_err::read_to_string(table)? } else { String::new() };
    let columns: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let ours =
        text.is_empty() || (columns.contains(&"task") || columns.contains(&"tasks")) && columns.contains(&"space");
    ensure!(ours, "{}: not a table of ours; nothing was overwritten: give another folder with --out", table.display());
    Ok(())
}
