//! Every setting of the learner.

use std::ops::Bound::{Excluded, Included};
use std::ops::RangeBounds;

use serde::{Deserialize, Serialize};

use crate::{Error, Kernels, Preset};

/// Settings of the learner. Some fields are newer than the first checkpoints. Where a file lacks such a field, the field is off, as in the
/// learner of that time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Units of each hidden layer (ReLU), the same for actor and critics.
    pub hidden: Vec<usize>,
    /// Transitions per update. The cost of an update is proportional to it.
    pub batch_size: usize,
    /// Step size of Adam for the actor.
    pub actor_learning_rate: f64,
    /// Step size of Adam for both critics.
    pub critic_learning_rate: f64,
    /// Step size of Adam for the logarithm of the temperature.
    pub temperature_learning_rate: f64,
    /// Discount per action, in [0, 1): rewards 1 / (1 - gamma) actions ahead still count.
    pub gamma: f64,
    /// Rewards summed before the critic's value is added (1: the textbook). A larger n carries a late reward back faster, and adds a bias:
    /// the actions in between are an older policy's, and their entropy is not counted.
    pub n_step: usize,
    /// Fraction by which the target critics move towards the critics, in (0, 1].
    pub tau: f64,
    /// Critic updates from one move of the target critics to the next.
    pub target_period: u64,
    /// Fraction by which the policy that is evaluated moves towards the actor after each step of the actor, in (0, 1]; 1 is the actor
    /// itself. The mean over the last steps performs more evenly than the actor of a single step.
    #[serde(default = "no_average")]
    pub policy_average: f64,
    /// Critic updates per update of the actor, the averaged policy and the temperature.
    #[serde(default = "every_update")]
    pub actor_period: u64,
    /// Whether the critics normalise each hidden layer before its ReLU.
    #[serde(default)]
    pub layer_norm: bool,
    /// Share of the episodes, each drawn at its start, whose sampled actions have pink noise; the others have white noise. Pink noise has
    /// as much power in slow changes as in fast ones, so that it moves the arm instead of shaking it. The random actions at the start of a
    /// run are white: pink ones drive the arm to the ends of its reach.
    #[serde(default)]
    pub pink_noise: f64,
    /// Share of the episodes, each drawn at its start, in which now and then one entry of a sampled action stays at an end of its range for
    /// 40 actions (two seconds at 20 Hz), while the policy commands the other entries.
    #[serde(default)]
    pub nudges: f64,
    /// Weight of the entropy at the start, in units of reward.
    pub initial_temperature: f64,
    /// Entropy to which the temperature is adapted, in nat; absent: minus the number of entries of an action.
    pub target_entropy: Option<f64>,
    /// Smallest log standard deviation of the policy before the squashing.
    pub log_std_min: f64,
    /// Largest log standard deviation. The range is reached through a tanh, so that no gradient is cut off.
    pub log_std_max: f64,
    /// Which kernels multiply matrices: the last bits of every number of a run depend on them.
    #[serde(default)]
    pub kernels: Kernels,
    /// Actions drawn uniformly at the start of a run, before the first update.
    pub random_steps: u64,
    /// Updates per environment step after the random ones; 0.5 is one at every second step. With more updates more is learned from each
    /// step, until the critics overestimate.
    pub updates_per_step: f64,
    /// Transitions kept; new ones replace the oldest. A transition takes 4 (observation + action + 5) bytes, with the numbers of an
    /// observation being all that the critics see.
    pub replay_capacity: usize,
    /// Episodes that a script plays before the run, and from which half of every batch is drawn; 0 for none
    /// ([`Sac::update_with_prior`](crate::Sac::update_with_prior)).
    #[serde(default)]
    pub prior_episodes: u32,
    /// Whether the learner sees observations scaled to about +-1. The learning rates of each preset are tuned for its value of this field.
    pub scaled_observations: bool,
}

impl Config {
    /// Checks every field.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] with the first field that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        let hidden = |valid, allowed| check("hidden", &format!("{:?}", self.hidden), valid, allowed);
        let widths = self.hidden.iter().all(|n| (1..=16_384).contains(n));
        hidden((1..=8).contains(&self.hidden.len()) && widths, "one to eight layers of 1 to 16384 units")?;
        within("batch_size", self.batch_size, 1..=65_536, "1 to 65536")?;
        rate("actor_learning_rate", self.actor_learning_rate)?;
        rate("critic_learning_rate", self.critic_learning_rate)?;
        // Zero keeps the temperature where it starts.
        within("temperature_learning_rate", self.temperature_learning_rate, 0.0..=1.0, "0 (fixed temperature) to 1")?;
        within("gamma", self.gamma, 0.0..1.0, "at least 0, below 1")?;
        within("n_step", self.n_step, 1..=1000, "1 to 1000")?;
        rate("tau", self.tau)?;
        within("target_period", self.target_period, 1.., "at least 1")?;
        rate("policy_average", self.policy_average)?;
        within("actor_period", self.actor_period, 1.., "at least 1")?;
        within("prior_episodes", self.prior_episodes, ..=10_000, "0 to 10000")?;
        if self.prior_episodes > 0 {
            within("batch_size", self.batch_size, 2.., "at least 2 with prior_episodes, which are half of a batch")?;
        }
        let weights: usize = self.hidden.windows(2).map(|pair| pair[0] * pair[1]).sum();
        hidden(weights <= 1 << 26, "layers with at most 67 million weights between them")?;
        within("pink_noise", self.pink_noise, 0.0..=1.0, "0 (no episode) to 1 (every episode)")?;
        within("nudges", self.nudges, 0.0..=1.0, "0 (no episode) to 1 (every episode)")?;
        let finite = (Excluded(0.0), Excluded(f64::INFINITY));
        within("initial_temperature", self.initial_temperature, finite, "above 0, finite")?;
        let entropy = self.target_entropy.unwrap_or(-1.0);
        within(
            "target_entropy",
            entropy,
            -1e6..=1e6,
            "-1e6 to 1e6, or absent for minus the number of entries of an action",
        )?;
        within("log_std_min", self.log_std_min, -20.0..self.log_std_max, "-20 to below log_std_max")?;
        within("log_std_max", self.log_std_max, ..=10.0, "above log_std_min, at most 10")?;
        within("updates_per_step", self.updates_per_step, 0.0..=100.0, "0 to 100")?;
        let transition = "at least n_step: the first update needs a transition";
        within("random_steps", self.random_steps, self.n_step as u64.., transition)?;
        within("replay_capacity", self.replay_capacity, self.batch_size..=u32::MAX as usize, "batch_size to 2^32 - 1")
    }

    /// Number of updates that follow environment step `step`, counted from 1: none up to `random_steps`, then as many as keep the total at
    /// `updates_per_step` times the steps taken since. The number depends on `step` alone, so that a continued run needs no counter.
    pub fn updates_after(&self, step: u64) -> u64 {
        let total = |step: u64| (step.saturating_sub(self.random_steps) as f64 * self.updates_per_step).floor() as u64;
        total(step) - total(step.saturating_sub(1))
    }
}

