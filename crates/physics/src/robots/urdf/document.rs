//! A URDF as links and joints, with every number checked.

use std::collections::HashSet;

use aforce::{Pose, Vector3};
use nalgebra::{Matrix3, UnitQuaternion, UnitVector3};
use roxmltree::{Document as Xml, Node, ParsingOptions};

use super::element::{child, named, optional, origin, required, vector};
use super::error::UrdfError;
use super::shapes::{Collision, collisions};
use crate::robots::check::impossible;
use crate::scene::Inertial;

/// An inertia below this (kg m2) counts as none and need not be physically possible: makers write small numbers for frames.
const NOTHING: f64 = 1e-6;

/// The links and joints of a URDF.
#[derive(Debug, Clone)]
pub struct Document {
    /// What the file calls the robot.
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

#[derive(Debug, Clone)]
pub(super) struct Link {
    pub name: String,
    /// In the link's frame; zero if the file gives none. An error if it is physically impossible, which concerns only an arm that carries the
    /// link.
    pub inertial: Result<Inertial, UrdfError>,
    /// An error concerns only an arm that carries the link and whose shapes are wanted.
    pub collisions: Result<Vec<Collision>, UrdfError>,
}

#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub name: String,
    /// As in the file: `revolute`, `fixed` and so on.
    pub kind: String,
    pub parent: String,
    pub child: String,
    /// The child's frame in the parent's, the joint at zero.
    pub origin: Pose,
    /// As in the file.
    pub axis: Vector3,
    /// Lower and upper end; 0 for one that the file does not give, `None` if it gives neither.
    pub range: Option<[f64; 2]>,
    pub effort: Option<f64>,
    pub velocity: Option<f64>,
    pub damping: f64,
    pub friction: f64,
    /// The joint that this one follows.
    pub mimics: Option<String>,
}

impl Document {
    /// Reads the text of a URDF.
    ///
    /// # Errors
    /// If it is not XML or not a URDF: a name occurs twice, a parent or a child does not exist, a number cannot be read, a mass is below 0,
    /// the joints are not a tree. Names the link or the joint.
    pub fn parse(text: &str) -> Result<Document, UrdfError> {
        let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
        let xml = Xml::parse_with_options(text, options);
        let xml = xml.map_err(|error| UrdfError::new(format!("no URDF: {error}")))?;
        let root = xml.root_element();
        if root.tag_name().name() != "robot" {
            let found = root.tag_name().name();
            return Err(UrdfError::new(format!("no URDF: its element is <{found}>; <robot> is wanted")));
        }
        if let Some(left) =
            root.children().find(|node| node.tag_name().namespace().is_some_and(|n| n.contains("xacro")))
        {
            let tag = left.tag_name().name();
            return Err(UrdfError::new(format!(
                "<xacro:{tag}> is left in it: write the URDF with `xacro FILE > arm.urdf`"
            )));
        }
        let elements = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
        let document = Document {
            name: root.attribute("name").unwrap_or("arm").into(),
            links: elements("link").map(link).collect::<Result<_, _>>()?,
            joints: elements("joint").map(joint).collect::<Result<_, _>>()?,
        };
        document.check()?;
        Ok(document)
    }

    /// Checks the names, and that the joints are one tree.
    fn check(&self) -> Result<(), UrdfError> {
        unique("link", self.links.iter().map(|link| &link.name))?;
        unique("joint", self.joints.iter().map(|joint| &joint.name))?;
        let mut moved = HashSet::new();
        for joint in &self.joints {
            for (end, link) in [("parent", &joint.parent), ("child", &joint.child)] {
                if self.link(link).is_none() {
                    let name = &joint.name;
                    return Err(UrdfError::new(format!("joint {name:?}: its {end} {link:?} is no link of the file")));
                }
            }
            if !moved.insert(&joint.child) {
                let link = &joint.child;
                return Err(UrdfError::new(format!(
                    "link {link:?} is the child of two joints; the joints of a URDF are a tree"
                )));
            }
        }
        let mut roots = self.links.iter().filter(|link| !moved.contains(&link.name)).map(|link| &link.name);
        match (roots.next(), roots.next()) {
            (Some(a), Some(b)) => {
                return Err(UrdfError::new(format!(
                    "links {a:?} and {b:?} both have no parent; the joints of a URDF are one tree"
                )));
            }
            (None, _) => return Err(UrdfError::new("no link is without a parent; the joints of a URDF are a tree")),
            _ => {}
        }
        // With a single root, joints can form a loop only in a part that is not connected to the root.
        let ended = |link: &Link| self.way_to(&link.name).len() <= self.joints.len();
        match self.links.iter().find(|link| !ended(link)) {
            Some(link) => {
                Err(UrdfError::new(format!("link {:?} is below itself; the joints of a URDF are a tree", link.name)))
            }
            None => Ok(()),
        }
    }

    pub(super) fn link(&self, name: &str) -> Option<&Link> {
        self.links.iter().find(|link| link.name == name)
    }

