//! Return, length, success and how an episode ended.

use super::Over::{Baseline, End, Final, Sampled};
use super::Statistic::{CountAbove0, Deviation, Mean};
use super::{Cell, Column, Over, number, summarised};

pub(super) const COLUMNS: &[Column] = &[
    Column::new(
        "return",
        "",
        "sum of rewards, less the penalty where the task has one and the prices of motion and of a stop (`env.motion_price`, `env.stop_price`)",
        |e| Cell::Real(e.sum(|s| s.reward)),
    )
    .printed("return")
    .scalar("charts/episodic_return")
    .evaluation_scalar("eval/episodic_return")
    .of_runs(&[
        summarised("final_return", Final, Mean),
        summarised("sampled_return", Sampled, Mean),
        summarised("end_return", End, Mean),
        number("return_mean", Baseline, Mean),
        number("return_std", Baseline, Deviation),
    ]),
    Column::new("length", "", "actions", |e| Cell::Count(e.steps.len() as u64)).scalar("charts/episodic_length"),
    Column::new("success", "", "the task stands fulfilled after the last action", |e| {
        Cell::Flag(e.at_the_end(|s| s.success))
    })
    .printed("success at the end")
    .evaluation_scalar("eval/success")
    .of_runs(&[
        summarised("final_success", Final, Mean),
        summarised("sampled_success", Sampled, Mean),
        summarised("end_success", End, Mean),
        number("success", Baseline, Mean),
    ]),
    Column::new("success_any", "", "the task stood fulfilled after any action", |e| {
        Cell::Flag(e.steps.iter().any(|s| s.success))
    })
    .printed("success at any time")
    .of_runs(&[summarised("final_success_any", Final, Mean), number("success_any", Baseline, Mean)]),
    Column::new("success_held", "", "the task stood fulfilled after every action of the last second", |e| {
        Cell::Flag(e.held())
    })
    .printed("success held for a second")
    .of_runs(&[
        number("final_success_held", Final, Mean),
        number("sampled_success_held", Sampled, Mean),
        summarised("end_success_held", End, Mean),
        number("success_held", Baseline, Mean),
    ]),
    Column::new(
        "success_without_hand",
        "",
        "the first success came before anything beyond the wrist had touched anything",
        |e| Cell::Flag(e.to_success.is_some_and(|part| part.hand_time == 0.0)),
    )
    .printed("success without the hand")
    .of_runs(&[number("sampled_success_without_hand", Sampled, Mean), number("success_without_hand", Baseline, Mean)]),
    Column::new(
        "terminated",
        "",
        "the simulation diverged, the task is lost, or (with `env.stops` and no price of it) the arm stopped itself",
        |e| Cell::Flag(e.at_the_end(|s| s.terminated)),
    ),
    Column::new(
        "truncated",
        "",
        "ended by the horizon, by a success where the configuration says so, or by a stop that has a price",
        |e| Cell::Flag(e.at_the_end(|s| s.truncated)),
    ),
    Column::new("diverged", "", "the simulation diverged", |e| Cell::Flag(e.at_the_end(|s| s.diverged)))
        .printed("diverged")
        .of_runs(&[
            number("diverged_episodes", Over::Training, CountAbove0),
            number("diverged_episodes", Baseline, CountAbove0),
        ]),
];
