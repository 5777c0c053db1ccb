//! Computes a run's numbers in `runs.csv` from its tables.

use anyhow::{Error, Result, ensure};
use output::statistics::{deviation, mean, mean_of, quantile};
use tasks::columns::{COLUMNS, Cell, Over, Statistic};

use crate::report::columns::Columns;
use crate::report::record::Record;
use crate::report::table::Table;
use crate::run::clock::Spent;

/// Number of evaluations at the end of a run whose mean is its final return.
const LAST: usize = 5;
/// Mean return of an evaluation from which on a run counts as solved: robosuite's tasks have at most 500 in 500 actions.
pub const SOLVED: f64 = 450.0;
/// Those numbers without an entry in [`COLUMNS`] that `summary.csv` summarises over seeds.
const SUMMARISED: [&str; 5] =
    ["curve_return", "best_return", "sampled_success_by_hand", "last_sampled_success_by_hand", "stopped_episode_share"];

/// Force limits (N) at which a real arm may be set to stop. Each has the name of a number: the share of the last policy's
/// episodes that succeed before the force or a joint's speed exceeds its limit.
const WITHIN: [(f64, &str); 6] = [
    (60.0, "end_success_within_60n"),
    (100.0, "end_success_within_100n"),
    (150.0, "end_success_within_150n"),
    (200.0, "end_success_within_200n"),
    (300.0, "end_success_within_300n"),
    (500.0, "end_success_within_500n"),
];

/// The names of the numbers that `summary.csv` summarises over seeds.
pub fn summarised() -> impl Iterator<Item = &'static str> {
    let of_columns = COLUMNS.iter().flat_map(|column| column.of_runs);
    let of_columns = of_columns.filter(|number| number.over_seeds).map(|number| number.name);
    of_columns.chain(SUMMARISED).chain(WITHIN.map(|(_, name)| name))
}

/// The tables from which a run's numbers are computed.
pub(super) struct RunTables {
    pub(super) training: Columns,
    /// Step and mean return of every evaluation with mean actions.
    returns: Vec<(f64, f64)>,
    /// The last evaluations, with mean and with sampled actions.
    last: Columns,
    last_sampled: Columns,
    pub(super) progress: Columns,
    /// Time that the whole run took; `None` if it is not done, or an outside run.
    spent: Option<Spent>,
    /// Episodes of the last policy, if it was played after training.
    end: Option<Columns>,
}

impl RunTables {
    /// Reads the tables of a run.
    pub(super) fn of(run: &Record) -> Result<Self> {
        let path = run.path.display();
        let (training, eval) = (run.columns(Table::Episodes)?, run.evaluations("mean")?);
        ensure!(run.outside || !training.is_empty(), "{path}: no training episode");
        let returns = eval.mean_by_step("return")?;
        ensure!(!returns.is_empty(), "{path}: no evaluation");
        let before = returns.len().checked_sub(LAST + 1).map_or(0.0, |i| returns[i].0);
        let last_sampled = run.evaluations("sampled")?.after(before)?;
        let end = run.csv(Table::End)?.map(Columns::of).transpose()?;
        if let Some(end) = &end {
            let [_, of_last] = run.policies_of(Table::End, end)?;
            ensure!(of_last, "{}: not of the last policy: evaluate --checkpoint last", run.place(Table::End));
        }
        ensure!(run.outside || !last_sampled.is_empty(), "{path}: no evaluation with sampled actions");
        Ok(RunTables {
            training,
            returns,
            last: eval.after(before)?,
            last_sampled,
            progress: run.columns(Table::Progress)?,
            spent: (run.done && !run.outside).then_some(run.manifest.spent),
            end,
        })
    }

    /// The last training action in the tables.
    pub(super) fn last_step(&self) -> Result<u64> {
        let trained = self.training.values("step")?.last().copied();
        Ok(trained.or(self.returns.last().map(|point| point.0)).map_or(0, |step| step as u64))
    }

    /// The action of the last evaluation.
    pub(super) fn last_evaluation(&self) -> Option<u64> {
        self.returns.last().map(|point| point.0 as u64)
    }

