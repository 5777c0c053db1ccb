//! The tables that a run may have.

use tasks::columns::{Over, run_numbers};

use crate::run::csv_writer::DIGITS;

/// Columns of training episodes that the archive always keeps: which episode it was, how it ended, and its largest force.
const KEPT_OF_TRAINING: [&str; 15] = [
    "schema",
    "step",
    "episode",
    "return",
    "length",
    "success",
    "success_any",
    "success_held",
    "time_to_success_s",
    "max_contact_force_n",
    "terminated",
    "truncated",
    "stop_time_s",
    "stop_reason",
    "success_before_stop",
];

/// The tables that a run may have, each a file of its folder and a file of the archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One row per training episode.
    Episodes,
    /// One row per evaluation episode.
    Eval,
    /// One row per logging interval.
    Progress,
    /// One row per episode of `evaluate --disturb`.
    Disturbed,
    /// One row per episode of the last policy.
    End,
}

impl Table {
    /// Every table.
    pub const ALL: [Table; 5] = [Table::Episodes, Table::Eval, Table::Progress, Table::Disturbed, Table::End];

    /// Its file in the folder of a run; in an archive the same with `.zst` behind it.
    pub fn file(self) -> &'static str {
        match self {
            Table::Episodes => "episodes.csv",
            Table::Eval => "eval.csv",
            Table::Progress => "progress.csv",
            Table::Disturbed => "disturbed.csv",
            Table::End => "end.csv",
        }
    }

    /// Significant digits of a fraction of a column in the archive. Three are enough for episodes that only enter means,
    /// and for the losses of a learner. The best evaluation is chosen by its return, which has the seven digits of the
    /// run's own table.
    pub fn digits(self, column: &str) -> usize {
        match self {
            Table::Episodes => 3,
            Table::Eval if column == "return" => DIGITS,
            Table::Progress if matches!(column, "wall_s" | "cpu_s") => 5,
            Table::Eval | Table::Progress => 3,
            Table::Disturbed | Table::End => 5,
        }
    }

    /// Whether the archive keeps a column. Of training episodes it keeps the columns that a number in `runs.csv` needs,
    /// and those in which an episode's end is recorded. Evaluations keep all columns; training episodes matter less, as
    /// their actions have noise.
    pub fn keeps(self, column: &str) -> bool {
        let told = || run_numbers(Over::Training).any(|(known, _)| known.name == column);
        self != Table::Episodes || KEPT_OF_TRAINING.contains(&column) || told()
    }
}
