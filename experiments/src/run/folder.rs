//! The folder of one run: what lies where, and whether a run may write there.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use output::file;
use sac::Checkpoint;

use crate::config::{RunConfig, RunId};
use crate::run::csv_table::CsvTable;
use crate::run::csv_writer::last_step;
use crate::run::kept;
use crate::run::place::Place;

/// `OUT/TASK/SPACE/seed_N`, or `OUT/TASK/SPACE,VARIANT/seed_N`.
#[derive(Debug, Clone)]
pub struct RunFolder {
    path: PathBuf,
}

/// Keeps other processes out of a run folder until it is dropped, or the process dies.
#[derive(Debug)]
pub struct Lock {
    #[allow(dead_code, reason = "held, not read")]
    file: File,
    folder: PathBuf,
    place: Place,
}

impl Lock {
    /// Checks that the folder is still at the path where it was locked. The open tables move with a moved folder, and a
    /// checkpoint written to the old path would be separated from them.
    ///
    /// # Errors
    /// If the folder or its lock file was moved or deleted.
    pub fn holds(&self) -> Result<()> {
        ensure!(
            self.place.is_there(),
            "{}: the folder or its file `lock` was moved or deleted while the run was at work: nothing was saved since; put it back and go \
             on from its last checkpoint with --resume",
            self.folder.display()
        );
        Ok(())
    }
}

/// A folder in which another process is at work.
#[derive(Debug, thiserror::Error)]
#[error("{}: another process is at work there", .0.display())]
pub struct Busy(pub PathBuf);

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nothing there yet.
    New,
    /// Begun, but no process is at work.
    Begun,
    /// A process is at work.
    Running,
    /// All steps are done.
    Done,
}

impl RunFolder {
    /// The folder of `config` below `out`.
    pub fn below(out: &Path, config: &RunConfig) -> Self {
        let id = RunId::of(config);
        RunFolder { path: out.join(&id.task).join(id.label()).join(format!("seed_{}", id.seed)) }
    }

    /// The folder `path`, with or without a run.
    pub fn at(path: &Path) -> Self {
        RunFolder { path: path.into() }
    }

    /// A folder that holds a run.
    ///
    /// # Errors
    /// If the folder holds no configuration.
    pub fn open(path: &Path) -> Result<Self> {
        let folder = Self::at(path);
        if !folder.config().is_file() {
            let below = fs_err::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
            // Earlier versions kept a policy as a folder; it is now a zip file with the folder's name and `.zip`.
            let beside = Some(file::with_suffix(path, ".zip")).filter(|path| path.is_file());
            let playable = |path: &PathBuf| Self::at(path).config().is_file() || kept::is_kept(path);
            let hint = match below.chain(beside).filter(playable).min() {
                Some(run) => format!("; did you mean {}?", run.display()),
                None => String::new(),
            };
            bail!("{}: not a run folder, it has no config.toml{hint}", path.display());
        }
        Ok(folder)
    }

    /// Locks the folder for this process and the run `config`. Its files stay as they are until [`RunFolder::begin`].
    ///
    /// # Errors
    /// If the folder holds another run, or a run and `resume` is false; [`Busy`] if another process is at work there.
    pub fn prepare(&self, config: &RunConfig, resume: bool) -> Result<Lock> {
        let path = self.path.display();
        if self.config().exists() {
            if !resume {
                bail!("{path} already holds a run: continue it with --resume, or choose another --out");
            }
            let stored = RunConfig::resolve(Some(&self.config()), &[])?;
            if stored.hash() != config.hash() {
                bail!(
                    "{path} holds a run with another configuration ({}): resume it with the same settings, or choose another --out",
                    stored.difference(config).unwrap_or_default()
                );
            }
            ensure!(
                stored.steps <= config.steps,
                "{path} holds a run of {} steps: it can be continued to as many or more, not to {}",
                stored.steps,
                config.steps
            );
        } else {
            let nothing = !Checkpoint::exists(&self.checkpoint()) && last_step(&self.episodes())? == 0;
            ensure!(nothing, "{path} holds a run without its config.toml: put it back, or choose another --out");
        }
        fs_err::create_dir_all(&self.path)?;
        let file = fs_err::File::create(self.lock())?.into_parts().0;
        // [`RunFolder::state`] also takes the lock for a moment, so this tries again.
        let mut waits = 0..10;
        loop {
            match file.try_lock() {
                Ok(()) => break,
                Err(TryLockError::WouldBlock) if waits.next().is_some() => sleep(Duration::from_millis(10)),
                Err(TryLockError::WouldBlock) => return Err(Busy(self.path.clone()).into()),
                Err(TryLockError::Error(error)) => return Err(error).context(format!("{path}: cannot be locked")),
            }
        }
        self.can_go_on(config)?;
        let place = Place::of(&self.lock(), &file)?;
        Ok(Lock { file, folder: self.path.clone(), place })
    }

