//! Door: turn a handle and pull the door open (robosuite 1.4 `Door`).

use std::f64::consts::{FRAC_PI_2, PI};

use aforce::{Measurement, Pose, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use physics::camera::Camera;
use physics::scenes::door::{self, MIDDLE};
use physics::{Plant, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::normalisation::normalisation;
use crate::observer::Observer;
use crate::task::{Reward, Task, Waypoint};
use crate::task_kind::TaskKind;
use crate::task_name::TaskName;

/// What Door is registered with.
pub(crate) const KIND: TaskKind =
    TaskKind::new(TaskName::DOOR.as_str(), "turn a handle and pull a door open", |config| {
        Ok(Box::new(Door::new(config.horizon)))
    })
    .disturbed_by(&["hinge_damping", "hinge_spring"]);

/// Opening (rad) from which the door counts as open; it stops at 0.4.
const OPEN: f64 = 0.3;
/// Offset of the door's root from its middle place, in x and in y (m).
const PLACEMENT: std::ops::Range<f64> = -0.01..0.01;
/// Yaw of the door's root against its middle place (rad).
const TURN: std::ops::Range<f64> = -0.125..0.125;

/// Handle angle (rad) from which the expert pulls; the latch releases at about 1.2.
const CLEAR: f64 = 1.25;

/// The task, with the scene of the running episode.
pub struct Door {
    /// Factor on the force penalty, the same as in Wipe, whose rewards are normalised to about 1. Unscaled, one action at 400 N
    /// would cost as much as 20 actions with an open door earn, and the learner would keep away from the door.
    penalty_scale: f64,
    scene: Option<door::Door>,
}

impl Door {
    /// For episodes of `horizon` actions.
    pub fn new(horizon: u32) -> Self {
        Door { penalty_scale: normalisation(horizon), scene: None }
    }

    fn scene(&self) -> &door::Door {
        self.scene.as_ref().expect("reset before use")
    }
}

impl Task for Door {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let (x, y) = (rng.random_range(PLACEMENT), rng.random_range(PLACEMENT));
        let yaw = rng.random_range(TURN);
        let root = door::root([MIDDLE[0] + x, MIDDLE[1] + y, MIDDLE[2] + yaw]);
        let (simulation, scene) = door::Door::simulate(plant, &root);
        self.scene = Some(scene);
        simulation
    }

    fn name(&self) -> &'static str {
        TaskName::DOOR.as_str()
    }

    fn has_gripper(&self) -> bool {
        true
    }

    fn observe(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer) {
        let scene = self.scene();
        let (door, handle) = (scene.centre(simulation), scene.handle_pose(simulation).translation.vector);
        let tool = y.pose.translation.vector;
        out.position("door_pos", door, [-0.2, -0.33, 1.1], 20.0);
        out.position("handle_pos", handle, [-0.14, -0.22, 1.03], 10.0);
        out.position("door_to_eef_pos", door - tool, [-0.08, -0.2, 0.05], 10.0);
        out.position("handle_to_eef_pos", handle - tool, [0.0; 3], 10.0);
        out.put("hinge_qpos", scene.opening(simulation), "rad", 0.15, 5.0);
        out.put("handle_qpos", scene.handle_angle(simulation), "rad", 0.5, 1.0);
    }

    /// How fast hinge and handle turn, and whether both fingers press on the lever.
    fn observe_privileged(&self, simulation: &Simulation, _: &Measurement, out: &mut Observer) {
        let [hinge, handle] = self.scene().speeds(simulation);
        out.put("hinge_qvel", hinge, "rad/s", 0.0, 5.0);
        out.put("handle_qvel", handle, "rad/s", 0.0, 1.0);
        out.put("handle_grasped", f64::from(self.scene().is_grasped(simulation)), "0 or 1", 0.0, 1.0);
    }

    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward {
        let (scene, penalty) = (self.scene(), self.penalty_scale * penalty.unwrap_or(0.0));
        let success = scene.opening(simulation) > OPEN;
        let (mut reach, mut handle, mut open) = (0.0, 0.0, 0.0);
        if success {
            open = 1.0;
        } else {
            let distance = (scene.handle_pose(simulation).translation.vector - y.pose.translation.vector).norm();
            reach = 0.25 * (1.0 - libm::tanh(10.0 * distance));
            handle = 0.25 * (scene.handle_angle(simulation).abs() / FRAC_PI_2).min(1.0);
        }
        Reward { terms: [("reach", reach), ("handle", handle), ("open", open), ("penalty", -penalty)].into(), success }
    }

    /// Moves the open hand in front of the lever and onto it, closes, turns and pulls. The phase follows from the present state, so
    /// the script recovers from a lost grasp. While turning and pulling, the goal lies ahead of the lever on the lever's own path.
    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint {
        let scene = self.scene();
        let (opening, angle) = (scene.opening(simulation), scene.handle_angle(simulation));
        if opening > 0.36 {
            // The hinge's dry friction keeps the door open.
            return Waypoint { pose: y.pose, grip: 1.0, force: 0.0 };
        }
        if scene.is_grasped(simulation) {
            // The goal of the pull lies far ahead, because a soft arm spends most of its force on holding the handle's spring.
            let pull = if angle > CLEAR || opening > 0.05 { 0.1 } else { 0.0 };
            let turn = (CLEAR + 0.15 - angle).clamp(-0.15, 0.15);
            return Waypoint { pose: grasp_pose(&scene.moved_handle(simulation, pull, turn)), grip: 1.0, force: 10.0 };
        }
        let lever = scene.handle_pose(simulation);
        let grasp = grasp_pose(&lever);
        let seen = (grasp.inverse() * y.pose).translation.vector;
        let (sideways, ahead) = (seen.fixed_rows::<2>(0).norm(), -seen.z);
        let turn = y.pose.rotation.angle_to(&grasp.rotation);
        let waypoint = |pose, grip| Waypoint { pose, grip, force: 0.0 };
        let in_front = grasp * Translation3::new(0.0, 0.0, -0.06);
        if turn > 1.8 {
            // First to an orientation half way, from which the shortest rotation to the grasp is the right one.
            let half_way = approach_rotation(&lever, 0.8, 0.0);
            waypoint(Pose::from_parts(in_front.translation, half_way), -1.0)
        } else if sideways < 0.012 && ahead < 0.008 && turn < 0.15 {
            waypoint(grasp, 1.0)
        } else if sideways < 0.012 && turn < 0.35 {
            waypoint(grasp, -1.0)
        } else {
            waypoint(in_front, -1.0)
        }
    }

    fn achievement(&self) -> &'static str {
        "opens the door"
    }

    /// From the side of the handle, past the arm, which comes from the right.
    fn camera(&self) -> Camera {
        Camera { eye: [0.75, 0.42, 1.35], target: [-0.12, -0.17, 1.02], field_of_view: 0.76 }
    }
}

/// Tool pose that grasps the lever from the front, fingers above and below it. The hand is not quite level, which keeps the
/// joints further from their limits.
fn grasp_pose(lever: &Pose) -> Pose {
    Pose::from_parts(lever.translation, approach_rotation(lever, 1.45, -FRAC_PI_2))
}

/// Rotation of the tool (world) that approaches the lever, for a tilt and a twist (rad). At tilt 0 the tool points
/// down, at pi/2 into the panel. At twist -pi/2 its y axis lies along the lever.
fn approach_rotation(lever: &Pose, tilt: f64, twist: f64) -> UnitQuaternion<f64> {
    lever.rotation
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI + tilt)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), twist)
}
