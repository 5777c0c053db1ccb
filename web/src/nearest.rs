//! acos, atan2, cbrt and cos, rounded to the nearest number, in place of those that Rust's library takes from the platform.
//!
//! The engine finds the principal axes of a body's inertia with acos and cos, and the generator of jerk-limited set-points the roots of its
//! polynomials with atan2 and cbrt. glibc rounds atan2, acos and cos to nearest but for a few arguments in a thousand. The functions of
//! WebAssembly and of musl err more often, so that last bits would differ.

/// The angle (rad, 0 to pi) of a cosine, in place of the C library's.
#[unsafe(no_mangle)]
pub extern "C" fn acos(cosine: f64) -> f64 {
    let near = libm::acos(cosine);
    if cosine.abs() < 1.0 {
        let Twofold { high, low } = cosine_of(near);
        near + (high - cosine + low) / libm::sin(near)
    } else {
        near
    }
}

/// The direction (rad, -pi to pi) of a vector, in place of the C library's.
#[unsafe(no_mangle)]
pub extern "C" fn atan2(y: f64, x: f64) -> f64 {
    let near = libm::atan2(y, x);
    let (cosine, sine) = (cosine_of(near), sine_of(near));
    // Components of the vector across the approximate direction and along it.
    let across = cosine.times(Twofold::of(y)).plus_twofold(sine.times(Twofold::of(-x)));
    let along = cosine.high * x + sine.high * y;
    let more = (across.high + across.low) / along;
    // Along an axis, and with components that are infinite or too large to be multiplied, the result is libm's.
    if more.is_normal() { near + more } else { near }
}

/// The cosine of an angle (rad), in place of the C library's. Beyond pi, where the engine needs none, the result is libm's.
#[unsafe(no_mangle)]
pub extern "C" fn cos(angle: f64) -> f64 {
    if angle.abs() <= std::f64::consts::PI { cosine_of(angle).high } else { libm::cos(angle) }
}

/// The cube root, in place of the C library's. libm's result is the nearest number, as that of Rust's own library is except with musl.
#[unsafe(no_mangle)]
pub extern "C" fn cbrt(number: f64) -> f64 {
    libm::cbrt(number)
}

/// A number of twice the digits (double-double): the sum of `high`, the f64 nearest to it, and `low`.
#[derive(Clone, Copy)]
struct Twofold {
    high: f64,
    low: f64,
}

/// The cosine of an angle between -pi and pi.
fn cosine_of(angle: f64) -> Twofold {
    series(angle, |k| (2 * k - 1) * (2 * k))
}

/// The sine of an angle between -pi and pi.
fn sine_of(angle: f64) -> Twofold {
    series(angle, |k| (2 * k) * (2 * k + 1)).times(Twofold::of(angle))
}

/// 1 - a^2 / d(1) (1 - a^2 / d(2) (1 - ...)); with the `divisors` of cosine and sine the first term left out is below 1e-35.
fn series(angle: f64, divisors: impl Fn(i32) -> i32) -> Twofold {
    let square = Twofold::product(angle, angle);
    (1..=24).rev().fold(Twofold::of(1.0), |rest, k| {
        let term = rest.times(square).over(f64::from(divisors(k)));
        Twofold::sum(1.0, -term.high).plus(-term.low)
    })
}

impl Twofold {
    fn of(number: f64) -> Twofold {
        Twofold { high: number, low: 0.0 }
    }

    fn sum(a: f64, b: f64) -> Twofold {
        let high = a + b;
        let of_b = high - a;
        Twofold { high, low: (a - (high - of_b)) + (b - of_b) }
    }

    fn product(a: f64, b: f64) -> Twofold {
        let high = a * b;
        Twofold { high, low: a.mul_add(b, -high) }
    }

    fn plus(self, little: f64) -> Twofold {
        Twofold::sum(self.high, self.low + little)
    }

    fn plus_twofold(self, other: Twofold) -> Twofold {
        Twofold::sum(self.high, other.high).plus(self.low + other.low)
    }

    fn times(self, other: Twofold) -> Twofold {
        Twofold::product(self.high, other.high).plus(self.high * other.low + self.low * other.high)
    }

    fn over(self, divisor: f64) -> Twofold {
        let high = self.high / divisor;
        Twofold { high, low: 0.0 }.plus(((-high).mul_add(divisor, self.high) + self.low) / divisor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Angles, and their cosines to the nearest number, worked out with 50 digits. glibc's results differ.
    const NEAREST: [(f64, f64); 4] = [
        (1.903339827057912, -0.3264482365695714),
        (1.9260720869765804, -0.34784891758259445),
        (1.7630606912985463, -0.19108202443642616),
        (0.4807455066142465, 0.8866504168944281),
    ];

    /// Vectors (y, x), and their directions to the nearest number, worked out with 50 digits. glibc's results differ for the last three.
    const DIRECTIONS: [(f64, f64, f64); 6] = [
        (-1.1769529708211812, 0.6966120569874565, -1.0363706129192052),
        (-1.0658813868166002, -1.970091307831463, -2.645661139623161),
        (-1.7004608899594835, 1.3227103623849086, -0.9097056464016632),
        (-1.9926515080879024, -0.7512563686815525, -1.931331021528871),
        (0.29383173257336326, -0.08412319841511762, 1.8496348112922034),
        (-1.1920840337839418, 1.9087899013913532, -0.5582565464804551),
    ];

    #[test]
    fn a_cosine_is_rounded_to_the_nearest_number() {
        for (angle, expected) in NEAREST {
            // The compiler knows functions of this name. For a constant argument it would insert its own library's result.
            assert_eq!(cos(std::hint::black_box(angle)), expected, "{angle}");
        }
    }

    /// The neighbouring numbers on either side are further from the exact angle.
    #[test]
    fn an_angle_is_rounded_to_the_nearest_number() {
        for k in -999..1000 {
            let cosine = f64::from(k) / 1000.0;
            let off = |angle: f64| {
                let Twofold { high, low } = cosine_of(angle);
                (high - cosine + low).abs()
            };
            let angle = acos(cosine);
            assert!(off(angle) <= off(angle.next_up()) && off(angle) <= off(angle.next_down()), "{cosine}");
        }
    }

    #[test]
    fn a_direction_is_rounded_to_the_nearest_number() {
        for (y, x, expected) in DIRECTIONS {
            assert_eq!(atan2(std::hint::black_box(y), x), expected, "{y}, {x}");
        }
        let of_axes = [(0.0, 1.0, 0.0), (-0.0, 1.0, -0.0), (0.0, 0.0, 0.0), (0.0, -1.0, std::f64::consts::PI)];
        for (y, x, expected) in of_axes {
            let direction = atan2(std::hint::black_box(y), x);
            assert_eq!(direction.to_bits(), f64::to_bits(expected), "{y}, {x}: {direction}");
        }
        assert!(atan2(f64::NAN, 1.0).is_nan());
        assert_eq!(atan2(1.0, f64::NEG_INFINITY), std::f64::consts::PI);
    }
}
