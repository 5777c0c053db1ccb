//! Normal samples that do not depend on the processor.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A sample from the normal distribution of mean 0 and deviation 1, drawn in single precision: the tails use the platform's exp and
/// ln, whose last double-precision bits differ between processors.
pub fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    f64::from(rng.sample::<f32, _>(StandardNormal))
}
