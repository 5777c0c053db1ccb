//! Lift: a cube on a table (robosuite 1.4 `Lift`).

use aforce::{Pose, Twist, Vector3};

use super::{Table, add_fixtures};
use crate::gripper::{GRIP_SITE, add_gripper};
use crate::robots::Robot;
use crate::scene::{Body, Geom, Inertial, Joint, Role, Scene, Shape, at};
use crate::{Plant, Simulation};

/// Height of the table top (m).
pub const TABLE_HEIGHT: f64 = 0.8;

/// Where to find what matters in the scene.
#[derive(Debug, Clone, Copy)]
pub struct Lift {
    cube: usize,
    cube_geom: usize,
    pads: [usize; 2],
}

/// The scene with a cube of the given half extents (m), and the body that carries the
/// grip site.
pub fn scene(robot: &Robot, cube_half: Vector3) -> (Scene, usize) {
    let mut scene = Scene::default();
    let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, TABLE_HEIGHT], friction: 1.0 };
    let base = add_fixtures(&mut scene, robot, &table);
    let right_hand = robot.add_to(&mut scene, base);
    let gripper = add_gripper(&mut scene, robot, right_hand);
    scene.add(Body {
        name: "cube".into(),
        parent: None,
        pose: at([0.0, 0.0, TABLE_HEIGHT + cube_half.z]),
        joint: Joint::Free,
        inertial: Inertial::solid_box(cube_half, 1000.0),
        geoms: vec![Geom {
            name: "cube".into(),
            shape: Shape::Box(cube_half),
            pose: Pose::identity(),
            friction: 1.0,
            role: Role::Object,
            color: [196, 58, 49],
        }],
    });
    (scene, gripper)
}

impl Lift {
    /// Builds and simulates the scene.
    pub fn simulate(plant: &Plant, cube_half: Vector3) -> (Simulation, Lift) {
        let (scene, gripper) = scene(&plant.robot, cube_half);
        let simulation = Simulation::new(&scene, gripper, GRIP_SITE, plant);
        let lift = Lift {
            cube: scene.body("cube"),
            cube_geom: scene.geom("cube"),
            pads: [scene.geom("left_pad"), scene.geom("right_pad")],
        };
        (simulation, lift)
    }

    /// Pose of the cube's centre (world).
    pub fn cube_pose(&self, simulation: &Simulation) -> Pose {
        simulation.body_pose(self.cube)
    }

    /// Velocity of the cube (m/s, rad/s; world), linear at its centre.
    pub fn cube_velocity(&self, simulation: &Simulation) -> Twist {
        simulation.body_velocity(self.cube)
    }

    /// Puts the cube at rest at `pose` (world).
    pub fn place_cube(&self, simulation: &mut Simulation, pose: &Pose) {
        simulation.place(self.cube, pose);
    }

    /// Whether both finger pads press on the cube; finger shells do not count.
    pub fn is_grasped(&self, simulation: &Simulation) -> bool {
        self.pads.iter().all(|&pad| simulation.touching(pad, self.cube_geom))
    }
}
