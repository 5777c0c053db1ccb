//! What neither the controller's model nor the policy knows: fixed, or drawn anew for every episode.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use aforce::{ConfigError, JointVector, Measurement, Vector3, Wrench, within};
use physics::{Deviation, Simulation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::normal::standard_normal;
use crate::task_name::TaskName;

/// A number, or the range from which one is drawn for every episode, each value as likely as any other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
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

/// Everything that may be disturbed; what is absent is as the controller's model has it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disturbance {
    /// Factor on every coefficient of sliding friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Draw>,
    /// Mass of a point at the tool point (kg).
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
    /// Amplitude of a force on the tool point that swings along a direction drawn for every episode (N).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push_n: Option<Draw>,
    /// Its frequency (Hz).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub push_hz: Option<Draw>,
    /// How late the joint torques act (s), to the next whole control sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_delay_s: Option<Draw>,
    /// Standard deviation of the noise of each measured joint angle (rad), drawn for every control sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_noise_rad: Option<Draw>,
    /// Of each measured joint velocity (rad/s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_noise_rad_per_s: Option<Draw>,
    /// Of each component of the measured force (N).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_noise_n: Option<Draw>,
    /// Size of an error of the measured force that stays (N), along a direction drawn for every episode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_bias_n: Option<Draw>,
}

/// One kind of disturbance: its key, the value that disturbs nothing, the values allowed, the one task that has it.
struct Kind {
    key: &'static str,
    neutral: f64,
    allowed: [f64; 2],
    task: Option<TaskName>,
    of: fn(&Disturbance) -> Option<Draw>,
}

const fn kind(
    key: &'static str,
    neutral: f64,
    allowed: [f64; 2],
    task: Option<TaskName>,
    of: fn(&Disturbance) -> Option<Draw>,
) -> Kind {
    Kind { key, neutral, allowed, task, of }
}

const KINDS: [Kind; 13] = [
    kind("friction", 1.0, [0.0, 10.0], None, |d| d.friction),
    kind("payload_kg", 0.0, [0.0, 5.0], None, |d| d.payload_kg),
    kind("table_height_m", 0.0, [-0.2, 0.2], Some(TaskName::Wipe), |d| d.table_height_m),
    kind("cube_mass", 1.0, [0.1, 100.0], Some(TaskName::Lift), |d| d.cube_mass),
    kind("hinge_damping", 1.0, [0.0, 100.0], Some(TaskName::Door), |d| d.hinge_damping),
    kind("hinge_spring", 0.0, [0.0, 100.0], Some(TaskName::Door), |d| d.hinge_spring),
    kind("push_n", 0.0, [0.0, 200.0], None, |d| d.push_n),
    kind("push_hz", 0.0, [0.0, 50.0], None, |d| d.push_hz),
    kind("torque_delay_s", 0.0, [0.0, 0.2], None, |d| d.torque_delay_s),
    kind("position_noise_rad", 0.0, [0.0, 0.1], None, |d| d.position_noise_rad),
    kind("velocity_noise_rad_per_s", 0.0, [0.0, 1.0], None, |d| d.velocity_noise_rad_per_s),
    kind("force_noise_n", 0.0, [0.0, 100.0], None, |d| d.force_noise_n),
    kind("force_bias_n", 0.0, [0.0, 100.0], None, |d| d.force_bias_n),
];

impl Disturbance {
    /// Checks every value, and that `task` has what is disturbed.
    ///
    /// # Errors
    /// The first value that is not allowed, with its key.
    pub fn validate(&self, task: TaskName) -> Result<(), ConfigError> {
        let contradiction =
            |key: &str, reason| Err(ConfigError::Contradiction { field: format!("disturbance.{key}"), reason });
        for Kind { key, allowed: [low, high], task: only, of, .. } in KINDS {
            let Some(draw) = of(self) else { continue };
            if let Some(only) = only.filter(|&only| only != task) {
                return contradiction(key, format!("{} has it, {} has not", only.as_str(), task.as_str()));
            }
            let ends = draw.ends();
            for value in ends {
                within(&format!("disturbance.{key}"), value, low..=high)?;
            }
            if ends[0] > ends[1] {
                return contradiction(key, format!("{ends:?} is upside down: the lower end comes first"));
            }
        }
        if self.push_n.is_some() != self.push_hz.is_some() {
            return contradiction("push_n", "push_n and push_hz stand together or not at all".into());
        }
        Ok(())
    }

