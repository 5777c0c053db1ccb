//! Named sets of settings.
//!
//! A preset that was published is frozen. A run's `config.toml` names its preset, and an older file that lacks a newer
//! field takes that field from the preset. So a new field of [`Config`] is off in every published preset, and an
//! improvement is a new preset: an entry of [`Preset::ALL`].

use std::fmt::{self, Debug, Formatter};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{Config, Kernels};

/// A named set of settings.
#[derive(Clone, Copy)]
pub struct Preset {
    /// Name of the preset in command lines and files.
    pub name: &'static str,
    /// Purpose of the preset, in one line.
    pub summary: &'static str,
    settings: fn() -> Config,
}

impl Preset {
    /// The learner of the AFORCE paper: pytorch_sac with two layers of 1024.
    pub const PAPER: Preset =
        Preset { name: "paper", summary: "The paper's learner: 2 x 1024, batch 1024; days on a CPU", settings: paper };

    /// Small and fast: made for runs of about twenty minutes on one core.
    pub const DESKTOP: Preset = Preset {
        name: "desktop",
        summary: "A learner for one CPU core: 2 x 256, batch 128; minutes",
        settings: desktop,
    };

    /// `desktop` at half the time per action. Half of the episodes have pink noise, which the Door task needs.
    pub const SWIFT: Preset = Preset {
        name: "swift",
        summary: "desktop at half the time per action: 2 x 128, actor at every second update, half the episodes with pink noise",
        settings: swift,
    };

    /// Stable-Baselines3's defaults: the learner that most readers know.
    pub const PLAIN: Preset = Preset {
        name: "plain",
        summary: "Stable-Baselines3's defaults: 2 x 256, batch 256, an update per action, white noise; four times swift's time",
        settings: plain,
    };

    /// `swift`, which also learns from episodes of a script: its runs are not comparable with those of other presets.
    pub const SWIFT_PRIOR: Preset = Preset {
        name: "swift-prior",
        summary: "swift; half of each batch from 20 episodes of the script",
        settings: swift_prior,
    };

    /// Every preset.
    pub const ALL: &[Preset] = &[Preset::PAPER, Preset::DESKTOP, Preset::SWIFT, Preset::PLAIN, Preset::SWIFT_PRIOR];

    /// The settings of the preset.
    pub fn settings(self) -> Config {
        (self.settings)()
    }
}

fn paper() -> Config {
    Config {
        hidden: vec![1024, 1024],
        batch_size: 1024,
        actor_learning_rate: 1e-4,
        critic_learning_rate: 1e-4,
        temperature_learning_rate: 1e-4,
        gamma: 0.99,
        n_step: 1,
        tau: 0.005,
        target_period: 2,
        policy_average: 1.0,
        actor_period: 1,
        layer_norm: false,
        pink_noise: 0.0,
        nudges: 0.0,
        initial_temperature: 0.1,
        target_entropy: None,
        log_std_min: -5.0,
        log_std_max: 2.0,
        kernels: Kernels::Fast,
        random_steps: 5000,
        updates_per_step: 1.0,
        replay_capacity: 1_000_000,
        prior_episodes: 0,
        scaled_observations: false,
    }
}

/// The reason for each difference from `paper` stands beside it.
fn desktop() -> Config {
    Config {
        // Time: an update takes 4.5 ms instead of 415, and there are half as many.
        hidden: vec![256, 256],
        batch_size: 128,
        updates_per_step: 0.5,
        // Faster learning of small networks on scaled observations.
        actor_learning_rate: 5e-4,
        critic_learning_rate: 5e-4,
        temperature_learning_rate: 5e-4,
        scaled_observations: true,
        // The reward at the end of a task reaches earlier steps in fewer updates.
        n_step: 3,
        gamma: 0.97,
        target_period: 1,
        // A mean over the last 3300 steps of the actor: evaluations differ less from one to the next, and are higher.
        policy_average: 3e-4,
        random_steps: 3300,
        ..paper()
    }
}

/// `results/learner` shows what each difference from `desktop` brings.
fn swift() -> Config {
    Config {
        // Time: the small network needs a third of the products. The actor, the averaged policy and the temperature make half as many
        // steps.
        hidden: vec![128, 128],
        actor_period: 2,
        // With white noise alone the door is not opened; with pink noise in every episode Lift is learned more slowly.
        pink_noise: 0.5,
        ..desktop()
    }
}

/// Stable-Baselines3 2.9's `SAC("MlpPolicy", env)`. Four things differ: the weights begin orthogonal; the log standard deviation is bounded
/// through a tanh (in Stable-Baselines3 it is clamped), so that the first policy's noise is 0.2 before the squashing and not 1; its lower
/// bound is -5 and not -20; the temperature's gradient is multiplied by the temperature.
fn plain() -> Config {
    Config {
        hidden: vec![256, 256],
        batch_size: 256,
        actor_learning_rate: 3e-4,
        critic_learning_rate: 3e-4,
        temperature_learning_rate: 3e-4,
        target_period: 1,
        initial_temperature: 1.0,
        random_steps: 100,
        ..paper()
    }
}

