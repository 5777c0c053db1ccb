//! Writes a scene as MJCF, so that MuJoCo (3.2.7 and 3.17.0 were tried) can load what Rapier simulates.

use std::fmt::Write;

use crate::model::GRAVITY;
use crate::scene::{Axis, Body, Geom, Joint, Scene, Shape, Stop};
use aforce::Pose;

/// The scene as an MJCF document with the given time step (s).
///
/// Contact roles become contype and conaffinity masks, and every actuator a motor with its
/// effort limit. The arm's stops are MuJoCo's own; springs become a `solreflimit`, which MuJoCo
/// scales by the inertia at the joint: a light door's are softer there.
/// Contact softness is the engine's own affair and stays at MuJoCo's default. `impratio` is
/// robosuite's: a sliding block then obeys Coulomb's law to 2 %, instead of 5.
pub fn export(scene: &Scene, dt: f64) -> String {
    let mut out = String::new();
    let w = &mut out;
    writeln!(w, r#"<mujoco model="scene">"#).unwrap();
    writeln!(w, r#"  <compiler angle="radian" autolimits="true"/>"#).unwrap();
    let [density, viscosity] = scene.air.map_or([0.0; 2], |air| [air.density, air.viscosity]);
    writeln!(
        w,
        r#"  <option timestep="{dt}" gravity="0 0 {}" density="{density}" viscosity="{viscosity}" integrator="Euler" cone="elliptic" impratio="20"/>"#,
        -GRAVITY
    )
    .unwrap();
    writeln!(w, "  <worldbody>").unwrap();
    for (index, _) in scene.bodies.iter().enumerate().filter(|(_, b)| b.parent.is_none()) {
        write_body(w, scene, index, 2);
    }
    writeln!(w, "  </worldbody>\n  <actuator>").unwrap();
    for actuator in &scene.actuators {
        let (joint, max) = (&actuator.joint, actuator.max_effort);
        writeln!(w, r#"    <motor name="{joint}" joint="{joint}" ctrlrange="-{max} {max}"/>"#).unwrap();
    }
    writeln!(w, "  </actuator>\n</mujoco>").unwrap();
    out
}

fn write_body(w: &mut String, scene: &Scene, index: usize, depth: usize) {
    let body = &scene.bodies[index];
    let pad = "  ".repeat(depth);
    writeln!(w, r#"{pad}<body name="{}" {}>"#, body.name, placement(&body.pose)).unwrap();
    write_inertial(w, body, &pad);
    match &body.joint {
        Joint::Fixed => {}
        Joint::Free => writeln!(w, r#"{pad}  <freejoint name="{}"/>"#, body.name).unwrap(),
        Joint::Hinge(axis) => write_axis(w, axis, "hinge", &pad),
        Joint::Slide(axis) => write_axis(w, axis, "slide", &pad),
    }
    for geom in &body.geoms {
        write_geom(w, geom, &scene.never_touch, &pad);
    }
    for (child, _) in scene.bodies.iter().enumerate().filter(|(_, b)| b.parent == Some(index)) {
        write_body(w, scene, child, depth + 1);
    }
    writeln!(w, "{pad}</body>").unwrap();
}

fn write_inertial(w: &mut String, body: &Body, pad: &str) {
    let inertial = &body.inertial;
    if inertial.mass == 0.0 {
        // In so many words: MuJoCo 3.2.7 looks for the centre of mass of several geoms without mass, and gives up.
        writeln!(w, r#"{pad}  <inertial mass="0" pos="0 0 0" diaginertia="0 0 0"/>"#).unwrap();
        return;
    }
    let (c, i) = (inertial.com, inertial.inertia);
    writeln!(
        w,
        r#"{pad}  <inertial mass="{}" pos="{} {} {}" fullinertia="{} {} {} {} {} {}"/>"#,
        inertial.mass, c.x, c.y, c.z, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23
    )
    .unwrap();
}

fn write_axis(w: &mut String, axis: &Axis, kind: &str, pad: &str) {
    let d = axis.direction;
    let stop = match axis.stop {
        Stop::Spring { stiffness, damping } => format!("-{stiffness} -{damping}"),
        Stop::Constraint => "0.02 1".into(),
    };
    writeln!(
        w,
        r#"{pad}  <joint name="{}" type="{kind}" axis="{} {} {}" range="{} {}" damping="{}" frictionloss="{}" armature="{}" stiffness="{}" solreflimit="{}"/>"#,
        axis.name,
        d.x,
        d.y,
        d.z,
        axis.range[0],
        axis.range[1],
        axis.damping,
        axis.friction,
        axis.armature,
        axis.spring,
        stop
    )
    .unwrap();
}

fn write_geom(w: &mut String, geom: &Geom, never_touch: &[[u8; 2]], pad: &str) {
    let (kind, size) = match geom.shape {
        Shape::Box(h) => ("box", format!("{} {} {}", h.x, h.y, h.z)),
        Shape::Capsule { half_length, radius } => ("capsule", format!("{radius} {half_length}")),
        Shape::Cylinder { half_length, radius } => ("cylinder", format!("{radius} {half_length}")),
    };
    let [r, g, b] = geom.color.map(|c| f64::from(c) / 255.0);
    // Mass 0: bodies carry their own inertia.
    writeln!(
        w,
        r#"{pad}  <geom name="{}" type="{kind}" size="{size}" {} mass="0" friction="{} 0.005 0.0001" contype="{}" conaffinity="{}" rgba="{r:.3} {g:.3} {b:.3} 1"/>"#,
        geom.name,
        placement(&geom.pose),
        geom.friction,
        geom.role.bit(),
        geom.role.mask(never_touch),
    )
    .unwrap();
}

fn placement(pose: &Pose) -> String {
    let (p, q) = (pose.translation.vector, pose.rotation);
    format!(r#"pos="{} {} {}" quat="{} {} {} {}""#, p.x, p.y, p.z, q.w, q.i, q.j, q.k)
}
