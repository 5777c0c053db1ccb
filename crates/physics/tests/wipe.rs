//! The wiping tool on the table: its forces are compared with statics, Coulomb's law and MuJoCo, its compliance
//! with robosuite's; impacts, and the wrench that a momentum observer estimates.

use std::path::Path;

use aforce::{JointVector, MomentumObserver, Pose, Vector6, Wrench};
use approx::assert_relative_eq;
use nalgebra::Translation3;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, Wipe};
use physics::wiping_tool::facing_down;
use physics::{Deviation, Plant, Simulation, SimulationConfig};

/// Stiffness and damping of the Cartesian spring that carries the tool.
const STIFFNESS: [f64; 6] = [800.0, 800.0, 800.0, 60.0, 60.0, 60.0];
const DAMPING: [f64; 6] = [40.0, 40.0, 40.0, 2.0, 2.0, 2.0];
/// Speed along the table (m/s).
const SPEED: f64 = 0.05;

/// A tool brought down by a spring, pressed by a constant force, and pulled along y; the
/// same law as in `scripts/mujoco_wipe_reference.py`. Joint friction is taken out, so that
/// statics tells the contact force.
struct Bench {
    simulation: Simulation,
    scene: Wipe,
    step: usize,
}

impl Bench {
    fn new(set: RobotName, height: f64, friction: f64) -> Bench {
        let robot = set.robot().with_damping(5.0).with_friction(0.0);
        let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
        let (mut simulation, scene) = Wipe::simulate(&plant, height, friction);
        simulation.reset(&HOME.into());
        Bench { simulation, scene, step: 0 }
    }

    /// Runs to step `end`, pressing with `force` (N) from step 2200 on and sliding from step
    /// 4000 on; returns mean and scatter of the raw reading over the last 500 steps.
    fn run(&mut self, end: usize, force: f64) -> (Wrench, Wrench) {
        let (mut sum, mut squares) = (Wrench::zeros(), Wrench::zeros());
        while self.step < end {
            let y = self.simulation.measure();
            let slid = SPEED * 0.002 * self.step.saturating_sub(4000) as f64;
            let height = (1.07 - 1e-4 * self.step as f64).max(TABLE_HEIGHT + 0.002);
            let target = Pose::from_parts(Translation3::new(0.15, slid, height), facing_down());
            let error = aforce::pose_error(&y.pose, &target);
            let mut wrench =
                -Vector6::from(STIFFNESS).component_mul(&error) - Vector6::from(DAMPING).component_mul(&y.twist);
            if self.step > 2200 {
                wrench[2] = -force - 40.0 * y.twist[2];
            }
            let tau = y.bias + y.jacobian.transpose() * wrench;
            self.simulation.step(&tau, 0.0).unwrap();
            self.step += 1;
            if end - self.step < 500 {
                let raw = self.simulation.contact().raw;
                sum += raw / 500.0;
                squares += raw.component_mul(&raw) / 500.0;
            }
        }
        (sum, (squares - sum.component_mul(&sum)).map(|v| v.max(0.0).sqrt()))
    }
}

/// Rows of `pressed, rest x y z, slide x y z` (N): the contact force on the tool in MuJoCo.
fn mujoco() -> Vec<[f64; 7]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/wiping.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|row| {
        let numbers: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    })
    .collect()
}

/// At rest the contact force equals the pressing force, steadily. While sliding, friction is mu times the
/// normal force and opposes the motion. MuJoCo's forces are the same.
#[test]
fn pressing_and_sliding_forces() {
    let rows = mujoco();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let pressed = row[0];
        let mut bench = Bench::new(RobotName::Robosuite, TABLE_HEIGHT, TABLE_FRICTION);
        let (rest, scatter) = bench.run(4000, pressed);
        println!("{pressed} N, rest: {:.4?} +- {:.4?}, MuJoCo {:.4?}", rest.as_slice(), scatter.as_slice(), &row[1..4]);
        assert!(bench.scene.is_flat(&bench.simulation));
        assert_relative_eq!(rest[2], pressed, max_relative = 0.01);
        assert_relative_eq!(rest[2], row[3], max_relative = 0.01);
        assert!(scatter[2] < 0.01 * pressed, "steady: {scatter}");

        let (slide, scatter) = bench.run(5000, pressed);
        println!(
            "{pressed} N, slide: {:.4?} +- {:.4?}, MuJoCo {:.4?}",
            slide.as_slice(),
            scatter.as_slice(),
            &row[4..]
        );
        assert_relative_eq!(slide.fixed_rows::<2>(0).norm(), TABLE_FRICTION * slide[2], max_relative = 0.01);
        assert!(slide[1] < 0.0, "friction opposes the motion");
        assert_relative_eq!(slide[2], row[6], max_relative = 0.02);
        assert_relative_eq!(slide[1], row[5], max_relative = 0.02);
    }
}

/// robosuite's level face gives way by 0.13 mm under 5.3 N and by 1.08 mm under 53 N. The pad's springs here are
/// linear; robosuite's stiffen to 68 kN/m at 127 N.
#[test]
fn the_face_gives_way_as_robosuites() {
    const ROBOSUITE: [(f64, f64); 6] =
        [(5.3, 0.13), (13.2, 0.30), (26.5, 0.59), (53.0, 1.08), (78.0, 1.42), (127.0, 1.88)];
    for set in [RobotName::Robosuite, RobotName::Identified] {
        for (force, expected) in ROBOSUITE {
            let mut bench = Bench::new(set, TABLE_HEIGHT, TABLE_FRICTION);
            bench.run(4000, force);
            let depth = 1000.0 * (TABLE_HEIGHT - bench.simulation.measure().pose.translation.z);
            println!("{set:?}, {force} N: {depth:.3} mm, robosuite {expected} mm");
            assert!((40.0..52.0).contains(&(force / depth)), "{set:?}: {} kN/m", force / depth);
            assert!(force > 60.0 || (depth / expected - 1.0).abs() < 0.2, "{set:?}: {depth} mm");
        }
    }
}

