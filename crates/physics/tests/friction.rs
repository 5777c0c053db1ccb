//! A cube slips or stays as Coulomb's law says, and slips with the acceleration that follows from the law: between the finger
//! pads and on a slope, near the critical coefficient of friction, along the edges and across. A grasped cube stays where it is
//! in the hand while the arm shakes it.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use aforce::{JointVector, Vector3};
use approx::assert_relative_eq;
use nalgebra::{Unit, UnitQuaternion};
use physics::gripper::GRIP_SITE;
use physics::model::GRAVITY;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scene::{Geom, Inertial, Role, Scene, Shape, at};
use physics::scenes::lift::{self, Lift, TABLE_HEIGHT};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

const CUBE_HALF: f64 = 0.021;
/// Heavy enough (kg) that the fingers hold it with coefficients above 0.26.
const CUBE_MASS: f64 = 1.0;
const DT: f64 = 0.002;
/// Coefficients of friction over the critical one.
const RATIOS: [f64; 5] = [0.90, 0.98, 1.00, 1.02, 1.10];

/// The Lift scene with a heavier cube. A pair takes the larger of two coefficients of friction: the cube's is 0.
struct Bench {
    simulation: Simulation,
    cube: usize,
    /// Where the arm is held.
    q: JointVector,
    grip: f64,
}

/// What a cube did after it was let go, for 5 s or until it had come 5 mm.
struct Motion {
    /// How far it came (m).
    slip: f64,
    /// Its mean acceleration (m/s2), from the first millimetre on if it came as far.
    acceleration: f64,
    /// Mean force on the left pad meanwhile (N, world axes).
    on_pad: Vector3,
}

impl Motion {
    /// A cube slides with the `expected` acceleration (m/s2) below the critical coefficient of friction and stays above
    /// it; `ratio` is the coefficient over the critical one. At the critical one it may do either.
    fn obeys_coulomb(&self, case: &str, ratio: f64, expected: f64) {
        let (slip, acceleration) = (1e3 * self.slip, self.acceleration);
        println!(
            "{case}, {ratio:.2}: {slip:.5} mm, {acceleration:.5} m/s2 ({expected:.5}), {:.3?} N",
            self.on_pad.y.abs()
        );
        if ratio < 1.0 {
            assert!(slip >= 5.0, "{case}: stays at {ratio} of the critical friction");
            assert_relative_eq!(acceleration, expected, max_relative = 0.01);
        } else if ratio > 1.0 {
            assert!(slip < 0.05, "{case}: slips by {slip} mm at {ratio} of the critical friction");
        }
    }
}

impl Bench {
    /// `change` turns the Lift scene into the tested one.
    fn new(q: JointVector, change: impl FnOnce(&mut Scene)) -> Bench {
        let robot = RobotName::Robosuite.robot();
        let (mut scene, gripper) = lift::scene(&robot, Vector3::repeat(CUBE_HALF));
        let cube = scene.body("cube");
        let density = CUBE_MASS / (2.0 * CUBE_HALF).powi(3);
        scene.bodies[cube].inertial = Inertial::solid_box(Vector3::repeat(CUBE_HALF), density);
        scene.bodies[cube].geoms[0].friction = 0.0;
        change(&mut scene);
        let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
        let mut simulation = Simulation::new(&scene, gripper, GRIP_SITE, &plant);
        simulation.reset(&q);
        Bench { simulation, cube, q, grip: -1.0 }
    }

    fn step(&mut self) {
        let y = self.simulation.measure();
        let tau = y.bias + y.mass * ((self.q - y.q) * 2500.0 - y.qd * 100.0);
        self.simulation.step(&tau, self.grip).unwrap();
    }

    fn position(&self) -> Vector3 {
        self.simulation.body_pose(self.cube).translation.vector
    }

    fn let_go(mut self) -> Motion {
        let start = self.position();
        let (mut slips, mut speeds, mut forces) = (vec![], vec![], vec![]);
        while slips.last().is_none_or(|&slip| slip < 0.005) && slips.len() < 2500 {
            self.step();
            slips.push((self.position() - start).norm());
            speeds.push(self.simulation.body_velocity(self.cube).fixed_rows::<3>(0).norm());
            forces.push(self.simulation.contact().raw.fixed_rows::<3>(0).into_owned());
        }
        let (first, last) = (slips.iter().position(|&slip| slip > 0.001).unwrap_or(0), slips.len() - 1);
        let steps = (last - first) as f64;
        Motion {
            slip: slips[last],
            acceleration: (speeds[last] - speeds[first]) / (steps * DT),
            on_pad: forces[first + 1..].iter().sum::<Vector3>() / steps,
        }
    }
}

