//! Tables read back as numbers.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};

/// A table as named columns of numbers; booleans are 0 and 1, text is NaN.
pub struct Columns {
    headers: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    /// Reads a CSV file.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read(path: &Path) -> Result<Self> {
        let mut reader = csv::Reader::from_path(path).with_context(|| path.display().to_string())?;
        let headers = reader.headers()?.iter().map(String::from).collect();
        let number = |text: &str| match text {
            "true" => 1.0,
            "false" => 0.0,
            other => other.parse().unwrap_or(f64::NAN),
        };
        let rows = reader.records().map(|r| Ok(r?.iter().map(number).collect())).collect::<Result<_>>()?;
        Ok(Columns { headers, rows })
    }

    /// The values of a column, from the top; none if there is no such column.
    pub fn values(&self, column: &str) -> Vec<f64> {
        let index = self.headers.iter().position(|h| h == column);
        index.map_or(vec![], |i| self.rows.iter().map(|row| row[i]).collect())
    }

    /// Pairs of thousands of steps and value.
    pub fn points(&self, column: &str) -> Vec<(f64, f64)> {
        self.values("step").into_iter().map(|step| step / 1000.0).zip(self.values(column)).collect()
    }

    /// Mean of the last `window` rows at every row, over thousands of steps.
    pub fn running_mean(&self, column: &str, window: usize) -> Vec<(f64, f64)> {
        let points = self.points(column);
        let mean = |window: &[(f64, f64)]| window.iter().map(|p| p.1).sum::<f64>() / window.len() as f64;
        points.windows(window.min(points.len()).max(1)).map(|w| (w[w.len() - 1].0, mean(w))).collect()
    }

    /// Mean of the rows of each step, over thousands of steps.
    pub fn mean_by_step(&self, column: &str) -> Vec<(f64, f64)> {
        let mut by_step: BTreeMap<u64, (f64, f64, f64)> = BTreeMap::new();
        for (x, y) in self.points(column) {
            let entry = by_step.entry((x * 1000.0) as u64).or_insert((x, 0.0, 0.0));
            entry.1 += y;
            entry.2 += 1.0;
        }
        by_step.into_values().map(|(x, sum, n)| (x, sum / n)).collect()
    }
}