fn swift_prior() -> Config {
    Config { prior_episodes: 20, ..swift() }
}

impl PartialEq for Preset {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Preset {}

impl Debug for Preset {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl Serialize for Preset {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl<'de> Deserialize<'de> for Preset {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let known = || Preset::ALL.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ");
        let preset = Preset::ALL.iter().find(|preset| preset.name == name);
        preset.copied().ok_or_else(|| D::Error::custom(format!("unknown preset {name:?}; known are {}", known())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The presets as in the first `config.toml` that named them: with the fields of that time, and without later ones.
    const FROZEN: &str = "
        [paper]
        hidden = [1024, 1024]
        batch_size = 1024
        actor_learning_rate = 0.0001
        critic_learning_rate = 0.0001
        temperature_learning_rate = 0.0001
        gamma = 0.99
        n_step = 1
        tau = 0.005
        target_period = 2
        policy_average = 1.0
        initial_temperature = 0.1
        log_std_min = -5.0
        log_std_max = 2.0
        random_steps = 5000
        updates_per_step = 1.0
        replay_capacity = 1_000_000
        scaled_observations = false

        [desktop]
        hidden = [256, 256]
        batch_size = 128
        actor_learning_rate = 0.0005
        critic_learning_rate = 0.0005
        temperature_learning_rate = 0.0005
        gamma = 0.97
        n_step = 3
        tau = 0.005
        target_period = 1
        policy_average = 0.0003
        initial_temperature = 0.1
        log_std_min = -5.0
        log_std_max = 2.0
        random_steps = 3300
        updates_per_step = 0.5
        replay_capacity = 1_000_000
        scaled_observations = true

        [swift]
        hidden = [128, 128]
        batch_size = 128
        actor_learning_rate = 0.0005
        critic_learning_rate = 0.0005
        temperature_learning_rate = 0.0005
        gamma = 0.97
        n_step = 3
        tau = 0.005
        target_period = 1
        policy_average = 0.0003
        actor_period = 2
        layer_norm = false
        pink_noise = 0.5
        initial_temperature = 0.1
        log_std_min = -5.0
        log_std_max = 2.0
        random_steps = 3300
        updates_per_step = 0.5
        replay_capacity = 1_000_000
        prior_episodes = 0
        scaled_observations = true

        [plain]
        hidden = [256, 256]
        batch_size = 256
        actor_learning_rate = 0.0003
        critic_learning_rate = 0.0003
        temperature_learning_rate = 0.0003
        gamma = 0.99
        n_step = 1
        tau = 0.005
        target_period = 1
        initial_temperature = 1.0
        log_std_min = -5.0
        log_std_max = 2.0
        random_steps = 100
        updates_per_step = 1.0
        replay_capacity = 1_000_000
        scaled_observations = false

        [swift-prior]
        hidden = [128, 128]
        batch_size = 128
        actor_learning_rate = 0.0005
        critic_learning_rate = 0.0005
        temperature_learning_rate = 0.0005
        gamma = 0.97
        n_step = 3
        tau = 0.005
        target_period = 1
        policy_average = 0.0003
        actor_period = 2
        layer_norm = false
        pink_noise = 0.5
        initial_temperature = 0.1
        log_std_min = -5.0
        log_std_max = 2.0
        random_steps = 3300
        updates_per_step = 0.5
        replay_capacity = 1_000_000
        prior_episodes = 20
        scaled_observations = true
    ";

    /// Fails if a preset changes, is not frozen or is removed, or if a later field is on in one of them.
    #[test]
    fn presets_are_frozen() {
        let frozen: toml::Table = toml::from_str(FROZEN).unwrap();
        assert!(frozen.keys().eq(Preset::ALL.iter().map(|preset| preset.name)), "{:?}", Preset::ALL);
        for (preset, (name, settings)) in Preset::ALL.iter().zip(frozen) {
            assert_eq!(settings.try_into::<Config>().unwrap(), preset.settings(), "{name}");
        }
    }

    #[test]
    fn presets_are_valid_and_have_names_of_their_own() {
        for (at, preset) in Preset::ALL.iter().enumerate() {
            preset.settings().validate().unwrap();
            assert!(!Preset::ALL[..at].contains(preset), "{preset:?}");
            let text = serde_json::to_string(preset).unwrap();
            assert_eq!(serde_json::from_str::<Preset>(&text).unwrap(), *preset);
        }
        let error = serde_json::from_str::<Preset>("\"laptop\"").unwrap_err().to_string();
        assert!(
            error.contains("laptop") && error.contains("known are paper, desktop, swift, plain, swift-prior"),
            "{error}"
        );
    }
}
