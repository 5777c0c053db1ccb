//! The part of URDF that describes objects.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, UnitQuaternion};
use roxmltree::Node;

use super::xml::{Source, called, elements};
use super::{Part, ReadError, Unfinished, nameless, plain_axis};
use crate::mesh;
use crate::scene::{Body, Geom, Inertial, Joint, Role, Shape};

/// How the first link of a URDF stands in the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Root {
    /// Fixed to the world.
    Fixed,
    /// Free to move.
    Free,
}

/// Colour of a link that has none.
const GREY: [u8; 3] = [128; 3];

struct File<'a, 'd> {
    source: Source<'a>,
    links: HashMap<&'d str, Node<'d, 'd>>,
    joints: Vec<Node<'d, 'd>>,
    /// Colours with a name.
    materials: HashMap<&'d str, [u8; 3]>,
    friction: f64,
    bodies: Vec<Unfinished>,
}

pub(super) fn read(file: &Path, root: Root, friction: f64) -> Result<Part, ReadError> {
    let source = Source { file };
    let text = source.text()?;
    let document = source.parse(&text, "robot")?;
    let robot = document.root_element();
    source.allow(robot, &["name"], &["link", "joint", "material"])?;
    let mut read = File {
        source,
        links: HashMap::new(),
        joints: called(robot, "joint").collect(),
        materials: HashMap::new(),
        friction,
        bodies: vec![],
    };
    for node in called(robot, "link") {
        let name = source.required(node, "name")?;
        if read.links.insert(name, node).is_some() {
            return Err(source.wrong(node, format!("a second link {name:?}")));
        }
    }
    for node in called(robot, "material") {
        let color = read.material(node)?;
        read.materials.insert(source.required(node, "name")?, color);
    }
    let first = read.first(robot)?;
    let joint = if root == Root::Free { Joint::Free } else { Joint::Fixed };
    read.take_link(first, None, Pose::identity(), joint, false)?;
    Ok(Part::finish(read.bodies))
}

