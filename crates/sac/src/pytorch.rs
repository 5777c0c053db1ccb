//! Compares three updates, and the mean actions of a checkpoint, with those of PyTorch: its autograd, its distributions, its Adam.
//! `scripts/pytorch_reference.py` recorded PyTorch's numbers in `reference/` and describes how.
//!
//! Properties:
//! - every loss, gradient, moment, weight, target and the temperature that an update leaves is PyTorch's, up to the rounding of f32;
//! - the comparison is sharp: a slip in any input, setting or count is noticed;
//! - a checkpoint written here means the same policy to PyTorch.

use std::path::{Path, PathBuf};

use safetensors::SafeTensors;
use serde_json::{Value, json};

use crate::gaussian::SquashedGaussian;
use crate::network::Networks;
use crate::{Act, Actor, ActorLosses, Checkpoint, Config, Replay, Sac, Sizes, Transition};

const OBSERVATIONS: usize = 5;
const ACTIONS: usize = 3;

// Tolerances, relative to the largest entry of a tensor. f32 rounds by 6e-8; the record itself is computed in f64.

/// Weights, targets, losses, temperature. Seen here: up to 2e-7, and once 1.5e-6 in an entropy, a mean of terms of both signs; PyTorch
/// in f32: 4e-7.
const OF_STATE: f32 = 3e-6;
/// Gradients and their means. The derivative by the one bias of a critic's last layer is a sum of terms of both signs, of which little
/// remains. Seen here: up to 1.5e-6; PyTorch in f32: 3e-6.
const OF_GRADIENT: f32 = 1e-5;
/// Means of squared gradients: twice the relative error of a gradient.
const OF_SQUARES: f32 = 1e-5;

fn path(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference").join(file)
}

/// The records: one whose critics see what the actor sees, and one whose critics see more.
const RECORDS: [&str; 2] = ["pytorch.safetensors", "pytorch_asymmetric.safetensors"];

/// What PyTorch computed.
struct Record(Vec<u8>);

impl Record {
    fn read(file: &str) -> Self {
        Self(std::fs::read(path(file)).unwrap())
    }

    fn about(&self) -> Value {
        let (_, header) = SafeTensors::read_metadata(&self.0).unwrap();
        serde_json::from_str(&header.metadata().as_ref().unwrap()["about"]).unwrap()
    }

    fn sizes(&self) -> Sizes {
        let privileged = self.about()["privileged"].as_u64().unwrap_or(0) as usize;
        Sizes { observation: OBSERVATIONS, privileged, action: ACTIONS }
    }

    fn config(&self) -> Config {
        // The record names only the settings that decide an update.
        let mut config = serde_json::to_value(Config::default()).unwrap();
        for (key, value) in self.about()["config"].as_object().unwrap() {
            config[key] = value.clone();
        }
        serde_json::from_value(config).unwrap()
    }

    fn get(&self, name: &str) -> Vec<f32> {
        let file = SafeTensors::deserialize(&self.0).unwrap();
        let tensor = file.tensor(name).unwrap_or_else(|_| panic!("no {name} in the record"));
        tensor.data().as_chunks().0.iter().map(|x| f32::from_le_bytes(*x)).collect()
    }

    fn fill(&self, networks: &mut Networks, suffix: &str) {
        for entry in networks.entries() {
            networks.values[entry.range()].copy_from_slice(&self.get(&format!("{}{suffix}", entry.name)));
        }
    }

    /// The learner that PyTorch started with.
    fn learner(&self) -> Sac {
        let mut sac = Sac::new(&self.config(), self.sizes(), 0).unwrap();
        self.fill(&mut sac.actor.network, "@0");
        self.fill(&mut sac.critics, "@0");
        self.fill(&mut sac.targets, ".target@0");
        sac
    }

    /// Puts the batch and the noise of update `t` into the learner's scratch memory.
    fn load_batch(&self, sac: &mut Sac, t: usize) {
        let get = |name| self.get(&format!("batch.{name}@{t}"));
        let rows = |observation: Vec<f32>, action: Vec<f32>| -> Vec<f32> {
            let seen = self.sizes().whole_observation();
            let rows = observation.chunks_exact(seen).zip(action.chunks_exact(ACTIONS));
            rows.flat_map(|(observation, action)| [observation, action].concat()).collect()
        };
        let batch = &mut sac.scratch.batch;
        batch.input = rows(get("observation"), get("action"));
        // The learner replaces each NaN by the policy's action.
        batch.next_input = rows(get("next_observation"), vec![f32::NAN; get("action").len()]);
        (batch.reward, batch.discount) = (get("reward"), get("discount"));
        (sac.scratch.next.noise, sac.scratch.present.noise) = (get("next_noise"), get("noise"));
    }
}

