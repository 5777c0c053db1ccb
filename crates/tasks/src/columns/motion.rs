//! How the tool moved.

use super::Over::{Baseline, End};
use super::Statistic::Mean;
use super::{Cell, Column, number, summarised};

pub(super) const COLUMNS: &[Column] = &[
    Column::new("path_m", "m", "length of the way of the tool point", |e| Cell::Real(e.whole.path))
        .of_runs(&[summarised("end_path_m", End, Mean), number("path_m", Baseline, Mean)]),
    Column::new(
        "jerk_mps3",
        "m/s3",
        "mean size of the tool point's jerk while it moves faster than 1 cm/s: the second derivative of a quadratic through its velocities in \
         15 control samples; empty if it never moves",
        |e| e.whole.jerk().into(),
    )
    .of_runs(&[summarised("end_jerk_mps3", End, Mean), number("jerk_mps3", Baseline, Mean)]),
];
