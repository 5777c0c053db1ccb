//! The outcome of one action.

use crate::interval::Interval;
use crate::reward_terms::RewardTerms;

/// The outcome of one action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Reward, less the penalty where the task subtracts it and less the prices of motion and of a stop.
    pub reward: f64,
    /// The terms of the reward. Their sum less `motion_cost` and `stop_cost` is `reward`.
    pub reward_terms: RewardTerms,
    /// The price of this action's motion (reward, at least 0), taken off the reward.
    pub motion_cost: f64,
    /// The price of the arm's stop (reward, at least 0), taken off the reward.
    pub stop_cost: f64,
    /// The episode ended in a terminal state, whose value is zero: the simulation diverged, the task is
    /// [lost](crate::Task::lost), or the arm stopped itself where episodes end with that
    /// ([`EnvConfig::stops`](crate::EnvConfig::stops)) and a stop has no price.
    pub terminated: bool,
    /// The episode was cut short, and to the learner its value goes on. It reached its horizon, or the task stood
    /// fulfilled for a second and the episode [ends with that](crate::EnvConfig::ends_on_success), or the arm stopped
    /// itself at a [price](crate::EnvConfig::stop_price).
    pub truncated: bool,
    /// Whether the task stands fulfilled.
    pub success: bool,
    /// The simulation diverged.
    pub diverged: bool,
    /// The largest sustained force on the part of the arm that the penalty counts exceeded the limit.
    pub over_limit: bool,
    /// Force penalty of this action, unscaled, whether or not the task takes it off.
    pub penalty: f64,
    /// Energy, force, stiffness, clipping during this action.
    pub interval: Interval,
}
