//! The same wipes under other conditions: disturbances that nobody knows of, and other settings.

use std::path::Path;

use aforce::{ActionSpace, Damping, DeltaSign, ImpedanceForm, Interpolation};
use anyhow::Result;
use output::parallel;
use output::statistics::mean;

use crate::metrics::{METRICS, cell, measure};
use crate::sensing::WrenchSource;
use crate::setup::Setup;
use crate::trial::{Disturbance, Trial};
use crate::{Run, simulate};

/// What is different.
pub struct Condition {
    name: &'static str,
    /// In arm, controller and sensing.
    change: fn(&mut Setup),
    /// In what none of them knows.
    disturbance: Disturbance,
}

/// What neither the script nor the controller's model knows.
pub fn disturbances() -> Vec<Condition> {
    fn exact(setup: &mut Setup) {
        setup.sensing.source = WrenchSource::Exact;
    }
    fn same(_: &mut Setup) {}
    let none = Disturbance::NONE;
    let payload = Disturbance { payload: 0.5, ..none };
    let table = |table_offset| Disturbance { table_offset, ..none };
    let late = |delay| Disturbance { delay, ..none };
    let condition = |name, disturbance| Condition { name, change: same, disturbance };
    vec![
        condition("none", none),
        Condition { name: "none; exact wrench", change: exact, disturbance: none },
        condition("table 3 cm lower", table(-0.03)),
        condition("table 1 cm higher", table(0.01)),
        condition("table 3 cm higher", table(0.03)),
        condition("friction doubled", Disturbance { friction: 2.0, ..none }),
        condition("payload 0.5 kg", payload),
        Condition { name: "payload 0.5 kg; exact wrench", change: exact, disturbance: payload },
        condition("wrench bias and noise x 4", Disturbance { wrench_error: 4.0, ..none }),
        condition("torque 1 ms late", late(0.001)),
        condition("torque 5 ms late", late(0.005)),
    ]
}

/// Settings on which the comparison may depend.
pub fn variants() -> Vec<Condition> {
    let condition = |name, change| Condition { name, change, disturbance: Disturbance::NONE };
    vec![
        condition("as compared", |_| ()),
        condition("set-points with all of the Panda's dynamics", all_dynamics),
        condition("D = 2 sqrt(K)", |setup| forms(setup, |form| form.damping = Damping::Literal)),
        condition("all dynamics, D = 2 sqrt(K)", |setup| {
            all_dynamics(setup);
            forms(setup, |form| form.damping = Damping::Literal);
        }),
        condition("damped against standstill", |setup| forms(setup, |form| form.reference_velocity = false)),
        condition("neither friction nor joint damping", |setup| setup.lossless = true),
    ]
}

/// Other parameters of the adaptive law.
pub fn laws() -> Vec<Condition> {
    let condition = |name, change| Condition { name, change, disturbance: Disturbance::NONE };
    vec![
        condition("as compared", |_| ()),
        condition("delta off", |setup| setup.controller.impedance.aforce.sign = DeltaSign::Off),
        condition("delta literal", |setup| setup.controller.impedance.aforce.sign = DeltaSign::Literal),
        condition("twice the tolerance", |setup| scale_tolerance(setup, 2.0)),
        condition("half the tolerance", |setup| scale_tolerance(setup, 0.5)),
    ]
}

fn all_dynamics(setup: &mut Setup) {
    setup.controller.interpolation = Interpolation::JerkLimited { dynamics: 1.0 };
}

fn scale_tolerance(setup: &mut Setup, factor: f64) {
    let law = &mut setup.controller.impedance.aforce;
    law.translation.tolerance *= factor;
    law.rotation.tolerance *= factor;
}

/// Changes the form of all impedances that are compared.
fn forms(setup: &mut Setup, change: impl Fn(&mut ImpedanceForm)) {
    let impedance = &mut setup.controller.impedance;
    let forms =
        [&mut impedance.aforce.form, &mut impedance.low.form, &mut impedance.mid.form, &mut impedance.high.form];
    forms.into_iter().for_each(change);
}

