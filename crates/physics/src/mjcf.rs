//! Writes a scene as MJCF, so that MuJoCo (3.2.7 and 3.17.0 were tried) can load what Rapier simulates.

use std::fmt::Write;

use crate::model::GRAVITY;
use crate::scene::{Axis, Body, Geom, Joint, Scene, Shape, Stop};
use aforce::Pose;

/// The scene as an MJCF document with the given time step (s).
///
/// Contact roles become contype and conaffinity masks, and every actuator a motor with its
/// effort limit. The arm's stops are MuJoCo's own. Stops with a spring become a `solreflimit`, which MuJoCo
/// scales by the inertia at the joint, so that the stops of a light door are softer in MuJoCo.
/// Contact softness is not exported and stays at MuJoCo's default. `impratio` is
/// robosuite's: a sliding block then obeys Coulomb's law to 2 %, instead of 5 %.
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
    write_meshes(w, scene);
    writeln!(w, "  <worldbody>").unwrap();
    for (index, _) in scene.bodies.iter().enumerate().filter(|(_, b)| b.parent.is_none()) {
        write_body(w, scene, index, 2);
    }
    writeln!(w, "  </worldbody>\n  <actuator>").unwrap();
    for actuator in &scene.actuators {
        let (joint, max) = (escaped(&actuator.joint), actuator.max_effort);
        writeln!(w, r#"    <motor name="{joint}" joint="{joint}" ctrlrange="-{max} {max}"/>"#).unwrap();
    }
    writeln!(w, "  </actuator>\n</mujoco>").unwrap();
    out
}

/// The hulls, each with the name of its geom. MuJoCo moves a mesh to its centre of mass and the geom's frame with it, so the pose of the geom
/// needs no correction.
fn write_meshes(w: &mut String, scene: &Scene) {
    let geoms = scene.bodies.iter().flat_map(|body| &body.geoms);
    let hulls = geoms.filter_map(|geom| match &geom.shape {
        Shape::Convex(hull) => Some((escaped(&geom.name), hull)),
        _ => None,
    });
    let mut hulls = hulls.peekable();
    if hulls.peek().is_none() {
        return;
    }
    writeln!(w, "  <asset>").unwrap();
    for (name, hull) in hulls {
        let corners: Vec<String> = hull.corners().iter().map(|p| format!("{} {} {}", p.x, p.y, p.z)).collect();
        writeln!(w, r#"    <mesh name="{name}" vertex="{}"/>"#, corners.join("  ")).unwrap();
    }
    writeln!(w, "  </asset>").unwrap();
}

fn write_body(w: &mut String, scene: &Scene, index: usize, depth: usize) {
    let body = &scene.bodies[index];
    let pad = "  ".repeat(depth);
    writeln!(w, r#"{pad}<body name="{}" {}>"#, escaped(&body.name), placement(&body.pose)).unwrap();
    write_inertial(w, body, &pad);
    match &body.joint {
        Joint::Fixed => {}
        Joint::Free => writeln!(w, r#"{pad}  <freejoint name="{}"/>"#, escaped(&body.name)).unwrap(),
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
        // Written out, because without it MuJoCo 3.2.7 looks for the centre of mass of several geoms without mass and
        // gives up.
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
    // Without a range a joint has no ends in MuJoCo.
    let [low, high] = axis.range;
    let range = if low.is_finite() { format!(r#" range="{low} {high}""#) } else { String::new() };
    writeln!(
        w,
        r#"{pad}  <joint name="{}" type="{kind}" axis="{} {} {}"{range} damping="{}" frictionloss="{}" armature="{}" stiffness="{}" springref="{}" solreflimit="{stop}"/>"#,
        escaped(&axis.name),
        d.x,
        d.y,
        d.z,
        axis.damping,
        axis.friction,
        axis.armature,
        axis.spring,
        axis.rest
    )
    .unwrap();
}

fn write_geom(w: &mut String, geom: &Geom, never_touch: &[[u8; 2]], pad: &str) {
    let (kind, size) = match &geom.shape {
        Shape::Box(h) => ("box", format!(r#"size="{} {} {}""#, h.x, h.y, h.z)),
        Shape::Capsule { half_length, radius } => ("capsule", format!(r#"size="{radius} {half_length}""#)),
        Shape::Cylinder { half_length, radius } => ("cylinder", format!(r#"size="{radius} {half_length}""#)),
        Shape::Sphere { radius } => ("sphere", format!(r#"size="{radius}""#)),
        Shape::Convex(_) => ("mesh", format!(r#"mesh="{}""#, escaped(&geom.name))),
    };
    let [r, g, b] = geom.color.map(|c| f64::from(c) / 255.0);
    // Mass 0: bodies carry their own inertia.
    writeln!(
        w,
        r#"{pad}  <geom name="{}" type="{kind}" {size} {} mass="0" friction="{} 0.005 0.0001" contype="{}" conaffinity="{}" rgba="{r:.3} {g:.3} {b:.3} 1"/>"#,
        escaped(&geom.name),
        placement(&geom.pose),
        geom.friction,
        geom.role.bit(),
        geom.role.mask(never_touch),
    )
    .unwrap();
}

/// A name, escaped for the value of an attribute.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

fn placement(pose: &Pose) -> String {
    let (p, q) = (pose.translation.vector, pose.rotation);
    format!(r#"pos="{} {} {}" quat="{} {} {} {}""#, p.x, p.y, p.z, q.w, q.i, q.j, q.k)
}
