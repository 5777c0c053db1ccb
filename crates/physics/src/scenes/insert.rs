//! Insert: a peg above a hole in a block on a table (Factory's and FORGE's `PegInsert`). Here the peg is fixed to the hand; in Factory and
//! FORGE the fingers hold it.

use aforce::{Pose, Vector3};
use serde::{Deserialize, Serialize};

use super::{Table, add_fixtures};
use crate::gripper::{GRIP_SITE, add_gripper};
use crate::robots::Robot;
use crate::scene::{Body, Geom, Hole, Inertial, Joint, Role, Scene, Shape, at};
use crate::{Plant, Simulation};

/// Height of the table top, on which the block with the hole stands (m).
pub const TABLE_HEIGHT: f64 = 0.8;
/// Depth of the hole, which is open below: its base is the table (m).
pub const DEPTH: f64 = 0.025;
/// Width of the peg: a round one's diameter (m).
pub const WIDTH: f64 = 0.007986;
/// How far the peg stands out of the hand above the tool point (m). FORGE has 17.6 mm; with its 32.4 mm below the tool point the shells
/// of these fingers would meet the rim before the peg meets the base.
const ABOVE_TOOL: f64 = 0.0115;
/// Mass of the peg for each metre of its length (kg/m): 19 g for 50 mm.
const MASS_PER_LENGTH: f64 = 0.38;
/// Half the width of the block (m).
const BLOCK: f64 = 0.02;

/// The cross-section of peg and hole.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// A cylinder in a ring of 24 wedges.
    #[default]
    Round,
    /// A box between four walls, parallel to the world's axes.
    Square,
}

/// Peg and hole (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Length of the peg.
    pub length: f64,
    /// Width of the hole less that of the peg.
    pub clearance: f64,
    /// Width and depth of the chamfer at the rim.
    pub chamfer: f64,
    /// Sliding friction of peg, hole and table.
    pub friction: f64,
    /// The cross-section.
    pub profile: Profile,
}

/// FORGE's sizes, with a chamfer added.
pub const FORGE: Sizes =
    Sizes { length: 0.05, clearance: 1.14e-4, chamfer: 1e-3, friction: 0.75, profile: Profile::Round };

impl Sizes {
    /// The peg's end as seen from the tool point, along its z (m).
    pub fn end(&self) -> f64 {
        self.length - ABOVE_TOOL
    }

    /// Geoms nearer than this become a contact (m): four times the gap between peg and wall, but no less than what a
    /// hand moves in 2 ms at 0.1 m/s, and no more than at 0.25 m/s.
    fn prediction(&self) -> f64 {
        (2.0 * self.clearance).clamp(2e-4, 5e-4)
    }

    fn peg(&self, gripper: usize) -> Body {
        let half = self.length / 2.0;
        let shape = match self.profile {
            Profile::Round => Shape::Cylinder { half_length: half, radius: WIDTH / 2.0 },
            Profile::Square => Shape::Box(Vector3::new(WIDTH / 2.0, WIDTH / 2.0, half)),
        };
        Body {
            name: "peg".into(),
            parent: Some(gripper),
            pose: at(GRIP_SITE) * at([0.0, 0.0, self.end() - half]),
            joint: Joint::Fixed,
            inertial: Inertial::of_mass(&shape, MASS_PER_LENGTH * self.length),
            geoms: vec![Geom {
                name: "peg".into(),
                shape,
                pose: Pose::identity(),
                friction: self.friction,
                role: Role::Tool,
                color: [196, 58, 49],
            }],
        }
    }

    /// The block with the hole, its rim's middle at `rim` (world, m).
    fn block(&self, rim: Vector3) -> Body {
        let sectors = match self.profile {
            Profile::Round => 24,
            Profile::Square => 4,
        };
        let radius = (WIDTH + self.clearance) / 2.0;
        let hole = Hole { radius, outer: BLOCK, depth: DEPTH, chamfer: self.chamfer, sectors };
        // The middle of the first of four walls lies half a sector from the x axis.
        let turn = if sectors == 4 { std::f64::consts::FRAC_PI_4 } else { 0.0 };
        let rotation = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let wedges = hole.wedges().expect("the task has checked the sizes");
        let geom = |(i, wedge)| Geom {
            name: format!("wedge_{i}"),
            shape: Shape::Convex(wedge),
            pose: Pose::identity(),
            friction: self.friction,
            role: Role::Fixture,
            color: [110, 140, 175],
        };
        Body {
            name: "hole".into(),
            parent: None,
            pose: Pose::from_parts(rim.into(), rotation),
            joint: Joint::Fixed,
            inertial: Inertial::NONE,
            geoms: wedges.into_iter().enumerate().map(geom).collect(),
        }
    }
}

/// The scene with the hole's rim at x, y (world, m) of `hole`, and the body that carries the grip site.
///
/// # Panics
/// If no hole has these sizes: as [`Hole::wedges`].
pub fn scene(robot: &Robot, sizes: &Sizes, hole: [f64; 2]) -> (Scene, usize) {
    let mut scene = Scene { prediction: Some(sizes.prediction()), ..Scene::default() };
    let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, TABLE_HEIGHT], friction: sizes.friction };
    let base = add_fixtures(&mut scene, robot, &table);
    let right_hand = robot.add_to(&mut scene, base);
    let gripper = add_gripper(&mut scene, robot, right_hand);
    let [x, y] = hole;
    scene.add(sizes.block(Vector3::new(x, y, TABLE_HEIGHT + DEPTH)));
    scene.add(sizes.peg(gripper));
    (scene, gripper)
}

/// Builds and simulates the scene; see [`scene`].
///
/// # Panics
/// As [`scene`] and [`Simulation::new`].
pub fn simulate(plant: &Plant, sizes: &Sizes, hole: [f64; 2]) -> Simulation {
    let (scene, gripper) = scene(&plant.robot, sizes, hole);
    Simulation::new(&scene, gripper, GRIP_SITE, plant)
}
