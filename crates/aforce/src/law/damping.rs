//! Damping that follows the stiffness, in the same sample.

use serde::{Deserialize, Serialize};

use crate::law::gains::Gains;
use crate::spatial::Vector6;

/// How D is formed from K.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damping {
    /// D_i = 2 zeta sqrt(K_i m_i) with m_i the apparent inertia of axis i: about critical at any inertia.
    MassAware,
    /// D = 2 zeta sqrt(K), as the paper prints it: critical only for an inertia of 1, and 2 to 6 times too weak on an arm.
    Literal,
}

impl Damping {
    /// D of each axis (Ns/m, Nms/rad; where stiffness is in 1/s^2, 1/s).
    ///
    /// `inertia` is the diagonal of Lambda (kg, kg m^2), or ones where stiffness is in 1/s^2; with ones both variants agree.
    #[must_use]
    pub fn of(self, stiffness: &Vector6, inertia: &Vector6, damping_ratio: &Gains) -> Vector6 {
        Vector6::from_fn(|axis, _| self.of_axis(stiffness[axis], inertia[axis], damping_ratio[axis]))
    }

    /// D of one axis, with the units of [`of`](Self::of).
    #[must_use]
    pub fn of_axis(self, stiffness: f64, inertia: f64, damping_ratio: f64) -> f64 {
        match self {
            Self::MassAware => 2.0 * damping_ratio * (stiffness * inertia).sqrt(),
            Self::Literal => 2.0 * damping_ratio * stiffness.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        assert_eq!(Damping::MassAware.of_axis(100.0, 4.0, 1.0), 40.0);
        assert_eq!(Damping::Literal.of_axis(100.0, 4.0, 1.0), 20.0);
        assert_eq!(Damping::MassAware.of_axis(100.0, 4.0, 0.5), 20.0);
    }

    #[test]
    fn mass_aware_reduces_to_literal_at_unit_inertia() {
        let k = Vector6::new(0.0, 20.0, 150.0, 300.0, 7.0, 1500.0);
        let ones = Vector6::repeat(1.0);
        assert_eq!(
            Damping::MassAware.of(&k, &ones, &Gains::all(1.0)),
            Damping::Literal.of(&k, &ones, &Gains::all(1.0))
        );
    }
}