    /// Makes the folder hold this run, and removes the mark of a shorter run that had ended. Called when all that the run
    /// needs has been read, so that a run that cannot be resumed stays unchanged.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub fn begin(&self, config: &RunConfig) -> Result<()> {
        self.clear();
        if self.done().exists() {
            fs_err::remove_file(self.done())?;
        }
        file::replace(&self.config(), config.to_toml().as_bytes())
    }

    /// Removes the run's temporary files that a killed process left.
    fn clear(&self) {
        let own = ["config.toml", "manifest.json", "episodes.csv", "eval.csv", "progress.csv", "curves.", "DONE"];
        for file in fs_err::read_dir(&self.path).into_iter().flatten().flatten() {
            let name = file.file_name().to_string_lossy().into_owned();
            if name.ends_with(".tmp") && own.iter().any(|own| name.starts_with(own)) {
                // A file that cannot be removed does no harm.
                let _ = fs_err::remove_file(file.path());
            }
        }
    }

    /// How far the run `config` has come here.
    pub fn state(&self, config: &RunConfig) -> State {
        let held = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        if self.is_done(config) {
            State::Done
        } else if File::open(self.lock()).is_ok_and(held) {
            // There may be no configuration yet, because prior data is collected first.
            State::Running
        } else if !self.config().exists() {
            State::New
        } else {
            State::Begun
        }
    }

    /// Whether this run, and no other, ended after at least the steps of `config`.
    fn is_done(&self, config: &RunConfig) -> bool {
        let stored = RunConfig::resolve(Some(&self.config()), &[]);
        self.done().exists()
            && stored.is_ok_and(|stored| stored.steps >= config.steps && stored.hash() == config.hash())
    }

    /// Whether this run was extended to more steps than those of `config` and has passed these, though it may not have
    /// reached its new end.
    pub fn has_come_past(&self, config: &RunConfig) -> bool {
        let stored = RunConfig::resolve(Some(&self.config()), &[]);
        stored.is_ok_and(|stored| stored.steps > config.steps && stored.hash() == config.hash())
            // An episode's row is written after those of the evaluations within it.
            && last_step(&self.episodes()).is_ok_and(|step| step >= config.steps)
    }

    /// The steps for which this run was begun here, if they are more than those of `config` and the run was left before it
    /// came as far as these. It cannot end there: [`RunFolder::prepare`] refuses fewer steps than it was begun for.
    pub fn begun_for_more(&self, config: &RunConfig) -> Option<u64> {
        let stored = RunConfig::resolve(Some(&self.config()), &[]).ok()?;
        let is_longer = stored.steps > config.steps && stored.hash() == config.hash();
        let was_left = self.state(config) == State::Begun && !self.has_come_past(config);
        (is_longer && was_left).then_some(stored.steps)
    }

    /// Fails if the run's checkpoint was removed. Without a checkpoint a run begins anew and cuts off its tables, which
    /// is allowed only to a run that was killed before its first checkpoint. A checkpoint is saved at the end of an
    /// episode, after so many actions or minutes, whichever come first.
    fn can_go_on(&self, config: &RunConfig) -> Result<()> {
        if self.is_done(config) || Checkpoint::exists(&self.checkpoint()) {
            return Ok(());
        }
        let reached = last_step(&self.episodes())?;
        if reached == 0 && !self.done().exists() && last_step(&self.progress())? <= u64::from(config.env.horizon) {
            // No episode has ended yet, so there was no time for a checkpoint.
            return Ok(());
        }
        // The interval between checkpoints with which the run was begun counts: it may be resumed with another.
        let begun = RunConfig::resolve(self.config().exists().then_some(self.config()).as_deref(), &[])?;
        let before_the_first = reached <= begun.checkpoint_every + u64::from(config.env.horizon)
            && learned_for_s(&self.progress(), begun.learner.prior_episodes > 0)?
                <= 2.0 * 60.0 * begun.checkpoint_minutes;
        ensure!(
            !self.done().exists() && before_the_first,
            "{}: has {reached} actions in its tables and no checkpoints/last to go on from: train in another folder",
            self.path.display()
        );
        Ok(())
    }

    /// The file that the process at work locks.
    fn lock(&self) -> PathBuf {
        self.path.join("lock")
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The resolved configuration.
    pub fn config(&self) -> PathBuf {
        self.path.join("config.toml")
    }

    /// One row per training episode.
    pub fn episodes(&self) -> PathBuf {
        self.path.join("episodes.csv")
    }

    /// One row per evaluation episode.
    pub fn eval(&self) -> PathBuf {
        self.path.join("eval.csv")
    }

    /// Where `evaluate --disturb` may write its episodes under each of a grid of disturbances.
    pub fn disturbed(&self) -> PathBuf {
        self.path.join("disturbed.csv")
    }

    /// One row per logging interval.
    pub fn progress(&self) -> PathBuf {
        self.path.join("progress.csv")
    }

    /// Learning curves, without extension.
    pub fn curves(&self) -> PathBuf {
        self.path.join("curves")
    }

    /// The checkpoint from which the run continues.
    pub fn checkpoint(&self) -> PathBuf {
        self.path.join("checkpoints/last")
    }

    /// The networks of the best evaluation so far.
    pub fn best(&self) -> PathBuf {
        self.path.join("checkpoints/best")
    }

    /// Present once the run is complete.
    pub fn done(&self) -> PathBuf {
        self.path.join("DONE")
    }
}

/// Time (s) that a run had learned at the last row of `progress`, 0 without a row. After a script's episodes it counts
/// from the first row, because the script may have played for longer than the interval between checkpoints.
fn learned_for_s(progress: &Path, after_script: bool) -> Result<f64> {
    if !progress.exists() {
        return Ok(0.0);
    }
    let table = CsvTable::read(progress)?;
    let times = table.column("wall_s")?;
    let time = |cell: Option<&&str>| cell.and_then(|cell| cell.parse::<f64>().ok()).unwrap_or(0.0);
    let begun = if after_script { time(times.first()) } else { 0.0 };
    Ok(time(times.last()) - begun)
}
