//! The same wipes under other conditions: disturbances that neither the script nor the controller's model knows, and other settings.

use std::path::Path;

use aforce::{ActionSpace, Damping, DeltaSign, Interpolation, Psi, RateRule, Stiffness};
use anyhow::Result;
use output::parallel;
use tasks::{Disturbance, Draw, SensedWrench};

use crate::metrics::{measure, write_wipes};
use crate::setup::Setup;
use crate::trial::Trial;
use crate::{Run, simulate};

/// How a condition differs from the given set-up.
pub struct Condition {
    name: &'static str,
    /// Changes arm, controller, spaces or sensing.
    change: fn(&mut Setup),
    /// What neither the script nor the controller's model knows.
    disturbance: Disturbance,
}

/// Disturbances that neither the script nor the controller's model knows, and how well the wrench is known.
pub fn disturbances() -> Vec<Condition> {
    fn exact(setup: &mut Setup) {
        setup.sensing.source = SensedWrench::Exact;
    }
    fn worse(setup: &mut Setup) {
        let sensing = &mut setup.sensing;
        [sensing.bias, sensing.noise] = [sensing.bias, sensing.noise].map(|error| error.map(|error| 4.0 * error));
    }
    let none = Disturbance::default;
    let fixed = |value| Some(Draw::Fixed(value));
    let payload = Disturbance { payload_kg: fixed(0.5), ..none() };
    let table = |height| Disturbance { table_height_m: fixed(height), ..none() };
    let late = |delay| Disturbance { torque_delay_s: fixed(delay), ..none() };
    let condition = |name, disturbance| Condition { name, change: |_| (), disturbance };
    vec![
        condition("none", none()),
        Condition { name: "none; exact wrench", change: exact, disturbance: none() },
        condition("table 3 cm lower", table(-0.03)),
        condition("table 1 cm higher", table(0.01)),
        condition("table 3 cm higher", table(0.03)),
        condition("friction doubled", Disturbance { friction: fixed(2.0), ..none() }),
        condition("payload 0.5 kg", payload.clone()),
        Condition { name: "payload 0.5 kg; exact wrench", change: exact, disturbance: payload },
        Condition { name: "wrench bias and noise x 4", change: worse, disturbance: none() },
        condition("torque 1 ms late", late(0.001)),
        condition("torque 5 ms late", late(0.005)),
    ]
}

/// Settings on which the comparison may depend.
pub fn variants() -> Vec<Condition> {
    let condition = |name, change| Condition { name, change, disturbance: Disturbance::default() };
    vec![
        condition("as compared", |_| ()),
        condition("set-points with all of the Panda's dynamics", all_dynamics),
        condition("D = 2 sqrt(K)", |setup| spaces(setup, |space| space.damping = Damping::Literal)),
        condition("all dynamics, D = 2 sqrt(K)", |setup| {
            all_dynamics(setup);
            spaces(setup, |space| space.damping = Damping::Literal);
        }),
        condition("damped against standstill", |setup| spaces(setup, |space| space.rate = RateRule::Standstill)),
        condition("neither friction nor joint damping", |setup| setup.lossless = true),
    ]
}

/// Other parameters of the adaptive law.
pub fn laws() -> Vec<Condition> {
    let condition = |name, change| Condition { name, change, disturbance: Disturbance::default() };
    vec![
        condition("as compared", |_| ()),
        condition("delta off", |setup| law(setup, |psi| psi.delta_sign = DeltaSign::Off)),
        condition("delta literal", |setup| law(setup, |psi| psi.delta_sign = DeltaSign::Literal)),
        condition("twice the tolerance", |setup| scale_tolerance(setup, 2.0)),
        condition("half the tolerance", |setup| scale_tolerance(setup, 0.5)),
    ]
}

fn all_dynamics(setup: &mut Setup) {
    setup.controller.interpolation = Interpolation::JerkLimited { dynamics: 1.0 };
}

/// The tolerance is gamma/beta.
fn scale_tolerance(setup: &mut Setup, factor: f64) {
    law(setup, |psi| psi.beta = psi.beta.map(|_, beta| beta / factor));
}

/// Changes all spaces that are compared.
fn spaces(setup: &mut Setup, change: impl Fn(&mut ActionSpace)) {
    setup.spaces.iter_mut().for_each(change);
}

