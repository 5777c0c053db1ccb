//! What an episode came to: the columns that training and evaluation share.

use serde::{Deserialize, Serialize};

use crate::env::Step;
use crate::interval::{AxisGroup, Stop};
use crate::protection::StopReason;
use crate::task::HELD;

/// What an episode ended with and what it cost, in the order of the columns.
///
/// `..._to_success_...` covers the actions up to the first after which the task stands fulfilled, that one included, and is
/// empty if there is none; `fulfilled_...` covers the actions after which it stands fulfilled. `stop_...` says when and why a
/// real arm would have stopped itself, and is empty if it would not have.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct Outcome {
    #[serde(rename = "return")]
    pub total: f64,
    pub length: usize,
    pub success: bool,
    pub success_any: bool,
    pub success_held: bool,
    pub success_without_hand: bool,
    pub terminated: bool,
    pub truncated: bool,
    pub diverged: bool,
    pub energy_j: f64,
    pub energy_per_action_j: f64,
    pub energy_positive_j: f64,
    pub energy_net_j: f64,
    pub squared_torque_nm2s: f64,
    pub copper_loss_j: f64,
    pub penalty: f64,
    pub penalised_steps: usize,
    pub excess_impulse_ns: f64,
    pub max_contact_force_n: f64,
    pub p99_contact_force_n: f64,
    pub max_raw_contact_force_n: f64,
    pub contact_time_s: f64,
    pub arm_max_contact_force_n: f64,
    pub arm_contact_time_s: f64,
    pub self_contact_time_s: f64,
    pub time_to_success_s: Option<f64>,
    pub energy_to_success_j: Option<f64>,
    pub energy_positive_to_success_j: Option<f64>,
    pub energy_net_to_success_j: Option<f64>,
    pub squared_torque_to_success_nm2s: Option<f64>,
    pub copper_loss_to_success_j: Option<f64>,
    pub max_force_to_success_n: Option<f64>,
    pub impulse_to_success_ns: Option<f64>,
    pub hand_share_to_success: Option<f64>,
    pub fulfilled_time_s: f64,
    pub fulfilled_energy_j: f64,
    pub fulfilled_max_force_n: f64,
    pub fulfilled_impulse_ns: f64,
    pub mean_stiffness: f64,
    pub saturated_fraction: f64,
    pub stiffness_translation_n_per_m: f64,
    pub stiffness_rotation_nm_per_rad: f64,
    pub feedforward_spring_translation_n_per_m: Option<f64>,
    pub feedforward_spring_rotation_nm_per_rad: Option<f64>,
    pub at_k_min_translation: f64,
    pub at_k_max_translation: f64,
    pub at_k_min_rotation: f64,
    pub at_k_max_rotation: f64,
    pub feedforward_share_translation: f64,
    pub feedforward_share_rotation: f64,
    pub tool_work_translation_j: f64,
    pub tool_work_rotation_j: f64,
    pub max_joint_speed_share: f64,
    pub max_joint_speed_share_to_success: Option<f64>,
    pub stop_time_s: Option<f64>,
    pub stop_reason: Option<StopReason>,
    pub success_before_stop: bool,
}

