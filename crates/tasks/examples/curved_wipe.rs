//! A task whose surface is curved: a ball wipes a lying cylinder across its back, pressed along the normal where it touches.
//! `cargo run --release -p tasks --example curved_wipe` prints how well the force was held, with that normal as contact axis and with "up".

use aforce::{Measurement, Pose, Vector3, Wrench};
use nalgebra::{Translation3, UnitQuaternion, UnitVector3};
use physics::camera::Camera;
use physics::robots::tool_pose;
use physics::scene::{Body, Geom, Inertial, Joint, Role, Scene, Shape, at, between};
use physics::scenes::{Table, add_fixtures};
use physics::wiping_tool::facing_down;
use physics::{Plant, Simulation};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, Observer, Reward, Task, Waypoint};

/// Radius of the cylinder (m), and a point of its axis, which runs along x (m, world).
const RADIUS: f64 = 0.15;
const AXIS: [f64; 3] = [-0.05, 0.0, 0.78];
/// Radius of the ball (m).
const BALL: f64 = 0.02;
/// The controlled point is the ball's centre (m, tool frame).
const CENTRE: [f64; 3] = [0.0, 0.0, 0.015];
/// Force to press with (N).
const FORCE: f64 = 15.0;
/// Angles that the tool has to reach in turn (rad from the top, positive towards +y).
const LEGS: [f64; 4] = [0.7, -0.7, 0.7, 0.0];
/// The script's goal lies `AHEAD` (rad) ahead of a tool that has the wanted `SPEED` (rad/s), and `AHEAD_PER_SPEED` (s) farther for each
/// rad/s that is missing. The farther goal overcomes friction: AFORCE's softest spring, 300 N/m, pulls with 6 N at 0.12 rad, of which
/// a friction coefficient of 0.3 takes 4.5 N. With 0.12 rad alone the tool crept at 1 cm/s.
const AHEAD: f64 = 0.12;
const SPEED: f64 = 0.4;
const AHEAD_PER_SPEED: f64 = 0.2;
/// An angle of the path counts as reached within this distance (rad).
const NEAR: f64 = 0.03;

struct CurvedWipe {
    friction: f64,
    /// Whether the controller is told the normal of the cylinder; else "up", as on a table.
    normal: bool,
    /// Number of the angles in [`LEGS`] that have been reached.
    done: usize,
}

fn force(wrench: &Wrench) -> Vector3 {
    wrench.fixed_rows::<3>(0).into()
}

/// From the cylinder's axis to the tool, at a right angle to the axis (m).
fn out(y: &Measurement) -> Vector3 {
    let from_axis = y.pose.translation.vector - Vector3::from(AXIS);
    Vector3::new(0.0, from_axis.y, from_axis.z)
}

/// Angle of the tool about the cylinder's axis (rad from the top, positive towards +y).
fn angle(y: &Measurement) -> f64 {
    libm::atan2(out(y).y, out(y).z)
}

/// Angular speed of the tool about the cylinder's axis (rad/s, positive towards +y).
fn speed(y: &Measurement) -> f64 {
    let out = out(y);
    (out.z * y.twist[1] - out.y * y.twist[2]) / out.norm_squared()
}