    /// The joints from the root to `link`, in order; one more than the file has if the joints form a loop.
    pub(super) fn way_to(&self, link: &str) -> Vec<&Joint> {
        let mut way = vec![];
        let mut link = link;
        while let Some(joint) = self.joints.iter().find(|joint| joint.child == link) {
            way.push(joint);
            if way.len() > self.joints.len() {
                break;
            }
            link = &joint.parent;
        }
        way.reverse();
        way
    }
}

fn unique<'a>(what: &str, names: impl Iterator<Item = &'a String>) -> Result<(), UrdfError> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(UrdfError::new(format!("two {what}s are called {name:?}")));
        }
    }
    Ok(())
}

fn link(node: Node) -> Result<Link, UrdfError> {
    let name = named(node)?;
    let at = format!("link {name:?}");
    let inertial = child(node, "inertial").map_or(Ok(Ok(Inertial::NONE)), |node| inertial(node, &at))?;
    Ok(Link { inertial, collisions: collisions(node, &at), name })
}

/// The outer error refuses the file: a number is missing or cannot be read, or the mass is below 0. The inner error is for
/// an inertia that is physically impossible.
fn inertial(node: Node, at: &str) -> Result<Result<Inertial, UrdfError>, UrdfError> {
    let value = |tag: &str, attribute: &str| {
        let element = child(node, tag);
        let element = element.ok_or_else(|| UrdfError::new(format!("{at}: <inertial> has no <{tag}>")))?;
        required(element, attribute, at)
    };
    let mass = value("mass", "value")?;
    if mass < 0.0 {
        return Err(UrdfError::new(format!("{at}: a mass of {mass} kg; it must be at least 0")));
    }
    let [xx, xy, xz] = [value("inertia", "ixx")?, value("inertia", "ixy")?, value("inertia", "ixz")?];
    let [yy, yz, zz] = [value("inertia", "iyy")?, value("inertia", "iyz")?, value("inertia", "izz")?];
    let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let origin = origin(node, at)?;
    // A point mass, or a frame without mass, that is welded to another link.
    let is_point = inertia.amax() < NOTHING;
    if let Some(reason) = impossible(&inertia).filter(|_| !is_point) {
        return Ok(Err(UrdfError::new(format!("{at}: {reason}"))));
    }
    if mass == 0.0 && !is_point {
        let problem = format!("{at}: it has an inertia and a mass of 0 kg; both or neither is wanted");
        return Ok(Err(UrdfError::new(problem)));
    }
    Ok(Ok(Inertial { mass, com: Vector3::zeros(), inertia }.transformed(&origin)))
}

fn joint(node: Node) -> Result<Joint, UrdfError> {
    let name = named(node)?;
    let at = format!("joint {name:?}");
    let end = |tag: &str| {
        let link = child(node, tag).and_then(|element| element.attribute("link"));
        link.map(String::from).ok_or_else(|| UrdfError::new(format!("{at}: <{tag} link=...> is missing")))
    };
    let limit = child(node, "limit");
    let of_limit = |attribute: &str| limit.map_or(Ok(None), |limit| optional(limit, attribute, &at));
    let ends = [of_limit("lower")?, of_limit("upper")?];
    let dynamics = child(node, "dynamics");
    let of_dynamics = |attribute: &str| {
        let value = dynamics.map_or(Ok(None), |dynamics| optional(dynamics, attribute, &at))?.unwrap_or(0.0);
        if value < 0.0 {
            return Err(UrdfError::new(format!("{at}: a {attribute} of {value}; it must be at least 0")));
        }
        Ok(value)
    };
    let axis = child(node, "axis").map_or(Ok(None), |axis| vector(axis, "xyz", &at))?;
    let mimics = child(node, "mimic").map(|mimic| mimic.attribute("joint").unwrap_or("another").into());
    Ok(Joint {
        kind: node.attribute("type").unwrap_or_default().into(),
        parent: end("parent")?,
        child: end("child")?,
        origin: origin(node, &at)?,
        // The format's default.
        axis: axis.unwrap_or([1.0, 0.0, 0.0]).into(),
        range: ends.iter().any(Option::is_some).then(|| ends.map(|end| end.unwrap_or(0.0))),
        effort: of_limit("effort")?,
        velocity: of_limit("velocity")?,
        damping: of_dynamics("damping")?,
        friction: of_dynamics("friction")?,
        mimics,
        name,
    })
}

impl Joint {
    /// A rotation that turns z to the joint's axis.
    pub(super) fn to_z(&self) -> Result<UnitQuaternion<f64>, UrdfError> {
        let axis = UnitVector3::try_new(self.axis, 1e-9);
        let (name, [x, y, z]) = (&self.name, self.axis.into());
        let axis =
            axis.ok_or_else(|| UrdfError::new(format!("joint {name:?}: the axis {x} {y} {z} has no direction")))?;
        // For an axis opposite to z any half turn about a perpendicular axis will do.
        Ok(UnitQuaternion::rotation_between(&Vector3::z(), &axis)
            .unwrap_or_else(|| UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI)))
    }
}