impl Outcome {
    /// Of an episode's actions, in their order.
    pub(crate) fn of(steps: &[Step]) -> Self {
        let n = steps.len().max(1) as f64;
        let first_success = steps.iter().position(|s| s.success);
        let whole = Part::of(steps);
        let before = first_success.map(|at| Part::of(&steps[..=at]));
        let fulfilled = Part::of(steps.iter().filter(|s| s.success));
        let held = Part::of(steps.iter().rev().take_while(|s| s.success));
        let first_stop = steps.iter().enumerate().find_map(|(at, s)| Some((at, s.interval.stop?)));
        let stop_time = |(at, stop): (usize, Stop)| Part::of(&steps[..at]).time + stop.time;
        let sum = |of: fn(&Step) -> f64| steps.iter().map(of).sum::<f64>();
        let max = |of: fn(&Step) -> f64| steps.iter().map(of).fold(0.0, f64::max);
        let last = steps.last();
        let samples = steps.iter().map(|s| f64::from(s.interval.samples)).sum::<f64>().max(1.0);
        let [translation, rotation] = impedance(steps);
        let spring = |part: &AxisGroup| Some(part.sum_feedforward_spring / samples).filter(|mean| mean.is_finite());
        Outcome {
            total: sum(|s| s.reward),
            length: steps.len(),
            success: last.is_some_and(|s| s.success),
            success_any: first_success.is_some(),
            success_held: held.time > HELD - 1e-9,
            success_without_hand: before.is_some_and(|part| part.hand_time == 0.0),
            terminated: last.is_some_and(|s| s.terminated),
            truncated: last.is_some_and(|s| s.truncated),
            diverged: last.is_some_and(|s| s.diverged),
            energy_j: whole.energy,
            energy_per_action_j: whole.energy / n,
            energy_positive_j: whole.positive,
            energy_net_j: whole.net,
            squared_torque_nm2s: whole.squared_torque,
            copper_loss_j: whole.copper_loss,
            penalty: sum(|s| s.penalty),
            penalised_steps: steps.iter().filter(|s| s.over_limit).count(),
            excess_impulse_ns: sum(|s| s.interval.excess_impulse),
            max_contact_force_n: max(|s| s.interval.hand.max),
            p99_contact_force_n: force_percentile(steps, 0.99),
            max_raw_contact_force_n: max(|s| s.interval.hand.max_raw),
            contact_time_s: whole.hand_time,
            arm_max_contact_force_n: whole.max_force,
            arm_contact_time_s: sum(|s| s.interval.link_contact_time),
            self_contact_time_s: sum(|s| s.interval.self_contact_time),
            time_to_success_s: before.map(|part| part.time),
            energy_to_success_j: before.map(|part| part.energy),
            energy_positive_to_success_j: before.map(|part| part.positive),
            energy_net_to_success_j: before.map(|part| part.net),
            squared_torque_to_success_nm2s: before.map(|part| part.squared_torque),
            copper_loss_to_success_j: before.map(|part| part.copper_loss),
            max_force_to_success_n: before.map(|part| part.max_force),
            impulse_to_success_ns: before.map(|part| part.impulse),
            hand_share_to_success: before
                .filter(|part| part.impulse > 0.0)
                .map(|part| part.hand_impulse / part.impulse),
            fulfilled_time_s: fulfilled.time,
            fulfilled_energy_j: fulfilled.energy,
            fulfilled_max_force_n: fulfilled.max_force,
            fulfilled_impulse_ns: fulfilled.impulse,
            mean_stiffness: sum(|s| s.interval.mean_own_stiffness()) / n,
            saturated_fraction: sum(|s| s.interval.saturated()) / n,
            stiffness_translation_n_per_m: translation.sum_stiffness / samples,
            stiffness_rotation_nm_per_rad: rotation.sum_stiffness / samples,
            feedforward_spring_translation_n_per_m: spring(&translation),
            feedforward_spring_rotation_nm_per_rad: spring(&rotation),
            at_k_min_translation: translation.sum_at_min / samples,
            at_k_max_translation: translation.sum_at_max / samples,
            at_k_min_rotation: rotation.sum_at_min / samples,
            at_k_max_rotation: rotation.sum_at_max / samples,
            feedforward_share_translation: translation.feedforward_share(),
            feedforward_share_rotation: rotation.feedforward_share(),
            tool_work_translation_j: translation.work,
            tool_work_rotation_j: rotation.work,
            max_joint_speed_share: whole.max_speed,
            max_joint_speed_share_to_success: before.map(|part| part.max_speed),
            stop_time_s: first_stop.map(stop_time),
            stop_reason: first_stop.map(|(_, stop)| stop.reason),
            success_before_stop: first_success.is_some_and(|success| first_stop.is_none_or(|(stop, _)| success < stop)),
        }
    }
}

/// Some of an episode's actions: how long, what they cost, how hard the arm was pushed.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    /// s
    time: f64,
    /// The definitions of [`aforce::EnergyLedger`].
    energy: f64,
    positive: f64,
    net: f64,
    squared_torque: f64,
    copper_loss: f64,
    /// Largest force on the whole arm (N).
    max_force: f64,
    /// Integral of the force on the whole arm (N s).
    impulse: f64,
    /// The hand's part of it (N s).
    hand_impulse: f64,
    /// Time with contact beyond the wrist (s).
    hand_time: f64,
    /// Largest speed of a joint, as a share of its limit.
    max_speed: f64,
}

impl Part {
    fn of<'a>(steps: impl IntoIterator<Item = &'a Step>) -> Self {
        steps.into_iter().fold(Part::default(), |sum, Step { interval, .. }| Part {
            time: sum.time + interval.time,
            energy: sum.energy + interval.energy.absolute,
            positive: sum.positive + interval.energy.positive,
            net: sum.net + interval.energy.net,
            squared_torque: sum.squared_torque + interval.energy.squared_torque,
            copper_loss: sum.copper_loss + interval.energy.copper_loss,
            max_force: sum.max_force.max(interval.arm.max),
            impulse: sum.impulse + interval.arm.impulse,
            hand_impulse: sum.hand_impulse + interval.hand.impulse,
            hand_time: sum.hand_time + interval.contact_time,
            max_speed: sum.max_speed.max(interval.max_speed_share),
        })
    }
}

