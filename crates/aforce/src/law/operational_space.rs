//! The arm's inertia as felt at the tool.
//!
//! The *apparent* mass along n, n^T Lambda n, is what a push along n feels while the tool cannot move sideways. The *effective* mass,
//! 1/(n^T Lambda^-1 n), is what it feels while the tool can; it is never larger.

use nalgebra::{Cholesky, Const, Matrix3, SMatrix};

use crate::spatial::{Jacobian, JointMatrix, Vector6, linear, rotational, stack};

/// Smallest pivot of J M^-1 J^T that is used undamped (1/kg, 1/(kg m^2)). A matrix with a smaller pivot is damped until
/// none is smaller.
///
/// The pivots are those of its Cholesky factor, squared. Each is one over the apparent mass along its axis, with the axes before it held and
/// those after it free. So at a singularity the apparent mass along z, the last axis of its block, stays below 4000 kg (about z: 4000 kg m^2).
/// Along a direction between the axes it may be larger: with 0.02, 0.2 and 0.2 on the diagonal and 2.5e-4 as the second pivot it is 44 000 kg.
const SMALLEST_PIVOT: f64 = 2.5e-4;

/// Operational-space inertia of the tool, from the mass matrix and the Jacobian of one sample.
#[derive(Debug, Clone)]
pub struct OperationalSpace {
    /// Lambda_p = (J_p M^-1 J_p^T)^-1 (kg): translation with rotation left free.
    pub lambda_p: Matrix3<f64>,
    /// Lambda_o = (J_o M^-1 J_o^T)^-1 (kg m^2): rotation with translation left free.
    pub lambda_o: Matrix3<f64>,
    /// Factor of the full, coupled J M^-1 J^T.
    coupled: Cholesky<f64, Const<6>>,
}

impl OperationalSpace {
    /// `None` if the mass matrix is not positive definite (or not finite).
    #[must_use]
    pub fn new(mass: &JointMatrix, jacobian: &Jacobian) -> Option<Self> {
        // With M = L L^T and Y = L^-1 J^T, J M^-1 J^T is Y^T Y: one factorisation of M serves everything.
        let factor = Cholesky::new(*mass)?;
        let mut y = jacobian.transpose();
        factor.l_dirty().solve_lower_triangular_mut(&mut y);
        let mut inverse_inertia = SMatrix::<f64, 6, 6>::zeros();
        for i in 0..6 {
            for j in 0..=i {
                let entry = y.column(i).dot(&y.column(j));
                inverse_inertia[(i, j)] = entry;
                inverse_inertia[(j, i)] = entry;
            }
        }
        Some(Self {
            lambda_p: damped_factor(inverse_inertia.fixed_view::<3, 3>(0, 0).into())?.inverse(),
            lambda_o: damped_factor(inverse_inertia.fixed_view::<3, 3>(3, 3).into())?.inverse(),
            coupled: damped_factor(inverse_inertia)?,
        })
    }

    /// `[Lambda_p f; Lambda_o m]`: accelerations (m/s^2, rad/s^2) to the wrench (N, Nm) that causes them, uncoupled.
    #[must_use]
    pub fn shape(&self, acceleration: &Vector6) -> Vector6 {
        stack(&(self.lambda_p * linear(acceleration)), &(self.lambda_o * rotational(acceleration)))
    }

    /// Diagonals of Lambda_p (kg) and Lambda_o (kg m^2).
    #[must_use]
    pub fn diagonal(&self) -> Vector6 {
        stack(&self.lambda_p.diagonal(), &self.lambda_o.diagonal())
    }

    /// Lambda a with the full, coupled Lambda = (J M^-1 J^T)^-1.
    #[must_use]
    pub fn shape_coupled(&self, acceleration: &Vector6) -> Vector6 {
        self.coupled.solve(acceleration)
    }
}