impl Task for CurvedWipe {
    fn reset(&mut self, plant: &Plant, _: &mut ChaCha8Rng) -> Simulation {
        self.done = 0;
        let mut scene = Scene::default();
        let table = Table { size: [0.8, 0.8, 0.05], top: [0.0, 0.0, AXIS[2] - RADIUS], friction: 1.0 };
        let base = add_fixtures(&mut scene, &plant.robot, &table);
        let geom = |name: &str, shape, pose, friction, role| Geom {
            name: name.into(),
            shape,
            pose,
            friction,
            role,
            color: [52, 120, 190],
        };
        let end = |x: f64| [AXIS[0] + x, AXIS[1], AXIS[2]];
        let (pose, half_length) = between(end(-0.2), end(0.2));
        let cylinder = Shape::Cylinder { half_length, radius: RADIUS };
        scene.add_static("cylinder", vec![geom("cylinder", cylinder, pose, self.friction, Role::Fixture)]);
        let wrist = plant.robot.add_to(&mut scene, base);
        // The capsule's lower end is the ball.
        let [x, y, z] = CENTRE;
        let finger = Shape::Capsule { half_length: z / 2.0, radius: BALL };
        let tool = scene.add(Body {
            name: "ball".into(),
            parent: Some(wrist),
            pose: tool_pose(BALL),
            joint: Joint::Fixed,
            inertial: Inertial::diagonal(0.03, [0.0; 3], [1e-4; 3]),
            geoms: vec![geom("ball", finger, at([x, y, z / 2.0]), 0.0, Role::Tool)],
        });
        Simulation::new(&scene, tool, CENTRE, plant)
    }

    fn name(&self) -> &'static str {
        "curved wipe"
    }

    fn has_gripper(&self) -> bool {
        false
    }

    /// Away from the cylinder's axis, through the ball.
    fn contact_normal(&self, _: &Simulation, y: &Measurement) -> UnitVector3<f64> {
        if self.normal { UnitVector3::new_normalize(out(y)) } else { Vector3::z_axis() }
    }

    fn observe(&self, _: &Simulation, y: &Measurement, observer: &mut Observer) {
        observer.put("angle", angle(y), "rad", 0.0, 1.0);
        observer.put("height", out(y).norm() - RADIUS - BALL, "m", 0.0, 20.0);
        observer.put("next_end", LEGS.get(self.done).copied().unwrap_or(0.0), "rad", 0.0, 1.0);
    }

    fn reward(&mut self, simulation: &Simulation, y: &Measurement, _penalty: Option<f64>) -> Reward {
        let reached = LEGS.get(self.done).is_some_and(|end| (angle(y) - end).abs() < NEAR);
        if reached && simulation.contact().touching {
            self.done += 1;
        }
        let wiped = self.done as f64 / LEGS.len() as f64;
        Reward { terms: [("wiped", wiped)].into(), success: self.done == LEGS.len() }
    }

    /// Moves above the top, down until the ball presses, then to each angle of the path.
    fn expert(&self, _: &Simulation, y: &Measurement) -> Waypoint {
        let pressing = force(&y.wrench).norm() > 1.0 || self.done > 0;
        let at = |angle: f64, height: f64| {
            let radius = RADIUS + BALL + height;
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let place = Vector3::from(AXIS) + radius * Vector3::new(0.0, sin, cos);
            Pose::from_parts(Translation3::from(place), facing_down())
        };
        let level: UnitQuaternion<f64> = facing_down();
        let over = angle(y).abs() < 0.05 && y.pose.rotation.angle_to(&level) < 0.1;
        if !pressing && !over {
            return Waypoint { pose: at(0.0, 0.03), grip: 0.0, force: 0.0 };
        }
        let end = LEGS.get(self.done).copied().unwrap_or(0.0);
        let way = (end - angle(y)).signum();
        let ahead = (AHEAD + AHEAD_PER_SPEED * (SPEED - way * speed(y))).max(0.0);
        let next = if pressing { angle(y) + ahead * way } else { 0.0 };
        Waypoint { pose: at(next, 0.0), grip: 0.0, force: FORCE }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.done as f64 / LEGS.len() as f64)
    }

    fn achievement(&self) -> &'static str {
        "wipes the cylinder's back"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.9, -0.8, 1.35], target: [-0.05, 0.0, 0.9], field_of_view: 0.76 }
    }
}

/// What was measured while the script wiped, from half a second after the first touch on.
struct Measured {
    /// Share of the path's angles that the tool reached.
    done: f64,
    /// Share of the control samples in which the ball touched the cylinder.
    contact: f64,
    /// Mean force along the true normal of each action (N), and the place at its end (rad).
    actions: Vec<(f64, f64)>,
}

