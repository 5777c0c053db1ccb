//! Every setting of the learner.

use serde::{Deserialize, Serialize};

use crate::{Error, Kernels, Preset};

/// Settings of the learner. A field that came later than the first checkpoints is, where a file lacks it, what it was before there was
/// such a field: off.
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
    /// Rewards summed before the critic takes over (1: the textbook). More carries a late reward back faster, and adds a bias: the
    /// actions in between are an older policy's, and their entropy is not counted.
    pub n_step: usize,
    /// Fraction by which the target critics move towards the critics, in (0, 1].
    pub tau: f64,
    /// Updates between two such moves.
    pub target_period: u64,
    /// Fraction by which the policy that is evaluated moves towards the actor after each step of the actor, in (0, 1]; 1 is the actor
    /// itself. A mean over the last steps plays more evenly than any of them.
    #[serde(default = "no_average")]
    pub policy_average: f64,
    /// Updates of the critics for one of actor, averaged policy and temperature.
    #[serde(default = "every_update")]
    pub actor_period: u64,
    /// Whether the critics normalise each hidden layer before its ReLU.
    #[serde(default)]
    pub layer_norm: bool,
    /// Share of the episodes, each drawn at its start, whose sampled actions have pink noise: as strong at slow changes as at fast ones,
    /// so that it moves the arm instead of shaking it. White otherwise. Random actions at the start stay white: pink ones fling the arm to
    /// the ends of its reach.
    #[serde(default)]
    pub pink_noise: f64,
    /// Share of the episodes, each drawn at its start, in which now and then one entry of a sampled action keeps an end of its range for
    /// two seconds, and the policy commands the others.
    #[serde(default)]
    pub nudges: f64,
    /// Weight of the entropy at the start, in units of reward.
    pub initial_temperature: f64,
    /// Entropy that the temperature steers to, in nat. `None` is minus the number of actions.
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
    /// Updates per environment step after that; 0.5 is one every second step. More learns more from each step until the critics
    /// overestimate.
    pub updates_per_step: f64,
    /// Transitions kept; the oldest make room. One takes 4 (observation + action + 5) bytes, an
    /// observation being all that the critics see.
    pub replay_capacity: usize,
    /// Episodes that a script plays before the run, and of which half of every batch is drawn; 0 for none. Played by the caller
    /// ([`Sac::update_with_prior`](crate::Sac::update_with_prior)).
    #[serde(default)]
    pub prior_episodes: u32,
    /// Whether the environment hands out observations scaled to about +-1. Applied by the caller; kept here because the learning rates
    /// belong to it.
    pub scaled_observations: bool,
}

impl Config {
    /// Checks every field.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] with the first field that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        // `valid` is false for a NaN, because every comparison with one is.
        let check = |valid: bool, field, value: &dyn ToString, allowed| {
            if valid { Ok(()) } else { Err(Error::Config { field, value: value.to_string(), allowed }) }
        };
        let rate = "above 0, at most 1";
        check(
            (1..=8).contains(&self.hidden.len()) && self.hidden.iter().all(|n| (1..=16_384).contains(n)),
            "hidden",
            &format!("{:?}", self.hidden),
            "one to eight layers of 1 to 16384 units",
        )?;
        check((1..=65_536).contains(&self.batch_size), "batch_size", &self.batch_size, "1 to 65536")?;
        check(
            self.actor_learning_rate > 0.0 && self.actor_learning_rate <= 1.0,
            "actor_learning_rate",
            &self.actor_learning_rate,
            rate,
        )?;
        check(
            self.critic_learning_rate > 0.0 && self.critic_learning_rate <= 1.0,
            "critic_learning_rate",
            &self.critic_learning_rate,
            rate,
        )?;
        // Zero keeps the temperature where it starts.
        let frozen_or_rate = self.temperature_learning_rate >= 0.0 && self.temperature_learning_rate <= 1.0;
        check(
            frozen_or_rate,
            "temperature_learning_rate",
            &self.temperature_learning_rate,
            "0 (fixed temperature) to 1",
        )?;
        check(self.gamma >= 0.0 && self.gamma < 1.0, "gamma", &self.gamma, "at least 0, below 1")?;
        check((1..=1000).contains(&self.n_step), "n_step", &self.n_step, "1 to 1000")?;
        check(self.tau > 0.0 && self.tau <= 1.0, "tau", &self.tau, rate)?;
        check(self.target_period >= 1, "target_period", &self.target_period, "at least 1")?;
        let average = self.policy_average;
        check(average > 0.0 && average <= 1.0, "policy_average", &average, rate)?;
        check(self.actor_period >= 1, "actor_period", &self.actor_period, "at least 1")?;
        check(self.prior_episodes <= 10_000, "prior_episodes", &self.prior_episodes, "0 to 10000")?;
        let weights: usize = self.hidden.windows(2).map(|pair| pair[0] * pair[1]).sum();
        check(
            weights <= 1 << 26,
            "hidden",
            &format!("{:?}", self.hidden),
            "layers with at most 67 million weights between them",
        )?;
        let pink = self.pink_noise;
        check((0.0..=1.0).contains(&pink), "pink_noise", &pink, "0 (no episode) to 1 (every episode)")?;
        check((0.0..=1.0).contains(&self.nudges), "nudges", &self.nudges, "0 (no episode) to 1 (every episode)")?;
        let temperature = self.initial_temperature;
        check(temperature > 0.0 && temperature.is_finite(), "initial_temperature", &temperature, "above 0, finite")?;
        let entropy = self.target_entropy.unwrap_or(-1.0);
        check(
            entropy.abs() <= 1e6,
            "target_entropy",
            &entropy,
            "-1e6 to 1e6, or absent for minus the number of actions",
        )?;
        check(
            self.log_std_min >= -20.0 && self.log_std_min < self.log_std_max,
            "log_std_min",
            &self.log_std_min,
            "-20 to below log_std_max",
        )?;
        check(self.log_std_max <= 10.0, "log_std_max", &self.log_std_max, "above log_std_min, at most 10")?;
        check(
            self.updates_per_step >= 0.0 && self.updates_per_step <= 100.0,
            "updates_per_step",
            &self.updates_per_step,
            "0 to 100",
        )?;
        check(
            self.random_steps >= self.n_step as u64,
            "random_steps",
            &self.random_steps,
            "at least n_step: the first update needs a transition",
        )?;
        let capacity = self.replay_capacity;
        check(
            capacity >= self.batch_size && capacity <= u32::MAX as usize,
            "replay_capacity",
            &capacity,
            "batch_size to 2^32 - 1",
        )
    }

    /// Number of updates that follow environment step `step`, counted from 1: none up to `random_steps`, then as many as keep the total at
    /// `updates_per_step` times the steps taken since. Depends on the step alone, so that a continued run needs no counter.
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
