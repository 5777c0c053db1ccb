//! AFORCE against low, mid and high stiffness on the same trials: figure 3 c, f.

use std::path::Path;

use aforce::ActionSpace;
use anyhow::Result;
use output::file;
use output::parallel;
use output::statistics::{deviation, mean};
use show::plot::{self, Panel, Series};
use tasks::Disturbance;

use crate::metrics::{METRICS, cell, column, measure, write_wipes};
use crate::setup::Setup;
use crate::spaces::HIGH;
use crate::trial::Trial;
use crate::{Run, simulate};

/// The metrics of every trial with every space.
pub struct Comparison {
    /// Names of the spaces.
    spaces: [String; 4],
    /// Values by space, trial and metric.
    values: [Vec<Vec<f64>>; 4],
}

impl Comparison {
    /// Wipes `trials` times with every space; all spaces have the same trials.
    ///
    /// # Errors
    /// If the configuration is not allowed.
    pub fn run(setup: &Setup, seed: u64, trials: u64) -> Result<Self> {
        let jobs: Vec<(&ActionSpace, Trial)> =
            setup.spaces.iter().flat_map(|s| (0..trials).map(move |i| (s, Trial::random(seed, i)))).collect();
        let wipe = |&(space, trial): &_| simulate(&Run { setup, space, trial, disturbance: Disturbance::default() });
        let rows = parallel::map(&jobs, |job| anyhow::Ok(measure(&wipe(job)?, setup.force)))?;
        let mut rows = rows.into_iter();
        Ok(Comparison {
            spaces: setup.spaces.each_ref().map(|space| space.name.clone()),
            values: [(); 4].map(|()| rows.by_ref().take(trials as usize).collect()),
        })
    }

    /// A metric in every trial with the space at `index`.
    ///
    /// # Panics
    /// If there is no such metric or space.
    pub fn values(&self, index: usize, metric: &str) -> Vec<f64> {
        self.values[index].iter().map(|row| row[column(metric)]).collect()
    }

    /// Writes `trials.csv`, `comparison.csv`, `comparison.svg`.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn write(&self, out: &Path) -> Result<()> {
        let trials = self.spaces.iter().zip(&self.values).flat_map(|(space, rows)| {
            rows.iter().enumerate().map(move |(trial, row)| ([space.clone(), trial.to_string()], row.to_vec()))
        });
        write_wipes(&out.join("trials.csv"), ["space", "trial"], trials)?;

        let mut table = csv::Writer::from_writer(vec![]);
        let header =
            ["metric", "space", "mean", "deviation", "minus_high_mean", "minus_high_deviation", "ratio_to_high"];
        table.write_record(header)?;
        for metric in METRICS.iter().map(|metric| metric.name) {
            let high = self.values(HIGH, metric);
            for (index, space) in self.spaces.iter().enumerate() {
                let values = self.values(index, metric);
                let differences: Vec<f64> = values.iter().zip(&high).map(|(value, high)| value - high).collect();
                let paired = [mean(&differences), deviation(&differences)];
                let numbers = [mean(&values), deviation(&values), paired[0], paired[1], mean(&values) / mean(&high)];
                table.write_record([metric.into(), space.clone()].into_iter().chain(numbers.map(cell)))?;
            }
        }
        file::replace(&out.join("comparison.csv"), &table.into_inner()?)?;
        plot::write("Stiffness and what it costs, 1 kHz", &self.panels(), &out.join("comparison"))
    }

    /// Panels in which every trial is a point over its stiffness.
    fn panels(&self) -> Vec<Panel> {
        let panel = |(title, unit, metric, scale): (&str, &str, &str, f64)| {
            let series = self.spaces.iter().enumerate().flat_map(|(index, space)| {
                let stiffness = self.values(index, "stiffness_n_per_m").into_iter();
                let points = stiffness.zip(self.values(index, metric)).map(move |(x, y)| vec![(x, scale * y)]);
                points.map(move |points| Series::new(space, points))
            });
            let x_label = "mean stiffness along the table (N/m)".into();
            Panel { title: title.into(), x_label, y_label: unit.into(), series: series.collect(), ..Panel::default() }
        };
        [
            ("Energy without gravity compensation", "J", "control_energy_absolute_j", 1.0),
            ("Energy of all of the torque", "J", "energy_absolute_j", 1.0),
            ("Tracking error: position", "mm", "position_error_mm", 1.0),
            ("Tracking error: quaternion difference", "", "quaternion_error", 1.0),
            ("Force error", "N", "force_error_n", 1.0),
            ("Paint left", "%", "paint_left", 100.0),
        ]
        .map(panel)
        .into()
    }
}
