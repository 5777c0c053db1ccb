//! The part of MJCF that describes objects.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion};
use roxmltree::Node;

use super::defaults::Classes;
use super::xml::{Source, called, elements, shift};
use super::{Part, ReadError, Unfinished, nameless, plain_axis};
use crate::mesh;
use crate::scene::{Body, Geom, Hull, Inertial, Joint, Role, Shape, Stop, between};

/// MuJoCo's density of a geom without mass (kg/m3), its sliding friction and its colour.
const DENSITY: f64 = 1000.0;
const FRICTION: f64 = 1.0;
const GREY: [u8; 3] = [128; 3];

/// What holds for the whole file.
struct File<'a> {
    source: Source<'a>,
    /// A unit of angle (rad).
    degree: f64,
    /// Axes of Euler angles: small letters turn with the body, capitals do not.
    eulerseq: String,
    meshes: HashMap<String, Hull>,
    classes: Classes,
    bodies: Vec<Unfinished>,
}

pub(super) fn read(file: &Path) -> Result<Part, ReadError> {
    let source = Source { file };
    let text = source.text()?;
    let document = source.parse(&text, "mujoco")?;
    let root = document.root_element();
    source.allow(root, &["model"], &["compiler", "default", "asset", "worldbody"])?;
    let mut read = File {
        source,
        degree: std::f64::consts::PI / 180.0,
        eulerseq: "xyz".into(),
        meshes: HashMap::new(),
        classes: Classes::default(),
        bodies: vec![],
    };
    let mut folder = file.parent().map(PathBuf::from).unwrap_or_default();
    for node in called(root, "compiler") {
        source.allow(node, &["angle", "eulerseq", "autolimits", "meshdir"], &[])?;
        read.take_compiler(node)?;
        folder.push(node.attribute("meshdir").unwrap_or_default());
    }
    called(root, "default").try_for_each(|node| read.classes.add(source, node, None))?;
    for assets in called(root, "asset") {
        source.allow(assets, &[], &["mesh"])?;
        elements(assets).try_for_each(|node| read.take_mesh(node, &folder))?;
    }
    for world in called(root, "worldbody") {
        source.allow(world, &[], &["body", "geom"])?;
        read.take_world(world, root.attribute("model").unwrap_or("fixtures"))?;
    }
    Ok(Part::finish(read.bodies))
}

