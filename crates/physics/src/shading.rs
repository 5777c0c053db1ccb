//! The colour of the surface that a ray meets: its own colour, sunlight and shadow, haze.

use aforce::Vector3;

use crate::Surfaces;

/// A coloured disc on a horizontal surface: drawn, not simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decal {
    /// Middle (m, world).
    pub centre: [f64; 3],
    /// Radius (m).
    pub radius: f64,
    /// Colour.
    pub color: [u8; 3],
}

impl Decal {
    fn covers(&self, point: &Vector3) -> bool {
        let d = point - Vector3::from(self.centre);
        d.z.abs() < 5e-4 && libm::hypot(d.x, d.y) < self.radius
    }
}

/// A picture, rows from the top, 8-bit RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

/// Direction towards the sun (world), not normalised.
const LIGHT: [f64; 3] = [0.45, 0.6, 1.0];
const SKY: [u8; 3] = [238, 241, 245];

/// Unit vector towards the sun.
pub(crate) fn sun() -> Vector3 {
    Vector3::from(LIGHT).normalize()
}

pub(crate) fn shade(
    surfaces: &Surfaces,
    decals: &[Decal],
    eye: &Vector3,
    direction: &Vector3,
    light: &Vector3,
) -> [u8; 3] {
    let Some((distance, normal, color)) = surfaces.cast(eye, direction) else {
        return SKY;
    };
    let point = eye + direction * distance;
    let color = decals.iter().rev().find(|decal| decal.covers(&point)).map_or(color, |decal| decal.color);
    let lit = normal.dot(light).max(0.0);
    let in_shadow = lit > 0.0 && surfaces.hides(&(point + normal * 1e-4), light);
    let brightness = 0.45 + if in_shadow { 0.0 } else { 0.55 * lit };
    // Far surfaces fade into the sky, so that the floor has no hard edge.
    let haze = ((distance - 2.0) / 3.0).clamp(0.0, 1.0);
    std::array::from_fn(|i| {
        let surface = f64::from(color[i]) * brightness;
        (surface + (f64::from(SKY[i]) - surface) * haze).round() as u8
    })
}
