//! One wipe over time: figure 3 a, b, d, e.

use std::path::Path;

use anyhow::Result;
use output::plot::{self, Panel, Series};

use crate::record::{Record, Sample};
use crate::setup::Setup;
use crate::trial::{Disturbance, Trial};
use crate::{Run, run, spaces};

/// Runs the nominal trial with AFORCE and writes `evolution.csv`, `evolution.svg`, `evolution.png`.
///
/// # Errors
/// If the configuration is not allowed or the disk does not take the files.
pub fn write(setup: &Setup, out: &Path) -> Result<()> {
    let [aforce, ..] = spaces();
    let record = run(&Run { setup, space: aforce, trial: Trial::nominal(), disturbance: Disturbance::NONE })?;
    record.write_csv(&out.join("evolution.csv"))?;
    plot::write(&panels(&record, setup), &out.join("evolution"))
}

fn panels(record: &Record, setup: &Setup) -> Vec<Panel> {
    let panel = |title: &str, unit: &str, curves: &[(&str, &dyn Fn(&Sample) -> f64)]| {
        let series = curves.iter().map(|(label, of)| Series {
            label: (*label).into(),
            points: record.samples.iter().step_by(10).map(|sample| (sample.time, of(sample))).collect(),
        });
        let mut panel =
            Panel { title: title.into(), x_label: "time (s)".into(), y_label: unit.into(), series: series.collect() };
        let marks = [("contact", record.contact()), ("force reached", record.force_reached(setup.force))];
        for (label, time) in marks {
            panel.series.extend(time.map(|time| mark(label, time, &panel)));
        }
        panel
    };
    vec![
        panel(
            "Normal force",
            "N",
            &[
                ("estimated", &|s| s.measured_force),
                ("contact", &|s| s.force),
                ("desired", &|s| {
                    if s.engagement > 0.0 { setup.force } else { 0.0 }
                }),
            ],
        ),
        panel(
            "Stiffness that acts",
            "N/m",
            &[
                ("x", &|s| s.stiffness[0]),
                ("y", &|s| s.stiffness[1]),
                ("z", &|s| s.stiffness[2] * (1.0 - s.engagement)),
            ],
        ),
        panel(
            "Position relative to the spot",
            "mm",
            &[
                ("x", &|s| 1000.0 * (s.position.x - Trial::nominal().spot[0])),
                ("y", &|s| 1000.0 * (s.position.y - Trial::nominal().spot[1])),
                ("z", &|s| 1000.0 * (s.position.z - Trial::nominal().height)),
            ],
        ),
        panel(
            "Tracking error",
            "mm",
            &[("x", &|s| 1000.0 * s.error[0]), ("y", &|s| 1000.0 * s.error[1]), ("z", &|s| 1000.0 * s.error[2])],
        ),
        panel(
            "Feed-forward force",
            "N",
            &[("x", &|s| s.feedforward[0]), ("y", &|s| s.feedforward[1]), ("z", &|s| s.feedforward[2])],
        ),
        panel(
            "Energy since circling began",
            "J",
            &[("all of the torque", &|s| s.energy), ("without gravity compensation", &|s| s.control_energy)],
        ),
    ]
}

/// A vertical line as high as the curves of `panel`.
fn mark(label: &str, time: f64, panel: &Panel) -> Series {
    let values = || panel.series.iter().flat_map(|series| &series.points).map(|point| point.1);
    let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    Series { label: label.into(), points: vec![(time, low), (time, high)] }
}
