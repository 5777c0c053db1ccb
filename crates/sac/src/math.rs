//! exp, log(1 + x) and tanh in f32. They give the same bits on every processor, which the platform's functions do not promise, and the
//! compiler can vectorise them. The tests compare them with f64.

use std::f32::consts::LOG2_E;

/// e^x, with a relative error of at most 1.5e-7. x is clamped to [-87, 88], so that nothing underflows or overflows.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    /// Adding 1.5 * 2^23 leaves no bits for a fraction: a sum is rounded to an integer, which stands in its lowest bits.
    const ROUND: f32 = 12_582_912.0;
    /// ln 2, in two parts: the first, 0.693359375, has few bits, so that its product with an integer is exact.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = x.clamp(-87.0, 88.0);
    let rounded = x * LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = x - n * LN_2[0] - n * LN_2[1];
    // The polynomial of Cephes' expf, on half of [-ln 2, ln 2].
    let p = polynomial(r, [1.987_569_1e-4, 1.398_2e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 5e-1]);
    let power_of_two = f32::from_bits(rounded.to_bits().wrapping_add(127) << 23);
    (p * r * r + r + 1.0) * power_of_two
}

/// log(1 + x) for x in [0, 1], with a relative error of at most 1.5e-7.
#[inline(always)]
pub(crate) fn ln_1p(x: f32) -> f32 {
    // 2 artanh(s) = 2 (s + s^3 / 3 + s^5 / 5 + ...); s is 1/3 at most, so the first omitted term is 2e-8 of the sum at most. 2 s is
    // computed as x - s x, in which the rounding of s weighs less.
    let s = x / (2.0 + x);
    let z = s * s;
    let series = polynomial(z, [1.0 / 13.0, 1.0 / 11.0, 1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0]);
    x - s * (x - 2.0 * z * series)
}

/// tanh x, with a relative error of at most 1.5e-7.
#[inline(always)]
pub(crate) fn tanh(x: f32) -> f32 {
    // Cephes' tanhf: a polynomial near zero, where the difference below would cancel.
    let z = x * x;
    let near = polynomial(z, [-5.704_988_7e-3, 2.063_909e-2, -5.373_971_6e-2, 1.333_144_2e-1, -3.333_328e-1]);
    let near = near * z * x + x;
    let far = (1.0 - 2.0 / (exp(2.0 * x.abs()) + 1.0)).copysign(x);
    if x.abs() < 0.625 { near } else { far }
}

/// By Horner's rule, the highest power first.
#[inline(always)]
fn polynomial<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    coefficients[1..].iter().fold(coefficients[0], |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest relative error over a million evenly spaced numbers from `low` to `high`.
    fn largest_error(f: fn(f32) -> f32, exact: fn(f64) -> f64, [low, high]: [f32; 2]) -> f64 {
        let n = 1_000_000;
        let at = |i: i32| low + (high - low) * (i as f32 / n as f32);
        let error = |x: f32| ((f64::from(f(x)) - exact(f64::from(x))) / exact(f64::from(x))).abs();
        (0..=n).map(|i| at(i).clamp(low, high)).filter(|x| exact(f64::from(*x)) != 0.0).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn errors_are_a_few_roundings() {
        for ends in [[-87.0, 88.0], [-20.0, 10.0], [-1.0, 1.0], [-1e-3, 1e-3]] {
            let error = largest_error(exp, f64::exp, ends);
            assert!(error < 1.5e-7, "exp {ends:?}: {error}");
        }
        for ends in [[0.0, 1.0], [0.0, 1e-3], [0.0, 1e-30], [f32::MIN_POSITIVE, 2e-38]] {
            let error = largest_error(ln_1p, f64::ln_1p, ends);
            assert!(error < 1.5e-7, "ln_1p {ends:?}: {error}");
        }
        for ends in [[-100.0, 100.0], [-1.0, 1.0], [-1e-3, 1e-3], [0.62, 0.63], [1e-30, 2e-30]] {
            let error = largest_error(tanh, f64::tanh, ends);
            assert!(error < 1.5e-7, "tanh {ends:?}: {error}");
        }
    }

    #[test]
    fn extremes() {
        for infinite in [f32::INFINITY, f32::MAX] {
            assert_eq!((tanh(infinite), tanh(-infinite)), (1.0, -1.0));
            assert_eq!((exp(infinite), exp(-infinite)), (exp(88.0), exp(-87.0)));
        }
        assert!(exp(f32::NAN).is_nan() && tanh(f32::NAN).is_nan() && ln_1p(f32::NAN).is_nan());
        assert_eq!((exp(0.0), ln_1p(0.0), tanh(0.0)), (1.0, 0.0, 0.0));
    }
}
