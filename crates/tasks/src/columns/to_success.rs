//! Time, energy and force up to the first success. The cells of an episode without success are empty.

use super::Over::{Baseline, End, Final, Sampled};
use super::Statistic::{Mean, Median, Quantile90};
use super::parts::Part;
use super::{Cell, Column, Parts, number, summarised};

fn of(episode: &Parts, number: fn(Part) -> f64) -> Cell {
    episode.to_success.map(number).into()
}

pub(super) const COLUMNS: &[Column] = &[
    Column::new(
        "time_to_success_s",
        "s",
        "until the end of the action after which the task first stands fulfilled; this and the next are empty if it never does",
        |e| of(e, |part| part.time),
    )
    .printed("time to success, s")
    .of_runs(&[
        number("final_time_to_success_s", Final, Mean),
        summarised("sampled_time_to_success_s", Sampled, Mean),
        summarised("end_time_to_success_s", End, Mean),
        number("time_to_success_s", Baseline, Mean),
    ]),
    Column::new("energy_to_success_j", "J", "`energy_j` until then", |e| of(e, |part| part.energy))
        .printed("energy to success, J")
        .of_runs(&[
            number("final_energy_to_success_j", Final, Mean),
            summarised("sampled_energy_to_success_j", Sampled, Mean),
            summarised("end_energy_to_success_j", End, Mean),
            number("energy_to_success_j", Baseline, Mean),
        ]),
    Column::new("energy_positive_to_success_j", "J", "`energy_positive_j` until then", |e| of(e, |part| part.positive)),
    Column::new("energy_net_to_success_j", "J", "`energy_net_j` until then", |e| of(e, |part| part.net)),
    Column::new("squared_torque_to_success_nm2s", "(Nm)2 s", "`squared_torque_nm2s` until then", |e| {
        of(e, |part| part.squared_torque)
    }),
    Column::new("copper_loss_to_success_j", "J", "`copper_loss_j` until then", |e| of(e, |part| part.copper_loss)),
    Column::new("max_force_to_success_n", "N", "largest sustained force on the whole arm until then", |e| {
        of(e, |part| part.max_force)
    })
    .printed("largest force to success, N")
    .of_runs(&[
        number("final_max_force_to_success_n", Final, Mean),
        number("sampled_max_force_to_success_n", Sampled, Mean),
        number("sampled_max_force_to_success_median_n", Sampled, Median),
        number("sampled_max_force_to_success_q90_n", Sampled, Quantile90),
        summarised("end_max_force_to_success_n", End, Mean),
        number("max_force_to_success_n", Baseline, Mean),
    ]),
    Column::new("impulse_to_success_ns", "N s", "integral of the force on the whole arm until then", |e| {
        of(e, |part| part.impulse)
    })
    .of_runs(&[number("sampled_impulse_to_success_ns", Sampled, Mean)]),
    Column::new(
        "hand_share_to_success",
        "",
        "the part of that integral that was exerted beyond the wrist; empty without contact too",
        |e| {
            let pressed = e.to_success.filter(|part| part.impulse > 0.0);
            pressed.map(|part| part.hand_impulse / part.impulse).into()
        },
    )
    .of_runs(&[number("sampled_hand_share_to_success", Sampled, Mean)]),
];
