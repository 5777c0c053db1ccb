//! Tables read back as numbers.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Result, bail, ensure};
use output::statistics::{mean, mean_of};
use tasks::columns::COLUMNS;

use crate::run::csv_table::CsvTable;
use crate::run::rows::SCHEMA;

/// A table as named columns of numbers; booleans are 0 and 1, empty cells are NaN.
#[derive(Debug, Clone)]
pub struct Columns(CsvTable);

impl Columns {
    /// Reads a CSV file, but for a last line that a killed process left incomplete.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read(path: &Path) -> Result<Self> {
        known(CsvTable::read(path)?).map(Columns)
    }

    /// The columns of a table.
    ///
    /// # Errors
    /// If the table has another schema.
    pub fn of(table: CsvTable) -> Result<Self> {
        known(table).map(Columns)
    }

    /// The rows of an `eval.csv` with `policy`, `mean` or `sampled`. A last evaluation of fewer than `episodes` episodes
    /// is left out: it is unfinished.
    ///
    /// # Errors
    /// If there is no such column.
    pub fn evaluations(self, policy: &str, episodes: usize) -> Result<Self> {
        let Columns(mut table) = self;
        table.keep("policy", policy)?;
        let steps = table.steps()?;
        let of_last = steps.iter().rev().take_while(|&step| Some(step) == steps.last()).count();
        if of_last < episodes {
            table.rows.truncate(steps.len() - of_last);
        }
        Ok(Columns(table))
    }

    /// The rows for each text in a column, the texts in the order in which they first occur.
    ///
    /// # Errors
    /// If there is no such column.
    pub fn by_text(&self, column: &str) -> Result<Vec<(String, Self)>> {
        let parts = self.0.clone().split(column)?;
        Ok(parts.into_iter().map(|(text, table)| (text, Columns(table))).collect())
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.0.rows.is_empty()
    }

    /// The values of a column, from the top; NaN where a cell is empty, and for an entry of [`COLUMNS`] that is newer than the table.
    ///
    /// # Errors
    /// If there is no such column, or a cell of it is no finite number.
    pub fn values(&self, column: &str) -> Result<Vec<f64>> {
        let number = |(row, cell): (usize, &str)| match number(cell) {
            Some(value) => Ok(value),
            None => bail!("{}: {column} is {cell:?}, not a number", self.0.place(row)),
        };
        if self.0.position(column).is_none() && COLUMNS.iter().any(|entry| entry.name == column) {
            return Ok(vec![f64::NAN; self.0.rows.len()]);
        }
        self.0.column(column)?.into_iter().enumerate().map(number).collect()
    }

    /// Pairs of step and value, of the rows that have a value.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn points(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        let points = self.values("step")?.into_iter().zip(self.values(column)?);
        Ok(points.filter(|point| !point.1.is_nan()).collect())
    }

    /// Mean of `window` rows at the step of the last of them, from the first full window on (of all rows if they are fewer).
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn running_mean(&self, column: &str, window: usize) -> Result<Vec<(f64, f64)>> {
        let points = self.points(column)?;
        let windows = points.windows(window.min(points.len()).max(1));
        Ok(windows.map(|w| (w[w.len() - 1].0, mean_of(w, |p| p.1))).collect())
    }

    /// Mean of the rows of each step.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn mean_by_step(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        Ok(by_step(self.points(column)?))
    }

    /// The rows after `step`.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn after(mut self, step: f64) -> Result<Self> {
        let mut late = self.values("step")?.into_iter().map(|at| at > step);
        self.0.rows.retain(|_| late.next().expect("one per row"));
        Ok(self)
    }

    /// Mean of a column over the rows that have a number; NaN if none has.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn mean(&self, column: &str) -> Result<f64> {
        Ok(mean_of(&self.points(column)?, |point| point.1))
    }

    /// The share of the episodes in which a real arm would have stopped itself; NaN if no row has `success_before_stop`.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn stopped_share(&self) -> Result<f64> {
        let known = self.points("success_before_stop")?.len();
        Ok(if known == 0 { f64::NAN } else { self.points("stop_time_s")?.len() as f64 / known as f64 })
    }

    /// The share of the episodes in which the task was first fulfilled before a force on the whole arm exceeded `limit`
    /// (N) or a joint its speed limit; NaN if no row has `success_before_stop`.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn success_within(&self, limit: f64) -> Result<f64> {
        let known = self.points("success_before_stop")?.len();
        // Both are NaN in an episode without success.
        let until_success = self.values("max_force_to_success_n")?.into_iter();
        let gentle = until_success
            .zip(self.values("max_joint_speed_share_to_success")?)
            .filter(|&(force, speed)| force <= limit && speed <= 1.0);
        Ok(if known == 0 { f64::NAN } else { gentle.count() as f64 / known as f64 })
    }

    /// Mean of the largest force (N) while the task is fulfilled, over the rows in which it is.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn fulfilled_max_force(&self) -> Result<f64> {
        let times = self.values("fulfilled_time_s")?.into_iter();
        let forces = times.zip(self.values("fulfilled_max_force_n")?).filter(|(time, _)| *time > 0.0);
        Ok(mean(&forces.map(|(_, force)| force).collect::<Vec<_>>()))
    }

    /// The share of the rows in which the task was fulfilled for the whole last second and was first fulfilled by the hand.
    ///
    /// # Errors
    /// As [`Columns::values`].
    pub fn success_by_hand(&self) -> Result<f64> {
        let held = self.values("success_held")?.into_iter();
        let by_hand =
            held.zip(self.values("success_without_hand")?).map(|(held, without_hand)| held * (1.0 - without_hand));
        // NaN where one of the two columns has no value.
        Ok(mean(&by_hand.filter(|share| !share.is_nan()).collect::<Vec<_>>()))
    }
}

