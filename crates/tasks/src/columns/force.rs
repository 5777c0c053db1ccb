//! The contact forces of an episode. A sustained force is low-passed, by default at 12 Hz.

use super::Over::{Baseline, End, Sampled, Training};
use super::Statistic::{Mean, Median, PerAction, Quantile90, ShareAbove0};
use super::{Cell, Column, number, summarised};

pub(super) const COLUMNS: &[Column] = &[
    Column::new(
        "penalty",
        "reward",
        "sum over actions of `env.force_penalty.weight` times F (0.05 by default) where the largest sustained force F of an action exceeds \
         `env.force_penalty.limit` (60 N), recorded in every task; F is that of the whole arm, with `env.force_penalty.of = \"hand\"` that beyond the wrist",
        |e| Cell::Real(e.sum(|s| s.penalty)),
    )
    .printed("penalty")
    .scalar("contact/penalty")
    .evaluation_scalar("eval/penalty")
    .of_runs(&[
        summarised("mean_penalty_per_episode", Training, Mean),
        summarised("median_penalty_per_episode", Training, Median),
        summarised("q90_penalty_per_episode", Training, Quantile90),
        number("penalty", Baseline, Mean),
        number("penalty_median", Baseline, Median),
        number("penalty_q90", Baseline, Quantile90),
    ]),
    Column::new("penalised_steps", "", "actions in which F exceeds `env.force_penalty.limit`, also where the task takes nothing off", |e| {
        Cell::Count(e.steps.iter().filter(|s| s.over_limit).count() as u64)
    })
    .printed("penalised actions")
    .scalar("contact/penalised_steps")
    .of_runs(&[
        summarised("penalised_episode_share", Training, ShareAbove0),
        summarised("penalised_action_share", Training, PerAction),
        number("penalised_episode_share", Baseline, ShareAbove0),
        number("penalised_action_share", Baseline, PerAction),
    ]),
    Column::new("excess_impulse_ns", "N s", "integral of F above `env.force_penalty.limit`", |e| Cell::Real(e.sum(|s| s.interval.excess_impulse)))
        .printed("excess impulse, N s")
        .scalar("contact/excess_impulse_ns")
        .of_runs(&[summarised("excess_impulse_per_episode_ns", Training, Mean)]),
    Column::new("max_contact_force_n", "N", "largest norm of the sustained contact force beyond the wrist", |e| {
        Cell::Real(e.max(|s| s.interval.hand.max))
    })
    .printed("largest force of the hand, N")
    .scalar("contact/max_force_n")
    .evaluation_scalar("eval/max_contact_force_n")
    .of_runs(&[summarised("end_max_contact_force_n", End, Mean), number("max_contact_force_n", Baseline, Mean)]),
    Column::new("p99_contact_force_n", "N", "99 % of an episode's actions have at most this largest sustained force beyond the wrist", |e| {
        Cell::Real(e.force_percentile(0.99))
    }),
    Column::new("max_raw_contact_force_n", "N", "largest norm of the contact force beyond the wrist, unfiltered", |e| {
        Cell::Real(e.max(|s| s.interval.hand.max_raw))
    }),
    Column::new("contact_time_s", "s", "time in contact beyond the wrist", |e| Cell::Real(e.whole.hand_time)),
    Column::new(
        "mean_contact_force_n",
        "N",
        "mean norm of the sustained contact force beyond the wrist over that time; empty without contact",
        |e| e.whole.contact_force().into(),
    )
    .printed("mean force in contact, N")
    .of_runs(&[summarised("end_mean_contact_force_n", End, Mean), number("mean_contact_force_n", Baseline, Mean)]),
    Column::new("hard_contact_time_s", "s", "time in which that force is above 20 N", |e| Cell::Real(e.whole.hard_time))
        .of_runs(&[summarised("end_hard_contact_time_s", End, Mean), number("hard_contact_time_s", Baseline, Mean)]),
    Column::new(
        "arm_max_contact_force_n",
        "N",
        "largest sustained force on the whole arm: the norm of that beyond the wrist, and the sizes of all forces on the links added to it",
        |e| Cell::Real(e.whole.max_force),
    )
    .printed("of the whole arm, N")
    .of_runs(&[
        summarised("median_arm_max_contact_force_n", Training, Median),
        summarised("q90_arm_max_contact_force_n", Training, Quantile90),
        number("sampled_arm_max_contact_force_n", Sampled, Mean),
        number("sampled_arm_max_contact_force_median_n", Sampled, Median),
        number("sampled_arm_max_contact_force_q90_n", Sampled, Quantile90),
        summarised("end_arm_max_contact_force_median_n", End, Median),
        number("arm_max_contact_force_median_n", Baseline, Median),
        number("arm_max_contact_force_q90_n", Baseline, Quantile90),
    ]),
    Column::new("arm_contact_time_s", "s", "time in which the scene touches a link between base and wrist; the hand does not count", |e| {
        Cell::Real(e.sum(|s| s.interval.link_contact_time))
    }),
    Column::new("self_contact_time_s", "s", "time in which two parts of the arm touch each other", |e| {
        Cell::Real(e.sum(|s| s.interval.self_contact_time))
    })
    .of_runs(&[number("sampled_self_contact_time_s", Sampled, Mean)]),
];