/// The impact of a tool that comes down is bounded by the pad: v sqrt(k m), with 43 kN/m and the
/// 36 kg that the arm weighs there 1.2 N per mm/s.
#[test]
fn an_impact_is_modest() {
    let mut bench = Bench::new(RobotName::Robosuite, TABLE_HEIGHT, TABLE_FRICTION);
    let (mut speed, mut peak, mut sustained) = (0.0f64, 0.0f64, 0.0f64);
    for step in 1..=2100 {
        bench.run(step, 0.0);
        let contact = bench.simulation.contact();
        if peak == 0.0 {
            speed = -bench.simulation.measure().twist[2];
        }
        peak = peak.max(contact.raw.fixed_rows::<3>(0).norm());
        sustained = sustained.max(contact.hand_force());
    }
    println!("at {speed:.3} m/s: {peak:.1} N raw, {sustained:.1} N sustained");
    assert!(speed > 0.02 && peak > 10.0 && peak < 1240.0 * speed && sustained < peak);
}

/// The table has the height and friction that the scene is built with.
#[test]
fn another_table() {
    let mut bench = Bench::new(RobotName::Identified, TABLE_HEIGHT + 0.01, 0.3);
    let (slide, _) = bench.run(5000, 20.0);
    let height = bench.simulation.measure().pose.translation.z;
    assert!((height - TABLE_HEIGHT - 0.01).abs() < 0.002, "{height}");
    assert_relative_eq!(slide.xy().norm(), 0.3 * slide[2], max_relative = 0.01);
}

/// In the air the estimate stays near zero in spite of fast motion; on the table it is the contact force, friction
/// included, once it had time to follow.
#[test]
fn free_motion_reads_zero_and_contact_its_force() {
    const DT: f64 = 0.001;
    let robot = RobotName::Identified.robot();
    let damping = robot.damping();
    let plant = Plant { robot, dt: DT, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, 0.3);
    simulation.reset(&HOME.into());
    let mut y = simulation.measure();
    let level = y.pose.rotation;
    let mut observer = MomentumObserver::new(25.0, damping, &y);
    let (mut in_the_air, mut speed) = (0.0f64, 0.0f64);
    let (mut estimated, mut exact) = (Wrench::zeros(), Wrench::zeros());
    // The table pushes up all the time, so this sum keeps the sign.
    let mut upwards = [0.0, 0.0];
    for step in 0..6000 {
        let time = f64::from(step) * DT;
        // A swing through the air, then down onto the table and along it.
        let swing = 0.1 * (4.0 * time).sin();
        let height = if time < 2.0 { TABLE_HEIGHT + 0.15 } else { TABLE_HEIGHT - 0.02 };
        let target = Pose::from_parts(Translation3::new(0.1, swing, height), level);
        let error = aforce::pose_error(&y.pose, &target);
        let stiffness = Vector6::new(600.0, 600.0, 600.0, 60.0, 60.0, 60.0);
        let wrench = -stiffness.component_mul(&error) - 0.15 * stiffness.component_mul(&y.twist);
        let tau: JointVector = y.bias + y.jacobian.tr_mul(&wrench);
        simulation.step(&tau, 0.0).unwrap();
        y = simulation.measure();
        observer.update(&tau, &y, DT);
        if (0.2..2.0).contains(&time) {
            in_the_air = in_the_air.max(observer.wrench().fixed_rows::<3>(0).norm());
            speed = speed.max(y.twist.fixed_rows::<3>(0).norm());
        }
        if time >= 4.0 {
            // Over whole swings, so that the delay of the estimate averages out.
            estimated += observer.wrench().map(f64::abs);
            exact += simulation.contact().raw.map(f64::abs);
            upwards[0] += observer.wrench()[2];
            upwards[1] += simulation.contact().raw[2];
        }
    }
    println!("in the air {in_the_air:.3} N at up to {speed:.2} m/s; {:.3?}, {:.3?}", estimated, exact);
    assert!(in_the_air < 0.1 && speed > 0.2);
    for axis in 0..3 {
        assert_relative_eq!(estimated[axis], exact[axis], max_relative = 0.05);
    }
    assert!(upwards[1] > 0.0);
    assert_relative_eq!(upwards[0], upwards[1], max_relative = 0.05);
}

/// An arm is held at rest against a force or a moment. The estimate equals this wrench.
#[test]
fn forces_and_moments_are_told_apart() {
    let plant = Plant {
        robot: RobotName::Identified.robot(),
        dt: 0.001,
        config: SimulationConfig::default(),
        deviation: Deviation::default(),
    };
    let (mut simulation, _) = Wipe::simulate(&plant, TABLE_HEIGHT, 0.3);
    simulation.reset(&HOME.into());
    let y = simulation.measure();
    // The highest cut-off and the longest period that a host allows, too.
    for (axis, (cutoff, dt)) in (0..6).flat_map(|axis| [(25.0, 0.001), (100.0, 0.1)].map(|rate| (axis, rate))) {
        let mut push = Wrench::zeros();
        push[axis] = if axis < 3 { 7.0 } else { -0.8 };
        let mut observer = MomentumObserver::new(cutoff, JointVector::zeros(), &y);
        for _ in 0..500 {
            observer.update(&(y.bias - y.jacobian.tr_mul(&push)), &y, dt);
        }
        assert_relative_eq!(observer.wrench(), push, epsilon = 1e-6);
    }
}