/// A cube that is let go when the pads hold it in the middle of their faces. The fingers point `tilt` (rad) away from
/// straight down, so that the weight pulls along the pads' edges or across; the axis of the grip stays level. Only the
/// left pad counts as beyond the wrist: the contact reading is the force on it.
fn held(tilt: f64, friction: f64) -> Motion {
    let mut q = JointVector::from(HOME);
    q[5] = q[1] - q[3] - tilt;
    let mut middle = 0.0;
    let mut bench = Bench::new(q, |scene| {
        for (side, role) in [("left", Role::Pad), ("right", Role::Link(7))] {
            let (finger, tip) = (scene.body(&format!("{side}_finger")), scene.body(&format!("{side}_tip")));
            let in_gripper = scene.bodies[finger].pose * scene.bodies[tip].pose;
            let pad = &mut scene.bodies[tip].geoms[0];
            (pad.friction, pad.role) = (friction, role);
            middle = (in_gripper * pad.pose).translation.z - GRIP_SITE[2];
        }
    });
    for step in 0..1000 {
        bench.grip = if step < 250 { -1.0 } else { 1.0 };
        let site = bench.simulation.measure().pose;
        bench.simulation.place(bench.cube, &(site * at([0.0, 0.0, middle])));
        bench.step();
    }
    bench.let_go()
}

/// The critical coefficient is m g / 2 N. The motors press with 20 N, of which the dry friction of the finger joints
/// takes 1 N as they close: N is what the pad measures when nothing slips, 19.0 N. A cube that slides does so with
/// g - 2 mu N / m within 0.02 %, N then being the same: at the critical coefficient itself it creeps, by 1 to 3 mm in
/// 5 s. Above it a cube moves by less than 1 um in 5 s.
#[test]
fn a_held_cube_slips_where_coulomb_says() {
    for tilt in [0.0, FRAC_PI_4, FRAC_PI_2] {
        let critical = CUBE_MASS * GRAVITY / (2.0 * held(tilt, 1.0).on_pad.y.abs());
        for ratio in RATIOS {
            let motion = held(tilt, ratio * critical);
            let expected = GRAVITY - 2.0 * ratio * critical * motion.on_pad.y.abs() / CUBE_MASS;
            motion.obeys_coulomb(&format!("held at {tilt:.2} rad"), ratio, expected);
        }
    }
}

/// On a plane that is turned by [`SLOPE`] about a level axis, `heading` (rad) away from an edge of plane and cube.
fn on_slope(heading: f64, friction: f64) -> Motion {
    let axis = Unit::new_normalize(Vector3::new(heading.cos(), heading.sin(), 0.0));
    let pose = at([0.0, 0.0, 3.0]) * UnitQuaternion::from_axis_angle(&axis, SLOPE);
    let half = Vector3::new(0.2, 0.2, 0.02);
    let mut bench = Bench::new(HOME.into(), |scene| {
        let (name, shape) = (String::from("slope"), Shape::Box(half));
        scene.add_static("slope", vec![Geom { name, shape, pose, friction, role: Role::Fixture, color: [0; 3] }]);
    });
    bench.simulation.place(bench.cube, &(pose * at([0.0, 0.0, half.z + CUBE_HALF])));
    bench.let_go()
}

const SLOPE: f64 = 0.4;

/// The critical coefficient is tan(slope). The acceleration is g sin(slope) (1 - ratio) within 0.01 %; above the
/// critical coefficient a cube moves by 0.02 mm as it settles, at the critical one it keeps the speed that it settled
/// with.
#[test]
fn a_cube_on_a_slope_slips_where_coulomb_says() {
    for heading in [0.0, FRAC_PI_4] {
        for ratio in RATIOS {
            let expected = GRAVITY * SLOPE.sin() * (1.0 - ratio);
            on_slope(heading, ratio * SLOPE.tan()).obeys_coulomb(
                &format!("slope to {heading:.2} rad"),
                ratio,
                expected,
            );
        }
    }
}

/// A cube that falls flat from 4 to 6 cm stays where it falls, within 0.01 mm.
#[test]
fn a_cube_that_falls_flat_does_not_slide() {
    let mut worst: f64 = 0.0;
    for millimetres in 40..60 {
        let mut bench = Bench::new(HOME.into(), |_| ());
        let height = TABLE_HEIGHT + CUBE_HALF + 1e-3 * f64::from(millimetres);
        bench.simulation.place(bench.cube, &at([0.1, 0.05, height]));
        let start = bench.position();
        (0..500).for_each(|_| bench.step());
        let fallen = start - bench.position();
        worst = worst.max(fallen.xy().norm());
    }
    println!("slides by {:.4} mm", 1e3 * worst);
    assert!(worst < 3e-5, "slides by {worst} m");
}

