//! The arm between a base and a tool of a URDF.

use aforce::{JointVector, Pose};
use nalgebra::UnitQuaternion;

use super::document::{Document, Joint};
use super::error::UrdfError;
use super::meshes::MeshFolders;
use super::shapes::{Collision, turned_back};
use crate::robots::check::impossible;
use crate::robots::panda::capsule;
use crate::robots::{JOINTS, Link, Robot};
use crate::scene::{Geom, Inertial, Role, Shape};

/// Range of a joint without end (rad): sixteen turns either way.
const ENDLESS: [f64; 2] = [-100.0, 100.0];
/// Largest end of a range (rad): two turns. A larger number is probably in degrees and is refused.
const LARGEST_ANGLE: f64 = 4.0 * std::f64::consts::PI + 0.01;
/// Range, limits and rotor inertia of the seventh joint of an arm of six, which does not move.
const NO_LIMIT: f64 = 1.0;
const GREY: [u8; 3] = [170, 172, 178];

/// Which part of a URDF is the arm, and values that replace or complete the URDF's. A list has one entry for each joint
/// that moves, from the base on.
#[derive(Debug, Clone, Default)]
pub struct Choices {
    /// The link that stands on the mount; `None`: the root.
    pub base: Option<String>,
    /// The link that is the flange; `None`: the one at the end of the arm, if there is only one.
    pub tool: Option<String>,
    /// The flange in the frame of that link.
    pub flange: Pose,
    /// Ends of the joints (rad).
    pub range: Option<Vec<[f64; 2]>>,
    /// Largest speeds (rad/s).
    pub speed_max: Option<Vec<f64>>,
    /// Largest torques (Nm).
    pub torque_max: Option<Vec<f64>>,
    /// Whether collision shapes are left out.
    pub without_shapes: bool,
    /// Where the files of meshes are.
    pub meshes: MeshFolders,
    /// Capsules on top of the file's shapes: link, the ends of the axis in the link's frame, radius (m).
    pub capsules: Vec<Capsule>,
    /// Pairs of links that never touch, besides neighbours.
    pub never_touch: Vec<[String; 2]>,
}

/// A capsule on a link.
#[derive(Debug, Clone)]
pub struct Capsule {
    /// The link.
    pub link: String,
    /// One end of its axis (m, in the link's frame).
    pub from: [f64; 3],
    /// The other end (m, in the link's frame).
    pub to: [f64; 3],
    /// Radius (m).
    pub radius: f64,
}

