//! The jerk of the tool.

use aforce::Vector3;

/// Number of control samples from which a jerk is computed.
const WINDOW: usize = 15;
/// Below this speed of the tool (m/s) a jerk does not count: time at rest would lower the mean jerk of any motion.
const MOVING: f64 = 0.01;

/// The tool's velocities in the last control samples of an episode.
#[derive(Debug, Clone, Default)]
pub(crate) struct Motion {
    /// Velocities, the oldest first (m/s).
    velocities: [Vector3; WINDOW],
    samples: usize,
}

impl Motion {
    /// Adds the tool's velocity (m/s) after one more sample of `dt` seconds. Returns the size of the jerk (m/s3) in the middle of the last
    /// 15 samples; `None` if there are fewer, or if the tool is slower than 1 cm/s there.
    ///
    /// It is the second derivative of the quadratic that fits those velocities best (Savitzky and Golay's filter), as in the score of the AI
    /// for Industry Challenge.
    pub fn jerk(&mut self, velocity: Vector3, dt: f64) -> Option<f64> {
        self.velocities.rotate_left(1);
        self.velocities[WINDOW - 1] = velocity;
        self.samples += 1;
        let moves = self.velocities[WINDOW / 2].norm() > MOVING;
        (self.samples >= WINDOW && moves).then(|| 2.0 * curvature(&self.velocities).norm() / (dt * dt))
    }
}

/// The coefficient of i² of the quadratic in i = -7 to 7 that fits 15 values best.
fn curvature(values: &[Vector3; WINDOW]) -> Vector3 {
    const MEAN_SQUARE: f64 = 56.0 / 3.0;
    // The sum of (i² - mean)² over i.
    const SPREAD: f64 = 12_376.0 / 3.0;
    let half = (WINDOW / 2) as f64;
    let weighted = |(at, value): (usize, &Vector3)| {
        let i = at as f64 - half;
        value * ((i * i - MEAN_SQUARE) / SPREAD)
    };
    values.iter().enumerate().map(weighted).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The jerk of a velocity that is quadratic in time is constant, whatever the velocity's value and slope are.
    #[test]
    fn the_jerk_of_a_quadratic_is_exact() {
        const DT: f64 = 0.002;
        let velocity = |k: usize| {
            let t = k as f64 * DT;
            Vector3::new(0.3 + 2.0 * t + 15.0 * t * t, 0.1 - 20.0 * t * t, 0.5 * t)
        };
        let mut motion = Motion::default();
        let jerks: Vec<_> = (0..20).map(|k| motion.jerk(velocity(k), DT)).collect();
        assert!(jerks[..14].iter().all(Option::is_none), "14 samples are too few");
        for jerk in &jerks[14..] {
            assert!((jerk.unwrap() - 50.0).abs() < 1e-6, "{jerk:?}: 2 sqrt(15² + 20²)");
        }
    }

    #[test]
    fn a_tool_at_rest_has_no_jerk() {
        let mut motion = Motion::default();
        let shaking = |k: usize| Vector3::x() * if k.is_multiple_of(2) { 0.009 } else { -0.009 };
        assert!((0..40).all(|k| motion.jerk(shaking(k), 0.002).is_none()));
    }
}