/// Largest force beyond the wrist (N) of an action that a `share` of the actions does not exceed.
fn force_percentile(steps: &[Step], share: f64) -> f64 {
    let mut forces: Vec<f64> = steps.iter().map(|s| s.interval.hand.max).collect();
    forces.sort_by(f64::total_cmp);
    let rank = (share * forces.len() as f64).ceil() as usize;
    forces.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// What the impedance of the translational and of the rotational axes did.
fn impedance(steps: &[Step]) -> [AxisGroup; 2] {
    let mut sums = [AxisGroup::default(); 2];
    for step in steps {
        for (sum, group) in sums.iter_mut().zip(step.interval.impedance) {
            *sum += group;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ForceRecord, Interval, REWARD_TERMS};
    use aforce::EnergyLedger;

    fn step(interval: Interval, success: bool) -> Step {
        Step {
            reward: 0.0,
            reward_terms: [0.0; REWARD_TERMS],
            motion_cost: 0.0,
            terminated: false,
            truncated: false,
            success,
            diverged: false,
            over_limit: false,
            penalty: 0.0,
            interval,
        }
    }

    #[test]
    fn ninety_nine_of_a_hundred_actions_stay_below_the_percentile() {
        let force = |max| Interval { hand: ForceRecord { max, ..ForceRecord::default() }, ..Interval::default() };
        let steps: Vec<Step> = (1..=200).rev().map(|n| step(force(f64::from(n)), false)).collect();
        let outcome = Outcome::of(&steps);
        assert_eq!((outcome.p99_contact_force_n, outcome.max_contact_force_n), (198.0, 200.0));
        assert_eq!(Outcome::of(&[]).p99_contact_force_n, 0.0);
    }

    /// An action of 50 ms that takes `energy`, in which the hand is pushed with 2 N and the links with what the arm
    /// feels beyond that.
    fn action(energy: f64, arm: f64, success: bool) -> Step {
        let force = |newton: f64| ForceRecord { max: newton, impulse: 0.05 * newton, last: newton, max_raw: newton };
        let energy = EnergyLedger { absolute: energy, positive: 0.5 * energy, ..EnergyLedger::default() };
        let (hand, contact_time) = (force(2.0), if arm == 2.0 { 0.05 } else { 0.0 });
        step(
            Interval { samples: 25, time: 0.05, energy, hand, arm: force(arm), contact_time, ..Interval::default() },
            success,
        )
    }

    /// Two actions until the task is fulfilled, one in which it is not any more, then a second and a bit in which it is.
    #[test]
    fn the_task_and_what_follows_are_told_apart() {
        let mut steps = vec![action(3.0, 8.0, false), action(5.0, 2.0, true), action(7.0, 9.0, false)];
        steps.extend(vec![action(1.0, 4.0, true); 20]);
        let outcome = Outcome::of(&steps);
        let to_success = (outcome.time_to_success_s, outcome.energy_to_success_j, outcome.energy_positive_to_success_j);
        assert_eq!(to_success, (Some(0.1), Some(8.0), Some(4.0)));
        assert_eq!((outcome.max_force_to_success_n, outcome.impulse_to_success_ns), (Some(8.0), Some(0.5)));
        assert_eq!(outcome.hand_share_to_success, Some(0.4));
        assert_eq!((outcome.fulfilled_energy_j, outcome.fulfilled_max_force_n), (25.0, 4.0));
        assert!((outcome.fulfilled_time_s - 1.05).abs() < 1e-12 && outcome.arm_max_contact_force_n == 9.0);
        assert!(outcome.success_held && outcome.success_any && !outcome.success_without_hand);
        assert!(!Outcome::of(&steps[..22]).success_held, "a twentieth of a second too short");
        assert!(Outcome::of(&steps[3..]).success_without_hand, "fulfilled before the hand touched anything");
    }

    /// Every number of an action is another one, so that a column that took its neighbour's would show.
    #[test]
    fn every_column_holds_what_its_name_says() {
        let group = |n: f64| AxisGroup {
            sum_stiffness: n,
            sum_feedforward_spring: n + 1.0,
            sum_at_min: n + 2.0,
            sum_at_max: n + 3.0,
            sum_feedforward: 1.0,
            sum_spring: n,
            sum_damper: 2.0,
            work: n + 4.0,
        };
        let interval = Interval {
            samples: 2,
            energy: EnergyLedger {
                absolute: 1.0,
                positive: 2.0,
                net: 3.0,
                squared_torque: 4.0,
                copper_loss: 5.0,
                ..EnergyLedger::default()
            },
            excess_impulse: 6.0,
            link_contact_time: 7.0,
            self_contact_time: 8.0,
            hand: ForceRecord { max_raw: 9.0, ..ForceRecord::default() },
            sum_own_stiffness: 20.0,
            impedance: [group(30.0), group(50.0)],
            sum_saturated: 0.5,
            max_speed_share: 13.0,
            ..Interval::default()
        };
        let one = Step { penalty: 11.0, over_limit: true, reward: 12.0, ..step(interval, false) };
        let outcome = Outcome::of(&[one, one]);
        let expected = [
            ("return", outcome.total, 24.0),
            ("energy_j", outcome.energy_j, 2.0),
            ("energy_per_action_j", outcome.energy_per_action_j, 1.0),
            ("energy_positive_j", outcome.energy_positive_j, 4.0),
            ("energy_net_j", outcome.energy_net_j, 6.0),
            ("squared_torque_nm2s", outcome.squared_torque_nm2s, 8.0),
            ("copper_loss_j", outcome.copper_loss_j, 10.0),
            ("penalty", outcome.penalty, 22.0),
            ("penalised_steps", outcome.penalised_steps as f64, 2.0),
            ("excess_impulse_ns", outcome.excess_impulse_ns, 12.0),
            ("max_raw_contact_force_n", outcome.max_raw_contact_force_n, 9.0),
            ("arm_contact_time_s", outcome.arm_contact_time_s, 14.0),
            ("self_contact_time_s", outcome.self_contact_time_s, 16.0),
            // Means over the four samples.
            ("mean_stiffness", outcome.mean_stiffness, 10.0),
            ("saturated_fraction", outcome.saturated_fraction, 0.25),
            ("stiffness_translation_n_per_m", outcome.stiffness_translation_n_per_m, 15.0),
            ("stiffness_rotation_nm_per_rad", outcome.stiffness_rotation_nm_per_rad, 25.0),
            ("feedforward_spring_translation", outcome.feedforward_spring_translation_n_per_m.unwrap(), 15.5),
            ("feedforward_spring_rotation", outcome.feedforward_spring_rotation_nm_per_rad.unwrap(), 25.5),
            ("at_k_min_translation", outcome.at_k_min_translation, 16.0),
            ("at_k_max_translation", outcome.at_k_max_translation, 16.5),
            ("at_k_min_rotation", outcome.at_k_min_rotation, 26.0),
            ("at_k_max_rotation", outcome.at_k_max_rotation, 26.5),
            ("feedforward_share_translation", outcome.feedforward_share_translation, 1.0 / 33.0),
            ("feedforward_share_rotation", outcome.feedforward_share_rotation, 1.0 / 53.0),
            ("tool_work_translation_j", outcome.tool_work_translation_j, 68.0),
            ("tool_work_rotation_j", outcome.tool_work_rotation_j, 108.0),
            ("max_joint_speed_share", outcome.max_joint_speed_share, 13.0),
        ];
        for (column, value, expected) in expected {
            assert!((value - expected).abs() < 1e-12, "{column}: {value}, not {expected}");
        }
    }

    /// Ten actions of 50 ms, the task fulfilled from the fourth on; a real arm would have stopped 20 ms into one of them.
    #[test]
    fn success_counts_where_a_real_arm_would_still_have_been_moving() {
        let stopping_in = |at: usize| {
            let mut steps: Vec<Step> = (0..10).map(|k| action(1.0, 2.0, k >= 3)).collect();
            for (late, reason) in [(0, StopReason::JointSpeed), (2, StopReason::HandForce)] {
                if let Some(step) = steps.get_mut(at + late) {
                    (step.interval.stop, step.interval.max_speed_share) = (Some(Stop { time: 0.02, reason }), 1.5);
                }
            }
            let o = Outcome::of(&steps);
            (o.success_before_stop, o.stop_time_s, o.stop_reason, o.max_joint_speed_share_to_success)
        };
        let after = |actions: f64| Some(actions * 0.05 + 0.02);
        assert_eq!(stopping_in(1), (false, after(1.0), Some(StopReason::JointSpeed), Some(1.5)));
        assert!(!stopping_in(3).0, "in the very action that fulfils the task");
        let (success, time, _, speed) = stopping_in(4);
        assert!(success && (time.unwrap() - 0.22).abs() < 1e-12 && speed == Some(0.0));
        assert_eq!(stopping_in(10), (true, None, None, Some(0.0)));
    }

    #[test]
    fn without_success_nothing_is_said_of_the_way_to_it() {
        let outcome = Outcome::of(&[action(3.0, 8.0, false)]);
        assert_eq!((outcome.time_to_success_s, outcome.hand_share_to_success), (None, None));
        assert_eq!((outcome.fulfilled_time_s, outcome.success_without_hand), (0.0, false));
    }
}