/// The arm of a URDF. Its links are turned so that each joint turns about its own z; the flange keeps the frame of its link. What neither
/// file nor choices give is as in `rest`: rotor inertia, limits on torque rates, speed of the tool, drives, gripper, mount, air. The home
/// is zero.
///
/// # Errors
/// If there is no such link, the way to the tool has other joints than six or seven revolute ones, or a joint on it has no axis, range,
/// speed or torque that an arm can have, or follows another joint; if a link that the arm carries has an inertia that no body has, or
/// what a joint moves weighs nothing; if a collision shape that is wanted has no size, or its mesh is not found, not closed or has no
/// hull. Names link or joint.
pub fn robot(document: &Document, choices: &Choices, rest: &Robot) -> Result<Robot, UrdfError> {
    let tool = tool(document, choices)?;
    let way = way(document, choices.base.as_deref(), tool)?;
    let hinges = hinges(&way, tool)?;
    let mut robot = Robot {
        name: document.name.clone(),
        joints: hinges.len(),
        base: vec![],
        flange: choices.flange,
        flange_inertial: Inertial::NONE,
        home: JointVector::zeros(),
        never_touch: (0..JOINTS as u8).map(|part| [part, part + 1]).collect(),
        ..rest.clone()
    };
    let mut turns = vec![];
    for i in 0..JOINTS {
        let joint = hinges.get(i).copied();
        set_limits(&mut robot, i, joint, choices)?;
        let (damping, friction) = joint.map_or((0.0, 0.0), |joint| (joint.damping, joint.friction));
        robot.links[i] = Link { frame: Pose::identity(), inertial: Inertial::NONE, geoms: vec![], damping, friction };
        turns.extend(joint.map(Joint::to_z).transpose()?);
    }
    let root = way.first().map_or(tool, |joint| joint.parent.as_str());
    let mut tree = Tree { document, hinges: &hinges, turns, tool, choices, robot, carriers: vec![] };
    tree.take_in(root, 0, Pose::identity())?;
    let Tree { mut robot, carriers, .. } = tree;
    for (i, joint) in hinges.iter().enumerate() {
        let Inertial { mass, inertia, .. } = &robot.links[i].inertial;
        let at = format!("link {:?}, which joint {:?} moves", joint.child, joint.name);
        if *mass <= 0.0 {
            return Err(UrdfError::new(format!("{at}, has no mass, nor has anything that is fixed to it")));
        }
        if let Some(reason) = impossible(inertia) {
            return Err(UrdfError::new(format!("{at}: {reason}")));
        }
    }
    let part = |link: &String| {
        let found = carriers.iter().find(|(name, _)| name == link).map(|(_, part)| *part);
        found.ok_or_else(|| UrdfError::new(format!("never_touch: {}", unknown_link(document, link))))
    };
    for [a, b] in &choices.never_touch {
        robot.never_touch.push([part(a)?, part(b)?]);
    }
    if let Some(capsule) =
        choices.capsules.iter().find(|capsule| !carriers.iter().any(|(name, _)| *name == capsule.link))
    {
        return Err(UrdfError::new(format!("capsules: {}", unknown_link(document, &capsule.link))));
    }
    Ok(robot)
}

fn unknown_link(document: &Document, link: &str) -> String {
    let known: Vec<&str> = document.links.iter().map(|link| link.name.as_str()).collect();
    if known.contains(&link) {
        return format!("link {link:?} does not hang on the base");
    }
    let hint = aforce::record::nearest(link, &known).map(|name| format!("; did you mean {name:?}?"));
    format!("no link {link:?}{}", hint.unwrap_or_else(|| format!("; there are {}", known.join(", "))))
}

/// The link that is the flange.
fn tool<'a>(document: &'a Document, choices: &'a Choices) -> Result<&'a str, UrdfError> {
    if let Some(tool) = &choices.tool {
        let link = document.link(tool);
        return Ok(&link.ok_or_else(|| UrdfError::new(format!("tool: {}", unknown_link(document, tool))))?.name);
    }
    let is_end = |name: &str| !document.joints.iter().any(|joint| joint.parent == name);
    let moves = |name: &str| document.way_to(name).iter().any(|joint| is_hinge(joint));
    let ends: Vec<&str> =
        document.links.iter().map(|link| link.name.as_str()).filter(|name| is_end(name) && moves(name)).collect();
    match ends[..] {
        [one] => Ok(one),
        // The name that ROS-Industrial gives to a flange.
        _ if ends.contains(&"tool0") => Ok("tool0"),
        [] => Err(UrdfError::new("no joint is revolute or continuous; an arm has six or seven that are")),
        _ => Err(UrdfError::new(format!(
            "which link is the flange? The key `tool` of a robot file says it; the arm ends in {}",
            ends.join(", ")
        ))),
    }
}

/// The joints from the base to the tool.
fn way<'a>(document: &'a Document, base: Option<&str>, tool: &str) -> Result<Vec<&'a Joint>, UrdfError> {
    let mut way = document.way_to(tool);
    let Some(base) = base else { return Ok(way) };
    if document.link(base).is_none() {
        return Err(UrdfError::new(format!("base: {}", unknown_link(document, base))));
    }
    match way.iter().position(|joint| joint.parent == base) {
        Some(first) => Ok(way.split_off(first)),
        None => Err(UrdfError::new(format!("base: link {base:?} is not on the way to {tool:?}"))),
    }
}