/// Largest error relative to the largest entry, because the rounding error of a sum is relative to its largest terms.
fn error(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    // Unlike `f32::max`, this keeps a NaN.
    let larger = |a: f32, b: f32| if b > a || b.is_nan() { b } else { a };
    let largest = |values: &mut dyn Iterator<Item = f32>| values.map(f32::abs).fold(0.0, larger);
    largest(&mut found.iter().zip(expected).map(|(a, b)| a - b)) / largest(&mut expected.iter().copied())
}

/// A change to what an update works with.
type Slip = fn(&mut Sac);

/// Does the three updates of a record, each after `slip`, and returns what differs from PyTorch's by more than rounding.
fn differences(record: &str, slip: Slip) -> Vec<String> {
    let record = Record::read(record);
    let mut sac = record.learner();
    let mut differences = Vec::new();
    for t in 1..=3 {
        record.load_batch(&mut sac, t);
        slip(&mut sac);
        let losses = sac.learn();
        let mut compare = |name: &str, found: &[f32], tolerance: f32| {
            let error = error(found, &record.get(&format!("{name}@{t}")));
            if error.is_nan() || error > tolerance {
                differences.push(format!("{name} after update {t}: off by {error:.1e}, allowed {tolerance:.1e}"));
            }
        };
        compare("critic_loss", &[losses.critic_loss], OF_STATE);
        let ActorLosses { loss, entropy, q_mean, .. } = losses.actor.unwrap();
        for (name, value) in [("actor_loss", loss), ("entropy", entropy), ("q_mean", q_mean)] {
            compare(name, &[value], OF_STATE);
        }
        compare("log_temperature", &[sac.log_temperature], OF_STATE);
        compare("log_temperature.adam_m", &sac.temperature_adam.m, OF_GRADIENT);
        compare("log_temperature.adam_v", &sac.temperature_adam.v, OF_SQUARES);
        for (networks, values, suffix, tolerance) in [
            (&sac.actor.network, &sac.actor.network.values[..], "", OF_STATE),
            (&sac.actor.network, &sac.scratch.actor_gradient.values, ".gradient", OF_GRADIENT),
            (&sac.actor.network, &sac.actor_adam.m, ".adam_m", OF_GRADIENT),
            (&sac.actor.network, &sac.actor_adam.v, ".adam_v", OF_SQUARES),
            (&sac.critics, &sac.critics.values, "", OF_STATE),
            (&sac.critics, &sac.scratch.critic_gradient.values, ".gradient", OF_GRADIENT),
            (&sac.critics, &sac.critic_adam.m, ".adam_m", OF_GRADIENT),
            (&sac.critics, &sac.critic_adam.v, ".adam_v", OF_SQUARES),
            (&sac.critics, &sac.targets.values, ".target", OF_STATE),
        ] {
            for entry in networks.entries() {
                compare(&format!("{}{suffix}", entry.name), &values[entry.range()], tolerance);
            }
        }
    }
    differences
}

#[test]
fn three_updates_leave_what_pytorch_leaves() {
    for record in RECORDS {
        let differences = differences(record, |_| ());
        assert!(differences.is_empty(), "{record}: {}", differences.join("\n"));
    }
}

