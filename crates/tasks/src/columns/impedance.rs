//! How stiff the arm was, and what the law did.

use super::Over::{Baseline, Training};
use super::Statistic::{Mean, Median, PerAction};
use super::{Cell, Column, Parts, number};
use crate::axis_group::AxisGroup;

/// Indices of the translational and of the rotational axes in an episode's sums.
const TRANSLATION: usize = 0;
const ROTATION: usize = 1;

/// Mean over the control samples of a quantity of which `sum` gives the sum.
fn mean(episode: &Parts, group: usize, sum: fn(&AxisGroup) -> f64) -> Cell {
    Cell::Real(sum(&episode.impedance[group]) / episode.samples)
}

/// Mean of alpha/mu, the stiffness that F_ff adds under a lasting error. Without a leak (mu = 0) it is infinite and the cell is empty.
fn feedforward_spring(episode: &Parts, group: usize) -> Cell {
    let mean = episode.impedance[group].sum_feedforward_spring / episode.samples;
    Some(mean).filter(|mean| mean.is_finite()).into()
}

pub(super) const COLUMNS: &[Column] = &[
    Column::new(
        "mean_stiffness",
        "",
        "mean over actions and translational axes, in the space's own unit (its `config.toml` says which); K alone, without feed-forward",
        |e| Cell::Real(e.sum(|s| s.interval.mean_own_stiffness()) / e.actions()),
    )
    .of_runs(&[number("mean_stiffness", Training, Mean)]),
    Column::new("saturated_fraction", "", "share of joint torques that the law's own limits cut, of size or of rate; a mean over actions", |e| {
        Cell::Real(e.sum(|s| s.interval.saturated()) / e.actions())
    })
    .printed("torques at their limit")
    .of_runs(&[number("saturated_fraction", Baseline, Mean)]),
    Column::new(
        "stiffness_translation_n_per_m",
        "N/m",
        "K, whatever the space's unit: mean over time and three axes, the contact axis included while a force controller has taken it \
         over (there K does not act, and AFORCE's sinks); a K in 1/s2 acts times the inertia, which is very large in some poses, so medians \
         are what to compare",
        |e| mean(e, TRANSLATION, |sums| sums.sum_stiffness),
    )
    .printed("stiffness, N/m")
    .scalar("contact/stiffness_translation_n_per_m")
    .of_runs(&[
        number("stiffness_translation_n_per_m", Training, Mean),
        number("median_stiffness_translation_n_per_m", Training, Median),
    ]),
    Column::new("stiffness_rotation_nm_per_rad", "Nm/rad", "the same about three axes", |e| {
        mean(e, ROTATION, |sums| sums.sum_stiffness)
    })
    .printed("stiffness, Nm/rad")
    .of_runs(&[
        number("stiffness_rotation_nm_per_rad", Training, Mean),
        number("median_stiffness_rotation_nm_per_rad", Training, Median),
    ]),
    Column::new(
        "feedforward_spring_translation_n_per_m",
        "N/m",
        "alpha/mu, with the same axes: the spring that F_ff is to an error that lasts, beside K; 0 without F_ff, empty without a leak (mu = 0)",
        |e| feedforward_spring(e, TRANSLATION),
    ),
    Column::new("feedforward_spring_rotation_nm_per_rad", "Nm/rad", "the same about three axes", |e| {
        feedforward_spring(e, ROTATION)
    }),
    Column::new("at_k_min_translation", "", "share of translational axes and time with K at its lower bound; 0 for constants", |e| {
        mean(e, TRANSLATION, |sums| sums.sum_at_min)
    })
    .of_runs(&[number("at_k_min_translation", Training, Mean)]),
    Column::new("at_k_max_translation", "", "the same at its upper bound", |e| mean(e, TRANSLATION, |sums| sums.sum_at_max))
        .of_runs(&[number("at_k_max_translation", Training, Mean)]),
    Column::new("at_k_min_rotation", "", "share of rotational axes and time with K at its lower bound; 0 for constants", |e| {
        mean(e, ROTATION, |sums| sums.sum_at_min)
    })
    .of_runs(&[number("at_k_min_rotation", Training, Mean)]),
    Column::new("at_k_max_rotation", "", "the same at its upper bound", |e| mean(e, ROTATION, |sums| sums.sum_at_max))
        .of_runs(&[number("at_k_max_rotation", Training, Mean)]),
    Column::new(
        "feedforward_share_translation",
        "",
        "integral of the norm of F_ff over the sum of those of F_ff, K e and D e_dot, forces",
        |e| Cell::Real(e.impedance[TRANSLATION].feedforward_share()),
    )
    .of_runs(&[number("feedforward_share_translation", Training, Mean)]),
    Column::new("feedforward_share_rotation", "", "the same of the moments", |e| {
        Cell::Real(e.impedance[ROTATION].feedforward_share())
    })
    .of_runs(&[number("feedforward_share_rotation", Training, Mean)]),
    Column::new(
        "tool_work_translation_j",
        "J",
        "integral of abs(force x velocity) of the wrench that the controller asks for at the tool and the velocity it is told (with a \
         disturbance's noise)",
        |e| Cell::Real(e.impedance[TRANSLATION].work),
    )
    .of_runs(&[number("tool_work_translation_per_action_j", Training, PerAction)]),
    Column::new("tool_work_rotation_j", "J", "the same of moment and angular velocity", |e| Cell::Real(e.impedance[ROTATION].work))
        .of_runs(&[number("tool_work_rotation_per_action_j", Training, PerAction)]),
];
