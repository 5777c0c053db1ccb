//! Hypotheses that ask the same of several experiments, taken together.

use output::rank_test::{holm, stratified_p_value};
use output::statistics::probability_of_improvement;
use serde::Serialize;

use crate::report::verdicts::VerdictRow;

/// A row of `pooled.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct PooledRow {
    pub task: String,
    pub metric: String,
    pub space: String,
    pub against: String,
    pub experiments: String,
    pub n_space: usize,
    pub n_against: usize,
    pub difference: Option<f64>,
    pub above: f64,
    pub p: f64,
    pub p_holm: f64,
}

/// A row for every task, metric and pair of groups (space and variant) that hypotheses of two or more experiments
/// compare. Each experiment is a stratum of the rank test, so that runs are compared within an experiment alone; the p of
/// all rows are corrected together. Two hypotheses on the same runs count as one, also if one names the two groups in the
/// other order. Hypotheses that say `pooled = false` are left out.
pub fn pooled(verdicts: &[VerdictRow]) -> Vec<PooledRow> {
    let question = |row: &VerdictRow| {
        let [space, against] = row.sides.each_ref().map(|side| side.label.clone());
        (row.task.clone(), row.metric.clone(), space, against)
    };
    let with_runs = verdicts.iter().filter(|row| row.p.is_some() && !row.stands_alone);
    let mut questions: Vec<Vec<VerdictRow>> = vec![];
    for row in with_runs {
        let asked = |row: &VerdictRow| questions.iter().position(|rows| question(&rows[0]) == question(row));
        let turned = turned(row);
        let found = asked(row).map(|at| (at, row)).or_else(|| asked(&turned).map(|at| (at, &turned)));
        match found {
            Some((at, _)) if questions[at].iter().any(|other| other.experiment == row.experiment) => {}
            Some((at, row)) => questions[at].push(row.clone()),
            None => questions.push(vec![row.clone()]),
        }
    }
    questions.retain(|rows| rows.len() > 1);
    let mut rows: Vec<PooledRow> = questions.iter().map(|rows| of_question(rows)).collect();
    let corrected = holm(&rows.iter().map(|row| row.p).collect::<Vec<_>>());
    rows.iter_mut().zip(corrected).for_each(|(row, p)| row.p_holm = p);
    rows
}

/// The same comparison with its groups in the other order.
fn turned(row: &VerdictRow) -> VerdictRow {
    let [space, against] = row.sides.clone();
    VerdictRow {
        n_space: row.n_against,
        n_against: row.n_space,
        difference: row.difference.map(|difference| -difference),
        sides: [against, space],
        ..row.clone()
    }
}

fn of_question(rows: &[VerdictRow]) -> PooledRow {
    let strata: Vec<[&[f64]; 2]> =
        rows.iter().map(|row| row.sides.each_ref().map(|side| side.values.as_slice())).collect();
    // Every pair of runs of one experiment counts alike.
    let pairs = |[a, b]: &[&[f64]; 2]| (a.len() * b.len()) as f64;
    let above: f64 =
        strata.iter().map(|stratum| pairs(stratum) * probability_of_improvement(stratum[0], stratum[1])).sum();
    let differences: Option<Vec<f64>> = rows.iter().map(|row| row.difference).collect();
    let experiments: Vec<&str> = rows.iter().map(|row| row.experiment.as_str()).collect();
    PooledRow {
        task: rows[0].task.clone(),
        metric: rows[0].metric.clone(),
        space: rows[0].sides[0].label.clone(),
        against: rows[0].sides[1].label.clone(),
        experiments: experiments.join(" "),
        n_space: rows.iter().map(|row| row.n_space).sum(),
        n_against: rows.iter().map(|row| row.n_against).sum(),
        difference: differences.map(|all| output::statistics::mean(&all)),
        above: above / strata.iter().map(pairs).sum::<f64>(),
        p: stratified_p_value(&strata),
        p_holm: f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::verdicts::Side;

    fn row(experiment: &str, metric: &str, a: &[f64], b: &[f64]) -> VerdictRow {
        let side = |label: &str, values: &[f64]| Side { label: label.into(), values: values.into() };
        VerdictRow {
            experiment: experiment.into(),
            task: "door".into(),
            metric: metric.into(),
            n_space: a.len(),
            n_against: b.len(),
            difference: Some(1.0),
            p: (!a.is_empty()).then_some(0.5),
            sides: [side("aforce", a), side("osc", b)],
            ..VerdictRow::default()
        }
    }

    #[test]
    fn one_question_of_two_experiments_is_one_test_within_each() {
        // The second experiment's values lie far above the first's, which would change p if runs were compared across experiments.
        let (low, high) = ([1.0, 2.0, 3.0], [11.0, 12.0, 13.0]);
        let (low_b, high_b) = ([4.0, 5.0, 6.0], [14.0, 15.0, 16.0]);
        let all = [
            row("a", "final_return", &low, &low_b),
            row("a", "final_return", &low, &low_b),
            row("b", "final_return", &high, &high_b),
            row("b", "curve_return", &high, &high_b),
            row("c", "final_return", &[], &[]),
            VerdictRow { stands_alone: true, ..row("d", "final_return", &low, &low_b) },
        ];
        let rows = pooled(&all);
        let [row] = rows.as_slice() else { panic!("{rows:?}") };
        assert_eq!((row.experiments.as_str(), row.n_space, row.n_against, row.above), ("a b", 6, 6, 0.0));
        // In each stratum 1 of 20 splits is this extreme, so 1 of 400 in both, and as many on the other side.
        assert!((row.p - 2.0 / 400.0).abs() < 1e-12 && row.p_holm == row.p);
        // The second experiment names its groups in the other order.
        let mirrored = pooled(&[all[0].clone(), turned(&all[2])]);
        assert_eq!(mirrored, rows);
    }
}
