//! The adaptive law on one axis, against the closed forms of its equations.

use approx::assert_relative_eq;

use crate::error::ConfigError;
use crate::law::action_space::ActionSpace;
use crate::law::adaptation::AdaptiveLaw;
use crate::law::damping::Damping;
use crate::law::gains::Gains;
use crate::law::psi::{DeltaSign, Psi};
use crate::spatial::Vector6;
use crate::testing::{adaptive, psi};

const DT: f64 = 0.002;
/// The excess of a sample in which no torque was cut.
const FREE: Vector6 = Vector6::from_array_storage(nalgebra::ArrayStorage([[0.0; 6]]));

#[test]
fn one_sample_by_hand() {
    let mut law = AdaptiveLaw::new(psi());
    // x: eps = 0.02 + 0.05 * 0.1 = 0.025; K' = 1.5e5 * 0.025 - 750 = 3000; F' = 100 * 0.025 = 2.5.
    // rz: eps = -0.1; K' = 900 * 0.1 - 45 = 45; F' = -0.5.
    let e = Vector6::new(0.02, 0.0, 0.0, 0.0, 0.0, -0.1);
    law.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), &FREE, DT);
    let (k, f) = (law.stiffness(), law.feedforward());
    assert_relative_eq!(k[0], 206.0, epsilon = 1e-9);
    assert_relative_eq!(f[0], 0.005, epsilon = 1e-12);
    assert_relative_eq!(k[1], 198.5, epsilon = 1e-9); // no error: relaxation alone
    assert_relative_eq!(k[5], 20.09, epsilon = 1e-9);
    assert_relative_eq!(f[5], -0.001, epsilon = 1e-12);
    // The literal sign subtracts the rate: eps = 0.015, K' = 1500.
    let mut literal = AdaptiveLaw::new(Psi { delta_sign: DeltaSign::Literal, ..psi() });
    literal.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), &FREE, DT);
    assert_relative_eq!(literal.stiffness()[0], 203.0, epsilon = 1e-9);
    // Off: eps = 0.02, K' = 2250.
    let mut off = AdaptiveLaw::new(Psi { delta_sign: DeltaSign::Off, ..psi() });
    off.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), &FREE, DT);
    assert_relative_eq!(off.stiffness()[0], 204.5, epsilon = 1e-9);
}

#[test]
fn tolerance_time_and_spring_follow_from_the_gains() {
    let psi = Psi { beta: Gains::pair(1.5e5, 0.0), mu: Gains::all(2.0), ..psi() };
    assert_eq!((psi.tolerance()[0], psi.tolerance()[3]), (0.005, f64::INFINITY));
    assert_eq!((psi.relaxation_time()[1], psi.relaxation_time()[4]), (1.0, 1.0));
    assert_eq!((psi.feedforward_spring()[2], psi.feedforward_spring()[5]), (50.0, 2.5));
}

#[test]
fn rates_and_bounds_hold_for_any_error() {
    let shaped: ActionSpace = "aforce-shaped".parse().unwrap();
    for bounds in [psi(), *shaped.psi().unwrap()] {
        let mut law = AdaptiveLaw::new(bounds);
        for sample in 0..4000 {
            let (k, f) = (*law.stiffness(), *law.feedforward());
            let e = Vector6::from_fn(|axis, _| 5.0 * f64::sin(0.01 * f64::from(sample) * (axis + 1) as f64));
            law.update(&e, &(30.0 * e), &FREE, DT);
            for axis in 0..6 {
                assert!((bounds.k_min[axis]..=bounds.k_max[axis]).contains(&law.stiffness()[axis]));
                assert!(law.feedforward()[axis].abs() <= bounds.f_ff_max[axis]);
                assert!((law.stiffness()[axis] - k[axis]).abs() <= bounds.k_rate_max[axis] * DT + 1e-9);
                assert!((law.feedforward()[axis] - f[axis]).abs() <= bounds.f_ff_rate_max[axis] * DT + 1e-9);
            }
        }
    }
}

#[test]
fn the_feedforward_does_not_wind_up() {
    let mut law = AdaptiveLaw::new(psi());
    let e = Vector6::new(0.5, 0.0, 0.0, 0.0, 0.0, 0.0);
    for _ in 0..5000 {
        law.update(&e, &Vector6::zeros(), &FREE, DT);
    }
    assert_eq!(law.feedforward()[0], 15.0);
    // After a change of the error's sign the feed-forward leaves its bound in the next sample.
    law.update(&(-e), &Vector6::zeros(), &FREE, DT);
    assert_relative_eq!(law.feedforward()[0], 15.0 - DT * (50.0 + 15.0), epsilon = 1e-9);
}

