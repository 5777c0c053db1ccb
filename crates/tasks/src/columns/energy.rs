//! The energy of an episode, in every definition.

use super::Over::{Baseline, End, Final, Sampled, Training};
use super::Statistic::{Mean, PerAction};
use super::{Cell, Column, number, summarised};

pub(super) const COLUMNS: &[Column] = &[
    Column::new(
        "energy_j",
        "J",
        "sum over samples and joints of abs(tau qd) dt, tau the torque that acts, qd the mean velocity of the sample: the headline energy",
        |e| Cell::Real(e.whole.energy),
    )
    .of_runs(&[
        summarised("energy_per_action_j", Training, PerAction),
        number("energy_per_action_j", Baseline, PerAction),
    ]),
    Column::new("energy_per_action_j", "J", "the same divided by the actions", |e| {
        Cell::Real(e.whole.energy / e.actions())
    })
    .printed("energy, J per action")
    .scalar("energy/per_action_j")
    .evaluation_scalar("eval/energy_per_action_j")
    .of_runs(&[
        summarised("final_energy_per_action_j", Final, Mean),
        number("sampled_energy_per_action_j", Sampled, Mean),
        summarised("end_energy_per_action_j", End, Mean),
    ]),
    Column::new("energy_positive_j", "J", "positive part of tau qd only", |e| Cell::Real(e.whole.positive))
        .of_runs(&[number("energy_positive_per_action_j", Training, PerAction)]),
    Column::new("energy_net_j", "J", "tau qd with its sign: work done on the arm", |e| Cell::Real(e.whole.net))
        .of_runs(&[number("energy_net_per_action_j", Training, PerAction)]),
    Column::new("squared_torque_nm2s", "(Nm)2 s", "integral of tau squared", |e| Cell::Real(e.whole.squared_torque))
        .of_runs(&[number("squared_torque_per_action_nm2s", Training, PerAction)]),
    Column::new(
        "copper_loss_j",
        "J",
        "squared torque weighted by nominal motor constants (an estimate)",
        |e| Cell::Real(e.whole.copper_loss),
    )
    .scalar("energy/copper_loss_j")
    .of_runs(&[number("copper_loss_per_action_j", Training, PerAction)]),
];
