//! Applies the disturbances of one episode to the plant, the torques and the measurements.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use aforce::{JointVector, Measurement, Vector3, Wrench};
use physics::{Deviation, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::normal::standard_normal;

/// The disturbances of one episode.
pub(crate) struct Drawn {
    /// Key and value of every kind of disturbance.
    pub values: Vec<(&'static str, f64)>,
    /// Deviation of the plant.
    pub deviation: Deviation,
    /// Amplitude of the push (N, world).
    push: Vector3,
    push_hz: f64,
    /// Phase of the push at the start (rad).
    phase: f64,
    /// How late torques act (s).
    delay: f64,
    /// Factor on torques beyond gravity and Coriolis compensation.
    gain: f64,
    /// Standard deviations of joint angle (rad), joint velocity (rad/s) and force (N).
    noise: [f64; 3],
    /// Constant error of the measured force (N, world).
    pub bias: Vector3,
    /// Torques that have not acted yet, the oldest first.
    late: VecDeque<JointVector>,
    /// Time since the start (s).
    time: f64,
    rng: ChaCha8Rng,
}

impl Drawn {
    /// `values` has a value for every built-in key of [`Disturbance`](crate::Disturbance). Directions and the phase of the push are drawn
    /// from `rng`.
    pub fn new(values: Vec<(&'static str, f64)>, mut rng: ChaCha8Rng) -> Self {
        let value = |key: &str| values.iter().find(|(of, _)| *of == key).expect("a kind of disturbance").1;
        let mut direction = || Vector3::from_fn(|_, _| standard_normal(&mut rng)).normalize();
        Drawn {
            deviation: Deviation {
                payload: value("payload_kg"),
                friction: value("friction"),
                object_mass: value("cube_mass"),
                hinge_damping: value("hinge_damping"),
                hinge_spring: value("hinge_spring"),
                table_height: value("table_height_m"),
                own: vec![],
            },
            push: direction() * value("push_n"),
            bias: direction() * value("force_bias_n"),
            push_hz: value("push_hz"),
            phase: TAU * rng.random::<f64>(),
            delay: value("torque_delay_s"),
            gain: value("torque_gain"),
            noise: ["position_noise_rad", "velocity_noise_rad_per_s", "force_noise_n"].map(value),
            late: VecDeque::new(),
            time: 0.0,
            rng,
            values,
        }
    }

    /// Starts an episode. Until the first delayed torque acts, the torque `holding` (Nm) does.
    pub fn begin(&mut self, holding: &JointVector, dt: f64) {
        self.late.clear();
        self.fill(holding, dt);
    }

    /// Sets the delay of the torques (s). If the delay grows, the torque that acts next is repeated, or `holding` (Nm) if no torque
    /// was delayed.
    pub fn set_delay(&mut self, delay: f64, holding: &JointVector, dt: f64) {
        self.delay = delay;
        self.values.iter_mut().filter(|(key, _)| *key == "torque_delay_s").for_each(|(_, value)| *value = delay);
        self.fill(self.late.front().copied().as_ref().unwrap_or(holding), dt);
    }

    /// Makes the queue of torques as long as the delay.
    fn fill(&mut self, oldest: &JointVector, dt: f64) {
        let samples = (self.delay / dt - 1e-9).ceil() as usize;
        self.late.drain(..self.late.len().saturating_sub(samples));
        while self.late.len() < samples {
            self.late.push_front(*oldest);
        }
    }

    /// The force (N, world) that pushes the tool point in the coming sample.
    pub fn pushing(&self) -> Vector3 {
        self.push * libm::sin(self.phase + TAU * self.push_hz * self.time)
    }

    /// As [`pushing`](Self::pushing), and moves the clock of the push on by one sample of `dt` seconds.
    pub fn push(&mut self, dt: f64) -> Vector3 {
        let push = self.pushing();
        self.time += dt;
        push
    }

    /// The torque (Nm) that acts in this sample if `tau` is commanded, of which `bias` compensates gravity and Coriolis forces. The motors
    /// give `most` at most.
    pub fn acting(&mut self, tau: &JointVector, bias: &JointVector, most: &JointVector) -> JointVector {
        // Without a gain `tau` is passed on unchanged, so that an undisturbed episode does not differ in its last bit.
        let given = if self.gain == 1.0 {
            *tau
        } else {
            (bias + (tau - bias) * self.gain).zip_map(most, |tau, most| tau.clamp(-most, most))
        };
        if self.late.is_empty() {
            return given;
        }
        let acting = self.late.pop_front().expect("it is not empty");
        self.late.push_back(given);
        acting
    }

    /// The measurement: exact, or with noise and bias where these are not zero. The seventh joint, which an arm of six
    /// joints does not have, has no noise.
    pub fn sense(&mut self, simulation: &Simulation) -> Measurement {
        if self.noise == [0.0; 3] && self.bias == Vector3::zeros() {
            return simulation.measure();
        }
        let rng = &mut self.rng;
        let (q, qd) = simulation.joints();
        let joints = simulation.model().joints();
        let mut noisy = |exact: JointVector, deviation: f64| {
            // Seven numbers are drawn for every arm, so that its joints do not decide what is drawn after them.
            let mut seen = exact.map(|value| value + deviation * standard_normal(rng));
            seen.iter_mut().zip(&exact).skip(joints).for_each(|(seen, exact)| *seen = *exact);
            seen
        };
        let (q, qd) = (noisy(q, self.noise[0]), noisy(qd, self.noise[1]));
        let error = self.bias.map(|bias| bias + self.noise[2] * standard_normal(&mut self.rng));
        let error = Wrench::new(error.x, error.y, error.z, 0.0, 0.0, 0.0);
        simulation.model().measure(q, qd, simulation.contact().filtered + error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disturbance::{Disturbance, Draw};

    /// All values differ, so that a value in the wrong field is noticed.
    #[test]
    fn every_kind_of_disturbance_comes_where_its_key_says() {
        let fixed = |value| Some(Draw::Fixed(value));
        let disturbance = Disturbance {
            friction: fixed(2.0),
            payload_kg: fixed(0.3),
            table_height_m: fixed(0.04),
            cube_mass: fixed(5.0),
            hinge_damping: fixed(6.0),
            hinge_spring: fixed(7.0),
            push_n: fixed(8.0),
            push_hz: fixed(9.0),
            torque_delay_s: fixed(0.1),
            torque_gain: fixed(1.1),
            position_noise_rad: fixed(0.012),
            velocity_noise_rad_per_s: fixed(0.13),
            force_noise_n: fixed(14.0),
            force_bias_n: fixed(15.0),
            own: Default::default(),
        };
        let drawn = disturbance.draw(1, &[]);
        let expected = Deviation {
            payload: 0.3,
            friction: 2.0,
            object_mass: 5.0,
            hinge_damping: 6.0,
            hinge_spring: 7.0,
            table_height: 0.04,
            own: vec![],
        };
        assert_eq!(drawn.deviation, expected);
        assert_eq!((drawn.push_hz, drawn.delay, drawn.gain), (9.0, 0.1, 1.1));
        assert_eq!(drawn.noise, [0.012, 0.13, 14.0]);
        assert!((drawn.push.norm() - 8.0).abs() < 1e-12 && (drawn.bias.norm() - 15.0).abs() < 1e-12);
    }
}
