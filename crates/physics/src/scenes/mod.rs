//! The scenes, and what they share: floor, table, pedestal.

pub mod door;
pub mod lift;
pub mod wipe;

use aforce::Vector3;

use crate::panda;
use crate::scene::{Geom, Role, Scene, Shape, at};

/// Height of the arm's base frame above the floor (m).
const BASE_HEIGHT: f64 = 0.912;

/// A table top.
pub struct Table {
    /// Full size along x, y, z (m).
    pub size: [f64; 3],
    /// Centre of the top surface (m).
    pub top: [f64; 3],
    /// Sliding friction.
    pub friction: f64,
}

/// Adds floor, pedestal and table; returns the pose of the arm's base, which stands half
/// the table's length and 16 cm behind the world's origin, as in robosuite.
pub fn add_fixtures(scene: &mut Scene, table: &Table) -> aforce::Pose {
    let base = at([-0.16 - table.size[0] / 2.0, 0.0, BASE_HEIGHT]);
    let fixture = |name: &str, half: [f64; 3], centre: [f64; 3], friction, color| Geom {
        name: name.into(),
        shape: Shape::Box(Vector3::from(half)),
        pose: at(centre),
        friction,
        role: Role::Fixture,
        color,
    };
    let [x, y, z] = table.top;
    let half = table.size.map(|s| s / 2.0);
    scene.add_static("floor", vec![fixture("floor", [3.0, 3.0, 0.05], [0.0, 0.0, -0.05], 1.0, [202, 206, 212])]);
    scene.add_static("pedestal", panda::pedestal(&base));
    scene.add_static("table", vec![fixture("table", half, [x, y, z - half[2]], table.friction, [190, 160, 128])]);
    base
}