/// Wipes `trials` times with all `spaces` under every condition and writes the means to `path`.
///
/// # Errors
/// If the configuration is not allowed or the disk does not take the table.
pub fn write(
    conditions: &[Condition],
    spaces: &[ActionSpace],
    setup: &Setup,
    seed: u64,
    trials: u64,
    path: &Path,
) -> Result<()> {
    let mut jobs = vec![];
    for condition in conditions {
        jobs.extend(spaces.iter().map(|&space| (condition, space)));
    }
    let rows = parallel::map(&jobs, |&(condition, space)| {
        let mut setup = setup.clone();
        (condition.change)(&mut setup);
        // The set-up as given is stable; what a changed one does is for the table to tell.
        setup.controller.impedance.aforce.allow_unstable = true;
        let wipe = |i| {
            simulate(&Run { setup: &setup, space, trial: Trial::random(seed, i), disturbance: condition.disturbance })
        };
        let all = (0..trials).map(|i| Ok(measure(&wipe(i)?, setup.force))).collect::<Result<Vec<_>>>()?;
        let of = |metric: usize| mean(&all.iter().map(|row| row[metric]).collect::<Vec<_>>());
        anyhow::Ok((0..METRICS.len()).map(of).map(cell).collect::<Vec<_>>())
    })?;
    let mut table = csv::Writer::from_path(path)?;
    table.write_record(["condition", "space"].into_iter().chain(METRICS.iter().map(|metric| metric.name)))?;
    for ((condition, space), row) in jobs.iter().zip(rows) {
        let keys = [condition.name.to_string(), space.to_string()];
        table.write_record(keys.into_iter().chain(row))?;
    }
    Ok(table.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spaces;

    /// No two conditions have the same value.
    fn assert_all_differ<T: PartialEq>(conditions: &[Condition], values: &[T]) {
        assert_eq!(conditions.len(), values.len());
        for (i, value) in values.iter().enumerate() {
            let same = values[..i].iter().position(|other| other == value);
            assert!(same.is_none(), "{} does what {} does", conditions[i].name, conditions[same.unwrap()].name);
        }
    }

    /// Each table begins with what it is compared with.
    #[test]
    fn every_condition_is_another_one() {
        for conditions in [disturbances(), variants(), laws()] {
            let set_up = |condition: &Condition| {
                let mut setup = Setup::default();
                (condition.change)(&mut setup);
                (setup, condition.disturbance)
            };
            assert_eq!(set_up(&conditions[0]), (Setup::default(), Disturbance::NONE));
            assert_all_differ(&conditions, &conditions.iter().map(set_up).collect::<Vec<_>>());
            assert_all_differ(&conditions, &conditions.iter().map(|condition| condition.name).collect::<Vec<_>>());
        }
    }

    /// A set-up may be stable as given and not under another condition: that is a row, not the end of the program.
    #[test]
    fn a_condition_may_be_unstable() {
        let folder = tempfile::tempdir().unwrap();
        let mut setup = Setup { rotations: 1, press_time: 0.5, ..Setup::default() };
        setup.controller.impedance.aforce.translation.feedforward_gain = 300.0;
        setup.controller.impedance.aforce.check_stability().unwrap();
        let literal = &variants()[2..3];
        let mut other = setup.clone();
        (literal[0].change)(&mut other);
        other.controller.impedance.aforce.check_stability().unwrap_err();
        write(literal, &spaces()[..1], &setup, 1, 1, &folder.path().join("table.csv")).unwrap();
    }

    /// One that is not heeded would have the numbers of another.
    #[test]
    fn every_condition_makes_a_difference() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("table.csv");
        let setup = Setup { rotations: 1, press_time: 0.5, ..Setup::default() };
        for conditions in [disturbances(), variants(), laws()] {
            write(&conditions, &spaces()[..1], &setup, 1, 1, &table).unwrap();
            let mut reader = csv::Reader::from_path(&table).unwrap();
            let numbers = |row: csv::StringRecord| row.iter().skip(2).map(String::from).collect::<Vec<_>>();
            let rows: Vec<_> = reader.records().map(|row| numbers(row.unwrap())).collect();
            assert_all_differ(&conditions, &rows);
        }
    }
}