/// Changes the law of every space that adapts.
fn law(setup: &mut Setup, change: impl Fn(&mut Psi)) {
    spaces(setup, |space| {
        if let Stiffness::Adaptive(psi) = &mut space.stiffness {
            change(psi);
        }
    });
}

/// Wipes `trials` times under every condition with each space of the set-up whose index is in `spaces`, and writes a row
/// per trial to `path`.
///
/// # Errors
/// If the configuration is not allowed, or the table cannot be written.
pub fn write(
    conditions: &[Condition],
    spaces: &[usize],
    setup: &Setup,
    seed: u64,
    trials: u64,
    path: &Path,
) -> Result<()> {
    let mut jobs = vec![];
    for condition in conditions {
        jobs.extend(spaces.iter().flat_map(|&space| (0..trials).map(move |trial| (condition, space, trial))));
    }
    let rows = parallel::map(&jobs, |&(condition, space, trial)| {
        let mut setup = setup.clone();
        (condition.change)(&mut setup);
        // The given set-up is stable. A changed one may be unstable, which the table then shows.
        law(&mut setup, |psi| psi.allow_unstable = true);
        let space = &setup.spaces[space];
        let trial = Trial::random(seed, trial);
        let record = simulate(&Run { setup: &setup, space, trial, disturbance: condition.disturbance.clone() })?;
        anyhow::Ok(measure(&record, setup.force))
    })?;
    let rows = jobs.iter().zip(rows).map(|((condition, space, trial), row)| {
        ([condition.name.into(), setup.spaces[*space].name.clone(), trial.to_string()], row)
    });
    write_wipes(path, ["condition", "space", "trial"], rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spaces::AFORCE;

    /// Asserts that no two conditions have the same value.
    fn assert_all_differ<T: PartialEq>(conditions: &[Condition], values: &[T]) {
        assert_eq!(conditions.len(), values.len());
        for (i, value) in values.iter().enumerate() {
            let same = values[..i].iter().position(|other| other == value);
            assert!(same.is_none(), "{} does what {} does", conditions[i].name, conditions[same.unwrap()].name);
        }
    }

    /// The first condition of each table is the unchanged set-up.
    #[test]
    fn every_condition_is_another_one() {
        for conditions in [disturbances(), variants(), laws()] {
            let set_up = |condition: &Condition| {
                let mut setup = Setup::default();
                (condition.change)(&mut setup);
                (setup, condition.disturbance.clone())
            };
            assert_eq!(set_up(&conditions[0]), (Setup::default(), Disturbance::default()));
            assert_all_differ(&conditions, &conditions.iter().map(set_up).collect::<Vec<_>>());
            assert_all_differ(&conditions, &conditions.iter().map(|condition| condition.name).collect::<Vec<_>>());
        }
    }

    /// A set-up may become unstable under a condition: the table then has its row, and the program goes on.
    #[test]
    fn a_condition_may_be_unstable() {
        let folder = tempfile::tempdir().unwrap();
        let mut setup = Setup { rotations: 1, press_time: 0.5, ..Setup::default() };
        law(&mut setup, |psi| psi.alpha.set(0, 300.0));
        let validate = |setup: &Setup| setup.spaces[AFORCE].validate(setup.controller.control_hz);
        validate(&setup).unwrap();
        let literal = &variants()[2..3];
        let mut other = setup.clone();
        (literal[0].change)(&mut other);
        validate(&other).unwrap_err();
        write(literal, &[AFORCE], &setup, 1, 1, &folder.path().join("table.csv")).unwrap();
    }

    /// Without an effect, a condition would have the same numbers as another.
    #[test]
    fn every_condition_makes_a_difference() {
        let folder = tempfile::tempdir().unwrap();
        let table = folder.path().join("table.csv");
        let setup = Setup { rotations: 1, press_time: 0.5, ..Setup::default() };
        for conditions in [disturbances(), variants(), laws()] {
            write(&conditions, &[AFORCE], &setup, 1, 1, &table).unwrap();
            let mut reader = csv::Reader::from_path(&table).unwrap();
            let numbers = |row: csv::StringRecord| row.iter().skip(3).map(String::from).collect::<Vec<_>>();
            let rows: Vec<_> = reader.records().map(|row| numbers(row.unwrap())).collect();
            assert_all_differ(&conditions, &rows);
        }
    }
}
