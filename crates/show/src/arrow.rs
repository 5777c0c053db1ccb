//! Forces as arrows over a picture.

use aforce::Vector3;
use physics::camera::{Camera, Image};

/// Length of an arrow in the scene: 60 N are 24 cm.
pub const METRES_PER_NEWTON: f64 = 0.004;
/// Smaller forces are not drawn (N).
const SMALLEST: f64 = 1.0;
/// Magenta, as in the page: the colour of no action space and of nothing in the scenes.
const COLOR: [f64; 3] = [214.0, 0.0, 140.0];

/// Draws a force (N, world) that acts at `point` (m, world), over everything else.
pub fn draw_force(image: &mut Image, camera: &Camera, point: &Vector3, force: &Vector3) {
    let end = point + force * METRES_PER_NEWTON;
    let ends = [point, &end].map(|p| camera.project(p, image.width, image.height));
    if let [Some(tail), Some(tip)] = ends
        && force.norm() > SMALLEST
    {
        draw(image, tail, tip);
    }
}

/// From `tail` to `tip` (column and row, pixels).
fn draw(image: &mut Image, tail: [f64; 2], tip: [f64; 2]) {
    let (dx, dy) = (tip[0] - tail[0], tip[1] - tail[1]);
    let length = dx.hypot(dy).max(1e-9);
    let half_width = (image.height as f64 / 200.0).max(1.0);
    let head = (6.0 * half_width).min(length);
    for row in 0..image.height {
        for column in 0..image.width {
            let (x, y) = (column as f64 + 0.5 - tail[0], row as f64 + 0.5 - tail[1]);
            // Along the arrow from its tail, and across it.
            let (along, across) = ((x * dx + y * dy) / length, (x * dy - y * dx).abs() / length);
            let shaft = (half_width - across).min(along).min(length - head - along);
            // The head's half width is half of the distance to the tip. The factor 0.9, the cosine of the flank's slope, turns
            // the distance across into the distance from the flank.
            let flank = 0.9 * ((length - along) / 2.0 - across);
            let cover = shaft.max(flank.min(along - (length - head))) + 0.5;
            let cover = cover.clamp(0.0, 1.0);
            let at = 3 * (row * image.width + column);
            for (value, color) in image.rgb[at..at + 3].iter_mut().zip(COLOR) {
                *value = (f64::from(*value) * (1.0 - cover) + color * cover).round() as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen along +y, a force upwards is an arrow upwards from its point, with a length in proportion to the force.
    #[test]
    fn an_arrow_stands_on_its_point() {
        let camera = Camera { eye: [0.0, -2.0, 1.0], target: [0.0, 0.0, 1.0], field_of_view: 1.0 };
        let blank = Image { width: 120, height: 100, rgb: vec![255; 3 * 120 * 100] };
        let mut image = blank.clone();
        draw_force(&mut image, &camera, &Vector3::z(), &Vector3::new(0.0, 0.0, 0.5));
        assert!(image == blank, "half a newton is not drawn");
        draw_force(&mut image, &camera, &Vector3::z(), &Vector3::new(0.0, 0.0, 80.0));
        let inked = |row: usize, column: usize| image.rgb[3 * (120 * row + column) + 1] < 128;
        // 32 cm at 2 m: 50 / tan 0.5 * 0.16 = 14.6 rows.
        assert!(inked(47, 60) && inked(37, 60) && !inked(33, 60) && !inked(53, 60));
        // The head is wider than the shaft.
        assert!(inked(40, 57) && !inked(47, 57));
    }
}
