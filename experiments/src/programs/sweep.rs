//! Many runs from one file: `sweep experiments/configs/study/table-1.toml`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use crate::config::sweep::{self, Sweep};
use crate::config::{RunConfig, RunId, cli};
use crate::report::search::{self, Candidate};
use crate::report::train_and_draw::{make_up_curves, train_and_draw};
use crate::run::csv_table::CsvTable;
use crate::run::folder::{Busy, RunFolder, State};
use crate::run::place::Place;
use crate::run::pool::{self, Ended, Job, Pool};
use crate::run::stop::Stop;
use crate::run::train::RunOptions;
use anyhow::{Context, Result, anyhow};
use clap::Parser;
use output::file;
use output::program::{self, bad};

/// Train every run of a sweep, several at a time, each a process with one thread.
///
/// Runs that are done are skipped, runs that were stopped or killed go on where they saved themselves, a run that fails
/// hides no other: it is named at the end, and the exit code is 3. Ctrl-C or SIGTERM lets running ones save themselves
/// and exits with 75. The same command continues. Runs at which another process is at work are left to it; the exit code
/// is 75 then, as it is if a run was killed.
///
/// A file with `halving` is a search: after each of those numbers of actions the better half of the candidates of each task
/// and action space goes on; a candidate whose run fails is ranked last. Their ranks are written to search.csv. A run that was killed has not failed: the
/// search stops there, and the same command goes on with it.
#[derive(Parser)]
#[command(name = "sweep", version = output::VERSION, after_help = "Example: sweep experiments/configs/study/table-1.toml --list")]
pub struct Arguments {
    /// TOML file with groups of tasks, spaces, seeds and settings that vary
    file: PathBuf,
    /// Folder of the experiment (default: runs/ and the sweep's name, which is the file's unless it says another)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the runs and train nothing
    #[arg(long, conflicts_with = "index")]
    list: bool,
    /// Train only this run of the list, in this process: what a scheduler calls; 75 if another process is at work on it
    #[arg(long, value_name = "N")]
    index: Option<usize>,
    /// With --index: train so many actions instead of those of the file, as a search does that halves its candidates
    #[arg(long, value_name = "N", requires = "index", value_parser = cli::parse_steps)]
    steps: Option<u64>,
    /// With --index: the hash of the run that is meant, of the sweep that asks for it
    #[arg(long, value_name = "HASH", requires = "index", hide = true)]
    expect: Option<String>,
    /// Runs at the same time (default: one per processor core)
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "index")]
    jobs: Option<u16>,
    /// Ask a run to save itself after so many minutes, and kill it if it has not a minute later; the same command goes on with it
    #[arg(long, value_name = "MINUTES", value_parser = cli::parse_minutes, conflicts_with = "index")]
    limit: Option<Duration>,
    /// Write TensorBoard's event files into the run folders as well
    #[arg(long)]
    tensorboard: bool,
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If the file is no sweep, or the folder cannot be written. A run that fails is told by the exit code.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let stop = Stop::on_signals()?;
    let Sweep { name, mut runs, halving } = sweep::read(&arguments.file)?;
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(name));
    if arguments.list {
        if !halving.is_empty() {
            program::tell(format_args!("a search: half of the candidates end after {halving:?} actions"));
        }
        return list(&runs, &out);
    }
    if arguments.index.is_some() && arguments.steps.is_none() && !halving.is_empty() {
        return Err(bad(format!(
            "{}: a search: --index needs --steps, the actions of a round",
            arguments.file.display()
        )));
    }
    // A folder that cannot be made is an error of every run, so it is reported once, here.
    fs_err::create_dir_all(&out)?;
    if let Some(steps) = arguments.steps {
        runs.iter_mut().for_each(|run| run.steps = steps);
    }
    if let Some(index) = arguments.index {
        return train_one(arguments, &runs, index, &out, &stop);
    }

    tell_of_longer(&runs, &out);
    let runs: Vec<(usize, RunConfig)> = runs.into_iter().enumerate().collect();
    if !halving.is_empty() {
        return halve(arguments, &runs, &halving, &out, &stop);
    }
    let trained = train_all(arguments, &runs, &out, &stop)?;
    if trained.ending == ExitCode::SUCCESS {
        program::next("report", &[&out.to_string_lossy()]);
    }
    Ok(trained.ending)
}

/// Names the runs that were begun for more actions than the file says now.
fn tell_of_longer(runs: &[RunConfig], out: &Path) {
    for run in runs {
        let stored = RunConfig::resolve(Some(&RunFolder::below(out, run).config()), &[]);
        if let Some(steps) = stored.ok().map(|stored| stored.steps).filter(|&steps| steps > run.steps) {
            program::say(format_args!("{}: was begun for {steps} actions, not {}", RunId::of(run), run.steps));
        }
    }
}

