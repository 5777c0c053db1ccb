//! The part of MJCF that describes objects.

mod element;
mod geom;
mod inertial;
mod joint;
mod mesh;
mod pose;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use aforce::Pose;
use roxmltree::Node;

use self::element::Element;
use self::joint::Placed;
use super::defaults::Classes;
use super::xml::{Source, called, elements, shift};
use super::{Part, ReadError, Unfinished};
use crate::scene::{Body, Geom, Hull, Inertial, Joint};

/// A file that is being read.
struct File<'a> {
    source: Source<'a>,
    /// The file's unit of angle (rad).
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
    if let Some(second) = called(root, "compiler").nth(1) {
        return Err(source.wrong(second, "a second <compiler>; write all its settings into one"));
    }
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

    /// Geoms of the world become a body called `name`.
    fn take_world(&mut self, world: Node, name: &str) -> Result<(), ReadError> {
        let mut geoms = vec![];
        for node in called(world, "geom") {
            let (geom, _) = Element { file: self, node, childclass: None }.geom(name, &geoms)?;
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

    /// Adds a body, and all below it, to `parent`. `frame` is the pose of the parent's frame here in the parent's frame
    /// of the file.
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
        let element = |node| Element { file: self, node, childclass: class };
        let only = |names: [&'static str; 2]| {
            let mut found = elements(node).filter(|child| names.contains(&child.tag_name().name()));
            let first = found.next();
            match found.next() {
                Some(second) => Err(source.wrong(second, format!("body {name:?} has one already; one is read"))),
                None => Ok(first),
            }
        };
        let Placed { joint, at, default_stop } = match only(["joint", "freejoint"])? {
            Some(joint) => element(joint).joint(name)?,
            None => Placed::without_axis(Joint::Fixed),
        };
        // In a scene a joint's axis passes through the origin of its body, so the body's frame is moved to the joint.
        let (there, back) = (shift(at), shift(-at));
        let (mut geoms, mut matter) = (vec![], Inertial::NONE);
        for child in called(node, "geom") {
            let (geom, mass) = element(child).geom(name, &geoms)?;
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
}
