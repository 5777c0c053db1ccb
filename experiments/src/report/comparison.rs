//! Groups against the reference of their section, `aforce`.

use std::sync::LazyLock;

use output::statistics::{FEWEST_FOR_INTERVAL, interval, mean, probability_of_improvement};
use serde::Serialize;

use crate::config::label;
use crate::report::groups::Group;

/// The ways to order two runs, each with the column of `runs.csv` that decides. A run learns faster if the mean of its
/// whole curve is higher.
pub const ORDERS: [(&str, &str); 3] = [
    ("ends higher", "final_return"),
    ("ends higher with sampled actions", "sampled_return"),
    ("learns faster", "curve_return"),
];

/// Measures of energy in training whose ratios are reported. Net work is left out because it can have either sign.
pub const ENERGIES: [&str; 4] = [
    "energy_per_action_j",
    "energy_positive_per_action_j",
    "squared_torque_per_action_nm2s",
    "copper_loss_per_action_j",
];

/// What is compared, by name.
pub static QUANTITIES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let orders = ORDERS.iter().map(|(order, _)| format!("probability that reference {order}"));
    orders.chain(ENERGIES.iter().map(|name| format!("{name}: space / reference"))).collect()
});

/// A row of `comparison.csv`: a space against `aforce` (with force where `aforce` has it) in the same section, with the
/// same preset and variant, or else without a variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct ComparisonRow {
    pub experiment: String,
    pub task: String,
    pub preset: String,
    pub space: String,
    pub variant: String,
    pub n_space: usize,
    pub reference: String,
    pub n_reference: usize,
    pub quantity: String,
    pub value: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
}

/// For every group with a reference: the probability that the reference is ahead, by each of [`ORDERS`], and the group's
/// energy divided by the reference's, by each of [`ENERGIES`]. A quantity that a run of either group lacks is left out.
pub fn comparison(groups: &[Group]) -> Vec<ComparisonRow> {
    let mut rows = vec![];
    for other in groups {
        let Some(reference) = reference(other, groups) else { continue };
        let mut compare = |quantity: &str, number: &str, statistic: fn(&[f64], &[f64]) -> f64| {
            let (a, b) = (reference.values(number), other.values(number));
            if a.iter().chain(&b).any(|value| value.is_nan()) {
                return;
            }
            let enough = a.len().min(b.len()) >= FEWEST_FOR_INTERVAL;
            let ci = enough.then(|| interval(&[&a, &b], |s| statistic(&s[0], &s[1])));
            rows.push(ComparisonRow {
                experiment: other.section.experiment.into(),
                task: other.section.task.into(),
                preset: other.preset.into(),
                space: other.space.into(),
                variant: other.variant.into(),
                n_space: b.len(),
                reference: label(reference.space, reference.variant),
                n_reference: a.len(),
                quantity: quantity.into(),
                value: statistic(&a, &b),
                ci_low: ci.map(|ci| ci[0]),
                ci_high: ci.map(|ci| ci[1]),
            });
        };
        let (orders, energies) = QUANTITIES.split_at(ORDERS.len());
        for (quantity, (_, number)) in orders.iter().zip(ORDERS) {
            compare(quantity, number, probability_of_improvement);
        }
        for (quantity, name) in energies.iter().zip(ENERGIES) {
            compare(quantity, name, |a, b| mean(b) / mean(a));
        }
    }
    rows
}

/// The group that `group` is compared with; `None` if there is none other than `group` itself.
fn reference<'a>(group: &Group, groups: &'a [Group<'a>]) -> Option<&'a Group<'a>> {
    let named = |space, variant| {
        let key = (group.section, group.preset, space, variant);
        groups.iter().find(|other| (other.section, other.preset, other.space, other.variant) == key)
    };
    let of_variant = |variant| {
        let reference = named("aforce-force", variant).or_else(|| named("aforce", variant));
        reference.filter(|reference| (reference.space, reference.variant) != (group.space, group.variant))
    };
    of_variant(group.variant).or_else(|| of_variant(""))
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;
    use crate::report::groups::tests::{runs, set};
    use crate::report::groups::{groups, summary};
    use crate::report::summary::RunSummary;

    #[test]
    fn there_is_one_reference() {
        let all = [runs("aforce", 1), runs("osc", 1), runs("aforce-force", 1)].concat();
        let with = |runs: &[RunSummary]| {
            let mut pairs: Vec<_> =
                comparison(&groups(runs)).into_iter().map(|row| (row.reference, row.space)).collect();
            pairs.dedup();
            pairs
        };
        let pair = |reference: &str, space: &str| (reference.to_string(), space.to_string());
        assert_eq!(with(&all), [pair("aforce-force", "aforce"), pair("aforce-force", "osc")]);
        assert_eq!(with(&all[..2]), [pair("aforce", "osc")]);
        assert_eq!(with(&all[1..2]), []);
    }

    /// A variant is compared with `aforce` of the same variant, or else with `aforce` without a variant; so is a variant of `aforce`.
    #[test]
    fn variants_are_groups_of_their_own() {
        let mut all = [runs("aforce", 2), runs("osc", 2), runs("aforce", 1), runs("osc", 1), runs("osc", 1)].concat();
        for (run, variant) in all.iter_mut().zip(["", "", "", "", "n_step=5", "n_step=5", "soft"]) {
            run.variant = variant.into();
        }
        let groups = groups(&all);
        assert_eq!(groups.iter().map(|group| group.runs.len()).collect::<Vec<_>>(), [2, 2, 1, 1, 1]);
        let labels: Vec<_> = summary(&groups).into_iter().map(|row| (row.space, row.variant)).collect();
        assert!(labels.contains(&("osc".into(), "soft".into())), "{labels:?}");
        let rows = comparison(&groups).into_iter();
        let mut pairs: Vec<_> = rows.map(|row| (label(&row.space, &row.variant), row.reference)).collect();
        pairs.dedup();
        let expected = [
            ("osc", "aforce"),
            ("aforce,n_step=5", "aforce"),
            ("osc,n_step=5", "aforce,n_step=5"),
            ("osc,soft", "aforce"),
        ];
        assert_eq!(pairs, expected.map(|(group, reference)| (group.to_string(), reference.to_string())));
    }

    #[test]
    fn presets_are_compared_apart() {
        let mut all = [runs("aforce", 1), runs("osc", 1), runs("aforce", 1), runs("osc", 1)].concat();
        (all[2].preset, all[3].preset) = ("paper".into(), "paper".into());
        set(&mut all[3], "final_return", Cell::Real(50.0));
        let rows = comparison(&groups(&all));
        let value = |preset: &str| {
            let of = |row: &&ComparisonRow| row.preset == preset && row.quantity.contains("ends higher");
            rows.iter().find(of).unwrap().value
        };
        assert_eq!((value("desktop"), value("paper")), (0.5, 1.0));
    }
}
