//! Packs run folders into an archive per experiment.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::config::RunId;
use crate::report::archive;
use crate::report::columns::Columns;
use crate::report::outside::is_outside;
use crate::report::record::Record;
use crate::report::summary::{RunSummary, find_runs};
use crate::report::table::Table;
use crate::run::folder::RunFolder;
use crate::run::kept;
use crate::run::manifest::Manifest;
use crate::run::which::Which;
use anyhow::{Result, bail, ensure};
use clap::Parser;
use output::program::{self, bad};

/// Archive the runs below a folder: one compressed file per experiment and kind of table.
///
/// Writes OUT/EXPERIMENT/episodes.csv.zst, eval.csv.zst and others, with task, space, variant and seed as columns, and
/// runs.jsonl.zst, a line per run with its configuration and its manifest. `report` reads them as it reads run folders. Of every
/// group one policy is kept, that of the run whose energy per action (mean actions, last evaluations) is nearest to the
/// group's median: OUT/EXPERIMENT/TASK/SPACE/seed_N.zip, which `evaluate` and `replay` take as a run. Runs that are under way are left out. A run that the archive holds already
/// stays as it is there; only tables that the archive lacks are added to it, such as the episodes of a policy that was played later. New runs are added.
#[derive(Parser)]
#[command(name = "archive", version = output::VERSION, after_help = "Example: archive runs/table-1 --out results/table-1")]
pub struct Arguments {
    /// Folder with run folders somewhere below it
    runs: PathBuf,
    /// Where the archive lies or is to lie
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Which checkpoint of a run is kept, also in place of the other one: best, unless given. Where evaluations have few episodes, the best of
    /// them may be luck
    #[arg(long)]
    checkpoint: Option<Which>,
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a run cannot be read, or the archive not written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    lies_apart(&arguments.out, &arguments.runs)?;
    let mut experiments: BTreeMap<String, Vec<Record>> = BTreeMap::new();
    for found in find_runs(&arguments.runs)? {
        let outside = |path: &Path| {
            let place = path.display();
            program::tell(format_args!("left out: {place}: curves of another learner, which stay where they are"));
        };
        let record = match found {
            Ok(record) => record,
            Err((folder, _)) if is_outside(folder.path()) => {
                outside(folder.path());
                continue;
            }
            Err((folder, reason)) => return Err(reason.context(folder.path().display().to_string())),
        };
        if record.outside {
            outside(&record.path);
        } else if record.done {
            experiments.entry(record.experiment(&arguments.runs)).or_default().push(record);
        } else {
            program::tell(format_args!("left out: {}: not done", record.path.display()));
        }
    }
    ensure!(!experiments.is_empty(), "{}: no run below it that is done", arguments.runs.display());
    for (experiment, new) in experiments {
        each_once(&new)?;
        let folder = arguments.out.join(&experiment);
        let mut all = if archive::is_archive(&folder) { archive::read_listed(&folder)? } else { vec![] };
        let known: Vec<RunId> = all.iter().map(|record| RunId::of(&record.config)).collect();
        let (there, added): (Vec<_>, Vec<_>) =
            new.iter().cloned().partition(|record| known.contains(&RunId::of(&record.config)));
        for record in &there {
            let kept = all.iter_mut().find(|kept| RunId::of(&kept.config) == RunId::of(&record.config));
            let kept = kept.expect("known by its name");
            if made_by(kept) == made_by(record) {
                *kept = completed(kept, record, &folder)?;
            } else {
                tell_of_another(kept, record, &folder);
            }
        }
        for record in &added {
            can_be_summed_up(record, &folder)?;
        }
        all.extend(added.iter().cloned());
        let order = |record: &Record| {
            let RunId { task, space, variant, seed } = RunId::of(&record.config);
            (task, space, variant, seed)
        };
        all.sort_by_key(order);
        archive::write(&all, &folder)?;
        keep_policies(&all, &new, arguments.checkpoint, &folder)?;
        let (all, there) = (all.len(), there.len());
        program::result(format_args!(
            "{}: {all} runs, {} of them new, {there} known before",
            folder.display(),
            added.len()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Fails if the archive would lie below the runs: the next call would read it as runs.
fn lies_apart(out: &Path, runs: &Path) -> Result<()> {
    // If `out` does not exist yet, its nearest existing parent counts.
    let there = out.ancestors().find(|folder| folder.exists()).filter(|folder| !folder.as_os_str().is_empty());
    let [out_place, runs_place] = [there.unwrap_or(Path::new(".")), runs].map(fs_err::canonicalize);
    if runs.exists() && out_place?.starts_with(runs_place?) {
        let problem = format!("--out {}: lies in {}, whose runs are read", out.display(), runs.display());
        return Err(bad(problem + ": name a folder beside it"));
    }
    Ok(())
}

/// Fails if a run cannot be summarised: the archive would keep the damaged run for good.
fn can_be_summed_up(record: &Record, folder: &Path) -> Result<()> {
    RunSummary::of(record, folder)?;
    if let Some(played) = record.csv(Table::Disturbed)? {
        record.policies_of(Table::Disturbed, &Columns::of(played)?)?;
    }
    Ok(())
}

/// The archived run `kept`, with the tables that its run folder has and the archive lacks.
fn completed(kept: &Record, record: &Record, folder: &Path) -> Result<Record> {
    let (completed, added) = kept.with_tables_of(record)?;
    if !added.is_empty() {
        can_be_summed_up(&completed, folder)?;
    }
    for table in added {
        program::say(format_args!("added: {}", record.place(table)));
    }
    Ok(completed)
}

/// Prints that the archive `folder` holds another run of the same name as `record`, which stays as it is.
fn tell_of_another(kept: &Record, record: &Record, folder: &Path) {
    let [there, here] = [kept, record].map(|run| {
        let Record { config, manifest, .. } = run;
        let Manifest { commit, config_hash, started_unix_s, .. } = manifest;
        format!(
            "{} actions, commit {commit}, configuration {config_hash}, begun at {started_unix_s} s of Unix time",
            config.steps
        )
    });
    program::tell(format_args!(
        "not taken: {}: {} has the run already ({there}), here it is another ({here})",
        record.path.display(),
        folder.display()
    ));
}

/// Commit, configuration, length and start of a run. If a run was trained again or longer, one of them differs from those
/// of the archived run.
fn made_by(record: &Record) -> (&str, &str, u64, u64) {
    let Manifest { commit, config_hash, started_unix_s, .. } = &record.manifest;
    (commit, config_hash, record.config.steps, *started_unix_s)
}

/// Fails if a run is there twice, for example as a copy of its folder: an archive with both could not be read.
fn each_once(records: &[Record]) -> Result<()> {
    let mut places: Vec<(RunId, &Path)> = vec![];
    for record in records {
        let id = RunId::of(&record.config);
        if let Some((_, other)) = places.iter().find(|(known, _)| *known == id) {
            bail!("{} and {} are the same run, {id}; move one away", other.display(), record.path.display());
        }
        places.push((id, &record.path));
    }
    Ok(())
}

/// Keeps one policy per group, out of those of the runs `found` now and the one kept before: that of the run whose energy
/// is nearest to the group's median.
fn keep_policies(all: &[Record], found: &[Record], which: Option<Which>, folder: &Path) -> Result<()> {
    let mut groups: BTreeMap<(String, String), Vec<(&Record, f64)>> = BTreeMap::new();
    for record in all {
        let id = RunId::of(&record.config);
        let energy = RunSummary::of(record, folder)?.number("final_energy_per_action_j");
        groups.entry((id.task.clone(), id.label())).or_default().push((record, energy));
    }
    for ((task, label), runs) in groups {
        let mut energies: Vec<f64> = runs.iter().map(|(_, energy)| *energy).collect();
        energies.sort_by(f64::total_cmp);
        // For an even number of runs this is the lower of the two middle values, so that it is the value of a run.
        let median = energies[(energies.len() - 1) / 2];
        let group = folder.join(task).join(label);
        let place = |record: &Record| group.join(format!("seed_{}.zip", record.config.seed));
        for (record, _) in &runs {
            pack_folder(&place(record))?;
        }
        let is_it = |new: &&Record, record: &Record| {
            RunId::of(&new.config) == RunId::of(&record.config) && made_by(new) == made_by(record)
        };
        let new = |record: &Record| found.iter().find(|new| is_it(new, record) && archive::has_policy(new, which));
        let kept = |record: &Record| kept::is_whole(&place(record));
        let available = runs.iter().filter(|(record, _)| new(record).is_some() || kept(record));
        let nearest = available.min_by(|a, b| (a.1 - median).abs().total_cmp(&(b.1 - median).abs()));
        for (record, _) in runs.iter().filter(|(record, _)| place(record).is_file() && !kept(record)) {
            program::tell(format_args!("{}: is damaged: no policy can be read from it", place(record).display()));
        }
        let Some((record, _)) = nearest else { continue };
        let holds = |which: Which| kept::holds(&place(record), which);
        match new(record) {
            Some(new) if !kept(record) || which.is_some_and(|which| !holds(which)) => {
                archive::keep_policy(new, which, &place(record))?;
            }
            None if which.is_some_and(|which| !holds(which)) => program::tell(format_args!(
                "{}: keeps the other policy of its run, which is not below the folder that was named",
                place(record).display()
            )),
            _ => {}
        }
        for (other, _) in runs.iter().filter(|(other, _)| other.config.seed != record.config.seed) {
            if place(other).is_file() {
                fs_err::remove_file(place(other))?;
            }
        }
    }
    Ok(())
}

/// Earlier versions kept a policy as a folder, which this packs into the file `place`. A run's own folder, which has
/// tables, is left alone.
fn pack_folder(place: &Path) -> Result<()> {
    let folder = RunFolder::at(&place.with_extension(""));
    if folder.best().is_dir() && !folder.episodes().exists() {
        kept::pack(folder.path(), Which::Best, place)?;
        fs_err::remove_dir_all(folder.path())?;
    }
    Ok(())
}
