//! A scene as plain data: bodies, joints, collision shapes.

use aforce::{Pose, Vector3};
use nalgebra::{Translation3, Unit, UnitQuaternion};
use serde::{Deserialize, Serialize};

mod hole;
mod hull;
pub(crate) mod inertial;
mod role;

pub use hole::{Hole, HoleError};
pub use hull::{Hull, HullError};
pub use inertial::Inertial;
pub use role::Role;

/// Everything that is simulated. A body's parent stands before the body.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Bodies in topological order.
    pub bodies: Vec<Body>,
    /// Motors of the joints. [`crate::mjcf`] exports them; the simulation applies any effort and does not look at them.
    pub actuators: Vec<Actuator>,
    /// The one contact that gives way; every other is rigid.
    pub pad: Option<Pad>,
    /// The air around the bodies; `None`: no air.
    pub air: Option<Air>,
    /// Pairs of the robot's parts that never touch: [`crate::robots::Robot::never_touch`].
    pub never_touch: Vec<[u8; 2]>,
    /// Geoms nearer than this (m) become a contact that the engine solves; `None`: the distance covered at 2 m/s in a step, 4 mm
    /// at 2 ms. Around a narrow hole a few times its clearance is enough and costs a third of the time. Geoms that approach by
    /// more than this distance in a step overlap for that step.
    pub prediction: Option<f64>,
}

/// A medium at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Air {
    /// kg/m3
    pub density: f64,
    /// Pa s
    pub viscosity: f64,
}

/// A soft layer on the geoms of [`Role::Tool`], felt where they meet one surface: a spring and a damper at every point of
/// contact, and nothing softer than any other contact beyond its travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pad {
    /// Index of the surface among the geoms of the scene.
    pub surface: usize,
    /// Stiffness at one point of contact (N/m).
    pub stiffness: f64,
    /// Damping at one point of contact (N s/m).
    pub damping: f64,
    /// How far the layer gives way (m).
    pub travel: f64,
}

/// A rigid body.
#[derive(Debug, Clone)]
pub struct Body {
    /// Unique name.
    pub name: String,
    /// Index of the parent body; `None` is the world.
    pub parent: Option<usize>,
    /// Pose of the body frame in the parent's frame (with the joint at zero).
    pub pose: Pose,
    /// How the body moves against its parent.
    pub joint: Joint,
    /// Mass and inertia; zero for static bodies.
    pub inertial: Inertial,
    /// Collision shapes.
    pub geoms: Vec<Geom>,
}

/// Connection of a body to its parent.
#[derive(Debug, Clone, PartialEq)]
pub enum Joint {
    /// Welded: the body is a part of its parent.
    Fixed,
    /// Six free degrees of freedom; only for children of the world.
    Free,
    /// Rotation about an axis (rad, Nm).
    Hinge(Axis),
    /// Translation along an axis (m, N).
    Slide(Axis),
}

/// One degree of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Unique name.
    pub name: String,
    /// Direction in the body frame; the axis passes through the body's origin.
    pub direction: Unit<Vector3>,
    /// Lower and upper end of travel (rad or m); minus and plus infinity for an axis without ends.
    pub range: [f64; 2],
    /// Viscous damping (Nm s/rad or N s/m).
    pub damping: f64,
    /// Dry friction (Nm or N).
    pub friction: f64,
    /// Rotor inertia reflected to the joint (kg m2 or kg).
    pub armature: f64,
    /// Stiffness of a spring (Nm/rad or N/m); 0: none.
    pub spring: f64,
    /// Where the spring is at rest (rad or m).
    pub rest: f64,
    /// What acts beyond the ends of travel.
    pub stop: Stop,
}

/// The soft end stop of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// A spring and a damper.
    Spring {
        /// Nm/rad or N/m.
        stiffness: f64,
        /// Nm s/rad or N s/m.
        damping: f64,
    },
    /// MuJoCo's joint limit, only for the joints of an arm. Under full torque a joint rests less than 0.004 rad beyond its
    /// range. If it starts 0.2 rad before the end, it first overshoots by up to 0.05 rad.
    Constraint,
}

