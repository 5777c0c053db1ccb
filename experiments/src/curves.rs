//! The learning curves of one run, drawn from its tables.

use std::collections::BTreeMap;

use anyhow::{Context, Result};

use crate::folder::RunFolder;
use crate::plot::{self, Panel, Series};

/// Training episodes in the running mean.
const WINDOW: usize = 20;

/// Draws `curves.svg` and `curves.png` of a run.
///
/// # Errors
/// If a table cannot be read or a picture not written.
pub fn draw(folder: &RunFolder) -> Result<()> {
    let training = Columns::read(&folder.episodes())?;
    let eval = Columns::read(&folder.eval())?;
    let panel = |title: &str, y_label: &str, column: &str| Panel {
        title: title.into(),
        x_label: "environment steps (thousands)".into(),
        y_label: y_label.into(),
        series: vec![
            Series { label: format!("training, mean of {WINDOW} episodes"), points: training.running_mean(column) },
            Series { label: "evaluation, mean action".into(), points: eval.mean_by_step(column) },
        ],
    };
    let panels = [
        panel("Return", "return", "return"),
        panel("Success at the end of an episode", "share of episodes", "success"),
        panel("Mechanical energy", "J per action", "energy_per_action_j"),
        panel("Stiffness, mean over time and axes", "1/s2 or N/m", "mean_stiffness"),
    ];
    plot::write(&panels, &folder.curves())
}

/// A table as named columns of numbers; booleans are 0 and 1.
struct Columns {
    headers: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    fn read(path: &std::path::Path) -> Result<Self> {
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

    /// Pairs of thousands of steps and value.
    fn points(&self, column: &str) -> Vec<(f64, f64)> {
        let index = |name: &str| self.headers.iter().position(|h| h == name);
        let (Some(step), Some(value)) = (index("step"), index(column)) else {
            return vec![];
        };
        self.rows.iter().map(|row| (row[step] / 1000.0, row[value])).collect()
    }

    fn running_mean(&self, column: &str) -> Vec<(f64, f64)> {
        let points = self.points(column);
        let mean = |window: &[(f64, f64)]| window.iter().map(|p| p.1).sum::<f64>() / window.len() as f64;
        points.windows(WINDOW.min(points.len()).max(1)).map(|w| (w[w.len() - 1].0, mean(w))).collect()
    }

    fn mean_by_step(&self, column: &str) -> Vec<(f64, f64)> {
        let mut by_step: BTreeMap<u64, (f64, f64, f64)> = BTreeMap::new();
        for (x, y) in self.points(column) {
            let entry = by_step.entry((x * 1000.0) as u64).or_insert((x, 0.0, 0.0));
            entry.1 += y;
            entry.2 += 1.0;
        }
        by_step.into_values().map(|(x, sum, n)| (x, sum / n)).collect()
    }
}
