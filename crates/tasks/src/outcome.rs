//! The outcome of an episode: a row of the tables of episodes.

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::columns::{COLUMNS, Cell, Parts};
use crate::step::Step;

/// The outcome of an episode: a cell for each of [`COLUMNS`]. It serialises as a struct whose fields are the columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome(Vec<Cell>);

impl Outcome {
    /// The outcome of an episode with these actions, in their order.
    pub(crate) fn of(steps: &[Step]) -> Self {
        let episode = Parts::of(steps);
        Outcome(COLUMNS.iter().map(|column| column.of(&episode)).collect())
    }

    /// The cell of the column `name`.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn cell(&self, name: &str) -> Cell {
        self.0[place(name)]
    }

    /// The cell of the column `name` as a number; `None` if it is empty or a word.
    ///
    /// # Panics
    /// As [`Outcome::cell`].
    pub fn number(&self, name: &str) -> Option<f64> {
        self.cell(name).number()
    }

    /// Whether the flag in the column `name` is true.
    ///
    /// # Panics
    /// As [`Outcome::cell`].
    pub fn flag(&self, name: &str) -> bool {
        self.cell(name) == Cell::Flag(true)
    }

    /// The same outcome with other cells in some columns.
    ///
    /// # Panics
    /// As [`Outcome::cell`].
    pub fn with(mut self, cells: &[(&str, Cell)]) -> Self {
        cells.iter().for_each(|(name, cell)| self.0[place(name)] = *cell);
        self
    }
}

/// The outcome of an episode without actions.
impl Default for Outcome {
    fn default() -> Self {
        Outcome::of(&[])
    }
}

impl Serialize for Outcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Outcome", COLUMNS.len())?;
        COLUMNS.iter().zip(&self.0).try_for_each(|(column, cell)| row.serialize_field(column.name, cell))?;
        row.end()
    }
}