impl Stop {
    /// Effort (Nm or N) of a spring that pushes a joint at `q`, moving with `qd`, back into `range`; 0 for a constraint,
    /// whose torque depends on the whole arm. A stop pushes and never pulls.
    pub fn effort(&self, range: [f64; 2], q: f64, qd: f64) -> f64 {
        let Stop::Spring { stiffness, damping } = *self else { return 0.0 };
        if q < range[0] {
            (stiffness * (range[0] - q) - damping * qd).max(0.0)
        } else if q > range[1] {
            (stiffness * (range[1] - q) - damping * qd).min(0.0)
        } else {
            0.0
        }
    }
}

/// A motor on a joint.
#[derive(Debug, Clone)]
pub struct Actuator {
    /// Name of the driven joint.
    pub joint: String,
    /// Largest effort in either direction (Nm or N). The controller keeps it, the simulation does not enforce it.
    pub max_effort: f64,
}

/// A collision shape on a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Geom {
    /// Unique name.
    pub name: String,
    /// Shape, centred on the geom frame.
    pub shape: Shape,
    /// Pose of the geom frame in the body frame.
    pub pose: Pose,
    /// Sliding friction coefficient; a pair takes the larger of its two.
    pub friction: f64,
    /// What the geom belongs to; decides what it collides with.
    pub role: Role,
    /// Colour in pictures.
    pub color: [u8; 3],
}