#[test]
fn any_slip_is_noticed() {
    let slips: [(&str, Slip); 20] = [
        ("a discount of gamma^2 for gamma^3", |sac| sac.scratch.batch.discount[0] /= 0.97),
        ("a discount after a termination", |sac| sac.scratch.batch.discount[5] = 0.97),
        ("a reward", |sac| sac.scratch.batch.reward[3] += 1e-3),
        ("an observation", |sac| sac.scratch.batch.input[OBSERVATIONS - 1] += 1e-3),
        ("an action", |sac| sac.scratch.batch.input[OBSERVATIONS] += 1e-3),
        ("a next observation", |sac| sac.scratch.batch.next_input[0] += 1e-3),
        ("next noise", |sac| sac.scratch.next.noise[0] += 1e-3),
        ("present noise", |sac| *sac.scratch.present.noise.last_mut().unwrap() += 1e-3),
        ("noise the wrong way round", |sac| {
            std::mem::swap(&mut sac.scratch.next.noise, &mut sac.scratch.present.noise);
        }),
        ("the temperature", |sac| sac.log_temperature += 1e-4),
        ("a weight of a target", |sac| sac.targets.values[0] += 1e-4),
        ("targets that are the critics", |sac| sac.targets = sac.critics.clone()),
        ("targets moved every time", |sac| sac.config.target_period = 1),
        ("the targets' step", |sac| sac.config.tau *= 1.01),
        ("the target entropy", |sac| sac.config.target_entropy = None),
        ("the actor's rate", |sac| sac.config.actor_learning_rate *= 1.01),
        ("the critics' rate", |sac| sac.config.critic_learning_rate *= 1.01),
        ("the temperature's rate", |sac| sac.config.temperature_learning_rate *= 1.01),
        ("updates counted from 0", |sac| sac.updates = sac.updates.max(1)),
        ("the range of log std", |sac| {
            sac.actor.policy = SquashedGaussian::new(&Config { log_std_max: 1.51, ..sac.config.clone() });
        }),
    ];
    for (what, slip) in slips {
        assert!(!differences(RECORDS[0], slip).is_empty(), "{what} makes no difference");
    }
    let of_critics: [(&str, Slip); 4] = [
        ("what only critics see", |sac| sac.scratch.batch.input[OBSERVATIONS] += 1e-3),
        ("what only critics see next", |sac| sac.scratch.batch.next_input[OBSERVATIONS] += 1e-3),
        ("the last of the actor's numbers", |sac| sac.scratch.batch.input[OBSERVATIONS - 1] += 1e-3),
        ("an action after it", |sac| {
            let seen = sac.sizes.whole_observation();
            sac.scratch.batch.input[seen] += 1e-3;
        }),
    ];
    for (what, slip) in of_critics {
        assert!(!differences(RECORDS[1], slip).is_empty(), "{what} makes no difference");
    }
}

#[test]
fn a_checkpoint_means_the_same_policy_to_pytorch() {
    let (mut actor, _) = Actor::load(&path("checkpoint"), OBSERVATIONS, ACTIONS, 0).unwrap();
    let record = Record::read(RECORDS[0]);
    let observations = record.get("checkpoint.observations");
    let expected = record.get("checkpoint.mean_actions");
    assert!(!expected.is_empty());
    for (observation, expected) in observations.chunks_exact(OBSERVATIONS).zip(expected.chunks_exact(ACTIONS)) {
        let mut action = [0.0; ACTIONS];
        actor.act(observation, &mut action, Act::Mean);
        // Both sides round to f32: a few times 6e-8 each.
        approx::assert_abs_diff_eq!(action[..], expected, epsilon = 1e-6);
    }
}

/// Writes the checkpoint that PyTorch evaluates: `cargo test -p sac --lib -- --ignored write_the_checkpoint`, then the script.
#[test]
#[ignore = "writes into the repository"]
fn write_the_checkpoint() {
    let config = Record::read(RECORDS[0]).config();
    let mut replay = Replay::new(&config, (OBSERVATIONS, ACTIONS));
    let observe = |k: usize| std::array::from_fn::<f32, OBSERVATIONS, _>(|i| ((7 * k + i) as f32).sin());
    for k in 0..50 {
        let step = Transition {
            observation: &observe(k),
            action: &[0.1, -0.5, 0.9],
            reward: (k as f32).cos(),
            next_observation: &observe(k + 1),
            terminated: k % 10 == 9,
            truncated: false,
        };
        replay.push(&step).unwrap();
    }
    let mut sac = Sac::new(&config, (OBSERVATIONS, ACTIONS), 1).unwrap();
    // Enough updates that no bias is zero any more.
    for _ in 0..100 {
        sac.update(&replay);
    }
    let observations: Vec<_> = (100..108).map(observe).collect();
    let mut policy = sac.policy(0);
    let mean_actions: Vec<_> = observations
        .iter()
        .map(|observation| {
            let mut action = [0.0; ACTIONS];
            policy.act(observation, &mut action, Act::Mean);
            action
        })
        .collect();
    let caller = json!({ "observations": observations, "mean_actions": mean_actions });
    Checkpoint::save(&path("checkpoint"), &sac, None, caller).unwrap();
}
