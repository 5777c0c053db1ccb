//! When and why a real arm would have stopped itself.

use super::Over::{Baseline, End, Final, Sampled};
use super::Statistic::Mean;
use super::parts::Part;
use super::{Cell, Column, number, summarised};

pub(super) const COLUMNS: &[Column] = &[
    Column::new("max_joint_speed_share", "", "largest speed of a joint as a share of its limit", |e| Cell::Real(e.whole.max_speed))
        .printed("fastest joint, of its limit"),
    Column::new("max_joint_speed_share_to_success", "", "the same until the task first stands fulfilled", |e| {
        e.to_success.map(|part| part.max_speed).into()
    }),
    Column::new(
        "stop_time_s",
        "s",
        "when a real arm would first have stopped itself; empty if it would not have, and so is the next",
        |e| e.stop.map(|(at, stop)| Part::of(&e.steps[..at]).time + stop.time).into(),
    )
    .printed("time until a real arm stops, s"),
    Column::new(
        "stop_reason",
        "",
        "why: `joint-speed`, `hand-force`, `link-force`, `self-contact` (thresholds: `env.protection`)",
        |e| e.stop.map_or(Cell::Empty, |(_, stop)| Cell::Word(stop.reason.as_str())),
    ),
    Column::new(
        "success_before_stop",
        "",
        "the task stood fulfilled after an action before that one, or at any time if the arm would not have stopped: *allowed success*",
        |e| Cell::Flag(e.success_before_stop()),
    )
    .printed("success before a real arm stops")
    .of_runs(&[
        summarised("final_success_before_stop", Final, Mean),
        summarised("sampled_success_before_stop", Sampled, Mean),
        summarised("end_success_before_stop", End, Mean),
        number("success_before_stop", Baseline, Mean),
    ]),
];
