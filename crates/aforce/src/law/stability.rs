//! When the adaptive loop is stable: a closed-form certificate for one axis.

use std::cmp::Ordering;

use crate::law::psi::Psi;

/// How far the feed-forward gain of an axis is from its limit, at the lowest stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilityMargin {
    /// The feed-forward gain of the law, alpha (N/m/s, Nm/rad/s; in 1/s^2: 1/s^3).
    pub alpha: f64,
    /// The largest stable alpha, in the same units; infinite if every one is stable.
    pub alpha_max: f64,
    /// Damping of the axis at the lowest stiffness (Ns/m, Nms/rad; in 1/s^2: 1/s).
    pub damping: f64,
}

impl StabilityMargin {
    /// Whether small oscillations die out. Without damping they do so only if alpha > 0 and delta has the damping sign.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.alpha < self.alpha_max && (self.damping > 0.0 || self.alpha > 0.0)
    }
}

/// The margin of an `axis` of the law `psi` at its lowest stiffness K, for an inertia M (kg, kg m^2; 1 where stiffness is in
/// 1/s^2) with damping D.
///
/// The loop M e'' + D e' + K e + F = 0, F' = alpha (e + s delta e') - mu F is stable exactly when, with T = D/M + mu,
///
/// ```text
/// K + D mu + s alpha delta > 0    and    alpha (1/T - s delta) < (K D/M)/T + D mu
/// ```
///
/// The limit falls as K relaxes, so it is taken at the lowest stiffness and not at the starting one. It rises with mu, unless delta has the
/// literal sign: then it may fall first. With a growing M the limit falls if D is [literal](crate::Damping::Literal) and the sign of delta
/// is not. If neither is literal, the limit falls up to M = K/mu^2 and may rise beyond.
#[must_use]
pub fn stability_margin(psi: &Psi, axis: usize, inertia: f64, damping: f64) -> StabilityMargin {
    let (k, d, mu) = (psi.k_min[axis], damping, psi.mu[axis]);
    let s_delta = psi.delta_sign.factor() * psi.delta[axis];
    let t = d / inertia + mu;
    let no_divergence = if s_delta < 0.0 { (k + d * mu) / -s_delta } else { f64::INFINITY };
    // Both sides of the second condition are multiplied by T. T is 0 if D and mu are 0: the limit is then 0, and no alpha is below it.
    let slope = 1.0 - s_delta * t;
    let damped = k * d / inertia + d * mu * t;
    let no_oscillation = match slope.total_cmp(&0.0) {
        Ordering::Greater => damped / slope,
        // The condition is 0 < damped, whatever alpha is.
        Ordering::Equal if damped <= 0.0 => 0.0,
        _ => f64::INFINITY,
    };
    StabilityMargin { alpha: psi.alpha[axis], alpha_max: no_divergence.min(no_oscillation), damping }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::damping::Damping;
    use crate::law::gains::Gains;
    use crate::law::psi::DeltaSign;
    use approx::assert_relative_eq;

    fn law(k_min: f64, alpha: f64, delta: f64, delta_sign: DeltaSign) -> Psi {
        let [k_min, alpha, delta] = [k_min, alpha, delta].map(Gains::all);
        Psi { k_min, alpha, delta, delta_sign, mu: Gains::all(1.0), ..crate::testing::psi() }
    }

    /// Worked out by hand from the closed form.
    #[test]
    fn limits_of_the_published_table() {
        let table = [
            (1.0, Damping::Literal, 300.0, [2547.0, 11_627.0, f64::INFINITY]),
            (4.0, Damping::Literal, 20.0, [56.0, 74.0, 109.0]),
            (4.0, Damping::Literal, 50.0, [166.0, 241.0, 441.0]),
            (4.0, Damping::Literal, 150.0, [638.0, 1093.0, 3800.0]),
            (4.0, Damping::MassAware, 50.0, [322.0, 582.0, 3016.0]),
            (4.0, Damping::MassAware, 300.0, [2283.0, 6465.0, f64::INFINITY]),
        ];
        for (mass, damping, k, limits) in table {
            let d = damping.of_axis(k, mass, 1.0);
            for (sign, limit) in [DeltaSign::Literal, DeltaSign::Off, DeltaSign::Damping].into_iter().zip(limits) {
                let found = stability_margin(&law(k, 1.0, 0.1, sign), 0, mass, d).alpha_max;
                // The table is rounded to whole numbers.
                assert!(found == limit || (found - limit).abs() < 0.6, "{mass} {k} {sign:?}: {found} not {limit}");
            }
        }
    }

    #[test]
    fn nothing_is_stable_without_damping_and_forgetting() {
        for sign in [DeltaSign::Literal, DeltaSign::Off, DeltaSign::Damping] {
            for alpha in [0.0, 1.0] {
                let law = Psi { mu: Gains::all(0.0), ..law(100.0, alpha, 0.1, sign) };
                assert!(!stability_margin(&law, 0, 4.0, 0.0).is_stable(), "{sign:?} {alpha}");
            }
        }
        // Without D, and with delta mu = 1 exactly, the loop oscillates for ever.
        let forever = Psi { mu: Gains::all(20.0), ..law(100.0, 1.0, 0.05, DeltaSign::Damping) };
        assert!(
            !stability_margin(&forever, 0, 4.0, 0.0).is_stable() && stability_margin(&forever, 0, 4.0, 1.0).is_stable()
        );
        let ahead = |alpha| Psi { mu: Gains::all(20.0), ..law(100.0, alpha, 0.1, DeltaSign::Damping) };
        assert!(!stability_margin(&ahead(0.0), 0, 4.0, 0.0).is_stable());
        assert!(stability_margin(&ahead(1.0), 0, 4.0, 0.0).is_stable());
    }

    /// How the limit changes with mass and leak.
    #[test]
    fn the_largest_mass_is_the_worst_up_to_k_over_mu_squared() {
        let limit = |damping: Damping, sign, mass, mu| {
            let law = Psi { mu: Gains::all(mu), ..law(300.0, 1.0, 0.1, sign) };
            stability_margin(&law, 0, mass, damping.of_axis(300.0, mass, 1.0)).alpha_max
        };
        let (off, aware) = (DeltaSign::Off, Damping::MassAware);
        assert_relative_eq!(limit(aware, off, 12.0, 5.0), 12_000.0, max_relative = 1e-9);
        assert_relative_eq!(limit(aware, off, 60.0, 5.0), 14_050.0, max_relative = 1e-4);
        for step in 1..60 {
            let (light, heavy) = (f64::from(step), f64::from(step + 1));
            for sign in [off, DeltaSign::Damping] {
                assert!(limit(Damping::Literal, sign, light, 5.0) >= limit(Damping::Literal, sign, heavy, 5.0));
                assert!(heavy > 12.0 || limit(aware, sign, light, 5.0) >= limit(aware, sign, heavy, 5.0));
                assert!(limit(aware, sign, 12.0, heavy) >= limit(aware, sign, 12.0, light));
            }
        }
    }

    /// Growth of the linear loop over 20 s, in fine steps (semi-implicit Euler, 0.05 ms).
    fn grows(mass: f64, k: f64, alpha: f64, s_delta: f64) -> bool {
        let (d, mu, dt) = (2.0 * k.sqrt(), 1.0, 5e-5);
        let (mut e, mut e_dot, mut f) = (0.01, 0.0, 0.0);
        let mut peaks = [0.0f64; 2];
        for step in 0..400_000 {
            f += dt * (alpha * (e + s_delta * e_dot) - mu * f);
            e_dot += dt * (-d * e_dot - k * e - f) / mass;
            e += dt * e_dot;
            if step >= 200_000 {
                let half = usize::from(step >= 300_000);
                peaks[half] = peaks[half].max(f64::abs(e));
            }
        }
        peaks[1] > peaks[0]
    }

    #[test]
    fn the_limit_is_the_boundary_between_decay_and_growth() {
        for sign in [DeltaSign::Damping, DeltaSign::Off, DeltaSign::Literal] {
            for (mass, k) in [(4.0, 20.0), (4.0, 150.0), (12.0, 50.0)] {
                let margin = |alpha| stability_margin(&law(k, alpha, 0.1, sign), 0, mass, 2.0 * f64::sqrt(k));
                let limit = margin(1.0).alpha_max;
                let s_delta = 0.1 * sign.factor();
                assert!(
                    margin(0.95 * limit).is_stable() && !grows(mass, k, 0.95 * limit, s_delta),
                    "{sign:?} {mass} {k}"
                );
                assert!(
                    !margin(1.05 * limit).is_stable() && grows(mass, k, 1.05 * limit, s_delta),
                    "{sign:?} {mass} {k}"
                );
            }
        }
    }
}