fn is_hinge(joint: &Joint) -> bool {
    matches!(joint.kind.as_str(), "revolute" | "continuous")
}

/// The joints that move the tool.
fn hinges<'a>(way: &[&'a Joint], tool: &str) -> Result<Vec<&'a Joint>, UrdfError> {
    let moving: Vec<&Joint> = way.iter().copied().filter(|joint| joint.kind != "fixed").collect();
    if !(JOINTS - 1..=JOINTS).contains(&moving.len()) || !moving.iter().all(|joint| is_hinge(joint)) {
        let found: Vec<String> = moving.iter().map(|joint| format!("{} ({})", joint.name, joint.kind)).collect();
        let found = if found.is_empty() { "no joint that moves".into() } else { found.join(", ") };
        return Err(UrdfError::new(format!(
            "the way to {tool:?} has {found}; six or seven revolute joints are wanted. The keys `base` and `tool` of a robot file \
             say where an arm begins and ends"
        )));
    }
    match moving.iter().find_map(|joint| Some((joint, joint.mimics.as_ref()?))) {
        Some((joint, other)) => Err(UrdfError::new(format!(
            "joint {:?} follows {other:?} (<mimic>); a joint of the arm must move by itself",
            joint.name
        ))),
        None => Ok(moving),
    }
}

/// Sets range, largest speed and largest torque of joint `i`. `joint` is `None` for the seventh joint of an arm of six.
fn set_limits(robot: &mut Robot, i: usize, joint: Option<&Joint>, choices: &Choices) -> Result<(), UrdfError> {
    let arm = &mut robot.arm;
    let Some(joint) = joint else {
        (arm.range[i], arm.speed_max[i], arm.torque_max[i]) = ([-NO_LIMIT, NO_LIMIT], NO_LIMIT, NO_LIMIT);
        arm.rotor_inertia[i] = NO_LIMIT;
        return Ok(());
    };
    let name = &joint.name;
    let wrong = |what: String| Err(UrdfError::new(format!("joint {name:?}: {what}")));
    arm.range[i] = match (choices.range.as_ref().and_then(|range| range.get(i).copied()), joint.range) {
        (Some(range), _) => range,
        (None, _) if joint.kind == "continuous" => ENDLESS,
        (None, Some(range)) => range,
        (None, None) => return wrong("it is revolute and has no <limit lower=... upper=...>".into()),
    };
    let [low, high] = arm.range[i];
    if low >= high {
        return wrong(format!("a range of {low} to {high} rad; the lower end must be below the upper one"));
    }
    let endless = arm.range[i] == ENDLESS && joint.kind == "continuous";
    if !endless && low.abs().max(high.abs()) > LARGEST_ANGLE {
        return wrong(format!(
            "a range of {low} to {high} rad; are these degrees? At most two turns, 12.57, are allowed"
        ));
    }
    for (what, unit, key, said, own, to) in [
        ("speed (velocity)", "rad/s", "speed_max", joint.velocity, &choices.speed_max, &mut arm.speed_max[i]),
        ("torque (effort)", "Nm", "torque_max", joint.effort, &choices.torque_max, &mut arm.torque_max[i]),
    ] {
        match own.as_ref().and_then(|own| own.get(i).copied()).or(said) {
            Some(most) if most > 0.0 => *to = most,
            Some(most) => {
                return wrong(format!(
                    "a largest {what} of {most} {unit}; it must be above 0. The key `{key}` of a robot file can say it"
                ));
            }
            None => {
                return wrong(format!("no largest {what}: <limit> has to say it, or the key `{key}` of a robot file"));
            }
        }
    }
    Ok(())
}

struct Tree<'a> {
    document: &'a Document,
    /// The joints that move, in order.
    hinges: &'a [&'a Joint],
    /// Orientation of each robot link's frame, whose z is the joint's axis, in the frame of the link in the file.
    turns: Vec<UnitQuaternion<f64>>,
    tool: &'a str,
    choices: &'a Choices,
    /// What has been read.
    robot: Robot,
    /// Every link that has been read, and how many joints carry it.
    carriers: Vec<(String, u8)>,
}

