//! Disturbances, which neither the controller's model nor the policy knows: fixed, or drawn for every episode.

use std::collections::BTreeMap;

use aforce::record::nearest;
use aforce::{ConfigError, within};
use physics::{Change, Deviation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::drawn::Drawn;
use crate::observer::Observer;

/// A number, or the range from which one is drawn for every episode, uniformly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or [low, high]")]
pub enum Draw {
    /// The same in every episode.
    Fixed(f64),
    /// Lower and upper end.
    Between([f64; 2]),
}

impl Draw {
    pub(crate) fn ends(self) -> [f64; 2] {
        match self {
            Draw::Fixed(value) => [value; 2],
            Draw::Between(ends) => ends,
        }
    }
}

/// Everything that may be disturbed. Without a key the plant is as the controller's model has it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disturbance {
    /// Factor on every coefficient of sliding friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Draw>,
    /// Point mass at the tool point (kg).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<Draw>,
    /// Wipe: how much higher the table stands than the observation of the markers says (m).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table_height_m: Option<Draw>,
    /// Lift: factor on the cube's mass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cube_mass: Option<Draw>,
    /// Door: factor on viscous damping and dry friction of the hinge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hinge_damping: Option<Draw>,
    /// Door: a spring that closes the door (Nm/rad).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hinge_spring: Option<Draw>,
    /// Amplitude of a sinusoidal force on the tool point (N), along a direction drawn for every episode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push_n: Option<Draw>,
    /// Frequency of that force (Hz).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push_hz: Option<Draw>,
    /// Delay of the joint torques (s), rounded up to whole control samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_delay_s: Option<Draw>,
    /// Factor on the torque that the motors give beyond gravity and Coriolis compensation: on every stiffness, damping and force at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_gain: Option<Draw>,
    /// Standard deviation of the noise of each measured joint angle (rad), drawn for every control sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_noise_rad: Option<Draw>,
    /// Standard deviation of the noise of each measured joint velocity (rad/s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_noise_rad_per_s: Option<Draw>,
    /// Standard deviation of the noise of each component of the measured force (N).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_noise_n: Option<Draw>,
    /// Size of a constant error of the measured force (N), along a direction drawn for every episode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_bias_n: Option<Draw>,
    /// Disturbances of the task's own bodies and joints, by the keys that the task is registered with
    /// ([`OwnDisturbance`](crate::OwnDisturbance)).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub own: BTreeMap<String, Draw>,
}

/// A disturbance of a body or a joint of a user's own task: a key below `env.disturbance.own`.
///
/// ```
/// # use tasks::{Change, OwnDisturbance};
/// const STICKY: OwnDisturbance = OwnDisturbance { key: "slide_friction", change: Change::JointFriction("slide"), allowed: [0.0, 10.0] };
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnDisturbance {
    /// The key.
    pub key: &'static str,
    /// What it changes.
    pub change: Change,
    /// Smallest and largest value allowed, in the unit of the change.
    pub allowed: [f64; 2],
}

/// One kind of disturbance: its key and unit, the value that disturbs nothing, the values allowed, whether every task has it.
struct Kind {
    key: &'static str,
    unit: &'static str,
    neutral: f64,
    allowed: [f64; 2],
    everywhere: bool,
    of: fn(&Disturbance) -> Option<Draw>,
}

const fn kind(
    key: &'static str,
    unit: &'static str,
    neutral: f64,
    allowed: [f64; 2],
    everywhere: bool,
    of: fn(&Disturbance) -> Option<Draw>,
) -> Kind {
    Kind { key, unit, neutral, allowed, everywhere, of }
}

const KINDS: [Kind; 14] = [
    kind("friction", "1", 1.0, [0.0, 10.0], true, |d| d.friction),
    kind("payload_kg", "kg", 0.0, [0.0, 5.0], true, |d| d.payload_kg),
    kind("table_height_m", "m", 0.0, [-0.2, 0.2], false, |d| d.table_height_m),
    kind("cube_mass", "1", 1.0, [0.1, 100.0], false, |d| d.cube_mass),
    kind("hinge_damping", "1", 1.0, [0.0, 100.0], false, |d| d.hinge_damping),
    kind("hinge_spring", "Nm/rad", 0.0, [0.0, 100.0], false, |d| d.hinge_spring),
    kind("push_n", "N", 0.0, [0.0, 200.0], true, |d| d.push_n),
    kind("push_hz", "Hz", 0.0, [0.0, 50.0], true, |d| d.push_hz),
    kind("torque_delay_s", "s", 0.0, [0.0, 0.2], true, |d| d.torque_delay_s),
    kind("position_noise_rad", "rad", 0.0, [0.0, 0.1], true, |d| d.position_noise_rad),
    kind("velocity_noise_rad_per_s", "rad/s", 0.0, [0.0, 1.0], true, |d| d.velocity_noise_rad_per_s),
    kind("force_noise_n", "N", 0.0, [0.0, 100.0], true, |d| d.force_noise_n),
    kind("force_bias_n", "N", 0.0, [0.0, 100.0], true, |d| d.force_bias_n),
    kind(TORQUE_GAIN, "1", 1.0, [0.1, 2.0], true, |d| d.torque_gain),
];

/// Drawn from a random stream of its own, so that the draws of the other kinds are the same with and without it.
const TORQUE_GAIN: &str = "torque_gain";

/// Whether a built-in disturbance has this key.
pub(crate) fn is_known(key: &str) -> bool {
    KINDS.iter().any(|kind| kind.key == key)
}

