//! Lift: raise a cube until its centre is 4 cm above the table (robosuite 1.4 `Lift`).

use aforce::{Measurement, Pose, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use physics::camera::Camera;
use physics::scenes::lift::{self, TABLE_HEIGHT};
use physics::{Plant, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::grasp::{nearest_straight_down, straight_down};
use crate::observer::Observer;
use crate::task::{Reward, Task, Waypoint};
use crate::task_kind::TaskKind;
use crate::task_name::TaskName;

/// What Lift is registered with.
pub(crate) const KIND: TaskKind =
    TaskKind::new(TaskName::LIFT.as_str(), "lift a cube off a table", |_| Ok(Box::<Lift>::default()))
        .disturbed_by(&["cube_mass"]);

/// Height of the cube's centre (m) from which it counts as lifted.
const LIFTED: f64 = TABLE_HEIGHT + 0.04;
/// robosuite divides the sum of its reward terms by this, so that success earns 1.
const FULL_REWARD: f64 = 2.25;
/// Added while both pads press on the cube.
const GRASP_REWARD: f64 = 0.25;
/// Half extents of the cube are drawn from this range (m).
const CUBE_HALF: std::ops::Range<f64> = 0.020..0.022;
/// The cube's centre starts within this distance of the table's centre, in x and in y (m).
const PLACEMENT: std::ops::Range<f64> = -0.03..0.03;
/// The cube starts this far above the table and falls (m).
const DROP: f64 = 0.01;

/// The task, with the scene of the running episode.
#[derive(Default)]
pub struct Lift {
    scene: Option<lift::Lift>,
}

impl Lift {
    fn scene(&self) -> &lift::Lift {
        self.scene.as_ref().expect("reset before use")
    }
}

impl Task for Lift {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let half = Vector3::from_fn(|_, _| rng.random_range(CUBE_HALF));
        let (mut simulation, scene) = lift::Lift::simulate(plant, half);
        let (x, y) = (rng.random_range(PLACEMENT), rng.random_range(PLACEMENT));
        let yaw = rng.random_range(0.0..std::f64::consts::TAU);
        let pose = Pose::from_parts(
            Translation3::new(x, y, TABLE_HEIGHT + DROP + half.z),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw),
        );
        scene.place_cube(&mut simulation, &pose);
        self.scene = Some(scene);
        simulation
    }

    fn name(&self) -> &'static str {
        TaskName::LIFT.as_str()
    }

    fn has_gripper(&self) -> bool {
        true
    }

    fn observe(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer) {
        let cube = self.scene().cube_pose(simulation);
        let position = cube.translation.vector;
        out.position("cube_pos", position, [0.0, 0.0, TABLE_HEIGHT + 0.02], 10.0);
        out.orientation("cube_quat", &cube.rotation);
        out.position("gripper_to_cube_pos", y.pose.translation.vector - position, [0.0; 3], 10.0);
    }

    /// The cube's velocity, and whether both fingers press on the cube.
    fn observe_privileged(&self, simulation: &Simulation, _: &Measurement, out: &mut Observer) {
        let velocity = self.scene().cube_velocity(simulation);
        out.axes("cube_vel", &velocity, ["m/s, world", "rad/s, world"], [0.0; 2], [5.0, 1.0]);
        out.put("cube_grasped", f64::from(self.scene().is_grasped(simulation)), "0 or 1", 0.0, 1.0);
    }

    /// The force penalty is not taken off: the paper has it in Door and Wipe only.
    fn reward(&mut self, simulation: &Simulation, y: &Measurement, _penalty: Option<f64>) -> Reward {
        let cube = self.scene().cube_pose(simulation).translation.vector;
        let success = cube.z > LIFTED;
        let (mut reach, mut grasp, mut lifted) = (0.0, 0.0, 0.0);
        if success {
            lifted = 1.0;
        } else {
            let distance = (y.pose.translation.vector - cube).norm();
            reach = (1.0 - libm::tanh(10.0 * distance)) / FULL_REWARD;
            grasp = if self.scene().is_grasped(simulation) { GRASP_REWARD / FULL_REWARD } else { 0.0 };
        }
        Reward { terms: [("reach", reach), ("grasp", grasp), ("lifted", lifted)].into(), success }
    }

    /// Moves the open hand above the cube and down, closes, and goes up. The phase follows from the present state, so the script
    /// recovers from a lost grasp. Once the cube is grasped the goal has the hand's own place and yaw: a goal at the cube
    /// would follow the hand, with which the cube moves.
    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint {
        let cube = self.scene().cube_pose(simulation);
        let centre = cube.translation.vector;
        let tool = y.pose.translation.vector;
        // The fingers meet two faces of the cube.
        let rotation = nearest_straight_down(&(cube.rotation * Vector3::x()), 4, &y.pose.rotation);
        let sideways = (tool - centre).fixed_rows::<2>(0).norm();
        let above = (tool - centre).z;
        let turn = y.pose.rotation.angle_to(&rotation);
        let waypoint = |height: f64, grip| Waypoint {
            pose: Pose::from_parts(Translation3::new(centre.x, centre.y, height), rotation),
            grip,
            force: 0.0,
        };
        if self.scene().is_grasped(simulation) {
            let up = Translation3::new(tool.x, tool.y, TABLE_HEIGHT + 0.12);
            Waypoint {
                pose: Pose::from_parts(up, straight_down(&(y.pose.rotation * Vector3::x()))),
                grip: 1.0,
                force: 0.0,
            }
        } else if sideways < 0.012 && above < 0.012 {
            waypoint(centre.z, 1.0)
        } else if sideways < 0.012 && turn < 0.15 {
            waypoint(centre.z, -1.0)
        } else {
            waypoint(centre.z + 0.07, -1.0)
        }
    }

    fn achievement(&self) -> &'static str {
        "lifts the cube"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.62, -0.75, 1.35], target: [-0.12, 0.0, 0.98], field_of_view: 0.76 }
    }
}