    /// Every number of the run: those with an entry in [`COLUMNS`], then those without.
    pub(super) fn numbers(&self) -> Result<Vec<(&'static str, Cell)>> {
        let mut numbers = vec![];
        for column in COLUMNS.iter() {
            for number in column.of_runs {
                let table = match number.over {
                    Over::Training => Some(&self.training),
                    Over::Final => Some(&self.last),
                    Over::Sampled => Some(&self.last_sampled),
                    Over::End => self.end.as_ref(),
                    Over::Baseline => continue,
                };
                let told = table.map(|table| told(table, column.name, number.how)).transpose()?;
                numbers.push((number.name, told.unwrap_or(Cell::Empty)));
            }
        }
        numbers.extend(self.beside()?);
        Ok(numbers)
    }

    /// The numbers without an entry in [`COLUMNS`].
    fn beside(&self) -> Result<Vec<(&'static str, Cell)>> {
        let Self { returns, last, last_sampled, .. } = self;
        let solved = returns.iter().find(|point| point.1 >= SOLVED).map(|point| point.0);
        // The only evaluation of a short run comes after its last row of progress.csv, so it has the time of the run's end.
        let minutes_to_450 = |clock: &str, at_the_end: fn(Spent) -> f64| {
            let (clock, at_the_end) = (self.progress.points(clock)?, self.spent.map(at_the_end));
            let until = |at: f64| clock.iter().find(|point| point.0 >= at).map(|point| point.1).or(at_the_end);
            Ok::<_, Error>(solved.and_then(until).map(|seconds| seconds / 60.0))
        };
        let last_but_one = returns.len().checked_sub(2).map_or(0.0, |i| returns[i].0);
        let very_last = last_sampled.clone().after(last_but_one)?;
        let power = last_sampled.mean("fulfilled_energy_j")? / last_sampled.mean("fulfilled_time_s")?;
        let within = WITHIN.iter().map(|&(limit, name)| {
            let share = self.end.as_ref().map(|end| end.success_within(limit)).transpose()?;
            Ok((name, share.map_or(Cell::Empty, known)))
        });
        let mut beside = vec![
            ("curve_return", Cell::Real(mean_of(returns, |point| point.1))),
            ("best_return", Cell::Real(returns.iter().map(|point| point.1).fold(f64::MIN, f64::max))),
            ("steps_to_450", solved.map_or(Cell::Empty, |step| Cell::Count(step as u64))),
            ("wall_min_to_450", minutes_to_450("wall_s", |spent| spent.wall_s)?.into()),
            ("cpu_min_to_450", minutes_to_450("cpu_s", |spent| spent.cpu_s)?.into()),
            ("final_success_by_hand", known(last.success_by_hand()?)),
            ("sampled_success_by_hand", known(last_sampled.success_by_hand()?)),
            ("last_sampled_return", known(very_last.mean("return")?)),
            ("last_sampled_success_by_hand", known(very_last.success_by_hand()?)),
            ("sampled_fulfilled_power_w", known(power)),
            ("sampled_fulfilled_max_force_n", known(last_sampled.fulfilled_max_force()?)),
            ("stopped_episode_share", known(self.training.stopped_share()?)),
        ];
        beside.extend(within.collect::<Result<Vec<_>>>()?);
        Ok(beside)
    }
}

/// A number that is NaN, because no row has it, becomes an empty cell.
fn known(value: f64) -> Cell {
    Some(value).filter(|value| !value.is_nan()).into()
}

fn told(table: &Columns, column: &str, how: Statistic) -> Result<Cell> {
    let mut values = table.values(column)?;
    values.retain(|value| !value.is_nan());
    let actions = if how == Statistic::PerAction { table.values("length")?.iter().sum() } else { f64::NAN };
    Ok(statistic(how, &values, actions))
}

/// A statistic of the `values` of episodes; empty if there are none. `actions` is the sum of their lengths, which
/// [`Statistic::PerAction`] divides by.
pub fn statistic(how: Statistic, values: &[f64], actions: f64) -> Cell {
    let above_0 = || values.iter().filter(|&&value| value > 0.0).count();
    if values.is_empty() {
        return Cell::Empty;
    }
    Cell::Real(match how {
        Statistic::Mean => mean(values),
        Statistic::Deviation if values.len() < 2 => return Cell::Empty,
        Statistic::Deviation => deviation(values),
        Statistic::Median => quantile(values, 0.5),
        Statistic::Quantile90 => quantile(values, 0.9),
        Statistic::PerAction => values.iter().sum::<f64>() / actions,
        Statistic::ShareAbove0 => above_0() as f64 / values.len() as f64,
        Statistic::CountAbove0 => return Cell::Count(above_0() as u64),
    })
}
