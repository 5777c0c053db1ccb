//! The bodies of a task's scene, from dicts and from files.

use std::collections::HashMap;
use std::path::PathBuf;

use aforce::{Pose, Vector3};
use nalgebra::{Quaternion, Translation3, Unit, UnitQuaternion};
use physics::mesh;
use physics::objects::{Root, default_stop, read_mjcf, read_urdf};
use physics::scene::{Axis, Body, Geom, Hole, Hull, Inertial, Joint, Role, Scene, Shape, Stop};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use super::answer::Part;

/// Default colour of a shape.
const GREY: [u8; 3] = [150, 140, 128];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodySpec {
    name: String,
    parent: Option<String>,
    #[serde(default)]
    pose: Vec<f64>,
    #[serde(default)]
    joint: Option<toml::Value>,
    mass: Option<f64>,
    density: Option<f64>,
    #[serde(default)]
    shapes: Vec<ShapeSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisSpec {
    hinge: Option<[f64; 3]>,
    slide: Option<[f64; 3]>,
    name: Option<String>,
    range: Option<[f64; 2]>,
    #[serde(default)]
    damping: f64,
    #[serde(default)]
    friction: f64,
    #[serde(default)]
    armature: f64,
    #[serde(default)]
    spring: f64,
    #[serde(default)]
    rest: f64,
    stop: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShapeSpec {
    #[serde(rename = "box")]
    half: Option<[f64; 3]>,
    sphere: Option<f64>,
    capsule: Option<[f64; 2]>,
    cylinder: Option<[f64; 2]>,
    points: Option<Vec<[f64; 3]>>,
    mesh: Option<PathBuf>,
    scale: Option<f64>,
    hole: Option<HoleSpec>,
    name: Option<String>,
    #[serde(default)]
    pose: Vec<f64>,
    friction: Option<f64>,
    color: Option<[u8; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HoleSpec {
    radius: f64,
    outer: f64,
    depth: f64,
    #[serde(default)]
    chamfer: f64,
    #[serde(default = "sectors")]
    sectors: usize,
}

fn sectors() -> usize {
    24
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSpec {
    file: PathBuf,
    #[serde(default)]
    pose: Vec<f64>,
    #[serde(default)]
    free: bool,
    friction: Option<f64>,
}

/// A pose in numbers: x, y, z (m); a fourth is the turn about z (rad); or seven, the last four a quaternion x, y, z, w.
///
/// # Errors
/// A message if there is another number of them, one is not finite, or the quaternion has not length 1.
pub fn pose(numbers: &[f64]) -> Result<Pose, String> {
    let at = |x, y, z, rotation| Ok(Pose::from_parts(Translation3::new(x, y, z), rotation));
    if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
        return Err(format!("a pose holds {number}; finite numbers are wanted"));
    }
    match *numbers {
        [] => Ok(Pose::identity()),
        [x, y, z] => at(x, y, z, UnitQuaternion::identity()),
        [x, y, z, yaw] => at(x, y, z, UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)),
        [x, y, z, i, j, k, w] => {
            let quaternion = Quaternion::new(w, i, j, k);
            if (quaternion.norm() - 1.0).abs() > 1e-3 {
                return Err(format!(
                    "a quaternion of length {}; a unit quaternion x, y, z, w has 1",
                    quaternion.norm()
                ));
            }
            at(x, y, z, UnitQuaternion::new_normalize(quaternion))
        }
        _ => Err(format!(
            "a pose of {} numbers; 3 (x, y, z), 4 (and the turn about z) or 7 (and a quaternion x, y, z, w) are wanted",
            numbers.len()
        )),
    }
}

/// The bodies of one entry. The parent of each is given as an index within the group. A body without one hangs on the earlier body that
/// `parent` names, or on the world.
pub struct Group {
    bodies: Vec<Body>,
    /// Of each part of a shape but its first, which has the shape's name: the part's name, and that of the shape.
    pub parts: HashMap<String, String>,
    parent: Option<String>,
    pose: Pose,
    /// Whether the joint gets the default end stop, which fits what the joint carries.
    default_stop: bool,
}

/// Reads the i-th entry of `bodies`.
///
/// # Errors
/// `TypeError` or `ValueError` with the name of what is wrong.
pub fn read_body(part: Part<'_>, entry: &Bound<'_, PyAny>, i: usize) -> PyResult<Group> {
    let at = format!("bodies[{i}]");
    if entry.cast::<PyDict>().is_ok_and(|dict| dict.contains("file").unwrap_or(false)) {
        return read_file(part.read(entry, &at)?).map_err(|words| part.value(words));
    }
    let spec: BodySpec = part.read(entry, &at)?;
    let name = spec.name.clone();
    let wrong = |words: String| part.value(format!("body {name:?}: {words}"));
    let axis = match &spec.joint {
        Some(toml::Value::Table(table)) => {
            let axis: AxisSpec = aforce::record::read(table.clone()).map_err(|problem| {
                let words = format!("body {name:?}: joint: {problem}");
                if problem.message.starts_with("unknown key") { part.kind(words) } else { part.value(words) }
            })?;
            Some(axis)
        }
        _ => None,
    };
    body(spec, axis).map_err(wrong)
}

/// The bodies of a scene that is a file.
///
/// # Errors
/// A message, if the file cannot be read.
pub fn read_scene(file: PathBuf) -> Result<Group, String> {
    read_file(FileSpec { file, pose: vec![], free: false, friction: None })
}

fn read_file(spec: FileSpec) -> Result<Group, String> {
    let root = if spec.free { Root::Free } else { Root::Fixed };
    let ending = spec.file.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let read = match ending.as_str() {
        "xml" | "mjcf" if spec.free || spec.friction.is_some() => {
            return Err(format!(
                "{}: free and friction are for a URDF; an MJCF file says both itself",
                spec.file.display()
            ));
        }
        "xml" | "mjcf" => read_mjcf(&spec.file),
        "urdf" => read_urdf(&spec.file, root, spec.friction.unwrap_or(1.0)),
        _ => return Err(format!("{}: an MJCF file (.xml) or a URDF file (.urdf) is wanted", spec.file.display())),
    };
    let bodies = read.map_err(|error| error.to_string())?.bodies;
    Ok(Group { bodies, parts: HashMap::new(), parent: None, pose: pose(&spec.pose)?, default_stop: false })
}

fn body(spec: BodySpec, axis: Option<AxisSpec>) -> Result<Group, String> {
    let default_stop = axis.as_ref().is_some_and(|axis| axis.stop.is_none());
    let joint = match (axis, &spec.joint) {
        (Some(axis), _) => moving(axis, &spec.name)?,
        (None, None) => Joint::Fixed,
        (None, Some(toml::Value::String(word))) if word == "fixed" => Joint::Fixed,
        (None, Some(toml::Value::String(word))) if word == "free" => Joint::Free,
        (None, Some(other)) => {
            return Err(format!(
                "joint {other}; \"fixed\", \"free\" or a dict with the axis is wanted: {{\"slide\": [1, 0, 0]}} or {{\"hinge\": ..}}"
            ));
        }
    };
    let (mut geoms, mut parts, mut matter) = (vec![], HashMap::new(), Inertial::NONE);
    for shape in &spec.shapes {
        let place = geoms.len();
        let own = match place {
            0 => spec.name.clone(),
            i => format!("{}_{i}", spec.name),
        };
        let named = shape.name.clone().unwrap_or(own);
        for (i, (solid, within)) in
            solids(shape).map_err(|words| format!("shape {named:?}: {words}"))?.into_iter().enumerate()
        {
            let frame = pose(&shape.pose)? * within;
            matter = matter.merged(&Inertial::solid(&solid, 1.0).transformed(&frame));
            let name = if i == 0 { named.clone() } else { format!("{named}_{i}") };
            if i > 0 {
                parts.insert(name.clone(), named.clone());
            }
            geoms.push(Geom {
                name,
                shape: solid,
                pose: frame,
                friction: shape.friction.unwrap_or(1.0),
                role: Role::Object,
                color: shape.color.unwrap_or(GREY),
            });
        }
    }
    let factor = match (spec.mass, spec.density) {
        (Some(_), Some(_)) => return Err("mass and density; one of them is wanted".into()),
        (Some(_), None) if matter.mass == 0.0 => {
            return Err("a mass and no shapes, over which it would be spread".into());
        }
        (Some(mass), None) => mass / matter.mass,
        (None, density) => density.unwrap_or(0.0),
    };
    let inertial = Inertial { mass: matter.mass * factor, inertia: matter.inertia * factor, ..matter };
    let pose = pose(&spec.pose)?;
    let body = Body { name: spec.name, parent: None, pose: Pose::identity(), joint, inertial, geoms };
    Ok(Group { bodies: vec![body], parts, parent: spec.parent, pose, default_stop })
}

fn moving(spec: AxisSpec, body: &str) -> Result<Joint, String> {
    let (direction, make): (_, fn(Axis) -> Joint) = match (spec.slide, spec.hinge) {
        (Some(axis), None) => (axis, Joint::Slide),
        (None, Some(axis)) => (axis, Joint::Hinge),
        _ => return Err("joint: one of \"slide\" and \"hinge\" is wanted, with the axis".into()),
    };
    let direction = Unit::try_new(Vector3::from(direction), 1e-9).ok_or("joint: its axis has no direction")?;
    let [stiffness, damping] = spec.stop.unwrap_or_default();
    Ok(make(Axis {
        name: spec.name.unwrap_or_else(|| body.into()),
        direction,
        range: spec.range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        damping: spec.damping,
        friction: spec.friction,
        armature: spec.armature,
        spring: spec.spring,
        rest: spec.rest,
        stop: Stop::Spring { stiffness, damping },
    }))
}

/// The convex parts of a shape, each in the frame of the shape.
fn solids(spec: &ShapeSpec) -> Result<Vec<(Shape, Pose)>, String> {
    let said = [
        spec.half.is_some(),
        spec.sphere.is_some(),
        spec.capsule.is_some(),
        spec.cylinder.is_some(),
        spec.points.is_some(),
        spec.mesh.is_some(),
        spec.hole.is_some(),
    ];
    if said.iter().filter(|said| **said).count() != 1 {
        return Err("exactly one of box, sphere, capsule, cylinder, points, mesh, hole is wanted".into());
    }
    if spec.scale.is_some() && spec.mesh.is_none() {
        return Err("scale is for a mesh".into());
    }
    let hulls = if let Some(file) = &spec.mesh {
        let scale = [spec.scale.unwrap_or(1.0); 3];
        let parts = mesh::parts(std::slice::from_ref(file)).map_err(|error| error.to_string())?;
        parts.iter().map(|hull| hull.scaled(scale)).collect::<Result<_, _>>().map_err(|error| error.to_string())?
    } else if let Some(hole) = &spec.hole {
        let &HoleSpec { radius, outer, depth, chamfer, sectors } = hole;
        Hole { radius, outer, depth, chamfer, sectors }.wedges().map_err(|error| error.to_string())?
    } else if let Some(points) = &spec.points {
        let points: Vec<Vector3> = points.iter().copied().map(Vector3::from).collect();
        vec![Hull::new(&points).map_err(|error| error.to_string())?]
    } else {
        vec![]
    };
    let simple = match (spec.half, spec.sphere, spec.capsule, spec.cylinder) {
        (Some(half), ..) => Some(Shape::Box(half.into())),
        (_, Some(radius), ..) => Some(Shape::Sphere { radius }),
        (_, _, Some([half_length, radius]), _) => Some(Shape::Capsule { half_length, radius }),
        (.., Some([half_length, radius])) => Some(Shape::Cylinder { half_length, radius }),
        _ => None,
    };
    Ok(hulls.into_iter().map(Shape::Convex).chain(simple).map(|shape| (shape, Pose::identity())).collect())
}

/// Adds the bodies of one entry to the scene; `first` is the index of the task's first body.
///
/// # Errors
/// A message, if the parent does not stand before the body.
pub fn add(scene: &mut Scene, group: Group, first: usize) -> Result<(), String> {
    let parent = match &group.parent {
        None => None,
        Some(name) => {
            let own = scene.bodies[first..].iter().position(|body| body.name == *name);
            let known = || scene.bodies[first..].iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join(", ");
            Some(
                first
                    + own.ok_or_else(|| {
                        let body = group.bodies.first().map_or("", |body| &body.name);
                        format!(
                            "body {body:?}: its parent {name:?} does not stand before it; before it stand: {}",
                            known()
                        )
                    })?,
            )
        }
    };
    let start = scene.bodies.len();
    for mut body in group.bodies {
        match &mut body.parent {
            Some(place) => *place += start,
            None => {
                body.parent = parent;
                body.pose = group.pose * body.pose;
            }
        }
        scene.bodies.push(body);
    }
    if group.default_stop {
        let stop = default_stop(&scene.bodies, start);
        if let Joint::Hinge(axis) | Joint::Slide(axis) = &mut scene.bodies[start].joint {
            axis.stop = stop;
        }
    }
    Ok(())
}
