//! Draws the simulated collision shapes by ray casting: no GPU, no display.

use aforce::Vector3;

use crate::view::View;
use crate::{Simulation, Surfaces};

/// A pinhole camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Position (m, world).
    pub eye: [f64; 3],
    /// The point in the middle of the picture (m, world).
    pub target: [f64; 3],
    /// Full vertical opening angle (rad).
    pub field_of_view: f64,
}

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

/// Towards the sun (unit length after normalisation).
const LIGHT: [f64; 3] = [0.45, 0.6, 1.0];
const SKY: [u8; 3] = [238, 241, 245];

impl Camera {
    /// The same target from the same distance, seen from `direction` (world, any length), which is
    /// not quite vertical.
    pub fn from_direction(&self, direction: [f64; 3]) -> Camera {
        let target = Vector3::from(self.target);
        let distance = (Vector3::from(self.eye) - target).norm();
        Camera { eye: (target + Vector3::from(direction).normalize() * distance).into(), ..*self }
    }

    /// Column and row (pixels from the top left corner) at which a point (m, world) appears in a
    /// picture of the given size; `None` behind the camera.
    pub fn project(&self, point: &Vector3, width: usize, height: usize) -> Option<[f64; 2]> {
        let [forward, right, up] = self.axes();
        let ray = point - Vector3::from(self.eye);
        let depth = ray.dot(&forward);
        let half = libm::tan(self.field_of_view / 2.0) * depth;
        let (x, y) = (ray.dot(&right) / half, ray.dot(&up) / half);
        (depth > 0.0).then_some([(x * height as f64 + width as f64) / 2.0, (1.0 - y) * height as f64 / 2.0])
    }

    /// Unit vectors (world): into the picture, to its right, to its top.
    fn axes(&self) -> [Vector3; 3] {
        let forward = (Vector3::from(self.target) - Vector3::from(self.eye)).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        [forward, right, right.cross(&forward)]
    }

    /// What it sees, upright.
    pub fn view(&self) -> View {
        View { eye: self.eye.into(), axes: self.axes(), field_of_view: self.field_of_view }
    }

    /// Draws what the camera sees; where decals overlap, the last one.
    pub fn render(&self, simulation: &Simulation, decals: &[Decal], width: usize, height: usize) -> Image {
        self.view().colors(simulation, decals, width, height)
    }
}

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
    let in_shadow = lit > 0.0 && surfaces.cast(&(point + normal * 1e-4), light).is_some();
    let brightness = 0.45 + if in_shadow { 0.0 } else { 0.55 * lit };
    // Far surfaces fade into the sky, so that the floor has no hard edge.
    let haze = ((distance - 2.0) / 3.0).clamp(0.0, 1.0);
    std::array::from_fn(|i| {
        let surface = f64::from(color[i]) * brightness;
        (surface + (f64::from(SKY[i]) - surface) * haze).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_appear_where_rays_go() {
        let camera =
            Camera { eye: [2.0, 0.0, 1.0], target: [0.0, 0.0, 1.0], field_of_view: std::f64::consts::FRAC_PI_2 };
        let at = |x, y, z| camera.project(&Vector3::new(x, y, z), 400, 200);
        // At 2 m, 2 m are half the height; seen along -x, y points to the right.
        let near = |seen: Option<[f64; 2]>, column: f64, row: f64| {
            let [c, r] = seen.unwrap();
            assert!((c - column).abs() < 1e-9 && (r - row).abs() < 1e-9, "{c} {r}");
        };
        near(at(0.0, 0.0, 1.0), 200.0, 100.0);
        near(at(0.0, 1.0, 1.0), 250.0, 100.0);
        near(at(0.0, 0.0, 2.0), 200.0, 50.0);
        assert!(at(3.0, 0.0, 1.0).is_none());
        let side = camera.from_direction([0.0, -3.0, 0.0]);
        assert!((Vector3::from(side.eye) - Vector3::new(0.0, -2.0, 1.0)).norm() < 1e-12);
    }
}
