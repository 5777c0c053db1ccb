//! The adaptive law on one axis, against the closed forms of its equations.

use approx::assert_relative_eq;

use crate::adaptation::AdaptiveLaw;
use crate::adaptive_impedance::{AdaptiveImpedance, DeltaSign};
use crate::damping::Damping;
use crate::error::ConfigError;
use crate::impedance::Convention;
use crate::spatial::Vector6;

const DT: f64 = 0.002;

#[test]
fn one_sample_by_hand() {
    let mut law = AdaptiveLaw::new(AdaptiveImpedance::physical());
    // x: eps = 0.02 + 0.05 * 0.1 = 0.025; K' = 1.5e5 * 0.025 - 750 = 3000; F' = 100 * 0.025 = 2.5.
    // rz: eps = -0.1; K' = 900 * 0.1 - 45 = 45; F' = -0.5.
    let e = Vector6::new(0.02, 0.0, 0.0, 0.0, 0.0, -0.1);
    law.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), DT);
    let (k, f) = (law.stiffness(), law.feedforward());
    assert_relative_eq!(k[0], 206.0, epsilon = 1e-9);
    assert_relative_eq!(f[0], 0.005, epsilon = 1e-12);
    assert_relative_eq!(k[1], 198.5, epsilon = 1e-9); // no error: relaxation alone
    assert_relative_eq!(k[5], 20.09, epsilon = 1e-9);
    assert_relative_eq!(f[5], -0.001, epsilon = 1e-12);
    // The literal sign subtracts the rate: eps = 0.015, K' = 1500.
    let mut literal = AdaptiveLaw::new(AdaptiveImpedance { sign: DeltaSign::Literal, ..AdaptiveImpedance::physical() });
    literal.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), DT);
    assert_relative_eq!(literal.stiffness()[0], 203.0, epsilon = 1e-9);
    // Off: eps = 0.02, K' = 2250.
    let mut off = AdaptiveLaw::new(AdaptiveImpedance { sign: DeltaSign::Off, ..AdaptiveImpedance::physical() });
    off.update(&e, &Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), DT);
    assert_relative_eq!(off.stiffness()[0], 204.5, epsilon = 1e-9);
}

#[test]
fn the_config_speaks_of_tolerance_and_time() {
    let law = AdaptiveImpedance::physical().translation;
    assert_relative_eq!(law.gamma(), 750.0);
    assert_relative_eq!(law.beta(), 1.5e5);
}

#[test]
fn rates_and_bounds_hold_for_any_error() {
    for config in [AdaptiveImpedance::physical(), AdaptiveImpedance::shaped()] {
        let mut law = AdaptiveLaw::new(config);
        for sample in 0..4000 {
            let (k, f) = (*law.stiffness(), *law.feedforward());
            let e = Vector6::from_fn(|axis, _| 5.0 * f64::sin(0.01 * f64::from(sample) * (axis + 1) as f64));
            law.update(&e, &(30.0 * e), DT);
            for axis in 0..6 {
                let bounds = if axis < 3 { config.translation } else { config.rotation };
                assert!((bounds.stiffness_min..=bounds.stiffness_max).contains(&law.stiffness()[axis]));
                assert!(law.feedforward()[axis].abs() <= bounds.feedforward_max);
                assert!((law.stiffness()[axis] - k[axis]).abs() <= bounds.stiffness_rate_max * DT + 1e-9);
                assert!((law.feedforward()[axis] - f[axis]).abs() <= bounds.feedforward_rate_max * DT + 1e-9);
            }
        }
    }
}

#[test]
fn the_feedforward_does_not_wind_up() {
    let mut law = AdaptiveLaw::new(AdaptiveImpedance::physical());
    let e = Vector6::new(0.5, 0.0, 0.0, 0.0, 0.0, 0.0);
    for _ in 0..5000 {
        law.update(&e, &Vector6::zeros(), DT);
    }
    assert_eq!(law.feedforward()[0], 15.0);
    // The error turns: the feed-forward leaves its bound in the next sample.
    law.update(&(-e), &Vector6::zeros(), DT);
    assert_relative_eq!(law.feedforward()[0], 15.0 - DT * (50.0 + 15.0), epsilon = 1e-9);
    law.reset();
    assert_eq!((law.feedforward()[0], law.stiffness()[0]), (0.0, 200.0));
}

/// A 4 kg axis under a constant load for 20 s: K, F_ff and e at the end, and the motion left in the last 2 s (m).
fn loaded_axis(sign: DeltaSign, load: f64) -> (f64, f64, f64, f64) {
    let mut config = AdaptiveImpedance { sign, ..AdaptiveImpedance::physical() };
    config.translation.stiffness_start = 200.0;
    let mut law = AdaptiveLaw::new(config);
    let (mass, mut e, mut e_dot) = (4.0, 0.0, 0.0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for sample in 0..10_000 {
        law.update(&(Vector6::x() * e), &(Vector6::x() * e_dot), DT);
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
    let literal = |convention| {
        let mut config = AdaptiveImpedance { sign: DeltaSign::Literal, ..AdaptiveImpedance::physical() };
        config.form.damping = Damping::Literal;
        config.form.convention = convention;
        config.translation.nominal_inertia = 12.0;
        config
    };
    let error = literal(Convention::Physical).check_stability().unwrap_err();
    // The closed form gives 81 at 12 kg.
    let ConfigError::Unstable { group, alpha, alpha_max, stiffness, inertia, .. } = error else { panic!("{error}") };
    assert_eq!((group.as_str(), alpha, stiffness, inertia), ("impedance.aforce.translation", 100.0, 50.0, 12.0));
    assert!((alpha_max - 81.0).abs() < 0.6, "{alpha_max}");
    AdaptiveImpedance { allow_unstable: true, ..literal(Convention::Physical) }.check_stability().unwrap();
    for config in [AdaptiveImpedance::physical(), AdaptiveImpedance::shaped()] {
        config.check_stability().unwrap();
    }
}
