//! How the external wrench is known to the controller.

use aforce::{ConfigError, JointVector, Measurement, MomentumObserver, Wrench, within};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};
use serde::{Deserialize, Serialize};

/// Which wrench is measured, and how good an estimated one is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensing {
    /// Which wrench is measured.
    pub source: SensedWrench,
    /// Cut-off of the observer that estimates (Hz).
    pub cutoff_hz: f64,
    /// Largest constant error of each component of an estimated wrench, in world axes, drawn anew in each episode (N, Nm).
    pub bias: [f64; 2],
    /// Standard deviation of the noise of each control sample of an estimated wrench (N, Nm).
    pub noise: [f64; 2],
}

/// Which wrench the law and the policy are given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensedWrench {
    /// Estimated from commanded joint torques by a momentum observer ([`MomentumObserver`]), with bias and noise: what an arm without a force
    /// sensor has.
    Estimated,
    /// The simulated contact forces themselves, low-passed.
    #[default]
    Exact,
}

impl Default for Sensing {
    fn default() -> Self {
        Sensing { source: SensedWrench::Exact, cutoff_hz: 25.0, bias: [0.5, 0.05], noise: [0.3, 0.03] }
    }
}

impl Sensing {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field (below `sensing`) and range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        within("sensing.cutoff_hz", self.cutoff_hz, 0.1..=1e4)?;
        for (name, [force, torque]) in [("bias", self.bias), ("noise", self.noise)] {
            within(&format!("sensing.{name}[0]"), force, 0.0..=100.0)?;
            within(&format!("sensing.{name}[1]"), torque, 0.0..=10.0)?;
        }
        Ok(())
    }

    /// The estimator of the episode with the given seed, which starts with the measurement `y`; `None` where nothing is
    /// estimated. `damping` is the viscous damping of the joints (Nm s/rad).
    pub(crate) fn estimator(&self, seed: u64, damping: JointVector, y: &Measurement) -> Option<Estimator> {
        let estimates = self.source == SensedWrench::Estimated;
        // The complement of the seed, so that bias and noise do not correlate with the scene, which is drawn from the seed itself.
        estimates.then(|| Estimator::new(self, damping, y, ChaCha8Rng::seed_from_u64(!seed)))
    }
}

/// The estimator of one episode.
pub(crate) struct Estimator {
    observer: MomentumObserver,
    bias: Wrench,
    noise: [Normal<f64>; 2],
    rng: ChaCha8Rng,
}

impl Estimator {
    /// Draws the bias from `rng`, and later the noise.
    fn new(sensing: &Sensing, damping: JointVector, y: &Measurement, mut rng: ChaCha8Rng) -> Self {
        let bias = Wrench::from_fn(|axis, _| {
            let largest = sensing.bias[axis / 3];
            Uniform::new_inclusive(-largest, largest).expect("a bias is not negative").sample(&mut rng)
        });
        let noise = sensing.noise.map(|deviation| Normal::new(0.0, deviation).expect("a finite deviation"));
        Estimator { observer: MomentumObserver::new(sensing.cutoff_hz, damping, y), bias, noise, rng }
    }

    /// The constant error (N, Nm; world axes).
    pub fn bias(&self) -> &Wrench {
        &self.bias
    }

    /// The estimated wrench that the environment exerts on the tool (N, Nm; world axes, about the tool point), after
    /// `tau` (Nm) was commanded for `dt` seconds and led to `y`.
    pub fn update(&mut self, tau: &JointVector, y: &Measurement, dt: f64) -> Wrench {
        self.observer.update(tau, y, dt);
        let noise = Wrench::from_fn(|axis, _| self.noise[axis / 3].sample(&mut self.rng));
        self.observer.wrench() + self.bias + noise
    }
}