impl<'d> File<'_, 'd> {
    /// The link that no joint moves; an error if the joints are not a tree.
    fn first(&self, robot: Node<'d, 'd>) -> Result<&'d str, ReadError> {
        let source = self.source;
        let mut moved = HashSet::new();
        for &joint in &self.joints {
            let [parent, child] = self.ends(joint)?;
            for link in [parent, child] {
                if !self.links.contains_key(link) {
                    return Err(source.wrong(joint, format!("there is no link {link:?}")));
                }
            }
            if !moved.insert(child) {
                return Err(source.wrong(joint, format!("link {child:?} is moved by two joints")));
            }
        }
        let mut roots =
            called(robot, "link").filter_map(|node| node.attribute("name")).filter(|name| !moved.contains(name));
        match (roots.next(), roots.next()) {
            (Some(first), None) => match called(robot, "link").find(|link| !self.hangs_on(first, *link)) {
                Some(link) => {
                    Err(source.wrong(link, format!("it does not hang on {first:?}: joints go round in a circle")))
                }
                None => Ok(first),
            },
            (Some(first), Some(second)) => {
                Err(source.wrong(robot, format!("links {first:?} and {second:?} hang together by no joint")))
            }
            (None, _) => Err(source.wrong(robot, "no link is without a joint above it; the joints are a tree")),
        }
    }

    /// Whether the way up the joints from `link` ends at the link `first`; each link has at most one joint above it.
    fn hangs_on(&self, first: &str, link: Node) -> bool {
        let above = |link: &str| {
            let mut ends = self.joints.iter().filter_map(|&joint| self.ends(joint).ok());
            ends.find(|[_, child]| *child == link).map(|[parent, _]| parent)
        };
        let mut at = link.attribute("name");
        for _ in 0..=self.joints.len() {
            match at {
                Some(name) if name == first => return true,
                Some(name) => at = above(name),
                None => return false,
            }
        }
        false
    }

    /// Names of the links above and below a joint.
    fn ends(&self, joint: Node<'d, 'd>) -> Result<[&'d str; 2], ReadError> {
        let end = |name: &str| {
            let node =
                self.source.only(joint, name)?.ok_or_else(|| self.source.wrong(joint, format!("no <{name}>")))?;
            self.source.allow(node, &["link"], &[])?;
            self.source.required(node, "link")
        };
        Ok([end("parent")?, end("child")?])
    }

    fn take_link(
        &mut self,
        name: &'d str,
        parent: Option<usize>,
        pose: Pose,
        joint: Joint,
        default_stop: bool,
    ) -> Result<(), ReadError> {
        let source = self.source;
        let node = self.links[name];
        source.allow(node, &["name"], &["inertial", "visual", "collision"])?;
        let inertial = match source.only(node, "inertial")? {
            Some(inertial) => self.inertial(inertial)?,
            None => Inertial::NONE,
        };
        let mut color = GREY;
        for visual in called(node, "visual") {
            source.allow(visual, &["name"], &["origin", "geometry", "material"])?;
            if let Some(material) = source.only(visual, "material")? {
                color = self.material(material)?;
            }
        }
        let mut geoms = vec![];
        for collision in called(node, "collision") {
            source.allow(collision, &["name"], &["origin", "geometry"])?;
            let shape = self.shape(collision)?;
            let pose = self.origin(collision)?;
            let name = collision.attribute("name").map_or_else(|| nameless(name, &geoms), String::from);
            geoms.push(Geom { name, shape, pose, friction: self.friction, role: Role::Object, color });
        }
        let body = Body { name: name.into(), parent, pose, joint, inertial, geoms };
        self.bodies.push(Unfinished { body, default_stop });
        let index = self.bodies.len() - 1;
        for child in self.joints.clone() {
            let [above, below] = self.ends(child)?;
            if above == name {
                let (joint, default_stop) = self.joint(child)?;
                self.take_link(below, Some(index), self.origin(child)?, joint, default_stop)?;
            }
        }
        Ok(())
    }

    /// A joint, and whether it has end stops.
    fn joint(&self, node: Node) -> Result<(Joint, bool), ReadError> {
        let source = self.source;
        source.allow(node, &["name", "type"], &["origin", "parent", "child", "axis", "limit", "dynamics"])?;
        let kind = source.required(node, "type")?;
        let direction = match source.only(node, "axis")? {
            Some(axis) => {
                source.allow(axis, &["xyz"], &[])?;
                source.direction(axis, "xyz", source.required(axis, "xyz")?)?
            }
            None => Vector3::x_axis(),
        };
        let mut axis = plain_axis(source.required(node, "name")?, direction);
        if let Some(dynamics) = source.only(node, "dynamics")? {
            source.allow(dynamics, &["damping", "friction"], &[])?;
            let size = |name| dynamics.attribute(name).map_or(Ok(0.0), |text| source.size(dynamics, name, text));
            (axis.damping, axis.friction) = (size("damping")?, size("friction")?);
        }
        let limit = source.only(node, "limit")?;
        if let Some(limit) = limit {
            source.allow(limit, &["lower", "upper", "effort", "velocity"], &[])?;
        }
        let ended = ["revolute", "prismatic"].contains(&kind);
        if ended {
            let limit = limit.ok_or_else(|| source.wrong(node, format!("a {kind} joint has a <limit>")))?;
            let end = |name| limit.attribute(name).map_or(Ok(0.0), |text| source.number(limit, name, text));
            axis.range = [end("lower")?, end("upper")?];
        }
        match kind {
            "revolute" | "continuous" => Ok((Joint::Hinge(axis), ended)),
            "prismatic" => Ok((Joint::Slide(axis), ended)),
            "fixed" => Ok((Joint::Fixed, false)),
            other => {
                let answer = format!("type={other:?}; read are revolute, continuous, prismatic and fixed");
                Err(source.wrong(node, answer))
            }
        }
    }

    fn inertial(&self, node: Node) -> Result<Inertial, ReadError> {
        let source = self.source;
        source.allow(node, &[], &["origin", "mass", "inertia"])?;
        let part = |name: &str, attributes: &[&str]| {
            let part = source.only(node, name)?.ok_or_else(|| source.wrong(node, format!("no <{name}>")))?;
            source.allow(part, attributes, &[]).map(|()| part)
        };
        let mass = part("mass", &["value"])?;
        let mass = source.size(mass, "value", source.required(mass, "value")?)?;
        let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
        let matrix = part("inertia", &names)?;
        let mut m = [0.0; 6];
        for (value, name) in m.iter_mut().zip(names) {
            *value = source.number(matrix, name, source.required(matrix, name)?)?;
        }
        let [xx, xy, xz, yy, yz, zz] = m;
        let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Ok(Inertial { mass, com: Vector3::zeros(), inertia }.transformed(&self.origin(node)?))
    }

    /// The shape in the `geometry` of a collision.
    fn shape(&self, node: Node) -> Result<Shape, ReadError> {
        let source = self.source;
        let geometry = source.only(node, "geometry")?.ok_or_else(|| source.wrong(node, "no <geometry>"))?;
        source.allow(geometry, &[], &["box", "sphere", "cylinder", "mesh"])?;
        let shapes: Vec<Node> = elements(geometry).collect();
        let [shape] = shapes[..] else { return Err(source.wrong(geometry, "one shape in it is wanted")) };
        let size = |name| source.size(shape, name, source.required(shape, name)?);
        match shape.tag_name().name() {
            "box" => {
                source.allow(shape, &["size"], &[])?;
                let size: [f64; 3] = source.array(shape, "size", source.required(shape, "size")?)?;
                Ok(Shape::Box(Vector3::from(size) / 2.0))
            }
            "sphere" => {
                source.allow(shape, &["radius"], &[])?;
                Ok(Shape::Sphere { radius: size("radius")? })
            }
            "cylinder" => {
                source.allow(shape, &["radius", "length"], &[])?;
                Ok(Shape::Cylinder { half_length: size("length")? / 2.0, radius: size("radius")? })
            }
            _ => {
                source.allow(shape, &["filename", "scale"], &[])?;
                let file = source.required(shape, "filename")?;
                if file.contains("://") {
                    return Err(source.wrong(shape, format!("{file:?}: a path from the URDF's folder is wanted")));
                }
                let folder = source.file.parent().unwrap_or(Path::new(""));
                let hull = mesh::hull(&folder.join(file)).map_err(|error| source.wrong(shape, error))?;
                let hull = match shape.attribute("scale") {
                    Some(text) => {
                        hull.scaled(source.array(shape, "scale", text)?).map_err(|error| source.wrong(shape, error))?
                    }
                    None => hull,
                };
                Ok(Shape::Convex(hull))
            }
        }
    }

    /// The colour of a material, its own or that of its name.
    fn material(&self, node: Node) -> Result<[u8; 3], ReadError> {
        let source = self.source;
        source.allow(node, &["name"], &["color"])?;
        if let Some(color) = source.only(node, "color")? {
            source.allow(color, &["rgba"], &[])?;
            return source.color(color, "rgba", source.required(color, "rgba")?);
        }
        let name = source.required(node, "name")?;
        self.materials.get(name).copied().ok_or_else(|| source.wrong(node, format!("no colour is called {name:?}")))
    }

    /// The pose in the `origin` of an element.
    fn origin(&self, node: Node) -> Result<Pose, ReadError> {
        let Some(origin) = self.source.only(node, "origin")? else { return Ok(Pose::identity()) };
        self.source.allow(origin, &["xyz", "rpy"], &[])?;
        let triple = |name| origin.attribute(name).map_or(Ok([0.0; 3]), |text| self.source.array(origin, name, text));
        let (position, [roll, pitch, yaw]) = (Vector3::from(triple("xyz")?), triple("rpy")?);
        Ok(Pose::from_parts(position.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
    }
}