/// Cholesky factor of a symmetric matrix. Near a singularity the matrix is damped: the identity is added to it, multiplied by the difference
/// between `SMALLEST_PIVOT` and the matrix' smallest pivot.
fn damped_factor<const N: usize>(a: SMatrix<f64, N, N>) -> Option<Cholesky<f64, Const<N>>> {
    let factor = Cholesky::new(a);
    let pivot = factor.as_ref().map_or(0.0, |f| f.l_dirty().diagonal().min().powi(2));
    if pivot >= SMALLEST_PIVOT {
        return factor;
    }
    // The damping grows from zero as the pivot falls below the threshold: the torque has no jump there.
    Cholesky::new(a + SMatrix::identity() * (SMALLEST_PIVOT - pivot))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::Vector3;
    use crate::testing::random_arm;
    use approx::assert_relative_eq;

    #[test]
    fn agrees_with_plain_inverses() {
        let y = random_arm(3);
        let inertia = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        let inverse_mass = y.mass.try_inverse().unwrap();
        let a = y.jacobian * inverse_mass * y.jacobian.transpose();
        let lambda = a.try_inverse().unwrap();
        let lambda_p = a.fixed_view::<3, 3>(0, 0).try_inverse().unwrap();
        let lambda_o = a.fixed_view::<3, 3>(3, 3).try_inverse().unwrap();
        assert_relative_eq!(inertia.lambda_p, lambda_p, max_relative = 1e-9);
        assert_relative_eq!(inertia.lambda_o, lambda_o, max_relative = 1e-9);
        let v = Vector6::new(1.0, -2.0, 0.5, 0.3, 0.1, -0.7);
        assert_relative_eq!(inertia.shape_coupled(&v), lambda * v, max_relative = 1e-8);
    }

    #[test]
    fn a_singular_arm_stays_finite_and_continuous() {
        let mut y = random_arm(4);
        let regular = y.jacobian;
        let mut previous: Option<f64> = None;
        for step in 0..=1000 {
            // The tool loses its motion along z: row 2 fades out.
            let fade = 0.03 * (1.0 - f64::from(step) / 1000.0);
            for joint in 0..7 {
                y.jacobian[(2, joint)] = fade * regular[(2, joint)];
            }
            let inertia = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
            let mass_z = inertia.lambda_p[(2, 2)];
            assert!(mass_z <= 1.001 / SMALLEST_PIVOT, "{mass_z} kg");
            assert!(inertia.shape_coupled(&Vector6::repeat(1.0)).iter().all(|x| x.is_finite()));
            if let Some(previous) = previous {
                assert!((mass_z - previous).abs() < 0.05 * previous, "jump at {fade}");
            }
            previous = Some(mass_z);
        }
    }

    /// Smallest pivot, largest apparent mass of any direction (kg), and a bound on that mass.
    fn heaviest(a: Matrix3<f64>) -> [f64; 3] {
        let factor = damped_factor(a).unwrap();
        let (l, lambda) = (factor.l(), factor.inverse());
        let half_trace = (l * l.transpose()).trace() / 2.0;
        let pivots = l.diagonal().map(|entry| entry * entry);
        [pivots.min(), lambda.symmetric_eigenvalues().max(), half_trace * half_trace / pivots.product()]
    }

    #[test]
    fn the_heaviest_direction_has_a_bound_of_its_own() {
        let side = f64::sqrt(0.02 * (0.2 - SMALLEST_PIVOT));
        let [pivot, mass, bound] = heaviest(Matrix3::new(0.02, side, 0.0, side, 0.2, 0.0, 0.0, 0.0, 0.2));
        assert_relative_eq!(pivot, SMALLEST_PIVOT, max_relative = 1e-6);
        assert_relative_eq!(mass, 44_000.0, max_relative = 1e-3);
        assert_relative_eq!(bound, 44_100.0, max_relative = 1e-3);
        // Any one of three directions, of any size, may be the lost one.
        for seed in 0..300 {
            let fades = Matrix3::from_diagonal(&Vector3::from_fn(|axis, _| {
                if axis == seed as usize % 3 { 10f64.powf(-0.02 * seed as f64) } else { 0.3 }
            }));
            let rows: Matrix3<f64> = random_arm(seed).jacobian.fixed_view::<3, 3>(0, 0).into();
            let part = fades * rows;
            let [pivot, mass, bound] = heaviest(part * part.transpose());
            assert!(
                pivot >= SMALLEST_PIVOT * (1.0 - 1e-9) && mass <= bound * (1.0 + 1e-6),
                "{pivot}: {mass} kg of {bound}"
            );
        }
    }

    #[test]
    fn a_mass_matrix_that_is_no_mass_matrix_is_refused() {
        let y = random_arm(5);
        assert!(OperationalSpace::new(&-y.mass, &y.jacobian).is_none());
        assert!(OperationalSpace::new(&(y.mass * f64::NAN), &y.jacobian).is_none());
    }
}
