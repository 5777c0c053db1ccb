//! A task in one file: grasp the knob of a drawer from above and pull it open.

use aforce::{ConfigError, Measurement, Pose, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use physics::camera::Camera;
use physics::gripper::{GRIP_SITE, add_gripper};
use physics::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at};
use physics::scenes::{Table, add_fixtures};
use physics::{Plant, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tasks::{Change, EnvConfig, Observer, OwnDisturbance, Reward, Task, Waypoint, nearest_straight_down};

/// Height of the table top (m).
const TABLE: f64 = 0.8;
/// Half extents of the drawer's box (m): x is the direction in which it moves.
const BOX: [f64; 3] = [0.08, 0.08, 0.04];
/// Half extents of the knob on top of it (m).
const KNOB: [f64; 3] = [0.008, 0.025, 0.03];
/// Centre of the knob in the drawer's frame (m).
const KNOB_AT: [f64; 3] = [-0.06, 0.0, BOX[2] + KNOB[2]];
/// Opening from which the drawer counts as open, and how far it goes (m).
const OPEN: f64 = 0.1;
const TRAVEL: f64 = 0.15;

/// The task's own disturbances: `--set env.disturbance.own.slide_friction=[0.5,2]` draws a factor on the slide's friction.
pub const DISTURBANCES: &[OwnDisturbance] =
    &[OwnDisturbance { key: "slide_friction", change: Change::JointFriction("slide"), allowed: [0.0, 10.0] }];

/// Indices in the scene of the running episode: body of the drawer, its joint, shape of the knob, shapes of the finger pads.
#[derive(Default)]
struct Drawer {
    drawer: usize,
    slide: usize,
    knob: usize,
    pads: [usize; 2],
}

/// The task; an option of its own would be read here with `config.own_options()`.
pub fn create(_: &EnvConfig) -> Result<Box<dyn Task>, ConfigError> {
    Ok(Box::<Drawer>::default())
}

/// A box with its half extents and its centre (m).
fn block(name: &str, half: [f64; 3], centre: [f64; 3], role: Role, color: [u8; 3]) -> Geom {
    Geom { name: name.into(), shape: Shape::Box(half.into()), pose: at(centre), friction: 1.0, role, color }
}

impl Drawer {
    /// Pose of the knob's centre (world); its -x is the direction in which the drawer opens.
    fn knob_pose(&self, simulation: &Simulation) -> Pose {
        simulation.body_pose(self.drawer) * at(KNOB_AT)
    }

    /// How far the drawer is open (m).
    fn opening(&self, simulation: &Simulation) -> f64 {
        simulation.joint(self.slide).0
    }

    /// Whether both finger pads press on the knob.
    fn is_grasped(&self, simulation: &Simulation) -> bool {
        self.pads.iter().all(|&pad| simulation.touching(pad, self.knob))
    }
}

impl Task for Drawer {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let mut within = |range: std::ops::Range<f64>| rng.random_range(range);
        let (x, y, yaw) = (within(0.0..0.04), within(-0.05..0.05), within(-0.2..0.2));
        let mut scene = Scene::default();
        let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, TABLE], friction: 1.0 };
        let base = add_fixtures(&mut scene, &plant.robot, &table);
        let wrist = plant.robot.add_to(&mut scene, base);
        let gripper = add_gripper(&mut scene, &plant.robot, wrist);
        // Objects collide with fixtures, so the box keeps 5 mm from the table and from the walls beside and behind it.
        let wood = |name: &str, half, centre| block(name, half, centre, Role::Fixture, [120, 96, 72]);
        let place = Pose::from_parts(
            Translation3::new(x, y, TABLE + BOX[2] + 0.005),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw),
        );
        let case = scene.add(Body {
            name: "case".into(),
            parent: None,
            pose: place,
            joint: Joint::Fixed,
            inertial: Inertial::NONE,
            geoms: vec![
                wood("left_wall", [0.08, 0.005, 0.04], [0.0, 0.09, -0.003]),
                wood("right_wall", [0.08, 0.005, 0.04], [0.0, -0.09, -0.003]),
                wood("back_wall", [0.005, 0.095, 0.04], [0.09, 0.0, -0.003]),
            ],
        });
        self.drawer = scene.add(Body {
            name: "drawer".into(),
            parent: Some(case),
            pose: Pose::identity(),
            joint: Joint::Slide(Axis {
                name: "slide".into(),
                direction: -Vector3::x_axis(),
                range: [0.0, TRAVEL],
                damping: 5.0,
                friction: 3.0,
                armature: 0.0,
                spring: 0.0,
                rest: 0.0,
                stop: Stop::Spring { stiffness: 20_000.0, damping: 200.0 },
            }),
            inertial: Inertial::solid_box(BOX.into(), 500.0),
            geoms: vec![
                block("box", BOX, [0.0; 3], Role::Object, [178, 142, 104]),
                block("knob", KNOB, KNOB_AT, Role::Object, [196, 58, 49]),
            ],
        });
        self.slide = scene.joint("slide");
        self.knob = scene.geom("knob");
        self.pads = [scene.geom("left_pad"), scene.geom("right_pad")];
        Simulation::new(&scene, gripper, GRIP_SITE, plant)
    }

    fn name(&self) -> &'static str {
        "drawer"
    }

    fn has_gripper(&self) -> bool {
        true
    }

    fn observe(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer) {
        let knob = self.knob_pose(simulation);
        let position = knob.translation.vector;
        // Name, value, typical value, one over the typical deviation; `put` takes the unit after the value.
        out.position("knob_pos", position, [-0.1, 0.0, TABLE + 0.1], 10.0);
        out.orientation("knob_quat", &knob.rotation);
        out.position("knob_to_eef_pos", position - y.pose.translation.vector, [0.0; 3], 10.0);
        out.put("opening", self.opening(simulation), "m", 0.05, 20.0);
    }

    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward {
        let opening = self.opening(simulation);
        let success = opening > OPEN;
        let distance = (self.knob_pose(simulation).translation.vector - y.pose.translation.vector).norm();
        let (mut reach, mut grasp, mut open) = (0.0, 0.0, 1.0);
        if !success {
            reach = 0.25 * (1.0 - libm::tanh(10.0 * distance));
            grasp = if self.is_grasped(simulation) { 0.25 } else { 0.0 };
            open = 0.5 * (opening / OPEN).clamp(0.0, 1.0);
        }
        let penalty = -0.03 * penalty.unwrap_or(0.0);
        Reward { terms: [("reach", reach), ("grasp", grasp), ("open", open), ("penalty", penalty)].into(), success }
    }

    /// Above the knob with open fingers, down, close, pull. The phase follows from the present state, so the script recovers from a
    /// lost grasp.
    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint {
        let knob = self.knob_pose(simulation);
        let (centre, tool) = (knob.translation.vector, y.pose.translation.vector);
        // The fingers open along x of the tool: they meet the knob's two broad faces.
        let rotation = nearest_straight_down(&(knob.rotation * Vector3::x()), 2, &y.pose.rotation);
        let sideways = (tool - centre).xy().norm();
        let turn = y.pose.rotation.angle_to(&rotation);
        let at = |point: Vector3, grip| Waypoint {
            pose: Pose::from_parts(Translation3::from(point), rotation),
            grip,
            force: 0.0,
        };
        if self.opening(simulation) > OPEN + 0.02 {
            at(tool, 1.0)
        } else if self.is_grasped(simulation) {
            at(centre - knob.rotation * Vector3::new(0.06, 0.0, 0.0), 1.0)
        } else if sideways < 0.012 && tool.z - centre.z < 0.012 {
            at(centre, 1.0)
        } else if sideways < 0.012 && turn < 0.15 {
            at(centre, -1.0)
        } else {
            at(centre + Vector3::new(0.0, 0.0, 0.09), -1.0)
        }
    }

    fn achievement(&self) -> &'static str {
        "opens the drawer"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.55, -0.85, 1.4], target: [-0.1, 0.0, 0.95], field_of_view: 0.76 }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use tasks::{Env, play};

    use super::*;

    #[test]
    fn the_script_opens_every_drawer() {
        for space in ["aforce", "osc"] {
            let config = EnvConfig { space: space.parse().unwrap(), horizon: 300, ..EnvConfig::default() };
            let mut env = Env::with_task(create(&config).unwrap(), config, 0).unwrap();
            for seed in 0..5 {
                let outcome = play(&mut env, Env::expert_action, seed, |_, _| ControlFlow::Continue(())).outcome();
                assert!(outcome.flag("success_held"), "{space}, seed {seed}: {outcome:?}");
            }
        }
    }
}