impl Tree<'_> {
    /// Adds `link` of the file, and all below it, to the part of the robot that `part` joints carry: the base for 0, else that link. `pose` is
    /// the pose of `link` in the frame of that part.
    fn take_in(&mut self, link: &str, part: usize, pose: Pose) -> Result<(), UrdfError> {
        let document = self.document;
        self.carriers.push((link.into(), part as u8));
        if let Some(found) = document.link(link) {
            if part > 0 {
                let inertial = &mut self.robot.links[part - 1].inertial;
                *inertial = inertial.merged(&found.inertial.clone()?.transformed(&pose));
            }
            if !self.choices.without_shapes {
                self.add_shapes(link, &found.collisions.clone()?, part, &pose)?;
            }
        }
        self.add_capsules(link, part, &pose)?;
        if link == self.tool {
            self.robot.flange = pose * self.choices.flange;
        }
        for child in document.joints.iter().filter(|joint| joint.parent == link) {
            let pose = pose * child.origin;
            if let Some(i) = self.hinges.iter().position(|joint| joint.name == child.name) {
                let turn = self.turns[i];
                self.robot.links[i].frame = pose * turn;
                self.take_in(&child.child, i + 1, turned_back(&turn))?;
            } else {
                self.take_in(&child.child, part, pose)?;
            }
        }
        Ok(())
    }

    /// Role and list of the shapes that `part` joints carry. The base's shapes are fixtures, as the mount's are.
    fn shapes_of(&mut self, part: usize) -> (Role, &mut Vec<Geom>) {
        match part {
            0 => (Role::Fixture, &mut self.robot.base),
            link => (Role::Link(link as u8), &mut self.robot.links[link - 1].geoms),
        }
    }

    fn add_shapes(&mut self, link: &str, shapes: &[Collision], part: usize, pose: &Pose) -> Result<(), UrdfError> {
        for (k, collision) in shapes.iter().enumerate() {
            let (shape, place) = match collision {
                Collision::Shape { shape, pose: own } => (shape.clone(), pose * own),
                Collision::Mesh { file, scale, pose: own } => {
                    let hull = self.choices.meshes.hull(file, *scale);
                    (Shape::Convex(hull.map_err(|error| no_mesh(link, &error))?), pose * own)
                }
            };
            let (role, geoms) = self.shapes_of(part);
            let name = format!("{}_{k}", plain(link));
            geoms.push(Geom { name, shape, pose: place, friction: 1.0, role, color: GREY });
        }
        Ok(())
    }

    fn add_capsules(&mut self, link: &str, part: usize, pose: &Pose) -> Result<(), UrdfError> {
        let choices = self.choices;
        for (k, own) in choices.capsules.iter().enumerate().filter(|(_, capsule)| capsule.link == link) {
            let length = (nalgebra::Vector3::from(own.to) - nalgebra::Vector3::from(own.from)).norm();
            if !(own.radius > 0.0 && own.radius.is_finite() && length > 1e-6 && length.is_finite()) {
                return Err(UrdfError::new(format!(
                    "capsules: the one on {link:?} has a radius of {} m and a length of {length} m; both must be above 0",
                    own.radius
                )));
            }
            let (role, geoms) = self.shapes_of(part);
            let geom = capsule(&format!("{}_capsule", plain(link)), k, role, own.from, own.to, own.radius);
            geoms.push(Geom { pose: pose * geom.pose, color: GREY, ..geom });
        }
        Ok(())
    }
}

fn no_mesh(link: &str, error: &str) -> UrdfError {
    UrdfError::new(format!(
        "link {link:?}: {error} (in a robot file, shapes = \"none\" leaves all collision shapes out, and `capsules` gives others)"
    ))
}

/// A link's name, with `_` for characters that may have a meaning in XML.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "_-.".contains(c) { c } else { '_' }).collect()
}