/// The value of a cell: a finite number; 1 or 0 for a flag as this program, pandas or a spreadsheet writes it; NaN for an
/// empty cell. `None` for anything else.
pub(super) fn number(cell: &str) -> Option<f64> {
    match cell {
        "" => Some(f64::NAN),
        "true" | "True" | "TRUE" => Some(1.0),
        "false" | "False" | "FALSE" => Some(0.0),
        other => other.parse().ok().filter(|value: &f64| value.is_finite()),
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

/// The last commit whose programs read tables of schema 1 to 5.
const READS_EARLIER: &str = "d3b96bb";

/// The table, if its rows have the schema of this program.
fn known(table: CsvTable) -> Result<CsvTable> {
    let Some(at) = table.position("schema") else { return Ok(table) };
    for (row, cells) in table.rows.iter().enumerate() {
        let (place, schema) = (table.place(row), &cells[at]);
        ensure!(
            *schema == SCHEMA.to_string(),
            "{place}: schema {schema:?}; this program reads {SCHEMA}. Earlier tables are read at commit {READS_EARLIER}"
        );
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
        let rows = ["6,1,true,false", "6,1,true,true", "6,2,false,true", "6,2,false,false", "6,3,true,false"];
        fs_err::write(&path, format!("{header}\n{}\n", rows.join("\n"))).unwrap();
        let table = || Columns::read(&path).unwrap();
        assert_eq!(table().success_by_hand().unwrap(), 2.0 / 5.0);
        assert_eq!(table().after(1.0).unwrap().success_by_hand().unwrap(), 1.0 / 3.0);
        assert!(table().after(3.0).unwrap().success_by_hand().unwrap().is_nan());
        // A row that lacks one of the two values does not shift the other rows.
        fs_err::write(&path, format!("{header}\n6,1,,true\n6,1,true,false\n6,2,true,false\n")).unwrap();
        assert_eq!(table().success_by_hand().unwrap(), 1.0);
    }

    #[test]
    fn a_success_counts_within_a_force_if_no_joint_was_too_fast() {
        let of = |rows: &str| {
            let header = "step,success_before_stop,max_force_to_success_n,max_joint_speed_share_to_success";
            Columns(CsvTable::parse(Path::new("end.csv"), &format!("{header}\n{rows}")).unwrap())
        };
        let table = of("1,true,80,0.5\n1,false,150,0.9\n1,false,90,1.2\n1,false,,\n");
        let shares = [60.0, 100.0, 200.0].map(|limit| table.success_within(limit).unwrap());
        assert_eq!(shares, [0.0, 0.25, 0.5]);
        assert!(of("1,,80,\n").success_within(100.0).unwrap().is_nan(), "a table from before stops were recorded");
    }

    #[test]
    fn flags_may_be_written_as_pandas_and_spreadsheets_do_and_numbers_are_finite() {
        let values = |cells: &str| {
            let table = CsvTable::parse(Path::new("a.csv"), &format!("step,success\n{cells}")).unwrap();
            Columns(table).values("success")
        };
        assert_eq!(values("1,True\n2,FALSE\n3,true\n").unwrap(), [1.0, 0.0, 1.0]);
        for wrong in ["1e999", "inf", "NaN", "0,5"] {
            let told = values(&format!("1,true\n2,\"{wrong}\"\n")).unwrap_err().to_string();
            assert_eq!(told, format!("a.csv, line 3: success is {wrong:?}, not a number"));
        }
    }
}
