//! Door: a door with a spring-loaded handle that works a latch (robosuite 1.4 `Door`).

use std::f64::consts::FRAC_PI_2;

use aforce::{Pose, Vector3};
use nalgebra::{Translation3, UnitQuaternion};

use super::{Table, add_fixtures};
use crate::gripper::{GRIP_SITE, add_gripper};
use crate::robots::Robot;
use crate::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at, between, pose};
use crate::{Plant, Simulation};

/// Centre of the table top (m).
const TABLE_TOP: [f64; 3] = [-0.2, -0.35, 0.8];
/// Where the door stands in the middle of its placements: x, y (m) and yaw (rad).
pub const MIDDLE: [f64; 3] = [TABLE_TOP[0] + 0.08, TABLE_TOP[1], -FRAC_PI_2 - 0.125];
/// The hinge as seen from robosuite's door frame, the middle of the panel (m). A joint's
/// axis passes through its body's origin here, so the body `door` sits on the hinge.
const HINGE_FROM_CENTRE: f64 = 0.255;
/// The grip of the handle in the frame of the body `handle` (m).
const HANDLE_SITE: [f64; 3] = [0.125, -0.1, 0.0];

/// Where to find what matters in the scene.
#[derive(Debug, Clone, Copy)]
pub struct Door {
    door: usize,
    handle: usize,
    lever: usize,
    pads: [usize; 2],
    /// Place of the door's joint in the scene.
    pub hinge: usize,
    /// Place of the handle's joint.
    pub shaft: usize,
}

/// Pose of the root of a door at x, y (m) that is turned by yaw (rad): 30 cm above the
/// table, which the posts stand on. With a yaw of -pi/2 it opens towards +y.
pub fn root([x, y, yaw]: [f64; 3]) -> Pose {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    Pose::from_parts(Translation3::new(x, y, TABLE_TOP[2] + 0.3), rotation)
}

/// The scene with the door's root at `root` (world), and the body that carries the grip
/// site.
pub fn scene(robot: &Robot, root: &Pose) -> (Scene, usize) {
    let mut scene = Scene::default();
    let table = Table { size: [0.8, 0.3, 0.05], top: TABLE_TOP, friction: 1.0 };
    let base = add_fixtures(&mut scene, robot, &table);
    let right_hand = robot.add_to(&mut scene, base);
    let gripper = add_gripper(&mut scene, robot, right_hand);
    add_door(&mut scene, root);
    (scene, gripper)
}

/// Frame, panel, handle. Nothing but the latch holds the door: a disc on the handle that
/// stands behind the left post until the handle is turned by about 1.2 rad.
fn add_door(scene: &mut Scene, root: &Pose) {
    let post = |name: &str, x: f64| {
        geom(name, Shape::Cylinder { half_length: 0.3, radius: 0.03 }, at([x, 0.0, 0.0]), Role::Fixture, [96, 84, 72])
    };
    let frame = scene.add(Body {
        name: "door_frame".into(),
        parent: None,
        pose: root * pose([0.0, 0.22, 0.0], [0.707388, 0.0, 0.0, -0.706825]),
        joint: Joint::Fixed,
        inertial: Inertial::NONE,
        geoms: vec![post("hinge_post", 0.555), post("latch_post", 0.045)],
    });
    let centre = at([-HINGE_FROM_CENTRE, 0.0, 0.0]);
    let door = scene.add(Body {
        name: "door".into(),
        parent: Some(frame),
        pose: at([0.3 + HINGE_FROM_CENTRE, 0.0, 0.0]),
        joint: Joint::Hinge(Axis {
            name: "hinge".into(),
            direction: Vector3::z_axis(),
            range: [0.0, 0.4],
            damping: 1.0,
            friction: 1.0,
            armature: 0.0,
            spring: 0.0,
            rest: 0.0,
            stop: Stop::Spring { stiffness: 600.0, damping: 24.0 },
        }),
        inertial: Inertial::diagonal(2.43455, [0.0; 3], [0.0913751, 0.0521615, 0.043714])
            .transformed(&(centre * pose([0.02968, -0.00152, 0.0], [0.701072, 0.0, 0.0, 0.713091]))),
        geoms: vec![geom("panel", Shape::Box(Vector3::new(0.22, 0.02, 0.29)), centre, Role::Object, [178, 142, 104])],
    });
    scene.add(Body {
        name: "handle".into(),
        parent: Some(door),
        pose: centre * at([-0.175, 0.0, -0.025]),
        joint: Joint::Hinge(Axis {
            name: "handle".into(),
            direction: Vector3::y_axis(),
            range: [-1.57, 1.57],
            damping: 0.0,
            friction: 0.1,
            armature: 0.0,
            spring: 1.0,
            rest: 0.0,
            stop: Stop::Spring { stiffness: 45.0, damping: 1.8 },
        }),
        inertial: Inertial::diagonal(0.1, [0.0; 3], [0.0483771, 0.0410001, 0.0111013])
            .transformed(&pose([-0.017762, 0.013854, 0.0], [0.365653, 0.605347, -0.36522, 0.605365])),
        geoms: handle_geoms(),
    });
}

