//! A peg enters a hole of wedges exactly where geometry lets it.

use std::f64::consts::TAU;

use aforce::{Pose, Twist, Vector3, Wrench};

use super::Engine;
use super::convert::{coordinates, vector};
use crate::model::GRAVITY;
use crate::scene::{Body, Geom, Hole, Inertial, Joint, Role, Scene, Shape, at};

const DT: f64 = 0.002;
/// Radius of the peg of FORGE (m), arXiv 2408.04587.
const RADIUS: f64 = 0.003993;
const HALF_LENGTH: f64 = 0.025;
const MASS: f64 = 2.0;
/// Moment of inertia of the peg about each axis (kg m2).
const INERTIA: f64 = 1e-3;

/// A hole with `clearance` (m, of the diameters) and a chamfer (m) below a peg.
fn scene(clearance: f64, chamfer: f64, friction: f64) -> (Scene, usize) {
    let geom = |name: String, shape, role| Geom { name, shape, pose: Pose::identity(), friction, role, color: [0; 3] };
    let hole = Hole { radius: RADIUS + clearance / 2.0, outer: 0.03, depth: 0.025, chamfer, sectors: 24 };
    let wedges = hole.wedges().unwrap().into_iter().enumerate();
    let wedges = wedges.map(|(i, wedge)| geom(format!("wedge{i}"), Shape::Convex(wedge), Role::Fixture)).collect();
    let mut scene = Scene { prediction: Some(2e-4), ..Scene::default() };
    scene.add_static("hole", wedges);
    let peg = scene.add(Body {
        name: "peg".into(),
        parent: None,
        pose: at([0.0, 0.0, HALF_LENGTH + 0.001]),
        joint: Joint::Free,
        inertial: Inertial::diagonal(MASS, [0.0; 3], [INERTIA; 3]),
        geoms: vec![geom("peg".into(), Shape::Cylinder { half_length: HALF_LENGTH, radius: RADIUS }, Role::Object)],
    });
    (scene, peg)
}

/// Lowers a peg on a spring of 500 N/m and 30 Nm/rad in 450 steps, aside of the hole's middle by `offset` (m), at
/// `speed` (m/s) to `bottom` (m) below the rim. After each step `watch` gets the spring's wrench beyond the weight (N,
/// Nm) and the peg's change of velocity (m/s, rad/s). Returns how deep the peg's end is at last (m).
fn lower(
    (scene, peg): (Scene, usize),
    offset: Vector3,
    [speed, bottom]: [f64; 2],
    mut watch: impl FnMut(&Engine, Wrench, Twist),
) -> f64 {
    let mut engine = Engine::new(&scene, DT, 1);
    engine.place(peg, &at((offset + Vector3::z() * (HALF_LENGTH + 0.001)).into()));
    let handle = engine.bodies[peg].unwrap();
    for step in 0..450 {
        let goal = offset + Vector3::z() * (HALF_LENGTH + (0.001 - speed * DT * f64::from(step)).max(-bottom));
        let (pose, velocity) = (engine.pose(peg), engine.velocity(peg));
        let (v, omega) = (velocity.fixed_rows::<3>(0), velocity.fixed_rows::<3>(3));
        let force = (goal - pose.translation.vector) * 500.0 - v * 60.0;
        let torque = pose.rotation.scaled_axis() * -30.0 - omega * 0.3;
        let body = &mut engine.world.bodies[handle];
        body.reset_forces(false);
        body.reset_torques(false);
        body.add_force(vector(&(force + Vector3::z() * MASS * GRAVITY)), true);
        body.add_torque(vector(&torque), true);
        engine.step(&[]);
        let spring = Wrench::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        watch(&engine, spring, engine.velocity(peg) - velocity);
    }
    HALF_LENGTH - coordinates(engine.world.bodies[handle].translation()).z
}

/// The same at 20 mm/s to 7 mm below the rim.
fn depth(clearance: f64, chamfer: f64, friction: f64, offset: Vector3) -> f64 {
    lower(scene(clearance, chamfer, friction), offset, [0.02, 0.007], |_, _, _| {})
}

