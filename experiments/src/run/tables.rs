//! The tables of a run, up to the action of its checkpoint.

use anyhow::{Result, bail, ensure};
use tasks::Outcome;

use crate::config::{RunConfig, RunId};
use crate::run::csv_table::CsvTable;
use crate::run::csv_writer::{CsvWriter, DIGITS, cut_after, last_step, rounded, takes};
use crate::run::folder::RunFolder;
use crate::run::rows::{EvaluationKey, ProgressRow, TrainingKey};

/// The tables that a run writes.
pub(super) struct Tables {
    pub(super) episodes: CsvWriter,
    pub(super) eval: CsvWriter,
    pub(super) progress: CsvWriter,
}

impl Tables {
    /// Checks that the tables of `folder` have this program's columns and all rows up to `step`, at which the checkpoint
    /// had counted so many `episodes`.
    pub(super) fn can_go_on(folder: &RunFolder, config: &RunConfig, step: u64, episodes: u64) -> Result<()> {
        let table = folder.episodes();
        takes(&table, (TrainingKey::default(), Outcome::default()))?;
        takes(&folder.eval(), (EvaluationKey::default(), Outcome::default()))?;
        takes(&folder.progress(), ProgressRow::default())?;
        for table in [&table, &folder.eval()] {
            if table.exists() {
                of_run(&CsvTable::read(table)?, config)?;
            }
        }
        for (path, needed) in [(&table, step), (&folder.eval(), evaluated(config, step))] {
            let last = last_step(path)?;
            ensure!(
                last >= needed,
                "{}: ends at action {last}, the checkpoint is of {step}: rows are missing",
                path.display()
            );
        }
        let steps = if table.exists() { CsvTable::read(&table)?.steps()? } else { vec![] };
        let there = steps.into_iter().filter(|&at| at <= step).count() as u64;
        ensure!(
            there == episodes,
            "{}: {there} rows up to action {step}, the checkpoint has seen {episodes} episodes: rows were taken out or added",
            table.display()
        );
        Ok(())
    }

    /// Opens the tables of `folder` up to `step`. Later rows are cut off and will be written again.
    pub(super) fn going_on(folder: &RunFolder, config: &RunConfig, step: u64) -> Result<Self> {
        let open = |path, step| {
            cut_after(path, step)?;
            CsvWriter::append(path)
        };
        Ok(Tables {
            episodes: open(&folder.episodes(), step)?,
            eval: open(&folder.eval(), evaluated(config, step))?,
            progress: open(&folder.progress(), step)?,
        })
    }

    /// Waits until every row is on the disk.
    pub(super) fn sync(&self) -> Result<()> {
        [&self.episodes, &self.eval, &self.progress].into_iter().try_for_each(CsvWriter::sync)
    }
}

/// Checks that every row of a table is of this run, as far as its columns tell.
///
/// # Errors
/// If a row is of another run.
pub fn of_run(table: &CsvTable, config: &RunConfig) -> Result<()> {
    let RunId { task, space, seed, .. } = RunId::of(config);
    for (column, ours) in [("task", task), ("space", rounded(&space, DIGITS)), ("seed", seed.to_string())] {
        let Some(at) = table.position(column) else { continue };
        if let Some(other) = table.rows.iter().map(|row| &row[at]).find(|there| *there != ours) {
            bail!("{}: has rows of another run, with {column} {other}, not {ours}", table.path().display());
        }
    }
    Ok(())
}

/// The action of the last regular evaluation of a run that has come to `step`. The extra evaluation at the end of a short
/// run does not count.
fn evaluated(config: &RunConfig, step: u64) -> u64 {
    step / config.evaluate_every * config.evaluate_every
}