impl File<'_> {
    fn take_compiler(&mut self, node: Node) -> Result<(), ReadError> {
        match node.attribute("angle") {
            None | Some("degree") => {}
            Some("radian") => self.degree = 1.0,
            Some(other) => return Err(self.source.wrong(node, format!("angle={other:?}: degree or radian is wanted"))),
        }
        if node.attribute("autolimits").is_some_and(|value| value != "true") {
            return Err(self.source.wrong(node, "autolimits is read only where it is \"true\""));
        }
        if let Some(sequence) = node.attribute("eulerseq") {
            if sequence.len() != 3 || !sequence.chars().all(|axis| "xyzXYZ".contains(axis)) {
                return Err(self
                    .source
                    .wrong(node, format!("eulerseq={sequence:?}: three of x, y, z, X, Y, Z are wanted")));
            }
            self.eulerseq = sequence.into();
        }
        Ok(())
    }

    fn take_mesh(&mut self, node: Node, folder: &Path) -> Result<(), ReadError> {
        let source = self.source;
        source.allow(node, &["name", "class", "file", "vertex", "scale"], &[])?;
        let hull = match (node.attribute("file"), node.attribute("vertex")) {
            (Some(file), None) => mesh::hull(&folder.join(file)).map_err(|error| source.wrong(node, error))?,
            (None, Some(text)) => {
                let numbers = source.numbers(node, "vertex", text)?;
                let (points, rest) = numbers.as_chunks::<3>();
                if !rest.is_empty() {
                    return Err(source.wrong(node, "vertex: three numbers for each point are wanted"));
                }
                let points: Vec<Vector3> = points.iter().map(|&point| point.into()).collect();
                Hull::new(&points).map_err(|error| source.wrong(node, error))?
            }
            _ => return Err(source.wrong(node, "a mesh has either a file or vertex")),
        };
        let hull = match self.classes.value(source, node, None, "scale")? {
            Some(text) => hull.scaled(source.array(node, "scale", text)?).map_err(|error| source.wrong(node, error))?,
            None => hull,
        };
        // MuJoCo calls a mesh without name as its file.
        let stem = node.attribute("file").and_then(|file| Path::new(file).file_stem()?.to_str());
        let Some(name) = node.attribute("name").or(stem) else {
            return Err(source.wrong(node, "the attribute \"name\" is missing"));
        };
        match self.meshes.insert(name.into(), hull) {
            None => Ok(()),
            Some(_) => Err(source.wrong(node, format!("a second mesh {name:?}"))),
        }
    }

    /// Geoms of the world become a body called `name`.
    fn take_world(&mut self, world: Node, name: &str) -> Result<(), ReadError> {
        let mut geoms = vec![];
        for node in called(world, "geom") {
            let (geom, _) = self.geom(node, None, name, &geoms)?;
            geoms.push(geom);
        }
        if !geoms.is_empty() {
            let body = Body {
                name: name.into(),
                parent: None,
                pose: Pose::identity(),
                joint: Joint::Fixed,
                inertial: Inertial::NONE,
                geoms,
            };
            self.bodies.push(Unfinished { body, default_stop: false });
        }
        let mut bodies = called(world, "body");
        bodies.try_for_each(|node| self.take_body(node, None, &Pose::identity(), None))
    }

    /// Adds a body, and all below it, to `parent`, whose frame as it is here has pose `frame` in that of the file.
    fn take_body(
        &mut self,
        node: Node,
        parent: Option<usize>,
        frame: &Pose,
        around: Option<&str>,
    ) -> Result<(), ReadError> {
        let source = self.source;
        let attributes = ["name", "childclass", "pos", "quat", "euler", "axisangle"];
        source.allow(node, &attributes, &["inertial", "joint", "freejoint", "geom", "body"])?;
        let name = source.required(node, "name")?;
        let class = node.attribute("childclass").or(around);
        let only = |names: [&'static str; 2]| {
            let mut found = elements(node).filter(|child| names.contains(&child.tag_name().name()));
            let first = found.next();
            match found.next() {
                Some(second) => Err(source.wrong(second, format!("body {name:?} has one already; one is read"))),
                None => Ok(first),
            }
        };
        let (joint, at, default_stop) = match only(["joint", "freejoint"])? {
            Some(joint) => self.joint(joint, class, name)?,
            None => (Joint::Fixed, Vector3::zeros(), false),
        };
        // A joint's axis passes through its body's origin here.
        let (there, back) = (shift(at), shift(-at));
        let (mut geoms, mut matter) = (vec![], Inertial::NONE);
        for child in called(node, "geom") {
            let (geom, mass) = self.geom(child, class, name, &geoms)?;
            matter = matter.merged(&mass.transformed(&(back * geom.pose)));
            geoms.push(Geom { pose: back * geom.pose, ..geom });
        }
        let inertial = match only(["inertial"; 2])? {
            Some(inertial) => self.inertial(inertial)?.transformed(&back),
            None => matter,
        };
        let pose = frame.inverse() * self.pose(node)? * there;
        let body = Body { name: name.into(), parent, pose, joint, inertial, geoms };
        self.bodies.push(Unfinished { body, default_stop });
        let index = self.bodies.len() - 1;
        let mut children = called(node, "body");
        children.try_for_each(|child| self.take_body(child, Some(index), &there, class))
    }

    /// A joint, where it is in its body's frame (m), and whether its stop is MuJoCo's default.
    fn joint(&self, node: Node, class: Option<&str>, body: &str) -> Result<(Joint, Vector3, bool), ReadError> {
        let source = self.source;
        let free = (Joint::Free, Vector3::zeros(), false);
        if node.has_tag_name("freejoint") {
            source.allow(node, &["name"], &[])?;
            return Ok(free);
        }
        let value = |name| self.classes.value(source, node, class, name);
        let kind = value("type")?.unwrap_or("hinge");
        if kind == "free" {
            source.allow(node, &["name", "type", "class"], &[])?;
            // MuJoCo gives a free joint what its class says of joints; only a freejoint has nothing of it.
            for name in ["damping", "frictionloss", "stiffness", "armature"] {
                if value(name)?.map_or(Ok(0.0), |text| source.number(node, name, text))? != 0.0 {
                    return Err(
                        source.wrong(node, format!("a free joint with {name} is not read; <freejoint/> has none"))
                    );
                }
            }
            return Ok(free);
        }
        let attributes = [
            "name",
            "class",
            "type",
            "pos",
            "axis",
            "range",
            "limited",
            "damping",
            "frictionloss",
            "stiffness",
            "springref",
            "armature",
            "solreflimit",
        ];
        source.allow(node, &attributes, &[])?;
        let unit = match kind {
            "hinge" => self.degree,
            "slide" => 1.0,
            other => return Err(source.wrong(node, format!("type={other:?}; read are hinge, slide and free"))),
        };
        let size = |name| value(name)?.map_or(Ok(0.0), |text| source.size(node, name, text));
        let direction = match value("axis")? {
            Some(text) => source.direction(node, "axis", text)?,
            None => Vector3::z_axis(),
        };
        let mut axis = plain_axis(node.attribute("name").unwrap_or(body), direction);
        (axis.damping, axis.friction) = (size("damping")?, size("frictionloss")?);
        (axis.spring, axis.armature) = (size("stiffness")?, size("armature")?);
        if let Some(text) = value("springref")? {
            axis.rest = source.number(node, "springref", text)? * unit;
        }
        let limited = value("limited")?;
        if !matches!(limited, None | Some("auto" | "true" | "false")) {
            return Err(source.wrong(node, "limited: auto, true or false is wanted"));
        }
        match value("range")? {
            Some(text) if limited != Some("false") => {
                axis.range = source.array::<2>(node, "range", text)?.map(|end| end * unit);
            }
            None if limited == Some("true") => return Err(source.wrong(node, "limited, and no range")),
            _ => {}
        }
        let stop = value("solreflimit")?.map(|text| source.array::<2>(node, "solreflimit", text)).transpose()?;
        let default_stop = stop.is_none_or(|stop| stop == [0.02, 1.0]);
        if let Some([stiffness, damping]) = stop.filter(|_| !default_stop) {
            if stiffness > 0.0 || damping > 0.0 {
                let answer = "solreflimit is read as \"0.02 1\", or as minus a stiffness and minus a damping";
                return Err(source.wrong(node, answer));
            }
            axis.stop = Stop::Spring { stiffness: -stiffness, damping: -damping };
        }
        let at = match node.attribute("pos") {
            Some(text) => source.array::<3>(node, "pos", text)?.into(),
            None => Vector3::zeros(),
        };
        Ok((if kind == "hinge" { Joint::Hinge(axis) } else { Joint::Slide(axis) }, at, default_stop))
    }

    /// A geom in its body's frame as it is in the file, and its mass in the geom's frame.
    fn geom(
        &self,
        node: Node,
        class: Option<&str>,
        body: &str,
        others: &[Geom],
    ) -> Result<(Geom, Inertial), ReadError> {
        let source = self.source;
        let attributes = [
            "name",
            "class",
            "type",
            "size",
            "fromto",
            "mesh",
            "pos",
            "quat",
            "euler",
            "axisangle",
            "mass",
            "density",
            "friction",
            "condim",
            "rgba",
        ];
        source.allow(node, &attributes, &[])?;
        let value = |name| self.classes.value(source, node, class, name);
        let mut pose = self.pose(node)?;
        let kind = value("type")?.unwrap_or("sphere");
        let sizes = || match value("size")? {
            Some(text) => source.numbers(node, "size", text),
            None => Err(source.wrong(node, "the attribute \"size\" is missing")),
        };
        let too_few = |wanted: &str| source.wrong(node, format!("the size of a {kind} is {wanted}"));
        let from_to = node.attribute("fromto").map(|text| source.array::<6>(node, "fromto", text)).transpose()?;
        let from_to = from_to.map(|[a, b, c, d, e, f]| between([a, b, c], [d, e, f]));
        if from_to.is_some() && !["capsule", "cylinder"].contains(&kind) {
            return Err(source.wrong(node, "fromto is read for capsules and cylinders"));
        }
        if let Some((other, _)) = from_to {
            if ["pos", "quat", "euler", "axisangle"].iter().any(|name| node.has_attribute(*name)) {
                return Err(source.wrong(node, "fromto says position and direction; others beside it contradict it"));
            }
            pose = other;
        }
        let shape = match kind {
            "box" => {
                let [x, y, z] = sizes()?[..] else { return Err(too_few("three half lengths")) };
                Shape::Box(Vector3::new(x, y, z))
            }
            "sphere" => {
                let [radius] = sizes()?[..] else { return Err(too_few("a radius")) };
                Shape::Sphere { radius }
            }
            "capsule" | "cylinder" => {
                let (radius, half_length) = match (&sizes()?[..], from_to) {
                    (&[radius], Some((_, half_length))) => (radius, half_length),
                    (&[radius, half_length], None) => (radius, half_length),
                    _ => return Err(too_few("a radius and a half length, or with fromto a radius")),
                };
                match kind {
                    "capsule" => Shape::Capsule { half_length, radius },
                    _ => Shape::Cylinder { half_length, radius },
                }
            }
            "mesh" => {
                let name = source.required(node, "mesh")?;
                let hull = self.meshes.get(name).cloned();
                Shape::Convex(hull.ok_or_else(|| source.wrong(node, format!("there is no mesh {name:?}")))?)
            }
            other => {
                let answer = format!("type={other:?}; read are box, sphere, capsule, cylinder and mesh");
                return Err(source.wrong(node, answer));
            }
        };
        if kind != "mesh" && node.has_attribute("mesh") {
            return Err(source.wrong(node, format!("a {kind} that is fitted to a mesh is not read")));
        }
        // Friction against turning and rolling acts in contacts of more than three dimensions only.
        if value("condim")?.is_some_and(|condim| condim != "3") {
            return Err(source.wrong(node, "condim is read where it is 3"));
        }
        let friction = match value("friction")? {
            Some(text) => source.numbers(node, "friction", text)?[0],
            None => FRICTION,
        };
        let inertial = match (node.attribute("mass"), value("density")?) {
            (Some(text), _) => Inertial::of_mass(&shape, source.size(node, "mass", text)?),
            (None, Some(text)) => Inertial::solid(&shape, source.size(node, "density", text)?),
            (None, None) => Inertial::solid(&shape, DENSITY),
        };
        let color = value("rgba")?.map_or(Ok(GREY), |text| source.color(node, "rgba", text))?;
        let name = node.attribute("name").map_or_else(|| nameless(body, others), String::from);
        Ok((Geom { name, shape, pose, friction, role: Role::Object, color }, inertial))
    }

    fn inertial(&self, node: Node) -> Result<Inertial, ReadError> {
        let source = self.source;
        let attributes = ["pos", "quat", "euler", "axisangle", "mass", "diaginertia", "fullinertia"];
        source.allow(node, &attributes, &[])?;
        let mass = source.size(node, "mass", source.required(node, "mass")?)?;
        let pose = self.pose(node)?;
        let inertia = match (node.attribute("diaginertia"), node.attribute("fullinertia")) {
            (Some(text), None) => Matrix3::from_diagonal(&source.array(node, "diaginertia", text)?.into()),
            (None, Some(text)) => {
                if pose.rotation != UnitQuaternion::identity() {
                    return Err(
                        source.wrong(node, "fullinertia is along the body's axes; an orientation contradicts it")
                    );
                }
                let [xx, yy, zz, xy, xz, yz] = source.array(node, "fullinertia", text)?;
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
            _ => return Err(source.wrong(node, "either diaginertia or fullinertia is wanted")),
        };
        Ok(Inertial { mass, com: Vector3::zeros(), inertia }.transformed(&pose))
    }

    /// `pos`, and one of the three orientations.
    fn pose(&self, node: Node) -> Result<Pose, ReadError> {
        let source = self.source;
        let position = match node.attribute("pos") {
            Some(text) => source.array::<3>(node, "pos", text)?.into(),
            None => Vector3::zeros(),
        };
        let said = ["quat", "euler", "axisangle"].map(|name| node.attribute(name));
        let rotation = match said {
            [None, None, None] => UnitQuaternion::identity(),
            [Some(text), None, None] => {
                let [w, x, y, z] = source.array(node, "quat", text)?;
                let unit = Unit::try_new(Quaternion::new(w, x, y, z), 1e-9);
                unit.ok_or_else(|| source.wrong(node, "a quat of length 0"))?
            }
            [None, Some(text), None] => self.euler(source.array(node, "euler", text)?),
            [None, None, Some(text)] => {
                let [x, y, z, angle] = source.array(node, "axisangle", text)?;
                let axis = Unit::try_new(Vector3::new(x, y, z), 1e-9);
                let axis = axis.ok_or_else(|| source.wrong(node, "axisangle has no direction"))?;
                UnitQuaternion::from_axis_angle(&axis, angle * self.degree)
            }
            _ => return Err(source.wrong(node, "more than one of quat, euler and axisangle")),
        };
        Ok(Pose::from_parts(position.into(), rotation))
    }

    fn euler(&self, angles: [f64; 3]) -> UnitQuaternion<f64> {
        self.eulerseq.chars().zip(angles).fold(UnitQuaternion::identity(), |rotation, (letter, angle)| {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let turn = UnitQuaternion::from_axis_angle(&axis, angle * self.degree);
            if letter.is_lowercase() { rotation * turn } else { turn * rotation }
        })
    }
}
