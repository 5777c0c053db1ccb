//! A map of the adaptive law: how lowest stiffness and tolerance change success before a real arm would have stopped, and energy.

use aforce::DeltaSign;
use output::statistics::{mean, quantile, range};
use show::plot::{HeatMap, HeatRow};
use tasks::TaskName;

use super::{Law, Row};
use crate::report::groups::Section;

/// For every task and sign of delta a row per quarter of the lowest stiffness. Its columns are quarters of the tolerance, first for
/// success, then for energy as a share of what the first row of the task spends, whether or not its stiffness adapts.
pub(super) fn map(rows: &[Row]) -> HeatMap {
    let adaptive: Vec<Adaptive> =
        rows.iter().filter_map(|row| Some(Adaptive { row, law: row.law.as_ref()? })).collect();
    let axes = Axes {
        stiffness: Quarters::of(&adaptive.iter().map(|row| row.law.k_min_n_per_m).collect::<Vec<_>>()),
        tolerance: Quarters::of(&adaptive.iter().map(|row| row.law.tolerance_m).collect::<Vec<_>>()),
    };
    let of_task = |task: TaskName| {
        let first = rows.iter().find(|row| row.task == task.as_str())?;
        Some(lines(task, first.number("energy_per_action_j"), &adaptive, &axes))
    };
    let columns = |what: &str| axes.tolerance.names(1000.0, "mm").map(|name| format!("{what}, {name}"));
    HeatMap {
        title:
            "By lowest stiffness and tolerance: success before a stop, %; energy per action, % of the task's first row"
                .into(),
        columns: [columns("success"), columns("energy")].concat(),
        rows: TaskName::all().into_iter().filter_map(of_task).flatten().collect(),
    }
}

/// A row whose stiffness adapts.
#[derive(Clone, Copy)]
struct Adaptive<'a> {
    row: &'a Row,
    law: &'a Law,
}

/// What the map's rows and columns stand for (N/m, m).
struct Axes {
    stiffness: Quarters,
    tolerance: Quarters,
}

/// The map's rows of a task whose first row spends `first` (J per action).
fn lines(task: TaskName, first: f64, rows: &[Adaptive], axes: &Axes) -> Vec<HeatRow> {
    let title = Section { experiment: "", task: task.as_str() }.title();
    let of_task: Vec<Adaptive> = rows.iter().filter(|row| row.row.task == task.as_str()).copied().collect();
    let signs = [
        (DeltaSign::Damping, "delta with the damping sign"),
        (DeltaSign::Literal, "delta with the printed sign"),
        (DeltaSign::Off, "without delta"),
    ];
    let mut lines = vec![];
    for (sign, name) in signs {
        let of_sign: Vec<Adaptive> = of_task.iter().filter(|row| row.law.delta_sign == sign).copied().collect();
        if of_sign.is_empty() {
            continue;
        }
        for (quarter, label) in axes.stiffness.names(1.0, "N/m").into_iter().enumerate() {
            let success = axes.shares(&of_sign, quarter, "success_before_stop", 1.0);
            let energy = axes.shares(&of_sign, quarter, "energy_per_action_j", first);
            lines.push(HeatRow { heading: format!("{title}, {name}"), label, shares: [success, energy].concat() });
        }
    }
    lines
}

impl Axes {
    /// For every quarter of the tolerance: the mean of `column`, divided by `whole`, over the rows in the quarter `stiffness`.
    fn shares(&self, rows: &[Adaptive], stiffness: usize, column: &str, whole: f64) -> [Option<f64>; 4] {
        let there = rows.iter().filter(|row| self.stiffness.place(row.law.k_min_n_per_m) == stiffness);
        let mut values = [(); 4].map(|()| vec![]);
        there.for_each(|row| values[self.tolerance.place(row.law.tolerance_m)].push(row.row.number(column)));
        values.map(|values| (!values.is_empty()).then(|| mean(&values) / whole))
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

    /// 0 to 3. An infinite number is in the last part, even where borders are infinite.
    fn place(&self, number: f64) -> usize {
        self.borders.iter().filter(|border| number > **border || number == f64::INFINITY).count()
    }

    /// Each part as `low to high UNIT`; a number is multiplied by `factor` to have that unit.
    fn names(&self, factor: f64, unit: &str) -> [String; 4] {
        let [first, second, third] = self.borders;
        [(self.lowest, first), (first, second), (second, third), (third, self.highest)]
            .map(|(low, high)| format!("{:.0} to {:.0} {unit}", factor * low, factor * high))
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;

    fn row(energy: f64, law: Option<Law>) -> Row {
        Row {
            task: TaskName::LIFT.as_str(),
            space: String::new(),
            variant: String::new(),
            policy: "expert",
            position_step_m: 0.05,
            rotation_step_rad: 0.5,
            law,
            episodes: 1,
            numbers: vec![("energy_per_action_j", Cell::Real(energy)), ("success_before_stop", Cell::Real(1.0))],
            commit: String::new(),
        }
    }

    /// The title says so: the first row counts even if its stiffness is fixed.
    #[test]
    fn energy_is_a_share_of_what_the_first_row_of_the_task_spends() {
        let law = Law::of(&"aforce".parse().unwrap());
        let energies = |rows: &[Row]| {
            let energy = |line: HeatRow| line.shares[4..].to_vec();
            map(rows).rows.into_iter().flat_map(energy).flatten().collect::<Vec<f64>>()
        };
        assert_eq!(energies(&[row(4.0, None), row(1.0, law), row(3.0, law)]), [0.5]);
        assert_eq!(energies(&[row(1.0, law), row(3.0, law), row(4.0, None)]), [2.0]);
    }

    /// A law whose stiffness does not grow (beta = 0) has an infinite tolerance.
    #[test]
    fn infinite_tolerances_are_in_the_last_quarter_and_in_its_name() {
        for infinite in [1, 3, 5, 8] {
            let mut numbers: Vec<f64> = (1..=8).map(f64::from).collect();
            numbers[8 - infinite..].fill(f64::INFINITY);
            let quarters = Quarters::of(&numbers);
            assert_eq!(quarters.place(f64::INFINITY), 3, "{infinite} of 8");
            for (number, next) in numbers.iter().zip(&numbers[1..]) {
                assert!(quarters.place(*number) <= quarters.place(*next), "{number}, {next}");
            }
            let names = quarters.names(1000.0, "mm");
            assert!(names[3].ends_with("to inf mm") && !names.concat().contains("NaN"), "{names:?}");
        }
        let finite = Quarters::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!([1.0, 2.0, 2.5, 3.5, 5.0].map(|number| finite.place(number)), [0, 0, 1, 2, 3]);
    }
}
