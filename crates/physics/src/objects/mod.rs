//! Objects from files: MJCF of MuJoCo and URDF, as a part of a scene.
//!
//! A small part of both formats is read. Anything else in a file is refused with file and line: nothing is left out
//! silently. Meshes are replaced by their convex hulls ([`crate::mesh`]).

mod defaults;
mod mjcf;
mod urdf;
mod xml;

use std::path::{Path, PathBuf};

use aforce::Pose;
use thiserror::Error;

pub use self::urdf::Root;
use crate::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Stop};

/// What was read: bodies, each parent being an index into this list.
#[derive(Debug, Clone, Default)]
pub struct Part {
    /// Bodies in topological order, with the file's names.
    pub bodies: Vec<Body>,
}

/// Why a file was not read: where, and what is wrong.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}:{line}: {what}", file.display())]
pub struct ReadError {
    /// The file.
    pub file: PathBuf,
    /// Line in it, from 1; 0 if the file could not be opened.
    pub line: u32,
    /// What is wrong, by its name, and what would be right.
    pub what: String,
}

/// Reads the bodies of an MJCF file.
///
/// Elements and attributes that are understood: one `compiler` (`angle`, `eulerseq`, `autolimits`, `meshdir`), `default` with
/// classes, `asset/mesh` (`file` or `vertex`, `scale`), and in `worldbody` bodies with `inertial`, one `joint` of type hinge,
/// slide or free or one `freejoint`, and geoms of type box, sphere, capsule, cylinder or mesh. Orientations are `quat`,
/// `axisangle` or `euler`; capsules and cylinders may have `fromto`. Geoms of the world itself become a body that is called as
/// the model is.
///
/// As in MuJoCo, a body without `inertial` has the mass of its geoms (1000 kg/m3 without `mass` or `density`). A joint
/// beyond its range is stopped by the spring and damper of a negative `solreflimit`; without one it has those that MuJoCo's default
/// gives for the inertia of what the joint carries. What moves gets [`Role::Object`], what stands still [`Role::Fixture`].
///
/// # Errors
/// The first thing that is not understood or not possible, with its line. [`Scene::check`] tells whether the bodies make a scene.
pub fn read_mjcf(file: &Path) -> Result<Part, ReadError> {
    mjcf::read(file)
}

/// Reads the links of a URDF file as bodies, the first one fixed to the world or free.
///
/// Understood are links with `inertial`, `collision` and the colour of their `visual`, joints of type fixed, revolute, continuous
/// and prismatic with `origin`, `axis`, `limit` and `dynamics`, and shapes box, sphere, cylinder and mesh. `friction` is the
/// sliding friction of every geom, which the format does not have. Only `collision` becomes a shape. The limits of effort and
/// velocity are ignored, because they belong to motors. End stops are as in [`read_mjcf`].
///
/// # Errors
/// As [`read_mjcf`].
pub fn read_urdf(file: &Path, root: Root, friction: f64) -> Result<Part, ReadError> {
    urdf::read(file, root, friction)
}

impl Scene {
    /// Appends the bodies of `part` to the scene, the origin of the file's world at `pose` (world). Returns the index of
    /// the first body added.
    pub fn add_part(&mut self, part: Part, pose: &Pose) -> usize {
        let first = self.bodies.len();
        self.bodies.extend(part.bodies.into_iter().map(|mut body| {
            match &mut body.parent {
                Some(parent) => *parent += first,
                None => body.pose = pose * body.pose,
            }
            body
        }));
        first
    }
}

impl Part {
    /// Sets what depends on the whole file: roles, and the end stops of joints that have none of their own.
    fn finish(bodies: Vec<Unfinished>) -> Part {
        let mut scene = Scene::default();
        let stops: Vec<bool> = bodies.iter().map(|body| body.default_stop).collect();
        scene.bodies = bodies.into_iter().map(|unfinished| unfinished.body).collect();
        for (index, default_here) in stops.into_iter().enumerate() {
            let role = if scene.moving_root(index).0.is_some() { Role::Object } else { Role::Fixture };
            scene.bodies[index].geoms.iter_mut().for_each(|geom| geom.role = role);
            if default_here {
                let stop = default_stop(&scene.bodies, index);
                if let Joint::Hinge(axis) | Joint::Slide(axis) = &mut scene.bodies[index].joint {
                    axis.stop = stop;
                }
            }
        }
        Part { bodies: scene.bodies }
    }
}

/// A body as it was read.
struct Unfinished {
    body: Body,
    /// Whether its joint, if any, has MuJoCo's default end stop.
    default_stop: bool,
}

/// Mass of a body and all that it carries, in its frame, joints at zero.
fn carried(bodies: &[Body], index: usize) -> Inertial {
    let children = (index + 1..bodies.len()).filter(|&child| bodies[child].parent == Some(index));
    children
        .fold(bodies[index].inertial, |sum, child| sum.merged(&carried(bodies, child).transformed(&bodies[child].pose)))
}

/// MuJoCo's `solreflimit="0.02 1"` for the joint of the body at `index` and what that carries: critically damped, 20 ms.
pub fn default_stop(bodies: &[Body], index: usize) -> Stop {
    const TIME: f64 = 0.02;
    let carried = carried(bodies, index);
    // kg m2 or kg.
    let inertia = match &bodies[index].joint {
        Joint::Hinge(axis) => axis.armature + carried.about(&axis.direction),
        Joint::Slide(axis) => axis.armature + carried.mass,
        Joint::Fixed | Joint::Free => carried.mass,
    };
    Stop::Spring { stiffness: inertia / (TIME * TIME), damping: 2.0 * inertia / TIME }
}

/// A joint with the default values.
fn plain_axis(name: &str, direction: nalgebra::Unit<aforce::Vector3>) -> Axis {
    Axis {
        name: name.into(),
        direction,
        range: [f64::NEG_INFINITY, f64::INFINITY],
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
        spring: 0.0,
        rest: 0.0,
        stop: Stop::Spring { stiffness: 0.0, damping: 0.0 },
    }
}

/// Name of a geom that has none.
fn nameless(body: &str, geoms: &[Geom]) -> String {
    format!("{body}_{}", geoms.len())
}
