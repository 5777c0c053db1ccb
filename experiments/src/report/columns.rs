//! Tables read back as numbers.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Result, bail, ensure};
use output::statistics::{mean, mean_of, quantile};

use crate::config::RunConfig;
use crate::run::csv_table::CsvTable;
use crate::run::folder::RunFolder;
use crate::run::rows::{COLUMNS, SCHEMA};

/// A table as named columns of numbers; booleans are 0 and 1, empty cells are NaN.
pub struct Columns(CsvTable);

impl Columns {
    /// Reads a CSV file but for a last line that a kill left half-written.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read(path: &Path) -> Result<Self> {
        known(CsvTable::read(path)?).map(Columns)
    }

    /// The evaluations of a run with `policy`, `mean` or `sampled`, but for a last one that is under way or was cut short. Tables
    /// before schema 5 have mean actions only.
    ///
    /// # Errors
    /// If they, or the run's configuration, cannot be read.
    pub fn evaluations(run: &RunFolder, policy: &str) -> Result<Self> {
        let mut table = known(CsvTable::read(&run.eval())?)?;
        table.keep("policy", policy)?;
        let steps = table.steps()?;
        let of_last = steps.iter().rev().take_while(|&step| Some(step) == steps.last()).count();
        let config = RunConfig::resolve(Some(&run.config()), &[])?;
        if of_last < config.evaluation_episodes as usize {
            table.rows.truncate(steps.len() - of_last);
        }
        Ok(Columns(table))
    }

    /// The rows of a CSV file by what a column of it says, in the order in which that comes first.
    ///
    /// # Errors
    /// As [`Columns::read`], or if there is no such column.
    pub fn by_text(path: &Path, column: &str) -> Result<Vec<(String, Self)>> {
        let parts = known(CsvTable::read(path)?)?.split(column)?;
        Ok(parts.into_iter().map(|(text, table)| (text, Columns(table))).collect())
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.0.rows.is_empty()
    }

    /// The values of a column, from the top; NaN where it is a column of ours that the table is too old to have.
    ///
    /// # Errors
    /// If no table has such a column, or a cell of it is no finite number; so for every method.
    pub fn values(&self, column: &str) -> Result<Vec<f64>> {
        let number = |(row, cell): (usize, &str)| match cell {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            "" => Ok(f64::NAN),
            other => match other.parse() {
                Ok(value) if f64::is_finite(value) => Ok(value),
                _ => {
                    let line = self.0.rows[row].position().map_or(0, csv::Position::line);
                    bail!("{}, line {line}: {column} is {other:?}, not a number", self.0.path().display())
                }
            },
        };
        if self.0.position(column).is_none() && COLUMNS.iter().flatten().any(|known| known == column) {
            return Ok(vec![f64::NAN; self.0.rows.len()]);
        }
        self.0.column(column)?.into_iter().enumerate().map(number).collect()
    }

    /// Pairs of step and value, where there is one.
    pub fn points(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        let points = self.values("step")?.into_iter().zip(self.values(column)?);
        Ok(points.filter(|point| !point.1.is_nan()).collect())
    }

    /// Mean of `window` rows at the step of the last of them, from the first full window on (of all rows if they are fewer).
    pub fn running_mean(&self, column: &str, window: usize) -> Result<Vec<(f64, f64)>> {
        let points = self.points(column)?;
        let windows = points.windows(window.min(points.len()).max(1));
        Ok(windows.map(|w| (w[w.len() - 1].0, mean_of(w, |p| p.1))).collect())
    }

    /// Mean of the rows of each step.
    pub fn mean_by_step(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        Ok(by_step(self.points(column)?))
    }

    /// The rows after `step`.
    pub fn after(mut self, step: f64) -> Result<Self> {
        let mut late = self.values("step")?.into_iter().map(|at| at > step);
        self.0.rows.retain(|_| late.next().expect("one per row"));
        Ok(self)
    }

    /// Mean of the rows that have a number there; NaN if none has.
    pub fn mean(&self, column: &str) -> Result<f64> {
        Ok(mean_of(&self.points(column)?, |point| point.1))
    }

    /// What a `share` of the rows that have a number there does not exceed; NaN if none has.
    pub fn quantile(&self, column: &str, share: f64) -> Result<f64> {
        let values: Vec<f64> = self.points(column)?.into_iter().map(|point| point.1).collect();
        Ok(quantile(&values, share))
    }

    /// The share of the rows that have a number there; NaN if the table is too old to have the column.
    pub fn share_with(&self, column: &str) -> Result<f64> {
        if self.0.position(column).is_none() {
            return Ok(f64::NAN);
        }
        Ok(self.points(column)?.len() as f64 / self.0.rows.len() as f64)
    }

    /// Mean of the largest force (N) while the task stands fulfilled, over the rows in which it does.
    pub fn fulfilled_max_force(&self) -> Result<f64> {
        let times = self.values("fulfilled_time_s")?.into_iter();
        let forces = times.zip(self.values("fulfilled_max_force_n")?).filter(|(time, _)| *time > 0.0);
        Ok(mean(&forces.map(|(_, force)| force).collect::<Vec<_>>()))
    }

    /// The share of the rows with the task fulfilled for the whole last second and first fulfilled with the hand.
    pub fn success_by_hand(&self) -> Result<f64> {
        let held = self.points("success_held")?.into_iter();
        let rows: Vec<_> = held.zip(self.points("success_without_hand")?).collect();
        Ok(mean_of(&rows, |((_, held), (_, without_hand))| held * (1.0 - without_hand)))
    }
}

/// Mean of the points of each step.
fn by_step(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for (step, value) in points {
        let (sum, n) = sums.entry(step as u64).or_default();
        *sum += value;
        *n += 1.0;
    }
    sums.into_iter().map(|(step, (sum, n))| (step as f64, sum / n)).collect()
}

/// The table, if its columns mean what this program knows: early tables do not tell their schema.
fn known(table: CsvTable) -> Result<CsvTable> {
    let Some(at) = table.position("schema") else { return Ok(table) };
    for (row, cells) in table.rows.iter().enumerate() {
        let known = cells[at].parse().is_ok_and(|schema: u32| (1..=SCHEMA).contains(&schema));
        let (path, line, schema) = (table.path().display(), row + 2, &cells[at]);
        ensure!(known, "{path}, line {line}: schema {schema:?}; this program reads 1 to {SCHEMA}");
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_door_opened_by_the_hand_and_held_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("eval.csv");
        let header = "schema,step,success_held,success_without_hand";
        let rows = ["5,1,true,false", "5,1,true,true", "5,2,false,true", "5,2,false,false", "5,3,true,false"];
        fs_err::write(&path, format!("{header}\n{}\n", rows.join("\n"))).unwrap();
        let table = || Columns::read(&path).unwrap();
        assert_eq!(table().success_by_hand().unwrap(), 2.0 / 5.0);
        assert_eq!(table().after(1.0).unwrap().success_by_hand().unwrap(), 1.0 / 3.0);
        assert!(table().after(3.0).unwrap().success_by_hand().unwrap().is_nan());
    }
}
