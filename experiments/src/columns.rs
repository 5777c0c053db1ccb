//! Tables read back as numbers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::config::RunConfig;
use crate::folder::RunFolder;
use crate::table::whole_lines;

/// A table as named columns of numbers; booleans are 0 and 1, text and empty cells are NaN.
pub struct Columns {
    path: PathBuf,
    headers: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    /// Reads a CSV file but for a last line that a kill left half-written.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs_err::read_to_string(path)?;
        Self::parse(path, whole_lines(&text)).with_context(|| path.display().to_string())
    }

    /// The evaluations of a run but for a last one that is under way or was cut short.
    ///
    /// # Errors
    /// If they, or the run's configuration, cannot be read.
    pub fn evaluations(run: &RunFolder) -> Result<Self> {
        let mut table = Self::read(&run.eval())?;
        let steps = table.values("step")?;
        let of_last = steps.iter().rev().take_while(|&&step| Some(&step) == steps.last()).count();
        let config = RunConfig::resolve(Some(&run.config()), &[])?;
        if of_last < config.evaluation_episodes as usize {
            table.rows.truncate(steps.len() - of_last);
        }
        Ok(table)
    }

    fn parse(path: &Path, text: &str) -> Result<Self> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let headers = reader.headers()?.iter().map(String::from).collect();
        let number = |text: &str| match text {
            "true" => 1.0,
            "false" => 0.0,
            other => other.parse().unwrap_or(f64::NAN),
        };
        let rows = reader.records().map(|r| Ok(r?.iter().map(number).collect())).collect::<Result<_>>()?;
        Ok(Columns { path: path.into(), headers, rows })
    }

    /// The values of a column, from the top; none of a table in which nothing has been written yet.
    ///
    /// # Errors
    /// If there is no such column; so for every method.
    pub fn values(&self, column: &str) -> Result<Vec<f64>> {
        if self.headers.is_empty() {
            return Ok(vec![]);
        }
        let index = self.headers.iter().position(|header| header == column);
        let index = index.with_context(|| format!("{}: no column {column:?}", self.path.display()))?;
        Ok(self.rows.iter().map(|row| row[index]).collect())
    }

    /// Pairs of step and value.
    pub fn points(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        Ok(self.values("step")?.into_iter().zip(self.values(column)?).collect())
    }

    /// Mean of `window` rows at the step of the last of them, from the first full window on (of all rows if they are fewer).
    pub fn running_mean(&self, column: &str, window: usize) -> Result<Vec<(f64, f64)>> {
        let points = self.points(column)?;
        let mean = |window: &[(f64, f64)]| window.iter().map(|p| p.1).sum::<f64>() / window.len() as f64;
        Ok(points.windows(window.min(points.len()).max(1)).map(|w| (w[w.len() - 1].0, mean(w))).collect())
    }

    /// Mean of the rows of each step.
    pub fn mean_by_step(&self, column: &str) -> Result<Vec<(f64, f64)>> {
        let mut by_step: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
        for (step, value) in self.points(column)? {
            let (sum, n) = by_step.entry(step as u64).or_default();
            *sum += value;
            *n += 1.0;
        }
        Ok(by_step.into_iter().map(|(step, (sum, n))| (step as f64, sum / n)).collect())
    }
}
