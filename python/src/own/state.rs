//! The state that a task's methods read, as it is when they are called.

use std::collections::HashMap;
use std::sync::Arc;

use aforce::{Measurement, Pose, Vector3};
use nalgebra::Point3;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use physics::Simulation;
use physics::gripper::pads_apart;
use physics::scene::{Joint, Scene};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;

use crate::arrays::numbers;

/// Indices of a task's bodies, joints and shapes in its simulation.
pub struct Places {
    /// Each body: its name, the moving body that carries it (`None`: the world), its pose in that body's frame.
    bodies: Vec<(String, Option<usize>, Pose)>,
    /// Name and index of each joint.
    joints: Vec<(String, usize)>,
    /// Of each geom the name of the shape of which it is a part, the name of its body, and its index.
    shapes: Vec<(String, String, usize)>,
    /// Indices of the finger pads' shapes, if there are fingers.
    pads: Option<[usize; 2]>,
}

impl Places {
    /// The indices for the bodies from `first` on. `parts` has the name of the shape of which a geom is a part, where the two differ.
    pub fn new(scene: &Scene, first: usize, parts: &HashMap<String, String>, fingers: bool) -> Self {
        let mut places = Places { bodies: vec![], joints: vec![], shapes: vec![], pads: None };
        for (index, body) in scene.bodies.iter().enumerate().skip(first) {
            let (root, pose) = scene.moving_root(index);
            places.bodies.push((body.name.clone(), root, pose));
            if let Joint::Hinge(axis) | Joint::Slide(axis) = &body.joint {
                places.joints.push((axis.name.clone(), scene.joint(&axis.name)));
            }
            places.shapes.extend(body.geoms.iter().map(|geom| {
                let shape = parts.get(&geom.name).unwrap_or(&geom.name);
                (shape.clone(), body.name.clone(), scene.geom(&geom.name))
            }));
        }
        places.pads = fingers.then(|| ["left_pad", "right_pad"].map(|pad| scene.geom(pad)));
        places
    }
}

/// The pose and velocity of a body, or of the tool.
#[derive(Clone, Copy)]
struct Motion {
    pose: Pose,
    /// Linear and angular velocity (m/s, rad/s; world axes).
    velocity: [Vector3; 2],
}

/// The data of a [`State`].
struct Snapshot {
    places: Arc<Places>,
    y: Measurement,
    time: f64,
    contact_force: f64,
    penalty: f64,
    fingers: Option<f64>,
    bodies: Vec<Motion>,
    joints: Vec<(f64, f64)>,
    /// For each geom, whether the left and the right finger pad press on it.
    pressed: Vec<[bool; 2]>,
}

/// State of the simulation that a task's methods read, as it was when they were called. World axes, SI units.
///
/// time           since the start of the episode (s)
/// tool           pose and velocity of the tool point, a `Place`
/// q, qd          joint angles (rad) and velocities (rad/s); shapes (7,)
/// force, torque  what the environment exerts on the hand, filtered (N, Nm); shapes (3,)
/// contact_force  sustained force on the whole arm at this moment (N)
/// fingers        distance of the finger pads (m); None for a tool without fingers
/// penalty        `force_penalty.weight` (0.05) times this action's largest force, if that is above the limit, else 0. Only `reward`,
///                `success` and `lost` get it; elsewhere it is 0
#[pyclass(frozen, module = "aforce")]
pub struct State(Snapshot);

impl State {
    /// Takes the state of the simulation; `y` is the measurement of the arm.
    pub fn take(places: &Arc<Places>, simulation: &Simulation, y: &Measurement, penalty: f64) -> Self {
        let motion = |(_, root, offset): &(String, Option<usize>, Pose)| {
            let Some(root) = *root else { return Motion { pose: *offset, velocity: [Vector3::zeros(); 2] } };
            let pose = simulation.body_pose(root) * offset;
            let velocity = simulation.body_velocity_at(root, &pose.translation.vector);
            Motion { pose, velocity: halves(&velocity) }
        };
        let pressed =
            |geom: usize| places.pads.map_or([false; 2], |pads| pads.map(|pad| simulation.touching(pad, geom)));
        State(Snapshot {
            y: y.clone(),
            time: simulation.time(),
            contact_force: simulation.contact().arm_force(),
            penalty,
            fingers: simulation.fingers().map(|fingers| pads_apart(fingers.map(|finger| finger.0))),
            bodies: places.bodies.iter().map(motion).collect(),
            joints: places.joints.iter().map(|(_, place)| simulation.joint(*place)).collect(),
            pressed: places.shapes.iter().map(|(.., place)| pressed(*place)).collect(),
            places: Arc::clone(places),
        })
    }

