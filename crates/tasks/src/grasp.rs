//! Rotations of the hand that scripts need.
//!
//! The tool's frame lies at the tool point between the finger pads: z points out of the hand, x is the axis along which the fingers
//! open, y lies along the broad faces of the fingers.

use aforce::Vector3;
use nalgebra::UnitQuaternion;

/// The hand straight down (its z axis is -z of the world), its x axis along the level part of `forward` (world). The fingers
/// then open along `forward`. A vertical `forward` counts as x.
pub fn straight_down(forward: &Vector3) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), libm::atan2(forward.y, forward.x))
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
}

/// The hand straight down on a body that looks the same after a turn by `1 / turns` of a circle about z: 2 for a bar, 4 for a
/// cube. Of these grasps, the first of which has its x axis along the level part of `forward` (world), the nearest to `tool`.
///
/// # Panics
/// If `turns` is 0.
pub fn nearest_straight_down(forward: &Vector3, turns: u32, tool: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    nearest((0..turns).map(|k| straight_down(&turned(forward, k, turns))), tool)
}

/// The level part of `v` after `k` turns by `1 / turns` of a circle about z. Quarters are exact.
fn turned(v: &Vector3, k: u32, turns: u32) -> Vector3 {
    let (sin, cos) = match (4 * k / turns, 4 * k % turns) {
        (0, 0) => (0.0, 1.0),
        (1, 0) => (1.0, 0.0),
        (2, 0) => (0.0, -1.0),
        (3, 0) => (-1.0, 0.0),
        _ => libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(turns)),
    };
    Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, 0.0)
}

/// The one of `rotations` that is nearest to `tool`: of the grasps of a symmetric body, the one that turns the hand least.
///
/// # Panics
/// If there is none.
pub fn nearest(
    rotations: impl IntoIterator<Item = UnitQuaternion<f64>>,
    tool: &UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    let nearer = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| a.angle_to(tool).total_cmp(&b.angle_to(tool));
    rotations.into_iter().min_by(nearer).expect("a rotation to choose")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_points_down_and_its_fingers_open_along_the_level_direction() {
        let hand = straight_down(&Vector3::new(0.3, 0.4, -0.7));
        assert!((hand * Vector3::z() + Vector3::z()).norm() < 1e-12);
        assert!((hand * Vector3::x() - Vector3::new(0.6, 0.8, 0.0)).norm() < 1e-12);
    }

    /// Of a cube's four grasps none needs more than an eighth of a turn, of a hexagon's six none more than a twelfth.
    #[test]
    fn the_nearest_of_n_turns_is_chosen() {
        for (turns, most) in [(1, 180.0), (2, 90.0), (4, 45.0), (6, 30.0)] {
            let furthest = (0..360)
                .map(|degrees| {
                    let (sin, cos) = libm::sincos(f64::from(degrees).to_radians());
                    let tool = straight_down(&Vector3::x());
                    let forward = Vector3::new(cos, sin, 0.0);
                    tool.angle_to(&nearest_straight_down(&forward, turns, &tool)).to_degrees()
                })
                .fold(0.0, f64::max);
            assert!((furthest - most).abs() < 1e-6, "{turns} turns: {furthest} degrees");
        }
    }
}
