//! acos and cos, rounded to the nearest number, in place of those that Rust's library takes from the platform.
//!
//! The engine finds the principal axes of a body's inertia with them. glibc rounds both to nearest but for a few arguments in a
//! thousand. The functions of WebAssembly and of musl err more often, and the last bits of a moving body's inertia would differ.

/// The angle (rad, 0 to pi) of a cosine, in place of the C library's.
#[unsafe(no_mangle)]
pub extern "C" fn acos(cosine: f64) -> f64 {
    let near = libm::acos(cosine);
    if cosine.abs() < 1.0 {
        let Twofold { high, low } = series(near);
        near + (high - cosine + low) / libm::sin(near)
    } else {
        near
    }
}

/// The cosine of an angle (rad), in place of the C library's. Beyond pi, where the engine asks for none, it is libm's.
#[unsafe(no_mangle)]
pub extern "C" fn cos(angle: f64) -> f64 {
    if angle.abs() <= std::f64::consts::PI { series(angle).high } else { libm::cos(angle) }
}

/// A number of twice the digits: the sum of two, of which the first is the nearest to it.
#[derive(Clone, Copy)]
struct Twofold {
    high: f64,
    low: f64,
}

/// The cosine of an angle between -pi and pi, by its power series.
fn series(angle: f64) -> Twofold {
    let square = Twofold::product(angle, angle);
    // cos a = 1 - a^2 / (1 * 2) (1 - a^2 / (3 * 4) (1 - ...)); the first term left out is below 1e-35.
    (1..=24).rev().fold(Twofold { high: 1.0, low: 0.0 }, |rest, k| {
        let term = rest.times(square).over(f64::from((2 * k - 1) * (2 * k)));
        Twofold::sum(1.0, -term.high).plus(-term.low)
    })
}

impl Twofold {
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

    /// Angles, and their cosines to the nearest number, worked out with 50 digits. glibc's are other ones.
    const NEAREST: [(f64, f64); 4] = [
        (1.903339827057912, -0.3264482365695714),
        (1.9260720869765804, -0.34784891758259445),
        (1.7630606912985463, -0.19108202443642616),
        (0.4807455066142465, 0.8866504168944281),
    ];

    #[test]
    fn a_cosine_is_rounded_to_the_nearest_number() {
        for (angle, expected) in NEAREST {
            // The compiler knows functions of this name, and would put in its own library's answer for a number that it sees.
            assert_eq!(cos(std::hint::black_box(angle)), expected, "{angle}");
        }
    }

    /// An ulp on either side is further away.
    #[test]
    fn an_angle_is_rounded_to_the_nearest_number() {
        for k in -999..1000 {
            let cosine = f64::from(k) / 1000.0;
            let off = |angle: f64| {
                let Twofold { high, low } = series(angle);
                (high - cosine + low).abs()
            };
            let angle = acos(cosine);
            assert!(off(angle) <= off(angle.next_up()) && off(angle) <= off(angle.next_down()), "{cosine}");
        }
    }
}
