//! The measured cases. `scripts/mujoco_contact_card.py` measures the same in MuJoCo.

use aforce::{JointVector, Pose, Vector3};
use physics::model::GRAVITY;
use physics::scene::{Role, Scene, at};
use physics::scenes::{door, lift};

use crate::bench::{DT, block, drive, hold, plant, simulate, slide};

/// One measured number.
pub struct Figure {
    pub case: String,
    pub quantity: &'static str,
    pub unit: &'static str,
    /// The value that follows from geometry or statics, if there is one.
    pub expected: Option<f64>,
    pub rapier: f64,
}

impl Figure {
    fn new(
        case: impl Into<String>,
        quantity: &'static str,
        unit: &'static str,
        expected: Option<f64>,
        rapier: f64,
    ) -> Self {
        Figure { case: case.into(), quantity, unit, expected, rapier }
    }
}

const CUBE_HALF: f64 = 0.021;
const CUBE_DENSITY: f64 = 1000.0;
/// Force of each pad on the held cube (N).
const GRIP: f64 = 2.0;
/// Coefficients of friction, as shares of the one that just holds the cube.
pub const SHARES: [f64; 5] = [0.90, 0.98, 1.00, 1.02, 1.10];
/// Difference of the widths of hole and peg (m).
pub const CLEARANCES: [f64; 4] = [0.003, 0.001, 0.0005, 0.000114];
/// By how much the oversized peg is wider than its hole (m).
pub const OVERSIZE: f64 = 0.00002;
/// Number of sideways offsets of the peg, which go up to 2.2 clearances.
const OFFSETS: u32 = 40;
/// Half width of the peg, height of its start above the rim, and depth of the hole (m).
const PEG_HALF: f64 = 0.003993;
const GAP: f64 = 0.005;
const DEPTH: f64 = 0.025;
const PEG_MASS: f64 = 2.0;
/// Stiffness of the springs that carry the peg (N/m), and speed at which their rest position sinks (m/s).
const SPRING: f64 = 500.0;
const LOWERING: f64 = 0.02;

fn weight() -> f64 {
    8.0 * CUBE_HALF.powi(3) * CUBE_DENSITY * GRAVITY
}

fn empty() -> Scene {
    lift::scene(&plant().robot, Vector3::repeat(CUBE_HALF)).0
}

/// The cube between two pads on slides.
pub fn held_scene(share: f64) -> Scene {
    let mut scene = empty();
    let cube = scene.body("cube");
    scene.bodies[cube].geoms[0].friction = 0.0;
    scene.bodies[cube].pose = at([0.3, 0.0, 1.2]);
    let friction = share * weight() / (2.0 * GRIP);
    for (name, side) in [("left", 1.0), ("right", -1.0)] {
        let geom = block(name, [0.01, 0.005, 0.01], [0.0; 3], friction, Role::Pad);
        scene.add(slide(name, None, [0.3, side * (CUBE_HALF + 0.005), 1.2], Vector3::y(), 0.1, vec![geom]));
    }
    scene
}

fn held(share: f64) -> Vec<Figure> {
    let scene = held_scene(share);
    let (cube, pads) = (scene.body("cube"), ["left", "right"].map(|name| scene.joint(name)));
    let mut simulation = simulate(&scene);
    simulation.set_load(pads[0], -GRIP);
    simulation.set_load(pads[1], GRIP);
    let time = if share < 1.0 { 0.2 } else { 5.0 };
    let steps = (time / DT) as u32;
    let mut force = 0.0;
    for _ in 0..steps {
        hold(&mut simulation);
        force -= simulation.contact().raw[2] / f64::from(steps);
    }
    let slip = 1000.0 * (1.2 - simulation.body_pose(cube).translation.z);
    let fall = 1000.0 * 0.5 * GRAVITY * (1.0 - share).max(0.0) * time * time;
    let case = format!("held cube, friction x {share:.2}");
    vec![
        Figure::new(case.clone(), if share < 1.0 { "slip in 0.2 s" } else { "slip in 5 s" }, "mm", Some(fall), slip),
        Figure::new(case, "force of its weight", "1", Some(share.min(1.0)), force / weight()),
    ]
}

pub fn drop_scene() -> Scene {
    empty()
}

fn dropped() -> Vec<Figure> {
    let scene = drop_scene();
    let cube = scene.body("cube");
    let mut simulation = simulate(&scene);
    simulation.place(cube, &at([0.2, 0.2, lift::TABLE_HEIGHT + CUBE_HALF + 0.05]));
    let mut deepest = 0.0f64;
    let mut after = [Pose::identity(); 2];
    for (pose, steps) in after.iter_mut().zip([500, 5000]) {
        for _ in 0..steps {
            hold(&mut simulation);
            deepest = deepest.max(simulation.deepest_penetration());
        }
        *pose = simulation.body_pose(cube);
    }
    let aside = |pose: &Pose, x: f64, y: f64| 1000.0 * (pose.translation.x - x).hypot(pose.translation.y - y);
    let figure = |quantity, value| Figure::new("cube dropped from 5 cm", quantity, "mm", Some(0.0), value);
    vec![
        figure("deepest overlap", 1000.0 * deepest),
        figure("slide in 1 s", aside(&after[0], 0.2, 0.2)),
        figure("creep in the next 10 s", aside(&after[1], after[0].translation.x, after[0].translation.y)),
    ]
}