/// A 4 kg axis under a constant load for 20 s: K, F_ff and e at the end, and the motion left in the last 2 s (m).
fn loaded_axis(sign: DeltaSign, load: f64) -> (f64, f64, f64, f64) {
    let mut law = AdaptiveLaw::new(Psi { delta_sign: sign, ..psi() });
    let (mass, mut e, mut e_dot) = (4.0, 0.0, 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in 0..10_000 {
        law.update(&(Vector6::x() * e), &(Vector6::x() * e_dot), &FREE, DT);
        let k = law.stiffness()[0];
        let d = Damping::MassAware.of_axis(k, mass, 1.0);
        e_dot += DT * (load - law.feedforward()[0] - k * e - d * e_dot) / mass;
        e += DT * e_dot;
        if sample >= 9000 {
            (low, high) = (low.min(e), high.max(e));
        }
    }
    (e, law.stiffness()[0], law.feedforward()[0], high - low)
}

/// At rest |e| = gamma/beta and K = F beta/gamma - alpha/mu inside the bounds, and
/// e = F/(K + alpha/mu) at a bound.
#[test]
fn rest_under_a_constant_load() {
    for (load, e, k, f) in [
        (1.0, 5.000e-3, 100.0, 0.500),
        (2.0, 5.000e-3, 300.0, 0.500),
        (5.0, 5.556e-3, 800.0, 0.556),
        (20.0, 22.222e-3, 800.0, 2.222),
    ] {
        let (e_end, k_end, f_end, moving) = loaded_axis(DeltaSign::Damping, load);
        assert_relative_eq!(e_end, e, epsilon = 1e-6);
        assert_relative_eq!(k_end, k, epsilon = 0.05);
        assert_relative_eq!(f_end, f, epsilon = 6e-4);
        assert!(moving < 1e-6, "{load} N still moves by {moving}");
    }
}

#[test]
fn with_the_literal_sign_the_softest_case_does_not_come_to_rest() {
    assert!(loaded_axis(DeltaSign::Literal, 1.0).3 > 1e-5);
    for load in [2.0, 5.0, 20.0] {
        assert!(loaded_axis(DeltaSign::Literal, load).3 < 1e-5, "{load}");
    }
}

#[test]
fn the_certificate_refuses_the_literal_law_at_the_floor() {
    let literal = Psi { delta_sign: DeltaSign::Literal, inertia: Gains::pair(12.0, 3.0), ..psi() };
    let space = |psi| ActionSpace { damping: Damping::Literal, ..adaptive(psi) };
    let error = space(literal).validate(500).unwrap_err();
    // The closed form gives 81 at 12 kg.
    let ConfigError::Unstable { field, alpha, alpha_max, stiffness, inertia, .. } = error else { panic!("{error}") };
    assert_eq!(field, "space.stiffness.adaptive.alpha (axis x)");
    assert_eq!((alpha, stiffness, inertia), (100.0, 50.0, 12.0));
    assert!((alpha_max - 81.0).abs() < 0.6, "{alpha_max}");
    space(Psi { allow_unstable: true, ..literal }).validate(500).unwrap();
    adaptive(psi()).validate(500).unwrap();
}

/// While the limits cut the torque that the spring asks for, a stiffer spring would only have more of it cut.
#[test]
fn stiffness_does_not_wind_up_against_a_torque_limit() {
    let e = *Gains::pair(0.02, 0.2).vector();
    // The spring pulls along the negative of every axis. The limits cut a pull along -x, and one along +rz, which is not the spring's.
    let excess = Vector6::new(-3.0, 0.0, 0.0, 0.0, 0.0, 3.0);
    let run = |psi: Psi| {
        let mut law = AdaptiveLaw::new(psi);
        law.update(&e, &Vector6::zeros(), &excess, DT);
        law.stiffness() - psi.k_0.vector()
    };
    let gained = run(psi());
    assert_eq!(gained[0], 0.0);
    assert!(gained[1] > 0.0 && gained[5] > 0.0);
    let unaware = run(Psi { anti_windup: false, ..psi() });
    assert!(unaware[0] > 0.0 && unaware[1] == gained[1]);
    // K may still fall.
    let mut law = AdaptiveLaw::new(psi());
    law.update(&(e * 1e-3), &Vector6::zeros(), &excess, DT);
    assert!(law.stiffness()[0] < psi().k_0[0]);
}

/// With beta and gamma 0, K is constant and only the feed-forward adapts.
#[test]
fn with_beta_and_gamma_zero_stiffness_is_frozen() {
    let frozen = Psi { beta: Gains::all(0.0), gamma: Gains::all(0.0), ..psi() };
    let mut law = AdaptiveLaw::new(frozen);
    for _ in 0..1000 {
        law.update(&Vector6::repeat(0.03), &Vector6::repeat(0.1), &FREE, DT);
    }
    assert_eq!(law.stiffness(), frozen.k_0.vector());
    assert!(law.feedforward()[0] > 1.0);
}

#[test]
fn stiffness_goes_to_moved_bounds_at_its_largest_rate() {
    let mut law = AdaptiveLaw::new(psi());
    law.psi_mut().k_min = Gains::pair(500.0, 5.0);
    law.update(&Vector6::zeros(), &Vector6::zeros(), &FREE, DT);
    assert_eq!(law.stiffness()[0], 200.0 + 5000.0 * DT);
    for _ in 0..100 {
        law.update(&Vector6::zeros(), &Vector6::zeros(), &FREE, DT);
    }
    assert_eq!(law.stiffness()[0], 500.0);
}

#[test]
fn a_lasting_error_lifts_k_from_floor_to_top_in_the_time_that_is_told() {
    let psi = Psi { k_0: psi().k_min, ..psi() };
    // Errors at which K rises more slowly than `k_rate_max`, and one at which that limit counts.
    for error in [0.008, 0.02, 0.2] {
        let mut law = AdaptiveLaw::new(psi);
        let steps = (psi.rise_time(0, error) / DT).ceil() as usize;
        let after = |law: &mut AdaptiveLaw, steps| {
            for _ in 0..steps {
                law.update(&Vector6::repeat(error), &Vector6::zeros(), &FREE, DT);
            }
            law.stiffness()[0]
        };
        assert!(after(&mut law, steps - 2) < 800.0 && after(&mut law, 2) == 800.0, "{error}: {steps}");
    }
    assert_eq!(psi.rise_time(0, 0.005), f64::INFINITY);
    let constant = Psi { beta: Gains::all(0.0), ..psi };
    assert!([0.2, f64::INFINITY].map(|error| constant.rise_time(0, error)).iter().all(|time| time.is_infinite()));
}
