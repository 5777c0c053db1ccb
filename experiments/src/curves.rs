//! The learning curves of one run, drawn from its tables.

use anyhow::Result;

use crate::columns::Columns;
use crate::folder::RunFolder;
use output::plot::{self, Panel, Series};

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
            Series {
                label: format!("training, mean of {WINDOW} episodes"),
                points: training.running_mean(column, WINDOW),
            },
            Series { label: "evaluation, mean action".into(), points: eval.mean_by_step(column) },
        ],
        ..Panel::default()
    };
    let panels = [
        panel("Return", "return", "return"),
        panel("Success at the end of an episode", "share of episodes", "success"),
        panel("Mechanical energy", "J per action", "energy_per_action_j"),
        panel("Stiffness, mean over time and axes", "1/s2 or N/m", "mean_stiffness"),
    ];
    plot::write(&panels, &folder.curves())
}
