//! Null-space torque of the redundant joint: it keeps a posture and does not accelerate the tool.

use crate::law::operational_space::OperationalSpace;
use crate::spatial::{JointVector, Measurement};

/// tau_null = N^T M (k (q0 - q) - 2 sqrt(k) qd) with the dynamically consistent N^T = I - J^T Lambda J M^-1 (Nm).
///
/// `stiffness` is k (1/s^2, robosuite: 10) and `q0` the posture to keep (rad). The mass matrix cancels in the projected
/// part: N^T M u = M u - J^T Lambda J u.
#[must_use]
pub fn null_space_torque(y: &Measurement, lambda: &OperationalSpace, q0: &JointVector, stiffness: f64) -> JointVector {
    let u = stiffness * (q0 - y.q) - 2.0 * stiffness.sqrt() * y.qd;
    y.mass * u - y.jacobian.tr_mul(&lambda.shape_coupled(&(y.jacobian * u)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random_arm;
    use approx::assert_relative_eq;
    use nalgebra::SMatrix;

    #[test]
    fn matches_the_formula_and_does_not_accelerate_the_tool() {
        let y = random_arm(11);
        let inertia = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        let q0 = JointVector::repeat(0.4);
        let tau = null_space_torque(&y, &inertia, &q0, 10.0);

        let inverse_mass = y.mass.try_inverse().unwrap();
        let lambda = (y.jacobian * inverse_mass * y.jacobian.transpose()).try_inverse().unwrap();
        let projector = SMatrix::<f64, 7, 7>::identity() - y.jacobian.transpose() * lambda * y.jacobian * inverse_mass;
        let expected = projector * y.mass * (10.0 * (q0 - y.q) - 2.0 * 10f64.sqrt() * y.qd);
        assert_relative_eq!(tau, expected, max_relative = 1e-8, epsilon = 1e-9);
        assert!(tau.norm() > 1e-3);
        assert!((y.jacobian * inverse_mass * tau).norm() < 1e-9 * tau.norm().max(1.0));
    }
}
