//! A view from one place in one direction: colours or depths, by ray casting.

use aforce::{Pose, Vector3};

use crate::shading::{Decal, Image, shade, sun};
use crate::{Simulation, Surfaces};

/// Place of a camera in the hand, and the point that it looks at (m, tool frame): beside the hand's narrow side, past the fingers.
const IN_HAND: [[f64; 3]; 2] = [[0.0, 0.08, -0.1], [0.0, 0.0, 0.02]];
/// Its full vertical opening angle (rad).
const HAND_FIELD: f64 = 1.31;

/// A pinhole camera that may stand any way up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Position (m, world).
    pub(crate) eye: Vector3,
    /// Unit vectors (world): into the picture, to its right, to its top.
    pub(crate) axes: [Vector3; 3],
    /// Full vertical opening angle (rad).
    pub(crate) field_of_view: f64,
}

impl View {
    /// From beside the hand to a point 2 cm beyond the tool point; `tool` is the tool's pose. The picture's top is the tool's +y.
    pub fn from_hand(tool: &Pose) -> View {
        let [eye, target] = IN_HAND.map(|point| tool.translation.vector + tool.rotation * Vector3::from(point));
        let forward = (target - eye).normalize();
        let right = forward.cross(&(tool.rotation * Vector3::y())).normalize();
        View { eye, axes: [forward, right, right.cross(&forward)], field_of_view: HAND_FIELD }
    }

    /// The view in colours; where decals overlap, the last one is seen.
    pub fn colors(&self, simulation: &Simulation, decals: &[Decal], width: usize, height: usize) -> Image {
        let light = sun();
        let mut rgb = Vec::with_capacity(3 * width * height);
        self.each_ray(simulation, width, height, |surfaces, direction| {
            rgb.extend(shade(surfaces, decals, &self.eye, direction, &light));
        });
        Image { width, height, rgb }
    }

    /// Depth of each pixel (m): the distance along the viewing direction, not along the ray. Rows from the top. A depth
    /// is at most `far`, which also stands where nothing is seen.
    pub fn depths(&self, simulation: &Simulation, far: f64, width: usize, height: usize) -> Vec<f32> {
        let mut depths = Vec::with_capacity(width * height);
        self.each_ray(simulation, width, height, |surfaces, direction| {
            let distance = surfaces.distance(&self.eye, direction);
            let depth = distance.map_or(far, |distance| distance * direction.dot(&self.axes[0]));
            depths.push(depth.min(far) as f32);
        });
        depths
    }

    /// Calls `see` with the direction (unit, world) of every pixel, row by row from the top left corner.
    fn each_ray(
        &self,
        simulation: &Simulation,
        width: usize,
        height: usize,
        mut see: impl FnMut(&Surfaces<'_>, &Vector3),
    ) {
        let [forward, right, up] = self.axes;
        let scale = libm::tan(self.field_of_view / 2.0);
        let surfaces = simulation.surfaces();
        for row in 0..height {
            for column in 0..width {
                let x = (2.0 * (column as f64 + 0.5) - width as f64) / height as f64 * scale;
                let y = (1.0 - 2.0 * (row as f64 + 0.5) / height as f64) * scale;
                see(&surfaces, &(forward + right * x + up * y).normalize());
            }
        }
    }
}