    fn joint_at(&self, name: &str) -> PyResult<(f64, f64)> {
        let joints = &self.0.places.joints;
        let found = joints.iter().position(|(known, _)| known == name);
        found
            .map(|i| self.0.joints[i])
            .ok_or_else(|| unknown("joint", name, joints.iter().map(|(known, _)| known.as_str())))
    }
}

fn halves(six: &aforce::Twist) -> [Vector3; 2] {
    [six.fixed_rows::<3>(0).into(), six.fixed_rows::<3>(3).into()]
}

fn unknown<'a>(kind: &str, name: &str, known: impl Iterator<Item = &'a str>) -> PyErr {
    let known: Vec<&str> = known.collect();
    let known = if known.is_empty() { "none".into() } else { known.join(", ") };
    PyKeyError::new_err(format!("the scene has no {kind} {name:?}; known are {known}"))
}

type Numbers<'py> = Bound<'py, PyArray1<f64>>;

#[pymethods]
impl State {
    #[getter]
    fn time(&self) -> f64 {
        self.0.time
    }

    #[getter]
    fn tool(&self) -> Place {
        Place(Motion { pose: self.0.y.pose, velocity: halves(&self.0.y.twist) })
    }

    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.y.q.as_slice())
    }

    #[getter]
    fn qd<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.y.qd.as_slice())
    }

    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, &self.0.y.wrench.as_slice()[..3])
    }

    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, &self.0.y.wrench.as_slice()[3..])
    }

    #[getter]
    fn contact_force(&self) -> f64 {
        self.0.contact_force
    }

    #[getter]
    fn fingers(&self) -> Option<f64> {
        self.0.fingers
    }

    #[getter]
    fn penalty(&self) -> f64 {
        self.0.penalty
    }

    /// Pose and velocity of the body of this name; KeyError if there is none.
    fn body(&self, name: &str) -> PyResult<Place> {
        let bodies = &self.0.places.bodies;
        let found = bodies.iter().position(|(known, ..)| known == name);
        let place = found.ok_or_else(|| unknown("body", name, bodies.iter().map(|(known, ..)| known.as_str())))?;
        Ok(Place(self.0.bodies[place]))
    }

    /// Position of the joint of this name (rad or m); KeyError if there is none.
    fn joint(&self, name: &str) -> PyResult<f64> {
        self.joint_at(name).map(|(q, _)| q)
    }

    /// Velocity of the joint of this name (rad/s or m/s); KeyError if there is none.
    fn joint_velocity(&self, name: &str) -> PyResult<f64> {
        self.joint_at(name).map(|(_, qd)| qd)
    }

    /// Whether each finger pad presses on the shape of this name, or on a shape of the body of this name; KeyError if there is none. A mesh of
    /// several parts is one shape. Nothing presses before an episode's first action, not even on a body in the hand.
    fn grasped(&self, name: &str) -> PyResult<bool> {
        let shapes = &self.0.places.shapes;
        let named = shapes.iter().zip(&self.0.pressed).filter(|((shape, body, _), _)| shape == name || body == name);
        // The pads may press on different parts.
        let by_pads = named.map(|(_, pressed)| *pressed).reduce(|[left, right], [l, r]| [left || l, right || r]);
        by_pads.map(|pads| pads == [true; 2]).ok_or_else(|| {
            let mut known: Vec<&str> = shapes.iter().map(|(shape, ..)| shape.as_str()).collect();
            known.dedup();
            unknown("shape", name, known.into_iter())
        })
    }
}

/// Pose and velocity of a body or of the tool, world axes.
///
/// position          origin of its frame (m); shape (3,)
/// quaternion        orientation as x, y, z, w; shape (4,)
/// rotation          rotation matrix with its axes as columns; shape (3, 3)
/// velocity          velocity of its origin (m/s); shape (3,)
/// angular_velocity  angular velocity (rad/s); shape (3,)
#[pyclass(frozen, module = "aforce")]
pub struct Place(Motion);

#[pymethods]
impl Place {
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.pose.translation.vector.as_slice())
    }

    #[getter]
    fn quaternion<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.pose.rotation.coords.as_slice())
    }

    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let matrix = self.0.pose.rotation.to_rotation_matrix();
        Array2::from_shape_fn((3, 3), |at| matrix[at]).into_pyarray(py)
    }

    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.velocity[0].as_slice())
    }

    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        PyArray1::from_slice(py, self.0.velocity[1].as_slice())
    }

    /// World position of a point that is given in its frame (m); shapes (3,).
    fn point<'py>(&self, py: Python<'py>, within: &Bound<'py, PyAny>) -> PyResult<Numbers<'py>> {
        let within = Vector3::from_vec(numbers(within, "within", &[3])?);
        Ok(PyArray1::from_slice(py, (self.0.pose * Point3::from(within)).coords.as_slice()))
    }
}