/// A peg enters if it is aside by less than half the clearance, and stays on the rim otherwise: 40 offsets up to 1.2
/// times the clearance, each towards the middle of another wall.
#[test]
fn a_peg_enters_below_half_the_clearance() {
    for clearance in [1e-3, 5e-4, 1.14e-4] {
        for k in 0..40 {
            let part = 1.2 * (f64::from(k) + 0.5) / 40.0;
            let (sin, cos) = (TAU * (f64::from(7 * k % 24) + 0.5) / 24.0).sin_cos();
            let depth = depth(clearance, 0.0, 0.75, Vector3::new(cos, sin, 0.0) * part * clearance);
            let enters = part < 0.5;
            let as_it_should = if enters { depth > 0.006 } else { depth < 2e-4 };
            assert!(as_it_should, "clearance {clearance} m, aside by {part:.3} of it: {depth} m deep");
        }
    }
}

/// Half a millimetre aside, a chamfer of 1 mm leads the peg in at a friction of 0.25. At 0.75 a hole of 0.114 mm jams it just below the
/// chamfer, as statics has it for two points that are less than friction times width apart.
#[test]
fn friction_decides_whether_a_chamfer_leads_in_or_jams() {
    let offset = Vector3::new(5e-4, 0.0, 0.0);
    for clearance in [1e-3, 5e-4, 1.14e-4] {
        let depth = depth(clearance, 1e-3, 0.25, offset);
        assert!(depth > 0.006, "clearance {clearance} m: {depth} m deep");
    }
    let depth = depth(1.14e-4, 1e-3, 0.75, offset);
    assert!(depth > 0.0005 && depth < 0.75 * 2.0 * RADIUS, "{depth} m deep");
}

/// A peg that is too thick by a fiftieth of a millimetre stays on the rim.
#[test]
fn a_peg_that_is_too_thick_stays_out() {
    let depth = depth(-2e-5, 0.0, 0.75, Vector3::zeros());
    assert!(depth < 2e-4, "{depth} m deep");
}

/// In every step the contact wrench that is read is the one that changes the peg's momentum. So a contact point that is found but not solved
/// does not count with the force of an earlier step, and the torque is that of the points at which the solver applies the forces.
#[test]
fn what_is_read_is_what_acts() {
    let (mut largest, mut pressed) = (0.0_f64, 0);
    for (clearance, aside) in [(1e-3, 5e-4), (5e-4, 5e-4), (1e-3, 1.2e-3)] {
        let (mut scene, peg) = scene(clearance, 1e-3, 0.0);
        scene.bodies[peg].geoms[0].role = Role::Hand;
        lower((scene, peg), Vector3::new(aside, aside / 3.0, 0.0), [0.1, 0.03], |engine, spring, change| {
            let middle = engine.pose(peg).translation.vector;
            let read = engine.arm_contacts(&middle).beyond_wrist.unwrap_or_default();
            let acted =
                change.component_mul(&Wrench::from([MASS, MASS, MASS, INERTIA, INERTIA, INERTIA])) / DT - spring;
            let [(force, torque), (moved, turned)] =
                [read, acted].map(|wrench| (wrench.fixed_rows::<3>(0).norm(), wrench.fixed_rows::<3>(3).into_owned()));
            largest = largest.max(force);
            pressed += usize::from(force > 0.0);
            let apart = (read - acted).fixed_rows::<3>(0).norm();
            assert!(apart < 1e-6 * (1.0 + moved), "{read} N read, {acted} N acted");
            // The peg moves by a tenth of a millimetre in a step, and the points are read after it.
            assert!(
                (torque - turned).norm() < 2e-4 * force + 1e-6,
                "{torque} Nm read, {turned} Nm acted, with {force} N"
            );
        });
    }
    assert!(largest > 20.0 && pressed > 100, "{largest} N, {pressed} steps");
}
