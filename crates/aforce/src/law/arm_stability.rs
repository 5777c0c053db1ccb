//! When the adaptive loop is stable on an arm: all six axes together, coupled by the arm's inertia.

use nalgebra::{Cholesky, SMatrix};

use crate::error::ConfigError;
use crate::law::action_space::ActionSpace;
use crate::law::operational_space::OperationalSpace;
use crate::law::psi::Psi;
use crate::spatial::{Measurement, Vector6};

/// Step h of the map (1 + h A) / (1 - h A) (s): between the slowest and the fastest time constants of the loop.
const TIME_STEP: f64 = 0.05;
/// Motion that has not died out after 2 to the power of this many steps counts as unstable.
const SQUARINGS: usize = 30;
/// Halvings of the interval in which a limit is searched: the limit is known to 1e-12 of that interval.
const HALVINGS: usize = 40;

/// Refuses a law under which small oscillations of the arm at `y` grow, unless `allow_unstable` is set. A single axis may be stable where
/// the arm, which couples the axes, is not. A psi that the policy commands is tried at every corner of its ranges.
///
/// # Errors
/// If the law is unstable: the field (below the space) and the limits of alpha on this arm.
pub fn stable_on(space: &ActionSpace, y: &Measurement) -> Result<(), ConfigError> {
    let Some(psi) = space.psi() else { return Ok(()) };
    let corners = space.commanded_psi.as_ref().map(|commanded| commanded.corners(psi));
    corners.into_iter().flatten().chain([*psi]).try_for_each(|psi| stable_with(space, &psi, y))
}

fn stable_with(space: &ActionSpace, psi: &Psi, y: &Measurement) -> Result<(), ConfigError> {
    let Some(arm) = LoopOnArm::with(space, psi, y) else { return Ok(()) };
    if psi.allow_unstable || arm.is_stable(psi.alpha.vector()) {
        return Ok(());
    }
    let [translation, rotation] = [0, 3].map(|first| {
        let alpha = psi.alpha.map(|axis, alpha| if axis / 3 == first / 3 { alpha } else { 0.0 });
        LoopOnArm { psi: &Psi { alpha, ..*psi }, ..arm.clone() }.limit(first, psi.alpha.vector().amax())
    });
    Err(ConfigError::Contradiction {
        field: "stiffness.adaptive.alpha".into(),
        reason: format!(
            "unstable on this arm in its present posture: each with the other at 0, the limits there are {translation:.0} and {rotation:.1} \
             {}; lower it, raise k_min, or set allow_unstable = true",
            space.unit.alpha_name()
        ),
    })
}

/// The loop of a law on an arm in one posture, at its lowest stiffness and without motion of the redundant joint.
///
/// With e the error, W = J M^-1 J^T, F the feed-forward in the space's unit and s the factor of
/// [`DeltaSign`](crate::DeltaSign):
///
/// ```text
/// e'' = -W U (D e' + K e + F)        F' = alpha (e + s delta e') - mu F
/// ```
///
/// U is the identity, or for stiffness in 1/s^2 the matrix of [`OperationalSpace::shape`].
#[derive(Debug, Clone)]
pub struct LoopOnArm<'a> {
    psi: &'a Psi,
    /// W U.
    acceleration_per_force: SMatrix<f64, 6, 6>,
    damping: Vector6,
}

impl<'a> LoopOnArm<'a> {
    /// The loop of `space` with the arm at `y`; `None` if its stiffness does not adapt, or the mass matrix is not
    /// positive definite.
    #[must_use]
    pub fn new(space: &'a ActionSpace, y: &Measurement) -> Option<Self> {
        Self::with(space, space.psi()?, y)
    }

    /// As [`LoopOnArm::new`], with other parameters of the law than those of `space`.
    fn with(space: &ActionSpace, psi: &'a Psi, y: &Measurement) -> Option<Self> {
        let arm = OperationalSpace::new(&y.mass, &y.jacobian)?;
        let mass = Cholesky::new(y.mass)?;
        let to_wrench = SMatrix::from_columns(&std::array::from_fn::<_, 6, _>(|axis| {
            space.unit.to_wrench(&Vector6::from_fn(|i, _| f64::from(u8::from(i == axis))), &arm)
        }));
        let acceleration_per_force = y.jacobian * mass.solve(&y.jacobian.transpose()) * to_wrench;
        let inertia = space.unit.inertia(&arm.diagonal());
        let damping = space.damping.of(psi.k_min.vector(), &inertia, &space.damping_ratio);
        Some(LoopOnArm { psi, acceleration_per_force, damping })
    }