/// Postures in which hand and forearm, or hand and shoulder, would overlap by centimetres (rad).
const WEDGED: [[f64; 7]; 4] = [
    [-2.83, -0.97, 2.64, -2.38, 0.71, 0.45, 2.15],
    [-1.49, 0.76, 1.29, -1.88, 1.55, 0.45, 2.30],
    [2.61, 0.65, 2.01, -1.98, 1.78, 0.17, -0.35],
    [2.03, -0.10, 2.10, -1.89, 2.34, 0.07, 1.51],
];

fn wedged() -> Vec<Figure> {
    let force = |posture: [f64; 7]| {
        let mut simulation = simulate(&empty());
        let mut sum = 0.0;
        for step in 0..2000 {
            drive(&mut simulation, &JointVector::from(posture));
            sum += if step < 1500 { 0.0 } else { simulation.contact().raw_arm_force() / 500.0 };
        }
        sum
    };
    let figure = |(i, posture): (usize, &[f64; 7])| {
        Figure::new(format!("driven into itself, {}", i + 1), "force", "N", None, force(*posture))
    };
    WEDGED.iter().enumerate().map(figure).collect()
}

/// A square peg on springs above a square hole of four boxes, which is wider by `clearance`.
pub fn peg_scene(clearance: f64) -> Scene {
    let mut scene = empty();
    let (hole, wall) = (PEG_HALF + clearance / 2.0, 0.02);
    let rim = 1.0;
    let boxes = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].into_iter().enumerate().map(|(i, (x, y))| {
        let half = if x == 0.0 { [hole, wall, DEPTH] } else { [wall, hole + 2.0 * wall, DEPTH] };
        let centre = [0.3 + x * (hole + wall), y * (hole + wall), rim - DEPTH];
        block(&format!("wall {i}"), half, centre, 0.75, Role::Fixture)
    });
    scene.add_static("hole", boxes.collect());
    let x = scene.add(slide("peg x", None, [0.3, 0.0, rim + GAP + DEPTH], Vector3::x(), 0.1, vec![]));
    let y = scene.add(slide("peg y", Some(x), [0.0; 3], Vector3::y(), 0.1, vec![]));
    let geom = block("peg", [PEG_HALF, PEG_HALF, DEPTH], [0.0; 3], 0.75, Role::Object);
    scene.add(slide("peg z", Some(y), [0.0; 3], Vector3::z(), PEG_MASS, vec![geom]));
    scene
}

/// Depth of the peg's end below the rim (m) after the peg was lowered to the hole's base at an offset `x` (m) from the hole's middle.
fn lowered(clearance: f64, x: f64) -> f64 {
    let scene = peg_scene(clearance);
    let joints = ["peg x", "peg y", "peg z"].map(|name| scene.joint(name));
    let mut simulation = simulate(&scene);
    for step in 0..1100 {
        let sunk = (LOWERING * DT * f64::from(step)).min(GAP + DEPTH);
        let damping = 2.0 * (SPRING * PEG_MASS).sqrt();
        for (joint, (rest, constant)) in joints.into_iter().zip([(x, 0.0), (0.0, 0.0), (-sunk, PEG_MASS * GRAVITY)]) {
            let (q, qd) = simulation.joint(joint);
            simulation.set_load(joint, constant + SPRING * (rest - q) - damping * qd);
        }
        hold(&mut simulation);
    }
    -simulation.joint(joints[2]).0 - GAP
}

fn pegs() -> Vec<Figure> {
    let right = |clearance: f64| {
        let agrees = |i: &u32| {
            let offset = 2.2 * clearance * f64::from(*i) / f64::from(OFFSETS);
            (lowered(clearance, offset) > DEPTH / 2.0) == (offset < clearance / 2.0)
        };
        (1..=OFFSETS).filter(agrees).count() as f64
    };
    let figure = |clearance: f64| {
        let case = format!("peg, clearance {} mm", 1000.0 * clearance);
        Figure::new(case, "enters rightly", "of 40", Some(f64::from(OFFSETS)), right(clearance))
    };
    let sunk = 1000.0 * lowered(-OVERSIZE, 0.0);
    let oversized = Figure::new("peg 0.02 mm too wide", "sinks in", "mm", Some(0.0), sunk);
    CLEARANCES.map(figure).into_iter().chain([oversized]).collect()
}

pub fn door_scene() -> Scene {
    door::scene(&plant().robot, &door::root(door::MIDDLE)).0
}

fn latch() -> Vec<Figure> {
    let opening = |handle: f64| {
        let scene = door_scene();
        let (hinge, shaft) = (scene.joint("hinge"), scene.joint("handle"));
        let mut simulation = simulate(&scene);
        simulation.set_load(shaft, handle);
        (0..500).for_each(|_| hold(&mut simulation));
        simulation.set_load(hinge, 5.0);
        (0..500).for_each(|_| hold(&mut simulation));
        1000.0 * simulation.joint(hinge).0
    };
    let figure = |case: &str, handle| Figure::new(case, "opens in 1 s", "mrad", None, opening(handle));
    vec![figure("door, handle at rest", 0.0), figure("door, handle turned", 3.0)]
}

pub fn all() -> Vec<Figure> {
    let held = SHARES.into_iter().flat_map(held);
    held.chain(dropped()).chain(wedged()).chain(pegs()).chain(latch()).collect()
}

/// Name and scene of every file that the script loads.
pub fn scenes() -> Vec<(String, Scene)> {
    let held = SHARES.map(|share| (format!("held_{share:.2}"), held_scene(share)));
    let pegs = CLEARANCES.into_iter().chain([-OVERSIZE]);
    let pegs = pegs.map(|clearance| (format!("peg_{:.0}", 1e6 * clearance), peg_scene(clearance)));
    held.into_iter().chain(pegs).chain([("drop".into(), drop_scene()), ("door".into(), door_scene())]).collect()
}