const SETS: [(&str, RobotName); 2] = [("robosuite", RobotName::Robosuite), ("identified", RobotName::Identified)];

/// Where the cube is in the hand (m) after 10 s in which the joints swing around HOME with
/// amplitudes `swing` (rad) and frequencies `rate` (rad/s): difference from the start, its
/// prediction, and the root mean square of the hand's acceleration (m/s2).
///
/// The prediction: the solver holds the cube by equal velocities at the contact points, with
/// the Jacobian of the start of the step. Within the step the cube moves straight and the pad on
/// a curve. They end dt^2 / 2 times J_dot qd apart, and friction does not correct positions.
fn shaken_grasp(set: RobotName, swing: JointVector, rate: JointVector) -> (Vector3, Vector3, f64) {
    let dt = 0.002;
    let plant = Plant { robot: set.robot(), dt, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, cube) = Lift::simulate(&plant, Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    let in_hand = |s: &Simulation| (s.measure().pose.inverse() * cube.cube_pose(s)).translation.vector;
    let (mut start, mut predicted, mut squares) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    let mut last = Vector3::zeros();
    for step in -1050..5000 {
        if step == 0 {
            assert!(cube.is_grasped(&simulation));
            start = in_hand(&simulation);
        }
        // Open, close on the cube that is kept between the fingers, hold, swing.
        let grip = if step < -800 { -1.0 } else { 1.0 };
        let y = simulation.measure();
        if (-800..-500).contains(&step) {
            cube.place_cube(&mut simulation, &y.pose);
        }
        let t = f64::from(step.max(0)) * dt;
        let swing = swing * (t / 0.5).min(1.0);
        let wave = |f: fn(f64) -> f64| JointVector::from_fn(|i, _| f(rate[i] * t) * swing[i]);
        let q = JointVector::from(HOME) + wave(f64::sin);
        let qd = wave(f64::cos).component_mul(&rate);
        let qdd = -wave(f64::sin).component_mul(&rate).component_mul(&rate);
        let tau = y.bias + y.mass * (qdd + (q - y.q) * 2500.0 + (qd - y.qd) * 100.0);
        simulation.step(&tau, grip).unwrap();

        let after = simulation.measure();
        let velocity = after.twist.fixed_rows::<3>(0).into_owned();
        if step >= 0 {
            squares += ((velocity - last) / dt).norm_squared() / 5000.0;
            let model = simulation.model();
            let twist = |s: f64| model.jacobian(&model.kinematics(&(after.q + after.qd * s))) * after.qd;
            let curve = ((twist(1e-6) - twist(-1e-6)) / 2e-6).fixed_rows::<3>(0).into_owned();
            predicted -= after.pose.rotation.inverse() * curve * (0.5 * dt * dt);
        }
        last = velocity;
    }
    assert!(cube.is_grasped(&simulation));
    (in_hand(&simulation) - start, predicted, squares.sqrt())
}

/// A grasped cube stays in the hand within 0.2 mm for 10 s while the arm shakes it with
/// 1 m/s2 (root mean square) at 2 Hz or more in all joints.
#[test]
fn grasp_holds_while_the_arm_accelerates() {
    for (name, set) in SETS {
        let rate = JointVector::from_fn(|i, _| std::f64::consts::TAU * (2.0 + 0.1 * i as f64));
        let swing = JointVector::from([0.0075, 0.005, 0.0075, 0.005, 0.015, 0.015, 0.015]);
        let (slip, _, acceleration) = shaken_grasp(set, swing, rate);
        println!("{name}: {acceleration:.2} m/s2, slip {:.1?} um", (slip * 1e6).as_slice());
        assert!((0.8..1.5).contains(&acceleration));
        assert!(slip.norm() < 2e-4, "{name}: slipped by {slip} m");
    }
}

/// In wider swings a grasped cube drifts by the error that a first-order step makes on the curved
/// path. Beyond this error friction gives way by less than 50 um in 10 s.
#[test]
fn a_grasped_cube_drifts_by_the_curvature_of_its_path_alone() {
    for (name, set) in SETS {
        let rate = JointVector::from_fn(|i, _| std::f64::consts::TAU * (0.7 + 0.1 * i as f64));
        let swing = JointVector::from([0.06, 0.03, 0.06, 0.03, 0.1, 0.1, 0.1]);
        let (slip, predicted, acceleration) = shaken_grasp(set, swing, rate);
        let [slip_um, predicted_um] = [slip, predicted].map(|v| v * 1e6);
        println!(
            "{name}: {acceleration:.2} m/s2, {:.0?} um, predicted {:.0?}",
            slip_um.as_slice(),
            predicted_um.as_slice()
        );
        assert!((slip - predicted).norm() < 5e-5, "{name}: {slip} m, predicted {predicted}");
    }
}