/// A collision shape (m), which is also what is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// Half extents along x, y, z.
    Box(Vector3),
    /// Half length of the segment along local z, radius.
    Capsule {
        /// Half length of the segment.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Half length along local z, radius.
    Cylinder {
        /// Half length.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// A ball around the origin of the geom frame.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// The convex hull of points, or of a mesh ([`crate::mesh`]), in the geom frame. A body with hollows has several.
    Convex(Hull),
}

impl Shape {
    /// Its sizes (m): half extents; half length and radius; radius; none of a hull, which was checked when it was made.
    pub fn sizes(&self) -> Vec<f64> {
        match self {
            Shape::Box(half) => vec![half.x, half.y, half.z],
            Shape::Capsule { half_length, radius } | Shape::Cylinder { half_length, radius } => {
                vec![*half_length, *radius]
            }
            Shape::Sphere { radius } => vec![*radius],
            Shape::Convex(_) => vec![],
        }
    }

    /// Name of the kind and its sizes (m), as the 3D pages read them; for a hull, `triangles` and the three corners of
    /// each.
    pub fn kind_and_sizes(&self) -> (&'static str, Vec<f64>) {
        match self {
            Shape::Box(_) => ("box", self.sizes()),
            Shape::Capsule { .. } => ("capsule", self.sizes()),
            Shape::Cylinder { .. } => ("cylinder", self.sizes()),
            Shape::Sphere { .. } => ("sphere", self.sizes()),
            Shape::Convex(hull) => {
                let corners = hull.triangles().as_flattened().iter().map(|&i| hull.corners()[i as usize]);
                ("triangles", corners.flat_map(|corner| [corner.x, corner.y, corner.z]).collect())
            }
        }
    }
}

impl Axis {
    /// Effort of the spring (Nm or N) at `q` (rad or m).
    pub fn spring_effort(&self, q: f64) -> f64 {
        -self.spring * (q - self.rest)
    }

    /// Adds a spring of this `stiffness` (Nm/rad or N/m), at rest at zero. Two springs are one, at rest where their efforts cancel.
    pub(crate) fn add_spring(&mut self, stiffness: f64) {
        let spring = self.spring + stiffness;
        if spring > 0.0 {
            self.rest *= self.spring / spring;
        }
        self.spring = spring;
    }
}

impl Scene {
    /// Adds a body and returns its index.
    pub fn add(&mut self, body: Body) -> usize {
        self.bodies.push(body);
        self.bodies.len() - 1
    }

    /// Adds a static body (child of the world, welded) with `geoms`.
    pub fn add_static(&mut self, name: &str, geoms: Vec<Geom>) -> usize {
        self.add(Body {
            name: name.into(),
            parent: None,
            pose: Pose::identity(),
            joint: Joint::Fixed,
            inertial: Inertial::NONE,
            geoms,
        })
    }

    /// Index of the body called `name`.
    ///
    /// # Panics
    /// If there is none: names are fixed by the code that builds the scene.
    pub fn body(&self, name: &str) -> usize {
        self.bodies.iter().position(|b| b.name == name).unwrap_or_else(|| panic!("no body {name:?} in the scene"))
    }

    /// Place of the joint called `name` among those of one degree of freedom: what [`crate::Simulation::joint`] takes.
    ///
    /// # Panics
    /// If there is none.
    pub fn joint(&self, name: &str) -> usize {
        let mut axes = self.bodies.iter().filter_map(|body| match &body.joint {
            Joint::Hinge(axis) | Joint::Slide(axis) => Some(axis),
            Joint::Fixed | Joint::Free => None,
        });
        axes.position(|axis| axis.name == name).unwrap_or_else(|| panic!("no joint {name:?} in the scene"))
    }

    /// The joint of one degree of freedom called `name`.
    ///
    /// # Panics
    /// If there is none.
    pub(crate) fn axis_mut(&mut self, name: &str) -> &mut Axis {
        let mut axes = self.bodies.iter_mut().filter_map(|body| match &mut body.joint {
            Joint::Hinge(axis) | Joint::Slide(axis) => Some(axis),
            Joint::Fixed | Joint::Free => None,
        });
        axes.find(|axis| axis.name == name).unwrap_or_else(|| panic!("no joint {name:?} in the scene"))
    }

    /// Place of the geom called `name` among all geoms of the scene.
    ///
    /// # Panics
    /// If there is none.
    pub fn geom(&self, name: &str) -> usize {
        let mut geoms = self.bodies.iter().flat_map(|b| &b.geoms);
        geoms.position(|g| g.name == name).unwrap_or_else(|| panic!("no geom {name:?} in the scene"))
    }

    /// The moving body that body `index` is welded to (itself if it moves; `None` is the world), and the pose of body
    /// `index` in the frame of that body.
    pub fn moving_root(&self, index: usize) -> (Option<usize>, Pose) {
        let body = &self.bodies[index];
        match (&body.joint, body.parent) {
            (Joint::Fixed, Some(parent)) => {
                let (root, pose) = self.moving_root(parent);
                (root, pose * body.pose)
            }
            (Joint::Fixed, None) => (None, body.pose),
            _ => (Some(index), Pose::identity()),
        }
    }

    /// Whether the moving body `index`, or what is welded to it, has a shape of the arm or its tool.
    pub(crate) fn is_arm_joint(&self, index: usize) -> bool {
        let welded = |&(i, _): &(usize, &Body)| self.moving_root(i).0 == Some(index);
        self.bodies
            .iter()
            .enumerate()
            .filter(welded)
            .flat_map(|(_, body)| &body.geoms)
            .any(|geom| geom.role.is_on_arm())
    }

    /// Mass properties of the moving body `index` with everything welded to it.
    pub fn merged_inertial(&self, index: usize) -> Inertial {
        (0..self.bodies.len()).fold(Inertial::NONE, |sum, i| match self.moving_root(i) {
            (Some(root), pose) if root == index => sum.merged(&self.bodies[i].inertial.transformed(&pose)),
            _ => sum,
        })
    }
}

/// Pose from a position and a quaternion w, x, y, z (normalised here: published
/// tables round them).
pub fn pose(position: [f64; 3], wxyz: [f64; 4]) -> Pose {
    let [w, x, y, z] = wxyz;
    Pose::from_parts(
        Translation3::from(Vector3::from(position)),
        UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z)),
    )
}

/// Pose without rotation.
pub fn at(position: [f64; 3]) -> Pose {
    pose(position, [1.0, 0.0, 0.0, 0.0])
}

/// Pose and half length of the capsule or cylinder whose axis runs from `a` to `b`.
pub fn between(a: [f64; 3], b: [f64; 3]) -> (Pose, f64) {
    let (a, b) = (Vector3::from(a), Vector3::from(b));
    let axis = b - a;
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), &axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    (Pose::from_parts(Translation3::from((a + b) / 2.0), rotation), axis.norm() / 2.0)
}