    /// Everything that is disturbed: every key with its value or range.
    pub fn in_words(&self) -> String {
        let text = |kind: &Kind| match (kind.of)(self)? {
            Draw::Fixed(value) => Some(format!("{} {value}", kind.key)),
            Draw::Between([low, high]) => Some(format!("{} {low} to {high}", kind.key)),
        };
        KINDS.iter().filter_map(text).collect::<Vec<_>>().join(", ")
    }

    /// The plant with the highest table that an episode may have.
    pub(crate) fn highest_table(&self) -> Deviation {
        let table_height = self.table_height_m.map_or(0.0, |draw| draw.ends()[1]);
        Deviation { table_height, ..Deviation::default() }
    }

    /// The values of the episode with the given seed. They have a stream of their own: episodes of one seed start alike,
    /// whatever disturbs them.
    pub(crate) fn draw(&self, seed: u64) -> Drawn {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(1);
        let values = KINDS.map(|kind| {
            let [low, high] = (kind.of)(self).map_or([kind.neutral; 2], Draw::ends);
            low + (high - low) * rng.random::<f64>()
        });
        let [
            friction,
            payload,
            table_height,
            object_mass,
            hinge_damping,
            hinge_spring,
            push,
            push_hz,
            delay,
            position_noise,
            velocity_noise,
            force_noise,
            bias,
        ] = values;
        let mut direction = || Vector3::from_fn(|_, _| standard_normal(&mut rng)).normalize();
        Drawn {
            deviation: Deviation { payload, friction, object_mass, hinge_damping, hinge_spring, table_height },
            push: direction() * push,
            bias: direction() * bias,
            push_hz,
            phase: TAU * rng.random::<f64>(),
            delay,
            noise: [position_noise, velocity_noise, force_noise],
            late: VecDeque::new(),
            time: 0.0,
            rng,
        }
    }
}

/// The disturbances of one episode.
pub(crate) struct Drawn {
    /// Of the plant.
    pub deviation: Deviation,
    /// Amplitude of the push (N, world).
    push: Vector3,
    push_hz: f64,
    /// At the start (rad).
    phase: f64,
    /// How late torques act (s).
    delay: f64,
    /// Standard deviations of joint angle (rad), joint velocity (rad/s) and force (N).
    noise: [f64; 3],
    /// Error of the force that stays (N, world).
    bias: Vector3,
    /// Torques that have not acted yet, the oldest first.
    late: VecDeque<JointVector>,
    /// Since the start (s).
    time: f64,
    rng: ChaCha8Rng,
}

impl Drawn {
    /// The episode starts: until the first torque arrives, the arm is held by `holding` (Nm).
    pub fn begin(&mut self, holding: &JointVector, dt: f64) {
        self.late = VecDeque::from(vec![*holding; (self.delay / dt - 1e-9).ceil() as usize]);
    }

    /// The force (N, world) that pushes the tool point in the coming sample of `dt` seconds.
    pub fn push(&mut self, dt: f64) -> Vector3 {
        let push = self.push * libm::sin(self.phase + TAU * self.push_hz * self.time);
        self.time += dt;
        push
    }

    /// The torque (Nm) that acts in this sample if `tau` is commanded.
    pub fn delayed(&mut self, tau: &JointVector) -> JointVector {
        if self.late.is_empty() {
            return *tau;
        }
        let acting = self.late.pop_front().expect("it is not empty");
        self.late.push_back(*tau);
        acting
    }

    /// What is measured.
    pub fn sense(&mut self, simulation: &Simulation) -> Measurement {
        if self.noise == [0.0; 3] && self.bias == Vector3::zeros() {
            return simulation.measure();
        }
        let rng = &mut self.rng;
        let (q, qd) = simulation.joints();
        let mut noisy = |v: JointVector, deviation: f64| v.map(|value| value + deviation * standard_normal(rng));
        let (q, qd) = (noisy(q, self.noise[0]), noisy(qd, self.noise[1]));
        let error = self.bias.map(|bias| bias + self.noise[2] * standard_normal(&mut self.rng));
        let error = Wrench::new(error.x, error.y, error.z, 0.0, 0.0, 0.0);
        simulation.model().measure(q, qd, simulation.contact().filtered + error)
    }
}
