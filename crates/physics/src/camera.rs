//! Draws the simulated collision shapes by ray casting: no GPU, no display.

use aforce::Vector3;

use crate::Simulation;
pub use crate::shading::{Decal, Image};
use crate::view::View;

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

impl Camera {
    /// The same target from the same distance, seen from `direction` (world, any length).
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
        let right = forward.cross(&Vector3::z());
        // Straight down or up: the picture's top is where x points.
        let right = right.try_normalize(1e-9).unwrap_or_else(|| forward.cross(&Vector3::x()));
        [forward, right, right.cross(&forward)]
    }

    /// The camera's view, upright.
    pub fn view(&self) -> View {
        View { eye: self.eye.into(), axes: self.axes(), field_of_view: self.field_of_view }
    }

    /// Draws what the camera sees; where decals overlap, the last one is seen.
    pub fn render(&self, simulation: &Simulation, decals: &[Decal], width: usize, height: usize) -> Image {
        self.view().colors(simulation, decals, width, height)
    }
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
        let below = Camera { target: [2.0, 0.0, 0.0], ..camera };
        near(below.project(&Vector3::new(3.0, 1.0, 0.0), 200, 200), 0.0, 0.0);
        let side = camera.from_direction([0.0, -3.0, 0.0]);
        assert!((Vector3::from(side.eye) - Vector3::new(0.0, -2.0, 1.0)).norm() < 1e-12);
    }
}