fn place(name: &str) -> usize {
    let at = COLUMNS.iter().position(|column| column.name == name);
    at.unwrap_or_else(|| panic!("{name} is no column"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis_group::AxisGroup;
    use crate::interval::Stop;
    use crate::{ForceRecord, Interval, RewardTerms, StopReason};
    use aforce::{EnergyLedger, Vector3};

    fn step(interval: Interval, success: bool) -> Step {
        Step {
            reward: 0.0,
            reward_terms: RewardTerms::default(),
            motion_cost: 0.0,
            stop_cost: 0.0,
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
        let forces = ["p99_contact_force_n", "max_contact_force_n"].map(|name| outcome.number(name));
        assert_eq!(forces, [Some(198.0), Some(200.0)]);
        assert_eq!(Outcome::default().number("p99_contact_force_n"), Some(0.0));
    }

    /// An action of 50 ms that takes `energy` (J). The force on the whole arm is `arm` (N), of which 2 N act on the hand.
    fn action(energy: f64, arm: f64, success: bool) -> Step {
        let force = |newton: f64| ForceRecord { max: newton, impulse: 0.05 * newton, last: newton, max_raw: newton };
        let energy = EnergyLedger { absolute: energy, positive: 0.5 * energy, ..EnergyLedger::default() };
        let (hand, contact_time) = (force(2.0), if arm == 2.0 { 0.05 } else { 0.0 });
        step(
            Interval { samples: 25, time: 0.05, energy, hand, arm: force(arm), contact_time, ..Interval::default() },
            success,
        )
    }

    /// The task is fulfilled after the second action, not after the third, and again after each of the last twenty, one second.
    #[test]
    fn the_task_and_what_follows_are_told_apart() {
        let mut steps = vec![action(3.0, 8.0, false), action(5.0, 2.0, true), action(7.0, 9.0, false)];
        steps.extend(vec![action(1.0, 4.0, true); 20]);
        let outcome = Outcome::of(&steps);
        for (column, value) in [
            ("time_to_success_s", 0.1),
            ("energy_to_success_j", 8.0),
            ("energy_positive_to_success_j", 4.0),
            ("max_force_to_success_n", 8.0),
            ("impulse_to_success_ns", 0.5),
            ("hand_share_to_success", 0.4),
            ("fulfilled_energy_j", 25.0),
            ("fulfilled_max_force_n", 4.0),
            ("arm_max_contact_force_n", 9.0),
        ] {
            assert_eq!(outcome.number(column), Some(value), "{column}");
        }
        assert!((outcome.number("fulfilled_time_s").unwrap() - 1.05).abs() < 1e-12);
        let flags = ["success_held", "success_any", "success_without_hand"].map(|name| outcome.flag(name));
        assert_eq!(flags, [true, true, false]);
        assert!(!Outcome::of(&steps[..22]).flag("success_held"), "a twentieth of a second too short");
        assert!(Outcome::of(&steps[3..]).flag("success_without_hand"), "fulfilled before the hand touched anything");
    }

    /// All numbers of an action differ, so that a wrong number in a column is noticed. Of three nearly equal actions the second fulfils
    /// the task, and in the third a real arm would have stopped.
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
            time: 0.5,
            energy: EnergyLedger {
                absolute: 5.0,
                positive: 7.0,
                net: 11.0,
                squared_torque: 13.0,
                copper_loss: 17.0,
                ..EnergyLedger::default()
            },
            excess_impulse: 19.0,
            link_contact_time: 23.0,
            self_contact_time: 29.0,
            hand: ForceRecord { max: 47.0, impulse: 53.0, max_raw: 59.0, ..ForceRecord::default() },
            arm: ForceRecord { max: 61.0, impulse: 67.0, ..ForceRecord::default() },
            sum_own_stiffness: 20.0,
            impedance: [group(30.0), group(50.0)],
            sum_saturated: 0.5,
            max_speed_share: 79.0,
            contact_time: 0.25,
            contact_impulse: 43.0,
            hard_time: 31.0,
            path: 37.0,
            moving_time: 0.125,
            sum_jerk: 41.0,
            ..Interval::default()
        };
        let one = Step { penalty: 71.0, over_limit: true, reward: 73.0, ..step(interval, false) };
        let mut steps = [one; 3];
        (steps[1].success, steps[1].interval.arm.max) = (true, 59.5);
        let last = &mut steps[2].interval;
        (last.arm.max, last.max_speed_share) = (89.0, 83.0);
        last.stop = Some(Stop { time: 0.2, reason: StopReason::HandForce });
        let outcome = Outcome::of(&steps);
        let expected = [
            ("return", 219.0),
            ("length", 3.0),
            ("success_any", 1.0),
            ("success_held", 0.0),
            ("success_without_hand", 0.0),
            ("success_before_stop", 1.0),
            ("energy_j", 15.0),
            ("energy_per_action_j", 5.0),
            ("energy_positive_j", 21.0),
            ("energy_net_j", 33.0),
            ("squared_torque_nm2s", 39.0),
            ("copper_loss_j", 51.0),
            ("penalty", 213.0),
            ("penalised_steps", 3.0),
            ("excess_impulse_ns", 57.0),
            ("max_contact_force_n", 47.0),
            ("p99_contact_force_n", 47.0),
            ("max_raw_contact_force_n", 59.0),
            ("contact_time_s", 0.75),
            ("mean_contact_force_n", 172.0),
            ("hard_contact_time_s", 93.0),
            ("arm_max_contact_force_n", 89.0),
            ("arm_contact_time_s", 69.0),
            ("self_contact_time_s", 87.0),
            ("time_to_success_s", 1.0),
            ("energy_to_success_j", 10.0),
            ("energy_positive_to_success_j", 14.0),
            ("energy_net_to_success_j", 22.0),
            ("squared_torque_to_success_nm2s", 26.0),
            ("copper_loss_to_success_j", 34.0),
            ("max_force_to_success_n", 61.0),
            ("impulse_to_success_ns", 134.0),
            ("hand_share_to_success", 53.0 / 67.0),
            ("fulfilled_time_s", 0.5),
            ("fulfilled_energy_j", 5.0),
            ("fulfilled_max_force_n", 59.5),
            ("fulfilled_impulse_ns", 67.0),
            // Means over the six samples.
            ("mean_stiffness", 10.0),
            ("saturated_fraction", 0.25),
            ("stiffness_translation_n_per_m", 15.0),
            ("stiffness_rotation_nm_per_rad", 25.0),
            ("feedforward_spring_translation_n_per_m", 15.5),
            ("feedforward_spring_rotation_nm_per_rad", 25.5),
            ("at_k_min_translation", 16.0),
            ("at_k_max_translation", 16.5),
            ("at_k_min_rotation", 26.0),
            ("at_k_max_rotation", 26.5),
            ("feedforward_share_translation", 1.0 / 33.0),
            ("feedforward_share_rotation", 1.0 / 53.0),
            ("tool_work_translation_j", 102.0),
            ("tool_work_rotation_j", 162.0),
            ("path_m", 111.0),
            ("jerk_mps3", 328.0),
            ("max_joint_speed_share", 83.0),
            ("max_joint_speed_share_to_success", 79.0),
            ("stop_time_s", 1.2),
            // 1 that it ran, 75 for success, 12 for being quick; 12 off for pressing hard, 24 for a link that touched.
            ("aic_score", 52.0),
        ];
        for (column, expected) in expected {
            let value = outcome.number(column).unwrap();
            assert!((value - expected).abs() < 1e-12, "{column}: {value}, not {expected}");
        }
        assert_eq!(outcome.cell("stop_reason"), Cell::Word("hand-force"));
        type Ending = fn(&mut Step);
        let endings: [(&str, Ending); 4] = [
            ("success", |last| last.success = true),
            ("terminated", |last| last.terminated = true),
            ("truncated", |last| last.truncated = true),
            ("diverged", |last| last.diverged = true),
        ];
        for (ending, end) in endings {
            let mut steps = [one; 2];
            end(&mut steps[1]);
            let outcome = Outcome::of(&steps);
            assert!(endings.iter().all(|&(column, _)| outcome.flag(column) == (column == ending)), "{ending}");
        }
        let mut told: Vec<&str> = expected.iter().map(|(column, _)| *column).collect();
        told.extend(endings.iter().map(|(column, _)| *column).chain(["stop_reason"]));
        let untold: Vec<&str> = COLUMNS.iter().map(|column| column.name).filter(|name| !told.contains(name)).collect();
        assert!(untold.is_empty(), "columns without a value above: {untold:?}");
    }

    /// The second of two actions of 16.25 s fulfils the task. It earns half of the points for duration, half of those for a path that is
    /// half a metre longer than straight, and half of those for jerk. The third action does not count.
    #[test]
    fn the_score_is_that_of_the_way_to_success() {
        let interval = Interval {
            time: 16.25,
            displacement: Vector3::new(0.0, 0.3, 0.0),
            path: 0.55,
            moving_time: 2.0,
            sum_jerk: 50.0,
            ..Interval::default()
        };
        let score = |change: fn(&mut Interval), success: bool| {
            let mut changed = interval;
            change(&mut changed);
            let late = Interval { link_contact_time: 1.0, hard_time: 9.0, ..interval };
            let steps = [step(interval, false), step(changed, success), step(late, success)];
            Outcome::of(&steps).number("aic_score").unwrap()
        };
        assert!((score(|_| (), true) - (1.0 + 75.0 + 6.0 + 3.0 + 3.0)).abs() < 1e-12);
        assert!((score(|i| i.hard_time = 1.1, true) - 76.0).abs() < 1e-12);
        assert!((score(|i| i.link_contact_time = 0.002, true) - 64.0).abs() < 1e-12);
        assert_eq!(score(|_| (), false), 1.0 - 12.0 - 24.0);
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
            let speed = o.number("max_joint_speed_share_to_success");
            (o.flag("success_before_stop"), o.number("stop_time_s"), o.cell("stop_reason"), speed)
        };
        let after = |actions: f64| Some(actions * 0.05 + 0.02);
        assert_eq!(stopping_in(1), (false, after(1.0), Cell::Word("joint-speed"), Some(1.5)));
        assert!(!stopping_in(3).0, "in the very action that fulfils the task");
        let (success, time, _, speed) = stopping_in(4);
        assert!(success && (time.unwrap() - 0.22).abs() < 1e-12 && speed == Some(0.0));
        assert_eq!(stopping_in(10), (true, None, Cell::Empty, Some(0.0)));
    }

    #[test]
    fn without_success_nothing_is_said_of_the_way_to_it() {
        let outcome = Outcome::of(&[action(3.0, 8.0, false)]);
        assert_eq!(["time_to_success_s", "hand_share_to_success"].map(|name| outcome.cell(name)), [Cell::Empty; 2]);
        assert_eq!((outcome.number("fulfilled_time_s"), outcome.flag("success_without_hand")), (Some(0.0), false));
    }

    #[test]
    fn a_name_is_given_once() {
        let mut names: Vec<&str> = COLUMNS.iter().map(|column| column.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    }
}
