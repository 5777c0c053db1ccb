//! An episode, cut into the parts from which columns are computed.

use aforce::Vector3;

use crate::axis_group::AxisGroup;
use crate::interval::Stop;
use crate::step::Step;
use crate::task::HELD;

/// An episode's actions and their parts.
pub struct Parts<'a> {
    pub(crate) steps: &'a [Step],
    /// All actions.
    pub(crate) whole: Part,
    /// The actions up to the first after which the task stands fulfilled, that action included; `None` if it never
    /// does.
    pub(crate) to_success: Option<Part>,
    /// The actions after which the task stands fulfilled.
    pub(crate) fulfilled: Part,
    /// Index of the action in which a real arm would first have stopped itself, and the time and reason of the stop.
    pub(crate) stop: Option<(usize, Stop)>,
    /// Sums over the samples, of the translational and of the rotational axes.
    pub(crate) impedance: [AxisGroup; 2],
    /// Control samples, at least 1.
    pub(crate) samples: f64,
}

impl<'a> Parts<'a> {
    pub(crate) fn of(steps: &'a [Step]) -> Self {
        let first_success = steps.iter().position(|s| s.success);
        Parts {
            steps,
            whole: Part::of(steps),
            to_success: first_success.map(|at| Part::of(&steps[..=at])),
            fulfilled: Part::of(steps.iter().filter(|s| s.success)),
            stop: steps.iter().enumerate().find_map(|(at, s)| Some((at, s.interval.stop?))),
            impedance: impedance(steps),
            samples: steps.iter().map(|s| f64::from(s.interval.samples)).sum::<f64>().max(1.0),
        }
    }

    /// Actions, at least 1.
    pub(crate) fn actions(&self) -> f64 {
        self.steps.len().max(1) as f64
    }

    pub(crate) fn sum(&self, of: fn(&Step) -> f64) -> f64 {
        self.steps.iter().map(of).sum()
    }

    pub(crate) fn max(&self, of: fn(&Step) -> f64) -> f64 {
        self.steps.iter().map(of).fold(0.0, f64::max)
    }

    /// Whether `of` is true of the last action.
    pub(crate) fn at_the_end(&self, of: fn(&Step) -> bool) -> bool {
        self.steps.last().is_some_and(of)
    }

    /// Whether the task stands fulfilled through the last second.
    pub(crate) fn held(&self) -> bool {
        Part::of(self.steps.iter().rev().take_while(|s| s.success)).time > HELD - 1e-9
    }

    /// Whether the task first stood fulfilled after an action before the one in which a real arm would have stopped itself.
    pub(crate) fn success_before_stop(&self) -> bool {
        let first = self.steps.iter().position(|s| s.success);
        first.is_some_and(|success| self.stop.is_none_or(|(stop, _)| success < stop))
    }

    /// The `share` quantile, over the actions, of the largest sustained force beyond the wrist (N).
    pub(crate) fn force_percentile(&self, share: f64) -> f64 {
        let mut forces: Vec<f64> = self.steps.iter().map(|s| s.interval.hand.max).collect();
        forces.sort_by(f64::total_cmp);
        let rank = (share * forces.len() as f64).ceil() as usize;
        forces.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
    }
}

/// Sums and maxima over some of an episode's actions.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Part {
    /// Duration (s).
    pub(crate) time: f64,
    /// This and the next four: the definitions of [`aforce::EnergyLedger`].
    pub(crate) energy: f64,
    pub(crate) positive: f64,
    pub(crate) net: f64,
    pub(crate) squared_torque: f64,
    pub(crate) copper_loss: f64,
    /// Largest force on the whole arm (N).
    pub(crate) max_force: f64,
    /// Integral of the force on the whole arm (N s).
    pub(crate) impulse: f64,
    /// Integral of the sustained force beyond the wrist (N s).
    pub(crate) hand_impulse: f64,
    /// Time with contact beyond the wrist (s).
    pub(crate) hand_time: f64,
    /// Integral of the hand's sustained force over `hand_time` (N s).
    pub(crate) contact_impulse: f64,
    /// Time in which the hand's sustained force is above 20 N (s).
    pub(crate) hard_time: f64,
    /// Time with contact between the scene and the links short of the wrist (s).
    pub(crate) link_time: f64,
    /// Displacement of the tool (m, world), and the length of its path (m).
    pub(crate) displacement: Vector3,
    pub(crate) path: f64,
    /// Integral of the size of the tool's jerk over the time in which it moves (m/s2), and that time (s).
    pub(crate) sum_jerk: f64,
    pub(crate) moving_time: f64,
    /// Largest speed of a joint, as a share of its limit.
    pub(crate) max_speed: f64,
}

impl Part {
    pub(crate) fn of<'a>(steps: impl IntoIterator<Item = &'a Step>) -> Self {
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
            contact_impulse: sum.contact_impulse + interval.contact_impulse,
            hard_time: sum.hard_time + interval.hard_time,
            link_time: sum.link_time + interval.link_contact_time,
            displacement: sum.displacement + interval.displacement,
            path: sum.path + interval.path,
            sum_jerk: sum.sum_jerk + interval.sum_jerk,
            moving_time: sum.moving_time + interval.moving_time,
            max_speed: sum.max_speed.max(interval.max_speed_share),
        })
    }

    /// Mean sustained force beyond the wrist during contact there (N); `None` without contact.
    pub(crate) fn contact_force(&self) -> Option<f64> {
        (self.hand_time > 0.0).then(|| self.contact_impulse / self.hand_time)
    }

    /// Mean size of the tool's jerk while the tool moves (m/s3); `None` if no sample has a jerk: the tool never moves, or not for long enough.
    pub(crate) fn jerk(&self) -> Option<f64> {
        (self.moving_time > 0.0).then(|| self.sum_jerk / self.moving_time)
    }
}

/// Sums over the actions, of the translational and of the rotational axes.
fn impedance(steps: &[Step]) -> [AxisGroup; 2] {
    let mut sums = [AxisGroup::default(); 2];
    for step in steps {
        for (sum, group) in sums.iter_mut().zip(step.interval.impedance) {
            *sum += group;
        }
    }
    sums
}
