//! One wipe over time: figure 3 a, b, d, e.

use std::path::Path;

use aforce::{Vector3, Vector6};
use anyhow::Result;
use show::plot::{self, Panel, Series};
use tasks::Disturbance;

use crate::record::{Record, SAMPLES_PER_ROW, Sample};
use crate::setup::Setup;
use crate::spaces::AFORCE;
use crate::trial::Trial;
use crate::{Run, simulate};

/// The figure ends here (s): three of eight rotations, which all look like the third. The table goes on.
const FIGURE_END: f64 = 12.0;

/// Runs the nominal trial with AFORCE and writes `evolution.csv`, `evolution.svg`.
///
/// # Errors
/// If the configuration is not allowed, or the files cannot be written.
pub fn write(setup: &Setup, out: &Path) -> Result<()> {
    let trial = Trial::nominal();
    let record = simulate(&Run { setup, space: &setup.spaces[AFORCE], trial, disturbance: Disturbance::default() })?;
    record.write_csv(&out.join("evolution.csv"))?;
    plot::write("One wipe over time, 1 kHz", &panels(&record, &trial, setup.force), &out.join("evolution"))
}

/// Label and value of a line.
type Curve<'a> = (&'a str, &'a dyn Fn(&Sample) -> f64);

fn panels(record: &Record, trial: &Trial, force: f64) -> Vec<Panel> {
    let shown = || record.samples.iter().step_by(SAMPLES_PER_ROW).take_while(|sample| sample.time <= FIGURE_END);
    let marks = [("contact", record.contact()), ("force reached", record.force_reached(force))];
    let marks: Vec<_> = marks.into_iter().filter_map(|(label, time)| Some((label.into(), time?))).collect();
    let panel = |title: &str, unit: &str, curves: &[Curve]| Panel {
        title: title.into(),
        x_label: "time (s)".into(),
        y_label: unit.into(),
        series: curves
            .iter()
            .map(|(label, of)| Series::new(*label, shown().map(|sample| (sample.time, of(sample))).collect()))
            .collect(),
        marks: marks.clone(),
        ..Panel::default()
    };
    let axes = |title: &str, unit: &str, of: &dyn Fn(&Sample) -> Vector3| {
        panel(title, unit, &[("x", &|s| of(s).x), ("y", &|s| of(s).y), ("z", &|s| of(s).z)])
    };
    let spot = Vector3::new(trial.spot[0], trial.spot[1], trial.height);
    vec![
        panel(
            "Normal force",
            "N",
            &[
                ("as estimated", &|s| s.measured_force),
                ("as simulated", &|s| s.force),
                ("desired", &|s| if s.engagement > 0.0 { force } else { 0.0 }),
            ],
        ),
        // Force control takes over a share of the contact axis.
        axes("Stiffness", "N/m", &|s| {
            translation(&s.stiffness).component_mul(&Vector3::new(1.0, 1.0, 1.0 - s.engagement))
        }),
        axes("Position relative to the spot", "mm", &|s| 1000.0 * (s.position - spot)),
        axes("Tracking error", "mm", &|s| 1000.0 * translation(&s.error)),
        axes("Feed-forward force", "N", &|s| translation(&s.feedforward)),
        panel(
            "Energy since circling began",
            "J",
            &[("all of the torque", &|s| s.energy), ("without gravity compensation", &|s| s.control_energy)],
        ),
    ]
}

/// The part of a vector for x, y and z.
fn translation(vector: &Vector6) -> Vector3 {
    vector.fixed_rows::<3>(0).into_owned()
}