impl Default for Config {
    fn default() -> Self {
        Preset::DESKTOP.settings()
    }
}

/// An error unless the value is `valid`.
fn check(field: &'static str, value: &dyn ToString, valid: bool, allowed: &'static str) -> Result<(), Error> {
    if valid { Ok(()) } else { Err(Error::Config { field, value: value.to_string(), allowed }) }
}

/// An error unless the value is in `range`; NaN is in no range.
fn within<T>(field: &'static str, value: T, range: impl RangeBounds<T>, allowed: &'static str) -> Result<(), Error>
where
    T: PartialOrd + ToString,
{
    check(field, &value, range.contains(&value), allowed)
}

/// An error unless the value is above 0 and at most 1.
fn rate(field: &'static str, value: f64) -> Result<(), Error> {
    within(field, value, (Excluded(0.0), Included(1.0)), "above 0, at most 1")
}

fn no_average() -> f64 {
    1.0
}

fn every_update() -> u64 {
    1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_field_is_not_ignored() {
        let mut table = toml::Table::try_from(Config::default()).unwrap();
        table.insert("learning_rate".into(), 1.into());
        let error = table.try_into::<Config>().unwrap_err().to_string();
        assert!(error.contains("learning_rate"), "{error}");
    }

    #[test]
    fn a_field_out_of_range_is_named_with_value_and_range() {
        let message = |change: fn(&mut Config)| {
            let mut config = Config::default();
            change(&mut config);
            config.validate().unwrap_err().to_string()
        };
        assert_eq!(message(|c| c.gamma = 1.0), "gamma = 1 is out of range: at least 0, below 1");
        assert_eq!(
            message(|c| c.hidden = vec![256, 0]),
            "hidden = [256, 0] is out of range: one to eight layers of 1 to 16384 units"
        );
        for (change, field) in [
            ((|c| c.hidden = vec![999_999_999]) as fn(&mut Config), "hidden"),
            (|c| c.hidden = vec![], "hidden"),
            (|c| c.hidden = vec![256; 9], "hidden"),
            (|c| c.hidden = vec![16_384; 8], "hidden"),
            (|c| c.prior_episodes = u32::MAX, "prior_episodes"),
            (|c| c.target_entropy = Some(1e308), "target_entropy"),
            (|c| c.batch_size = 0, "batch_size"),
            (|c| c.batch_size = 1_000_000, "batch_size"),
            (|c| c.actor_learning_rate = 0.0, "actor_learning_rate"),
            (|c| c.critic_learning_rate = f64::NAN, "critic_learning_rate"),
            (|c| c.temperature_learning_rate = -1e-3, "temperature_learning_rate"),
            (|c| c.gamma = f64::NAN, "gamma"),
            (|c| c.n_step = 0, "n_step"),
            (|c| (c.n_step, c.random_steps) = (1_000_000, 1_000_000), "n_step"),
            (|c| c.tau = 0.0, "tau"),
            (|c| c.target_period = 0, "target_period"),
            (|c| c.policy_average = 1.5, "policy_average"),
            (|c| c.actor_period = 0, "actor_period"),
            (|c| c.initial_temperature = 0.0, "initial_temperature"),
            (|c| c.pink_noise = 1.1, "pink_noise"),
            (|c| c.nudges = -0.1, "nudges"),
            (|c| c.target_entropy = Some(f64::INFINITY), "target_entropy"),
            (|c| c.log_std_min = 3.0, "log_std_min"),
            (|c| c.log_std_max = 11.0, "log_std_max"),
            (|c| c.updates_per_step = -0.5, "updates_per_step"),
            (|c| c.random_steps = 2, "random_steps"),
            (|c| c.replay_capacity = 64, "replay_capacity"),
        ] {
            assert!(message(change).starts_with(&format!("{field} = ")), "{field}: {}", message(change));
        }
    }

    #[test]
    fn updates_keep_their_ratio_to_steps() {
        for ratio in [0.0, 0.4, 0.5, 1.0, 2.5] {
            let config = Config { random_steps: 10, updates_per_step: ratio, ..Config::default() };
            assert_eq!((1..=10).map(|step| config.updates_after(step)).sum::<u64>(), 0);
            assert_eq!((1..=110).map(|step| config.updates_after(step)).sum::<u64>(), (100.0 * ratio) as u64);
        }
    }
}
