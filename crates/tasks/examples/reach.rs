//! A task in one file: the hand reaches a point above a table. `cargo run --release -p tasks --example reach`

use aforce::{Measurement, Pose, Vector3};
use nalgebra::Translation3;
use physics::camera::{Camera, Decal};
use physics::gripper::{GRIP_SITE, add_gripper};
use physics::scene::Scene;
use physics::scenes::{Table, add_fixtures};
use physics::{Plant, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, Observer, Reward, Task, Waypoint, play};

/// Height of the table top (m).
const TABLE: f64 = 0.8;
/// Nearer than this counts as reached (m).
const REACHED: f64 = 0.02;

/// The task, with the target point of the running episode (m, world).
#[derive(Default)]
struct Reach {
    target: Vector3,
}

impl Task for Reach {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let mut within = |range: std::ops::Range<f64>| rng.random_range(range);
        self.target = Vector3::new(within(-0.1..0.1), within(-0.2..0.2), TABLE + within(0.1..0.3));
        let mut scene = Scene::default();
        let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, TABLE], friction: 1.0 };
        let base = add_fixtures(&mut scene, &plant.robot, &table);
        let wrist = plant.robot.add_to(&mut scene, base);
        let gripper = add_gripper(&mut scene, &plant.robot, wrist);
        Simulation::new(&scene, gripper, GRIP_SITE, plant)
    }

    fn name(&self) -> &'static str {
        "reach"
    }

    fn has_gripper(&self) -> bool {
        false // The gripper is there and observed, but no action moves it.
    }

    fn observe(&self, _: &Simulation, y: &Measurement, out: &mut Observer) {
        // Name, value, typical value, one over the typical deviation.
        out.position("target_to_eef", self.target - y.pose.translation.vector, [0.0; 3], 5.0);
    }

    fn reward(&mut self, _: &Simulation, y: &Measurement, _penalty: Option<f64>) -> Reward {
        let distance = (self.target - y.pose.translation.vector).norm();
        Reward { terms: [("near", 1.0 - libm::tanh(10.0 * distance))].into(), success: distance < REACHED }
    }

    fn expert(&self, _: &Simulation, y: &Measurement) -> Waypoint {
        Waypoint { pose: Pose::from_parts(Translation3::from(self.target), y.pose.rotation), grip: 0.0, force: 0.0 }
    }

    fn achievement(&self) -> &'static str {
        "reaches the point"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.95, -0.95, 1.5], target: [-0.22, 0.0, 1.04], field_of_view: 0.76 }
    }

    /// A disc on the table straight below the point.
    fn decals(&self) -> Vec<Decal> {
        vec![Decal { centre: [self.target.x, self.target.y, TABLE], radius: REACHED, color: [40, 120, 200] }]
    }
}

/// Success, and time to it (s), of an episode of the script.
fn episode(seed: u64) -> (bool, Option<f64>) {
    let mut env = Env::with_task(Box::new(Reach::default()), EnvConfig::default(), 0).expect("the default is allowed");
    let outcome = play(&mut env, Env::expert_action, seed, |_, _| std::ops::ControlFlow::Continue(())).outcome();
    (outcome.flag("success_held"), outcome.number("time_to_success_s"))
}

fn main() {
    for seed in 0..5 {
        println!("{:?}", episode(seed));
    }
}

#[test]
fn the_script_reaches_every_point() {
    assert!((0..5).all(|seed| episode(seed).0));
}