    /// Whether small oscillations die out with the feed-forward gains `alpha` (unit: [`Psi::alpha`]) in place of the
    /// law's own.
    #[must_use]
    pub fn is_stable(&self, alpha: &Vector6) -> bool {
        let Psi { k_min, mu, delta, delta_sign, .. } = self.psi;
        let diagonal = |v: &Vector6| SMatrix::<f64, 6, 6>::from_diagonal(v);
        let (stiffness, damping) = (diagonal(k_min.vector()), diagonal(&self.damping));
        let mut system = SMatrix::<f64, 18, 18>::zeros();
        system.fixed_view_mut::<6, 6>(0, 6).fill_with_identity();
        system.fixed_view_mut::<6, 6>(6, 0).copy_from(&(-self.acceleration_per_force * stiffness));
        system.fixed_view_mut::<6, 6>(6, 6).copy_from(&(-self.acceleration_per_force * damping));
        system.fixed_view_mut::<6, 6>(6, 12).copy_from(&-self.acceleration_per_force);
        system.fixed_view_mut::<6, 6>(12, 0).copy_from(&diagonal(alpha));
        let ahead = alpha.component_mul(delta.vector()) * delta_sign.factor();
        system.fixed_view_mut::<6, 6>(12, 6).copy_from(&diagonal(&ahead));
        // With alpha = 0, F_ff stays 0 whatever its leak. Where mu is 0 too, the eigenvalue 0 of F_ff would count as
        // motion that does not die out, so 1 stands for mu.
        let leak = mu.vector().zip_map(alpha, |mu, alpha| if mu == 0.0 && alpha == 0.0 { 1.0 } else { mu });
        system.fixed_view_mut::<6, 6>(12, 12).copy_from(&diagonal(&-leak));
        dies_out(&system)
    }

    /// The largest stable alpha, up to `most`, of the three axes from `first` on (0: translation, 3: rotation), with
    /// the same alpha on all three and the law's own on the others; 0 if none is stable. Its unit is that of
    /// [`Psi::alpha`].
    #[must_use]
    pub fn limit(&self, first: usize, most: f64) -> f64 {
        let mut alpha = *self.psi.alpha.vector();
        let mut stable = |value: f64| {
            alpha.fixed_rows_mut::<3>(first).fill(value);
            self.is_stable(&alpha)
        };
        if stable(most) {
            return most;
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if stable(middle) { low = middle } else { high = middle }
        }
        low
    }
}