impl Measured {
    /// Mean force (N) of the actions at whose angle from the top (rad) `counts` is true.
    fn mean(&self, counts: impl Fn(f64) -> bool) -> f64 {
        let forces: Vec<f64> =
            self.actions.iter().filter(|(_, place)| counts(place.abs())).map(|(force, _)| *force).collect();
        forces.iter().sum::<f64>() / forces.len() as f64
    }

    /// Share of the actions whose force is within 20 % of [`FORCE`].
    fn within(&self) -> f64 {
        let near = self.actions.iter().filter(|(force, _)| (force - FORCE).abs() < 0.2 * FORCE);
        near.count() as f64 / self.actions.len() as f64
    }
}

fn measure(space: &str, friction: f64, normal: bool) -> Measured {
    let task = CurvedWipe { friction, normal, done: 0 };
    let config = EnvConfig { space: space.parse().expect("a built-in space"), ..EnvConfig::default() };
    let mut env = Env::with_task(Box::new(task), config, 0).expect("the default is allowed");
    env.reset(Some(1));
    let (mut since_touch, mut samples, mut touching, mut actions) = (0, 0u32, 0u32, vec![]);
    loop {
        let (mut sum, mut count, mut touched, mut place) = (0.0, 0u32, 0u32, 0.0);
        let step = env.step_watched(&env.expert_action(), |sample| {
            let (y, contact) = (sample.simulation.measure(), sample.simulation.contact());
            sum += force(&contact.filtered).dot(&out(&y).normalize());
            place = angle(&y);
            count += 1;
            touched += u32::from(contact.touching);
        });
        since_touch += u32::from(since_touch > 0 || touched > 0);
        // The first ten actions of contact, half a second, are the landing.
        if since_touch > 10 {
            samples += count;
            touching += touched;
            actions.push((sum / f64::from(count), place));
        }
        if step.success || step.terminated || step.truncated {
            break;
        }
    }
    let done = env.task().progress().expect("it tells");
    Measured { done, contact: f64::from(touching) / f64::from(samples), actions }
}

fn main() {
    println!("space          friction  axis    path  contact  N: all   top  flanks  within 20 %");
    for space in ["aforce-force", "low-force", "osc-force"] {
        for friction in [0.03, 0.3] {
            for normal in [true, false] {
                let m = measure(space, friction, normal);
                let axis = if normal { "normal" } else { "up" };
                // Within 10 degrees of the top, and beyond 30.
                let forces = [m.mean(|_| true), m.mean(|place| place < 0.17), m.mean(|place| place > 0.52)];
                let written = |force: f64| if force.is_nan() { "-".into() } else { format!("{force:.1}") };
                let [all, top, flanks] = forces.map(written);
                let (path, contact, within) = (100.0 * m.done, 100.0 * m.contact, 100.0 * m.within());
                println!(
                    "{space:<14} {friction:<9} {axis:<6} {path:>4.0} % {contact:>5.1} % {all:>8} {top:>5} {flanks:>7} {within:>10.0} %"
                );
            }
        }
    }
}

/// With the surface normal as contact axis the force stays near its set value over the whole back, at low and at high friction. With "up"
/// the tool does not finish the path, or holds the force in fewer actions.
#[test]
fn the_force_follows_the_curve() {
    for friction in [0.03, 0.3] {
        let followed = measure("aforce-force", friction, true);
        assert!(followed.done == 1.0 && followed.contact > 0.95 && followed.within() > 0.95, "friction {friction}");
        for place in [|place: f64| place < 0.17, |place: f64| place > 0.52] {
            assert!((followed.mean(place) - FORCE).abs() < 0.1 * FORCE, "friction {friction}");
        }
        let up = measure("aforce-force", friction, false);
        assert!(up.done < 1.0 || up.within() < followed.within() - 0.05, "friction {friction}");
    }
}