/// Whether this is the key of a built-in disturbance that only some tasks have.
pub(crate) fn is_of_some_tasks(key: &str) -> bool {
    KINDS.iter().any(|kind| kind.key == key && !kind.everywhere)
}

impl Disturbance {
    /// Checks every value, and that the task called `task` has what is disturbed. `has` are its keys among the
    /// disturbances that only some tasks have; `known` are its own disturbances. `owners` names the tasks that have a
    /// key.
    pub(crate) fn check(
        &self,
        task: &str,
        has: &[&str],
        known: &[OwnDisturbance],
        owners: impl Fn(&str) -> Vec<&'static str>,
    ) -> Result<(), ConfigError> {
        let contradiction =
            |key: &str, reason| Err(ConfigError::Contradiction { field: format!("disturbance.{key}"), reason });
        let in_range = |key: &str, draw: Draw, [low, high]: [f64; 2]| {
            let ends = draw.ends();
            for value in ends {
                within(&format!("disturbance.{key}"), value, low..=high)?;
            }
            if ends[0] > ends[1] {
                return contradiction(key, format!("{ends:?} is upside down: the lower end comes first"));
            }
            Ok(())
        };
        for Kind { key, allowed, everywhere, of, .. } in KINDS {
            let Some(draw) = of(self) else { continue };
            if !everywhere && !has.contains(&key) {
                return contradiction(key, format!("{} has it, {task} has not", owners(key).join(", ")));
            }
            in_range(key, draw, allowed)?;
        }
        for (key, &draw) in &self.own {
            let keys: Vec<&str> = known.iter().map(|own| own.key).collect();
            let Some(own) = known.iter().find(|own| own.key == key) else {
                let hint = match nearest(key, &keys) {
                    Some(near) => format!("did you mean {near:?}?"),
                    None if keys.is_empty() => "it has no disturbances of its own".into(),
                    None => format!("known are {}", keys.join(", ")),
                };
                return contradiction(&format!("own.{key}"), format!("{task} has no such disturbance; {hint}"));
            };
            in_range(&format!("own.{key}"), draw, own.allowed)?;
        }
        if self.push_n.is_some() != self.push_hz.is_some() {
            return contradiction("push_n", "push_n and push_hz stand together or not at all".into());
        }
        Ok(())
    }

    /// Everything that is disturbed: every key with its value or range.
    pub fn in_words(&self) -> String {
        let words = |key: &str, draw| match draw {
            Draw::Fixed(value) => format!("{key} {value}"),
            Draw::Between([low, high]) => format!("{key} {low} to {high}"),
        };
        let text = |kind: &Kind| Some(words(kind.key, (kind.of)(self)?));
        let own = self.own.iter().map(|(key, draw)| words(key, *draw));
        KINDS.iter().filter_map(text).chain(own).collect::<Vec<_>>().join(", ")
    }

    /// The plant with the highest table that an episode may have.
    pub(crate) fn highest_table(&self) -> Deviation {
        let table_height = self.table_height_m.map_or(0.0, |draw| draw.ends()[1]);
        Deviation { table_height, ..Deviation::default() }
    }

    /// The values of the episode with the given seed, of a task with these `known` disturbances of its own. They are
    /// drawn from other random streams than the scene: episodes of one seed start alike, whatever disturbs them.
    pub(crate) fn draw(&self, seed: u64, known: &[OwnDisturbance]) -> Drawn {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(1);
        // A draw of `torque_gain` from the first stream would change the draws after it, and with them every episode of earlier versions.
        let mut later = ChaCha8Rng::seed_from_u64(seed);
        later.set_stream(3);
        let values = KINDS.map(|kind| {
            let [low, high] = (kind.of)(self).map_or([kind.neutral; 2], Draw::ends);
            let stream = if kind.key == TORQUE_GAIN { &mut later } else { &mut rng };
            (kind.key, low + (high - low) * stream.random::<f64>())
        });
        let mut drawn = Drawn::new(values.into(), rng);
        // The task's own disturbances have a stream of their own, so that they do not change the values above.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(2);
        for own in known {
            let share = rng.random::<f64>();
            if let Some(draw) = self.own.get(own.key) {
                let [low, high] = draw.ends();
                let value = low + (high - low) * share;
                drawn.values.push((own.key, value));
                drawn.deviation.own.push((own.change, value));
            }
        }
        drawn
    }

    /// Puts the `drawn` value of every disturbed key and, as vectors, the bias of the measured force and the push of the coming control
    /// sample (N, world). Scaling maps a range to -1 to 1.
    pub(crate) fn observe(&self, drawn: &Drawn, out: &mut Observer) {
        let own_units = drawn.deviation.own.iter().map(|(change, _)| change.unit());
        for ((key, value), unit) in drawn.values.iter().zip(KINDS.iter().map(|kind| kind.unit).chain(own_units)) {
            let kind = KINDS.iter().find(|kind| kind.key == *key);
            let draw = kind.map_or_else(|| self.own.get(*key).copied(), |kind| (kind.of)(self));
            let Some([low, high]) = draw.map(Draw::ends) else { continue };
            let scale = if high > low { 2.0 / (high - low) } else { 1.0 };
            out.put(format_args!("disturbance_{key}"), *value, unit, (low + high) / 2.0, scale);
            match *key {
                "force_bias_n" => out.vector("disturbance_force_bias", drawn.bias, "N, world", 1.0 / high.max(1.0)),
                "push_n" => out.vector("disturbance_push", drawn.pushing(), "N, world", 1.0 / high.max(1.0)),
                _ => (),
            }
        }
    }
}
