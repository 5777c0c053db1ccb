//! What is measured of every wipe: the columns of the tables.

use std::path::Path;

use anyhow::Result;
use output::file;

use crate::record::{Outcome, Record};

/// One column.
pub(crate) struct Metric {
    /// Name with its unit.
    pub name: &'static str,
    /// Its value.
    pub of: fn(&Record, &Outcome) -> f64,
}

/// All metrics. First come energies while circling: of the whole torque, then without the compensation of gravity and Coriolis forces.
pub(crate) const METRICS: [Metric; 28] = {
    const fn metric(name: &'static str, of: fn(&Record, &Outcome) -> f64) -> Metric {
        Metric { name, of }
    }
    [
        metric("energy_absolute_j", |r, _| r.energy.absolute),
        metric("energy_positive_j", |r, _| r.energy.positive),
        metric("energy_net_j", |r, _| r.energy.net),
        metric("energy_net_absolute_j", |r, _| r.energy.net_absolute),
        metric("squared_torque_nm2s", |r, _| r.energy.squared_torque),
        metric("copper_loss_j", |r, _| r.energy.copper_loss),
        metric("control_energy_absolute_j", |r, _| r.control_energy.absolute),
        metric("control_energy_positive_j", |r, _| r.control_energy.positive),
        metric("control_energy_net_j", |r, _| r.control_energy.net),
        metric("control_energy_net_absolute_j", |r, _| r.control_energy.net_absolute),
        metric("control_squared_torque_nm2s", |r, _| r.control_energy.squared_torque),
        metric("control_copper_loss_j", |r, _| r.control_energy.copper_loss),
        metric("joint_loss_j", |r, _| r.losses.joints),
        metric("table_loss_j", |r, _| r.losses.table),
        metric("path_m", |_, o| o.path),
        metric("tracking_error", |_, o| o.position_error + o.quaternion_error),
        metric("position_error_mm", |_, o| 1000.0 * o.position_error),
        metric("quaternion_error", |_, o| o.quaternion_error),
        metric("force_error_n", |_, o| o.force_error),
        metric("measured_force_error_n", |_, o| o.measured_force_error),
        metric("force_held_share", |_, o| o.force_held),
        metric("force_max_n", |r, _| r.force_max),
        metric("contact_lost_share", |_, o| o.contact_lost),
        metric("force_reached_s", |_, o| o.force_reached.unwrap_or(f64::NAN)),
        metric("paint_left", |r, _| r.paint_left),
        metric("stiffness_n_per_m", |_, o| o.stiffness),
        metric("completed", |r, _| f64::from(u8::from(r.completed))),
        metric("ledger_gap", |r, _| r.ledger_gap()),
    ]
};

/// The value of every metric, in order; `force` is the desired one (N). An unfinished wipe has NaN for all but
/// `completed`, which is 0: half of the circles would seem to cost half of the energy.
pub(crate) fn measure(record: &Record, force: f64) -> Vec<f64> {
    let outcome = record.outcome(force);
    let counts = |metric: &Metric| record.completed || metric.name == "completed";
    METRICS.iter().map(|metric| if counts(metric) { (metric.of)(record, &outcome) } else { f64::NAN }).collect()
}

/// A number as it is written in the tables; empty if it is not finite.
pub(crate) fn cell(value: f64) -> String {
    match value {
        value if !value.is_finite() => String::new(),
        value if value != 0.0 && value.abs() < 1e-3 => format!("{value:.3e}"),
        value => format!("{value:.6}"),
    }
}

/// Writes a table with a row per wipe: the columns `keys`, which name the wipe, then every metric.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn write_wipes<const N: usize>(
    path: &Path,
    keys: [&str; N],
    rows: impl IntoIterator<Item = ([String; N], Vec<f64>)>,
) -> Result<()> {
    let mut table = csv::Writer::from_writer(vec![]);
    table.write_record(keys.into_iter().chain(METRICS.iter().map(|metric| metric.name)))?;
    for (keys, row) in rows {
        table.write_record(keys.into_iter().chain(row.into_iter().map(cell)))?;
    }
    file::replace(path, &table.into_inner()?)
}

/// Column of a metric.
///
/// # Panics
/// If there is none of this name.
pub(crate) fn column(name: &str) -> usize {
    METRICS.iter().position(|metric| metric.name == name).expect("a metric")
}
