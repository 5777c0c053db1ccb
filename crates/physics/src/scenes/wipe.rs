//! Wipe: a compliant tool over a slippery table (robosuite 1.4 `Wipe`).

use super::{Table, add_fixtures};
use crate::model::Model;
use crate::robots::Robot;
use crate::scene::Scene;
use crate::wiping_tool::{GRIP_SITE, RAILS, add_wiping_tool, pad};
use crate::{Plant, Simulation};

/// Height of the table top (m).
pub const TABLE_HEIGHT: f64 = 0.9;
/// Sliding friction of the table top.
pub const TABLE_FRICTION: f64 = 0.03;
/// Middle of the table top in the plane (m, world).
pub const TABLE_CENTRE: [f64; 2] = [0.15, 0.0];
/// Full size of the table top along x and y (m).
pub const TABLE_SIZE: [f64; 2] = [0.5, 0.8];

/// Where to find what matters in the scene.
#[derive(Debug, Clone, Copy)]
pub struct Wipe {
    table: usize,
    rails: [usize; 2],
}

/// The scene with a table top at `height` (m) whose sliding friction is `friction`, and the
/// body that carries the grip site.
pub fn scene(robot: &Robot, height: f64, friction: f64) -> (Scene, usize) {
    let mut scene = Scene::default();
    let [x, y] = TABLE_CENTRE;
    let table = Table { size: [TABLE_SIZE[0], TABLE_SIZE[1], 0.05], top: [x, y, height], friction };
    let base = add_fixtures(&mut scene, robot, &table);
    let right_hand = robot.add_to(&mut scene, base);
    let tool = add_wiping_tool(&mut scene, right_hand);
    scene.pad = Some(pad(&Model::new(&scene, tool, GRIP_SITE), &robot.home, scene.geom("table")));
    (scene, tool)
}

impl Wipe {
    /// Builds and simulates the scene; see [`scene`].
    pub fn simulate(plant: &Plant, height: f64, friction: f64) -> (Simulation, Wipe) {
        let (scene, tool) = scene(&plant.robot, height, friction);
        let simulation = Simulation::new(&scene, tool, GRIP_SITE, plant);
        let wipe = Wipe { table: scene.geom("table"), rails: RAILS.map(|rail| scene.geom(rail)) };
        (simulation, wipe)
    }

    /// Whether the tool lies flat: all corners of both rails press on the table.
    pub fn is_flat(&self, simulation: &Simulation) -> bool {
        self.rails.iter().all(|&rail| simulation.contact_points(rail, self.table) >= 4)
    }
}
