//! The scenes, and what they share: floor, table, and what the robot stands on.

pub mod door;
pub mod insert;
pub mod lift;
pub mod wipe;

use aforce::{Pose, Vector3};

use crate::robots::{Mount, Robot};
use crate::scene::{Geom, Role, Scene, Shape, at};

/// A table top.
pub struct Table {
    /// Full size along x, y, z (m).
    pub size: [f64; 3],
    /// Centre of the top surface (m).
    pub top: [f64; 3],
    /// Sliding friction.
    pub friction: f64,
}

/// Adds floor, mount and table; returns the pose of the robot's base (world), which stands half the table's length and the mount's
/// distance behind the world's origin, as in robosuite.
pub fn add_fixtures(scene: &mut Scene, robot: &Robot, table: &Table) -> Pose {
    let Mount { height, behind_table, geoms } = &robot.mount;
    let base = at([-behind_table - table.size[0] / 2.0, 0.0, *height]);
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
    let mount = geoms.iter().map(|geom| Geom { pose: base * geom.pose, ..geom.clone() });
    scene.add_static("pedestal", mount.collect());
    scene.add_static("table", vec![fixture("table", half, [x, y, z - half[2]], table.friction, [190, 160, 128])]);
    base
}
