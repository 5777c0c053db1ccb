//! Which tables a run may leave.

use crate::run::csv_writer::DIGITS;

/// The tables that a run may leave, each a file of its folder and a file of the archive.
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

    /// Digits of a fraction of a column in the archive: three are enough for an episode that is only one of a mean. The best evaluation is chosen
    /// by its return, which has the seven of the run's own table.
    pub fn digits(self, column: &str) -> usize {
        match self {
            Table::Episodes => 3,
            Table::Eval if column == "return" => DIGITS,
            Table::Eval => 3,
            Table::Progress | Table::Disturbed | Table::End => 5,
        }
    }
}