/// The handle's shaft passes through the panel, the lever in front of it, the latch behind.
fn handle_geoms() -> Vec<Geom> {
    const METAL: [u8; 3] = [245, 243, 235];
    let along_y = |name: &str, x: f64, from: f64, to: f64| {
        let (pose, half_length) = between([x, from, 0.0], [x, to, 0.0]);
        geom(name, Shape::Cylinder { half_length, radius: 0.025 }, pose, Role::Object, METAL)
    };
    let block = |name: &str, half: [f64; 3], centre: [f64; 3]| {
        geom(name, Shape::Box(half.into()), at(centre), Role::Object, METAL)
    };
    vec![
        along_y("shaft", 0.0, -0.125, 0.0625),
        block("lever", [0.075, 0.015, 0.02], [0.075, -0.1, 0.0]),
        block("latch_bar", [0.03125, 0.0125, 0.025], [-0.03125, 0.05, 0.0]),
        along_y("latch_tip", -0.0625, 0.0375, 0.0625),
    ]
}

fn geom(name: &str, shape: Shape, pose: Pose, role: Role, color: [u8; 3]) -> Geom {
    Geom { name: name.into(), shape, pose, friction: 1.0, role, color }
}

impl Door {
    /// Builds and simulates the scene.
    pub fn simulate(plant: &Plant, root: &Pose) -> (Simulation, Door) {
        let (scene, gripper) = scene(&plant.robot, root);
        let simulation = Simulation::new(&scene, gripper, GRIP_SITE, plant);
        let door = Door {
            door: scene.body("door"),
            handle: scene.body("handle"),
            lever: scene.geom("lever"),
            pads: [scene.geom("left_pad"), scene.geom("right_pad")],
            hinge: scene.joint("hinge"),
            shaft: scene.joint("handle"),
        };
        (simulation, door)
    }

    /// Middle of the panel (world, m): robosuite's door position.
    pub fn centre(&self, simulation: &Simulation) -> Vector3 {
        (simulation.body_pose(self.door) * Translation3::new(-HINGE_FROM_CENTRE, 0.0, 0.0)).translation.vector
    }

    /// The grip of the handle (world): its position 2.5 cm from the lever's end, x along
    /// the lever away from the shaft, y into the panel, -z in the direction in which a
    /// positive angle moves it.
    pub fn handle_pose(&self, simulation: &Simulation) -> Pose {
        simulation.body_pose(self.handle) * at(HANDLE_SITE)
    }

    /// Where the grip of the handle would be if the door were opened by `opening` and the
    /// handle turned by `angle` more (rad).
    pub fn moved_handle(&self, simulation: &Simulation, opening: f64, angle: f64) -> Pose {
        let (door, handle) = (simulation.body_pose(self.door), simulation.body_pose(self.handle));
        let hinge = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), opening);
        let shaft = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        door * hinge * door.inverse() * handle * shaft * at(HANDLE_SITE)
    }

    /// Opening angle (rad), from 0 to 0.4.
    pub fn opening(&self, simulation: &Simulation) -> f64 {
        simulation.joint(self.hinge).0
    }

    /// Angle of the handle (rad); positive pushes the lever down.
    pub fn handle_angle(&self, simulation: &Simulation) -> f64 {
        simulation.joint(self.shaft).0
    }

    /// How fast the door and its handle turn (rad/s).
    pub fn speeds(&self, simulation: &Simulation) -> [f64; 2] {
        [self.hinge, self.shaft].map(|joint| simulation.joint(joint).1)
    }

    /// Whether both finger pads press on the lever.
    pub fn is_grasped(&self, simulation: &Simulation) -> bool {
        self.pads.iter().all(|&pad| simulation.touching(pad, self.lever))
    }
}
