//! The columns of the tables of episodes and runs, one entry each.
//!
//! An entry has the column's name, unit and meaning, how its cell is computed from an episode, and the numbers of it that tables of runs
//! have. The tables of episodes, `runs.csv`, `baselines`, what `evaluate` prints, TensorBoard and `docs/columns.md` follow from the entries.

mod energy;
mod force;
mod fulfilled;
mod impedance;
mod motion;
mod parts;
mod protection;
mod score;
mod success;
mod to_success;

use std::sync::LazyLock;

use serde::{Serialize, Serializer};

pub use parts::Parts;

/// A column's value for one episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// A real number.
    Real(f64),
    /// A whole number.
    Count(u64),
    /// Yes or no.
    Flag(bool),
    /// A word.
    Word(&'static str),
    /// No value.
    Empty,
}

impl Cell {
    /// The value as a number, a flag as 1 or 0; `None` for a word or an empty cell.
    pub fn number(self) -> Option<f64> {
        match self {
            Cell::Real(value) => Some(value),
            Cell::Count(count) => Some(count as f64),
            Cell::Flag(flag) => Some(f64::from(u8::from(flag))),
            Cell::Word(_) | Cell::Empty => None,
        }
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Cell::Empty, Cell::Real)
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Cell::Real(value) => serializer.serialize_f64(value),
            Cell::Count(count) => serializer.serialize_u64(count),
            Cell::Flag(flag) => serializer.serialize_bool(flag),
            Cell::Word(word) => serializer.serialize_str(word),
            Cell::Empty => serializer.serialize_none(),
        }
    }
}

/// Which episodes a number of a run is taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// All training episodes: `runs.csv`.
    Training,
    /// The last evaluations with mean actions: `runs.csv`.
    Final,
    /// The last evaluations with sampled actions: `runs.csv`.
    Sampled,
    /// The episodes of the last policy: `runs.csv`.
    End,
    /// The episodes that `baselines` plays: the table of `baselines`.
    Baseline,
}

/// How a column is summarised over episodes. An episode whose cell is empty is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statistic {
    /// The mean.
    Mean,
    /// The standard deviation (n - 1).
    Deviation,
    /// The median.
    Median,
    /// The 90 % quantile.
    Quantile90,
    /// The sum, divided by the actions of all episodes.
    PerAction,
    /// The share of the episodes with a value above 0.
    ShareAbove0,
    /// The number of episodes with a value above 0.
    CountAbove0,
}

/// A number of a run: a statistic of a column over some of its episodes.
#[derive(Debug, Clone, Copy)]
pub struct RunNumber {
    /// Name in tables.
    pub name: &'static str,
    /// The episodes over which it is taken.
    pub over: Over,
    /// The statistic over these episodes.
    pub how: Statistic,
    /// Whether `summary.csv` summarises it over seeds.
    pub over_seeds: bool,
}

const fn number(name: &'static str, over: Over, how: Statistic) -> RunNumber {
    RunNumber { name, over, how, over_seeds: false }
}

/// A number that `summary.csv` summarises over seeds.
const fn summarised(name: &'static str, over: Over, how: Statistic) -> RunNumber {
    RunNumber { name, over, how, over_seeds: true }
}

/// A column of the tables of episodes.
#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// Name in tables.
    pub name: &'static str,
    /// Unit; empty for a share, a count or a word.
    pub unit: &'static str,
    /// The meaning, without a full stop, as `docs/columns.md` has it.
    pub meaning: &'static str,
    /// Label with which `evaluate` prints the column; `None` if it does not print it.
    pub printed: Option<&'static str>,
    /// The tag of TensorBoard's scalar of a training episode, if it has one.
    pub scalar: Option<&'static str>,
    /// The tag of TensorBoard's scalar of an evaluation, the mean over its episodes, if it has one.
    pub evaluation_scalar: Option<&'static str>,
    /// The numbers of the column that tables of runs have.
    pub of_runs: &'static [RunNumber],
    of: fn(&Parts) -> Cell,
}

impl Column {
    const fn new(name: &'static str, unit: &'static str, meaning: &'static str, of: fn(&Parts) -> Cell) -> Self {
        Column { name, unit, meaning, printed: None, scalar: None, evaluation_scalar: None, of_runs: &[], of }
    }

    const fn printed(mut self, label: &'static str) -> Self {
        self.printed = Some(label);
        self
    }

    const fn scalar(mut self, tag: &'static str) -> Self {
        self.scalar = Some(tag);
        self
    }

    const fn evaluation_scalar(mut self, tag: &'static str) -> Self {
        self.evaluation_scalar = Some(tag);
        self
    }

    const fn of_runs(mut self, numbers: &'static [RunNumber]) -> Self {
        self.of_runs = numbers;
        self
    }

    /// The column's cell for an episode.
    pub(crate) fn of(&self, episode: &Parts) -> Cell {
        (self.of)(episode)
    }
}

/// Every column, in the order of the tables.
pub static COLUMNS: LazyLock<Vec<Column>> = LazyLock::new(|| {
    [
        success::COLUMNS,
        energy::COLUMNS,
        force::COLUMNS,
        to_success::COLUMNS,
        fulfilled::COLUMNS,
        impedance::COLUMNS,
        motion::COLUMNS,
        protection::COLUMNS,
        score::COLUMNS,
    ]
    .concat()
});

/// Every number that tables of runs take over the episodes `over`, each with its column.
pub fn run_numbers(over: Over) -> impl Iterator<Item = (&'static Column, &'static RunNumber)> {
    let of_column = |column: &'static Column| column.of_runs.iter().map(move |number| (column, number));
    COLUMNS.iter().flat_map(of_column).filter(move |(_, number)| number.over == over)
}