/// Trains the candidates of a search in rounds. After each round the better half of them goes on.
fn halve(
    arguments: &Arguments,
    all: &[(usize, RunConfig)],
    rounds: &[u64],
    out: &Path,
    stop: &Stop,
) -> Result<ExitCode> {
    // The table is there from the beginning of the search on: `report` leaves out the runs of a folder that has one.
    let table = out.join("search.csv");
    if table.exists() {
        is_of_this_search(&table, all, out)?;
    } else {
        file::write_table(&table, &[] as &[Candidate])?;
    }
    let mut runs = all.to_vec();
    let (mut ranked, mut ending) = (vec![], ExitCode::SUCCESS);
    for &round in rounds.iter().chain([&all[0].1.steps]) {
        let shorter: Vec<_> = runs.iter().cloned().map(|(at, run)| (at, RunConfig { steps: round, ..run })).collect();
        has_no_longer_run(&shorter, out)?;
        program::say(format_args!("until {round} actions:"));
        let trained = train_all(arguments, &shorter, out, stop)?;
        if trained.killed {
            program::tell("a search ranks nobody whose run was killed: the same command goes on with it");
            return Ok(ExitCode::from(cli::STOPPED));
        } else if trained.ending == ExitCode::from(cli::SOME_FAILED) {
            ending = trained.ending; // A candidate whose run fails is ranked last, and the others go on.
        } else if trained.ending != ExitCode::SUCCESS {
            return Ok(trained.ending);
        }
        let of_round = search::rank(&configs(&runs), &configs(all), out, round)?;
        runs.retain(|(_, run)| search::goes_on(run, &of_round));
        ranked.extend(of_round);
        file::write_table(&table, &ranked)?;
    }
    program::say(format_args!("candidates, ranked: {}", table.display()));
    Ok(ending)
}

/// Fails if one of the runs of a round was begun for a longer round and has not come as far as this one ends: its
/// training would fail, and the candidate be ranked last.
fn has_no_longer_run(round: &[(usize, RunConfig)], out: &Path) -> Result<()> {
    for (_, run) in round {
        if let Some(begun) = RunFolder::below(out, run).begun_for_more(run) {
            let (id, now) = (RunId::of(run), run.steps);
            let what =
                format!("{id} was begun for a round of {begun} actions and is not done; the round has {now} now");
            return Err(anyhow!("{}: {what}: put the round back, or take another folder (--out)", out.display()));
        }
    }
    Ok(())
}

/// Fails unless every candidate that the table ranks is one of this search, drawn and set up as now: the ranks of
/// another search would be overwritten.
fn is_of_this_search(table: &Path, all: &[(usize, RunConfig)], out: &Path) -> Result<()> {
    let wrong = |task: &str, space: &str, variant: &str| {
        let table = table.display();
        anyhow!(
            "{table}: ranks {task} {space},{variant}, which is no candidate of this search: take another folder (--out)"
        )
    };
    let known: Vec<RunId> = all.iter().map(|(_, run)| RunId::of(run)).collect();
    let ranked = CsvTable::read(table)?;
    let [tasks, spaces, variants] = ["task", "space", "variant"].map(|name| ranked.column(name));
    for ((task, space), variant) in tasks?.into_iter().zip(spaces?).zip(variants?) {
        if !known.iter().any(|id| (&*id.task, &*id.space, &*id.variant) == (task, space, variant)) {
            return Err(wrong(task, space, variant));
        }
    }
    for (_, run) in all {
        let stored = RunFolder::below(out, run).config();
        if stored.exists() && RunConfig::resolve(Some(&stored), &[])?.hash() != run.hash() {
            let RunId { task, space, variant, .. } = RunId::of(run);
            return Err(wrong(&task, &space, &variant));
        }
    }
    Ok(())
}

/// Time that a run has to save a checkpoint after its limit, before it is killed.
const GRACE: Duration = Duration::from_secs(60);

fn configs(runs: &[(usize, RunConfig)]) -> Vec<&RunConfig> {
    runs.iter().map(|(_, run)| run).collect()
}

