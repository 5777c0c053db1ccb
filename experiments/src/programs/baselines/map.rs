//! A map of the adaptive law: which lowest stiffness and tolerance do a task before a real arm would have stopped, and what they cost.

use aforce::DeltaSign;
use output::statistics::{mean, quantile, range};
use show::plot::{HeatMap, HeatRow};
use tasks::TaskName;

use super::{Law, Row};
use crate::report::groups::Section;

/// For every task and sign of delta a row per quarter of the lowest stiffness. Its columns are quarters of the tolerance, first for
/// success, then for energy as a share of what the first row of the task spends.
pub(super) fn map(rows: &[Row]) -> HeatMap {
    let all: Vec<(&Row, &Law)> = rows.iter().filter_map(|row| Some((row, row.law.as_ref()?))).collect();
    let numbers = |of: fn(&Law) -> f64| all.iter().map(|(_, law)| of(law)).collect::<Vec<_>>();
    let stiffness = Quarters::of(&numbers(|law| law.k_min_n_per_m));
    let tolerance = Quarters::of(&numbers(|law| 1000.0 * law.tolerance_m));
    let columns = |what: &str| tolerance.names("mm").map(|name| format!("{what}, {name}"));
    let of_task = |task: TaskName| {
        let of_task: Vec<_> = all.iter().filter(|(row, _)| row.task == task.as_str()).collect();
        let first = of_task.first().map_or(f64::NAN, |(row, _)| row.number("energy_per_action_j"));
        let of_sign = |(sign, name): (DeltaSign, &str)| {
            let title = Section { experiment: "", task: task.as_str() }.title();
            let of_sign: Vec<_> = of_task.iter().filter(|(_, law)| law.delta_sign == sign).collect();
            let row = |(quarter, label): (usize, String)| {
                let shares = |column: &str, whole: f64| {
                    let of_cell = |wanted: usize| {
                        let there = |law: &Law| {
                            stiffness.place(law.k_min_n_per_m) == quarter
                                && tolerance.place(1000.0 * law.tolerance_m) == wanted
                        };
                        let rows = of_sign.iter().filter(|(_, law)| there(law));
                        let values: Vec<f64> = rows.map(|(row, _)| row.number(column)).collect();
                        (!values.is_empty()).then(|| mean(&values) / whole)
                    };
                    (0..4).map(of_cell).collect::<Vec<_>>()
                };
                let shares = [shares("success_before_stop", 1.0), shares("energy_per_action_j", first)].concat();
                HeatRow { heading: format!("{title}, {name}"), label, shares }
            };
            if of_sign.is_empty() { vec![] } else { stiffness.names("N/m").into_iter().enumerate().map(row).collect() }
        };
        let signs = [
            (DeltaSign::Damping, "delta with the damping sign"),
            (DeltaSign::Literal, "delta with the printed sign"),
            (DeltaSign::Off, "without delta"),
        ];
        signs.into_iter().flat_map(of_sign).collect::<Vec<_>>()
    };
    HeatMap {
        title:
            "By lowest stiffness and tolerance: success before a stop, %; energy per action, % of the task's first row"
                .into(),
        columns: [columns("success"), columns("energy")].concat(),
        rows: TaskName::all().into_iter().flat_map(of_task).collect(),
    }
}

/// Numbers divided into four parts of about the same length.
struct Quarters {
    lowest: f64,
    borders: [f64; 3],
    highest: f64,
}

impl Quarters {
    fn of(numbers: &[f64]) -> Self {
        let [lowest, highest] = range(numbers);
        Quarters { lowest, borders: [0.25, 0.5, 0.75].map(|share| quantile(numbers, share)), highest }
    }

    /// 0 to 3.
    fn place(&self, number: f64) -> usize {
        self.borders.iter().filter(|border| number > **border).count()
    }

    fn names(&self, unit: &str) -> [String; 4] {
        let [first, second, third] = self.borders;
        [(self.lowest, first), (first, second), (second, third), (third, self.highest)]
            .map(|(low, high)| format!("{low:.0} to {high:.0} {unit}"))
    }
}