/// Whether every eigenvalue of a linear system (1/s) has a negative real part.
///
/// (1 + h A) / (1 - h A) maps the left half-plane into the unit circle, and its powers vanish exactly when all eigenvalues lie in that
/// circle. An eigenvalue iteration may not converge where axes are equal.
fn dies_out(system: &SMatrix<f64, 18, 18>) -> bool {
    let (one, step) = (SMatrix::<f64, 18, 18>::identity(), system * TIME_STEP);
    let Some(inverse) = (one - step).try_inverse() else { return false };
    let mut power = (one + step) * inverse;
    for _ in 0..SQUARINGS {
        let size = power.amax();
        if size < 1e-6 {
            return true;
        }
        if size.is_nan() || size > 1e9 {
            return false;
        }
        power *= power;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::gains::Gains;
    use crate::law::psi::DeltaSign;
    use crate::law::stability::stability_margin;
    use crate::law::stiffness::{Stiffness, StiffnessUnit};
    use crate::testing::{gantry, random_arm};

    /// On an arm with uncoupled axes the limit is that of the single axis, which has a closed form.
    #[test]
    fn uncoupled_axes_have_the_limit_of_one_axis() {
        let space: ActionSpace = "aforce".parse().unwrap();
        let mass = 7.0;
        let y = gantry([mass; 6]);
        let arm = LoopOnArm::new(&space, &y).unwrap();
        let psi = space.psi().unwrap();
        for first in [0, 3] {
            let damping = space.damping.of_axis(psi.k_min[first], mass, space.damping_ratio[first]);
            let exact = stability_margin(psi, first, mass, damping).alpha_max;
            let found = arm.limit(first, 1e6);
            assert!((found / exact - 1.0).abs() < 1e-6, "{first}: {found}, not {exact}");
        }
        assert!(arm.is_stable(psi.alpha.vector()));
        assert!(!arm.is_stable(Gains::all(1e6).vector()));
    }

    /// The largest error in the first and in the second half of 40 s of the coupled loop, in fine steps (semi-implicit Euler, 0.1 ms).
    fn halves(space: &ActionSpace, arm: &LoopOnArm, alpha: &Vector6) -> [f64; 2] {
        let (psi, dt) = (space.psi().unwrap(), 1e-4);
        let s_delta = psi.delta.vector() * psi.delta_sign.factor();
        let (mut e, mut e_dot, mut f) = (Vector6::repeat(0.01), Vector6::zeros(), Vector6::zeros());
        let mut largest = [0.0f64; 2];
        for step in 0..400_000 {
            let eps = e + s_delta.component_mul(&e_dot);
            f += (alpha.component_mul(&eps) - psi.mu.vector().component_mul(&f)) * dt;
            let pull = arm.damping.component_mul(&e_dot) + psi.k_min.vector().component_mul(&e) + f;
            e_dot -= arm.acceleration_per_force * pull * dt;
            e += e_dot * dt;
            let half = step / 200_000;
            largest[half] = largest[half].max(e.amax());
        }
        largest
    }

    /// With both signs of delta, in N/m and in 1/s^2: below the limit oscillations die out, above it they grow.
    #[test]
    fn the_limit_of_coupled_axes_is_where_motion_begins_to_grow() {
        // The mass is scaled to that of an arm: with the damping sign a light arm has no limit.
        let mut y = random_arm(3);
        y.mass *= 40.0;
        for (unit, sign) in [
            (StiffnessUnit::NewtonPerMetre, DeltaSign::Damping),
            (StiffnessUnit::NewtonPerMetre, DeltaSign::Literal),
            (StiffnessUnit::PerSecondSquared, DeltaSign::Literal),
        ] {
            let mut space: ActionSpace = "aforce".parse().unwrap();
            space.unit = unit;
            let Stiffness::Adaptive(psi) = &mut space.stiffness else { panic!("aforce adapts") };
            (psi.delta_sign, psi.allow_unstable) = (sign, true);
            let arm = LoopOnArm::new(&space, &y).unwrap();
            let limit = arm.limit(0, 1e6);
            assert!(limit > 0.0 && limit < 1e6, "{unit:?} {sign:?}: {limit}");
            for (part, grows) in [(0.9, false), (1.1, true)] {
                let mut alpha = *space.psi().unwrap().alpha.vector();
                alpha.fixed_rows_mut::<3>(0).fill(part * limit);
                let [first, second] = halves(&space, &arm, &alpha);
                assert_eq!(second > first, grows, "{unit:?} {sign:?}: {part} of {limit}: {first}, then {second}");
            }
        }
    }

    #[test]
    fn what_is_unstable_on_an_arm_is_refused_in_the_units_of_its_space() {
        let y = random_arm(3);
        let mut space: ActionSpace = "aforce".parse().unwrap();
        stable_on(&space, &y).unwrap();
        let Stiffness::Adaptive(psi) = &mut space.stiffness else { panic!("aforce adapts") };
        psi.alpha = Gains::all(1e6);
        let told = stable_on(&space, &y).unwrap_err().to_string();
        assert!(
            told.starts_with("stiffness.adaptive.alpha: unstable on this arm") && told.contains("N/(m s)"),
            "{told}"
        );
        assert!(!told.contains(" 0 and") && !told.contains("and 0.0 "), "limits that help: {told}");
        space.unit = StiffnessUnit::PerSecondSquared;
        assert!(stable_on(&space, &y).unwrap_err().to_string().contains(" 1/s^3; "));
        let Stiffness::Adaptive(psi) = &mut space.stiffness else { panic!("aforce adapts") };
        psi.allow_unstable = true;
        stable_on(&space, &y).unwrap();
    }

    /// The feed-forward and its leak may be 0, on some axes or on all.
    #[test]
    fn without_feed_forward_the_law_is_a_spring() {
        let y = random_arm(3);
        let mut space: ActionSpace = "aforce".parse().unwrap();
        for axes in [0..3, 0..6] {
            let Stiffness::Adaptive(psi) = &mut space.stiffness else { panic!("aforce adapts") };
            axes.clone().for_each(|axis| psi.alpha.set(axis, 0.0));
            axes.for_each(|axis| psi.mu.set(axis, 0.0));
            space.validate(500).unwrap();
            stable_on(&space, &y).unwrap();
        }
    }

    #[test]
    fn a_constant_stiffness_has_no_such_loop() {
        let space: ActionSpace = "mid".parse().unwrap();
        assert!(LoopOnArm::new(&space, &random_arm(1)).is_none());
    }
}