fn train_one(arguments: &Arguments, runs: &[RunConfig], index: usize, out: &Path, stop: &Stop) -> Result<ExitCode> {
    let last = runs.len() - 1;
    let run = runs.get(index).ok_or_else(|| bad(format!("--index {index}: the list goes from 0 to {last}")))?;
    if arguments.expect.as_ref().is_some_and(|meant| *meant != run.hash()) {
        return Err(bad(format!(
            "{}: was changed while the sweep was at work, run {index} is now {}: start the sweep again",
            arguments.file.display(),
            RunId::of(run)
        )));
    }
    let folder = RunFolder::below(out, run);
    if folder.state(run) == State::Done || folder.has_come_past(run) {
        program::say(format_args!("{}: done before", folder.path().display()));
        return Ok(ExitCode::SUCCESS);
    }
    let options = RunOptions { resume: true, tensorboard: arguments.tensorboard, quiet: false };
    match train_and_draw(run, out, options, stop) {
        // Not a failure: the run is left to the process that is at work on it, as in a whole sweep.
        Err(error) if error.is::<Busy>() => {
            program::tell(error);
            Ok(ExitCode::from(cli::STOPPED))
        }
        other => other,
    }
}

/// How the trainings of a sweep ended.
struct Trained {
    /// Exit code of the sweep if it ends here.
    ending: ExitCode,
    /// Whether a run was killed.
    killed: bool,
}

/// Trains what is not done yet, several at a time.
fn train_all(arguments: &Arguments, runs: &[(usize, RunConfig)], out: &Path, stop: &Stop) -> Result<Trained> {
    let place = Place::of(out, fs_err::File::open(out)?.file())?;
    let path = std::env::current_exe().context("the path of this program")?;
    let jobs = runs.iter().map(|(index, run)| (*index, run, RunFolder::below(out, run)));
    let (mut done, mut elsewhere) = (0, 0);
    let jobs = jobs.filter(|(_, run, folder)| match folder.state(run) {
        state if state == State::Done || folder.has_come_past(run) => {
            done += 1;
            make_up_curves(folder);
            false
        }
        State::Running => {
            elsewhere += 1;
            false
        }
        _ => true,
    });
    let jobs = jobs.map(|(index, run, folder)| {
        let mut command = program::again("sweep", &path);
        command.arg(&arguments.file).arg("--out").arg(out);
        command.args(["--index", &index.to_string(), "--steps", &run.steps.to_string(), "--expect", &run.hash()]);
        if arguments.tensorboard {
            command.arg("--tensorboard");
        }
        Job { name: RunId::of(run).to_string(), command, log: folder.path().join("log.txt") }
    });
    let jobs: Vec<Job> = jobs.collect();
    let busy = if elsewhere == 0 { String::new() } else { format!(", {elsewhere} at work in other processes") };
    program::say(format_args!("{} runs, {done} done before{busy}, in {}", runs.len(), out.display()));
    let parallel =
        arguments.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, Into::into), usize::from);
    program::outlive_readers();
    let ended = pool::run(jobs, &Pool { parallel, limit: arguments.limit, grace: GRACE, out: &place, stop });

    // A run that was killed has not failed: the same command goes on with it.
    let stopped = |job: &Ended| job.killed || job.code == Some(cli::STOPPED.into());
    let has_failed = |job: &Ended| job.code != Some(0) && !stopped(job);
    for job in ended.iter().filter(|job| job.killed || has_failed(job)) {
        let what = if job.killed { "killed" } else { "failed" };
        program::tell(format_args!("{what}: {}: {} ({})", job.name, job.words, job.log.display()));
    }
    let failed = ended.iter().filter(|job| has_failed(job)).count();
    let whole = done + ended.iter().filter(|job| job.code == Some(0)).count();
    program::result(format_args!("{whole} of {} runs done, {failed} failed", runs.len()));
    // Some runs are unfinished without having failed, so the sweep has to be called again: the sweep or one of its runs
    // was stopped, or another process is at work on some of them.
    let ending = if stop.requested() || elsewhere > 0 || ended.iter().any(stopped) {
        ExitCode::from(cli::STOPPED)
    } else if failed > 0 {
        ExitCode::from(cli::SOME_FAILED)
    } else {
        ExitCode::SUCCESS
    };
    Ok(Trained { ending, killed: ended.iter().any(|job| job.killed) })
}

fn list(runs: &[RunConfig], out: &Path) -> Result<ExitCode> {
    let ids: Vec<RunId> = runs.iter().map(RunId::of).collect();
    let width = ids.iter().map(|id| id.label().len()).max().unwrap_or(0).max("space".len());
    let mut text = format!("{:>5} {:<5} {:<width$} {:>5} {:<8} folder\n", "index", "task", "space", "seed", "state");
    for ((index, run), id) in runs.iter().enumerate().zip(&ids) {
        let folder = RunFolder::below(out, run);
        let state = format!("{:?}", folder.state(run)).to_lowercase();
        let (task, label, seed, folder) = (&id.task, id.label(), id.seed, folder.path().display());
        text += &format!("{index:>5} {task:<5} {label:<width$} {seed:>5} {state:<8} {folder}\n");
    }
    program::print(text)?;
    Ok(ExitCode::SUCCESS)
}
