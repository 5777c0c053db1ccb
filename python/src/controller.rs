//! The control law alone.

use aforce::host::contact_axis;
use aforce::{ActionSpace, Arm, Jacobian, JointMatrix, JointVector, Pose, Vector3, Vector6, Wrench};
use nalgebra::{Matrix3, Quaternion, Translation3, UnitQuaternion, UnitVector3};
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, numbers};
use crate::exclusive::Exclusive;
use crate::keywords::env_config;
use crate::{type_error, value_error};

/// Names of the built-in action spaces.
#[pyfunction]
pub fn spaces() -> Vec<String> {
    ActionSpace::names()
}

/// Measurement(*, q, qd, position, orientation, jacobian, mass, bias, wrench=0, twist=None)
///
/// What the law reads of an arm at one control sample. World axes, linear part first, at the tool point; SI units.
///
/// q, qd        joint angles (rad) and velocities (rad/s), 7
/// position     of the tool (m), 3
/// orientation  of the tool: a unit quaternion x, y, z, w, or a rotation matrix 3 x 3
/// jacobian     6 x 7: twist = jacobian @ qd
/// mass         joint mass matrix with rotor inertia (kg m2), 7 x 7
/// bias         torques that hold the arm against gravity and Coriolis forces (Nm), 7
/// wrench       what the environment exerts on the tool, filtered: force (N) and moment about the tool point (Nm), 6
/// twist        velocity of the tool (m/s, rad/s), 6; jacobian @ qd if it is not given
///
/// ValueError for a wrong shape or a mass matrix that is not symmetric, TypeError for values that are not numbers. Numbers that are not finite
/// are no error: the law then holds the arm with `bias` and counts a fault.
#[pyclass(frozen, module = "aforce")]
pub struct Measurement(aforce::Measurement);

#[pymethods]
impl Measurement {
    #[new]
    #[pyo3(signature = (*, q, qd, position, orientation, jacobian, mass, bias, wrench=None, twist=None))]
    #[allow(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        q: &Bound<'_, PyAny>,
        qd: &Bound<'_, PyAny>,
        position: &Bound<'_, PyAny>,
        orientation: &Bound<'_, PyAny>,
        jacobian: &Bound<'_, PyAny>,
        mass: &Bound<'_, PyAny>,
        bias: &Bound<'_, PyAny>,
        wrench: Option<&Bound<'_, PyAny>>,
        twist: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let joints = |value, name| Ok::<_, PyErr>(JointVector::from_vec(numbers(value, name, &[7])?));
        let six = |value, name| Ok::<_, PyErr>(Vector6::from_vec(numbers(value, name, &[6])?));
        let position = Translation3::from(Vector3::from_vec(numbers(position, "position", &[3])?));
        let qd = joints(qd, "qd")?;
        let jacobian = Jacobian::from_row_slice(&numbers(jacobian, "jacobian", &[6, 7])?);
        let mass = JointMatrix::from_row_slice(&numbers(mass, "mass", &[7, 7])?);
        if let Some([row, column]) = aforce::asymmetry(&mass) {
            let (lower, upper) = (mass[(row, column)], mass[(column, row)]);
            return Err(value_error(format!(
                "mass is not symmetric: mass[{row}, {column}] = {lower}, mass[{column}, {row}] = {upper}, a difference of {}",
                (lower - upper).abs()
            )));
        }
        Ok(Self(aforce::Measurement {
            q: joints(q, "q")?,
            qd,
            pose: Pose::from_parts(position, rotation(orientation)?),
            twist: twist.map_or(Ok(jacobian * qd), |twist| six(twist, "twist"))?,
            jacobian,
            mass,
            bias: joints(bias, "bias")?,
            wrench: wrench.map_or(Ok(Wrench::zeros()), |wrench| six(wrench, "wrench"))?,
        }))
    }
}

/// Whether one of the keywords is no key of `env.controller`.
fn unknown_setting(section: &Bound<'_, PyDict>) -> PyResult<bool> {
    let known = toml::Table::try_from(aforce::ControllerConfig::default()).map_err(value_error)?;
    for key in section.keys() {
        if !known.contains_key(&key.extract::<String>()?) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Largest deviation of a quaternion's length from 1.
const UNIT: f64 = 1e-3;

/// A rotation from a quaternion x, y, z, w, which is not normalised, or from a matrix.
fn rotation(value: &Bound<'_, PyAny>) -> PyResult<UnitQuaternion<f64>> {
    if is_matrix(value) {
        let matrix = Matrix3::from_row_slice(&numbers(value, "orientation", &[3, 3])?);
        // A matrix with entries that are not finite passes: the controller counts the fault.
        let finite = matrix.iter().all(|entry| entry.is_finite());
        let unknown = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
        let rotation = aforce::rotation_from_matrix(&matrix).or((!finite).then_some(unknown));
        return rotation.ok_or_else(|| value_error("orientation is no rotation matrix"));
    }
    let [x, y, z, w] = numbers(value, "orientation", &[4])?[..] else { unreachable!("four numbers") };
    let quaternion = Quaternion::new(w, x, y, z);
    if quaternion.norm().is_finite() && (quaternion.norm() - 1.0).abs() > UNIT {
        return Err(value_error(format!("orientation has length {}, a unit quaternion has 1", quaternion.norm())));
    }
    Ok(UnitQuaternion::new_unchecked(quaternion))
}

fn is_matrix(value: &Bound<'_, PyAny>) -> bool {
    if let Ok(array) = value.cast::<numpy::PyUntypedArray>() {
        return array.ndim() == 2;
    }
    // A list of lists is a matrix.
    value.len().is_ok_and(|len| len > 0) && value.get_item(0).is_ok_and(|first| first.len().is_ok())
}

/// Controller(space="aforce", dt=0.002, *, torque_limits=None, torque_rate_limits=None, contact_axis=(0, 0, 1), **settings)
///
/// From the actions of an action space to joint torques: the Rust crate's controller, bit for bit.
///
/// space               a name of `aforce.spaces()`, a file, or a dict of changes
/// dt                  length of a control sample (s); 1/dt is a whole multiple of policy_hz
/// torque_limits       largest torque of each joint (Nm), 7; the Panda's if not given
/// torque_rate_limits  largest rate of each joint's torque (Nm/s), 7; none if not given
/// contact_axis        direction, world axes, in which the environment pushes on the tool, for spaces with force
/// settings            what stands below `env.controller` in a configuration: policy_hz, position_step, rotation_step, force, ..;
///                     not control_hz, which is 1/dt
///
/// `reset(measurement)`, then one `set_goal(action, measurement)` for each action and one `update(measurement)` for each sample.
#[pyclass(frozen, module = "aforce")]
pub struct Controller(Exclusive<Law>);

struct Law {
    controller: aforce::Controller,
    config: aforce::ControllerConfig,
    /// Whether an episode has begun.
    ready: bool,
}

/// Numbers as a new array.
type Numbers<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (space=None, dt=0.002, *, torque_limits=None, torque_rate_limits=None, contact_axis=None, **settings))]
    fn new(
        py: Python<'_>,
        space: Option<&Bound<'_, PyAny>>,
        dt: f64,
        torque_limits: Option<&Bound<'_, PyAny>>,
        torque_rate_limits: Option<&Bound<'_, PyAny>>,
        contact_axis: Option<&Bound<'_, PyAny>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let keywords = PyDict::new(py);
        if let Some(space) = space {
            keywords.set_item("space", space)?;
        }
        let section = settings.map_or_else(|| Ok(PyDict::new(py)), |settings| settings.copy())?;
        if section.contains("control_hz")? {
            return Err(value_error(format!("control_hz is not allowed: dt = {dt} s sets it")));
        }
        section.set_item("control_hz", samples_per_second(dt)?)?;
        keywords.set_item("controller", &section)?;
        // An unknown keyword is a `TypeError` by itself only at the level of an environment's keywords; these lie one table deeper.
        let unknown = unknown_setting(&section)?;
        let env = env_config("lift", None, &keywords)
            .map_err(|error| if unknown { type_error(error.value(py)) } else { error })?;

        let joints = |value, name| Ok::<_, PyErr>(JointVector::from_vec(numbers(value, name, &[7])?).into());
        let mut arm = Arm { torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA };
        if let Some(limits) = torque_limits {
            arm.torque_max = joints(limits, "torque_limits")?;
        }
        if let Some(limits) = torque_rate_limits {
            arm.torque_rate_max = joints(limits, "torque_rate_limits")?;
        }
        let axis = contact_axis.map_or_else(|| Ok(Vector3::z_axis()), direction)?;
        let controller = aforce::Controller::new(&env.space, &env.controller, &arm, axis).map_err(value_error)?;
        Ok(Self(Exclusive::new(Law { controller, config: env.controller, ready: false })))
    }

    /// Begins an episode: goal at the measured pose, K at its initial value, no force.
    fn reset(&self, measurement: &Measurement) -> PyResult<()> {
        self.0.with(|law| {
            law.controller.reset(&measurement.0);
            law.ready = true;
            Ok(())
        })
    }

    /// A new goal: one action of the space, entries in [-1, 1] (others are clipped).
    fn set_goal(&self, action: &Bound<'_, PyAny>, measurement: &Measurement) -> PyResult<()> {
        self.law(|law| {
            let action = arrays::action(action, &[law.controller.space().dim()])?;
            law.controller.set_goal(&action, &measurement.0);
            Ok(())
        })
    }

    /// Turns the direction, world axes, in which the environment pushes on the tool.
    fn set_contact_axis(&self, axis: &Bound<'_, PyAny>) -> PyResult<()> {
        let axis = direction(axis)?;
        self.0.with(|law| {
            law.controller.set_contact_axis(axis);
            Ok(())
        })
    }

    /// The joint torques of one control sample (Nm), gravity compensation included; shape (7,).
    fn update<'py>(&self, py: Python<'py>, measurement: &Measurement) -> Numbers<'py> {
        self.law(|law| Ok(PyArray1::from_slice(py, law.controller.update(&measurement.0).as_slice())))
    }

    /// Number of entries of an action.
    #[getter]
    fn dim(&self) -> PyResult<usize> {
        self.0.with(|law| Ok(law.controller.space().dim()))
    }

    /// What each entry of an action means: dicts with name, unit, frame, low, high.
    fn entries<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let entries = self.0.with(|law| Ok(law.controller.space().entries(&law.config)))?;
        py.import("json")?.call_method1("loads", (serde_json::to_string(&entries).map_err(value_error)?,))
    }

    /// K (N/m, Nm/rad; world axes), of which the share `engagement` does not act along the contact axis; shape (6,).
    #[getter]
    fn stiffness<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| controller.stiffness().as_slice().to_vec())
    }

    /// K in the space's own unit; shape (6,).
    #[getter]
    fn own_stiffness<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| controller.own_stiffness().as_slice().to_vec())
    }

    /// F_ff as it acts (N, Nm; world axes), which enters the torque law with a minus sign; shape (6,).
    #[getter]
    fn feedforward<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| controller.feedforward().as_slice().to_vec())
    }

    /// Wrench with which the law has the tool push (N, Nm; world axes): -F_ff - F_cmd - K e - D e_dot; shape (6,).
    #[getter]
    fn wrench<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| controller.wrench().as_slice().to_vec())
    }

    /// e = x - x_d of the latest sample (m, rad; world axes); shape (6,).
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| controller.error().as_slice().to_vec())
    }

    /// The goal of the latest action: position (m), quaternion x, y, z, w; shape (7,).
    #[getter]
    fn goal<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| seven(controller.goal()))
    }

    /// The set-point of the latest sample: position (m), quaternion x, y, z, w; shape (7,).
    #[getter]
    fn set_point<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.read(py, |controller| seven(controller.set_point()))
    }

    /// F_d, to which force control holds the force along the contact axis (N); 0 without contact.
    #[getter]
    fn desired_force(&self) -> PyResult<f64> {
        self.0.with(|law| Ok(law.controller.desired_force()))
    }

    /// F_cmd, the output of force control along the contact axis (N).
    #[getter]
    fn force_command(&self) -> PyResult<f64> {
        self.0.with(|law| Ok(law.controller.force_command()))
    }

    /// Share of the contact axis that force control has taken over, 0 to 1.
    #[getter]
    fn engagement(&self) -> PyResult<f64> {
        self.0.with(|law| Ok(law.controller.engagement()))
    }

    /// Whether each joint's latest torque was cut by a limit.
    #[getter]
    fn saturated(&self) -> PyResult<[bool; 7]> {
        self.0.with(|law| Ok(law.controller.saturated()))
    }

    /// Samples since reset without a torque: measurement or torque was not finite, or the mass matrix not positive definite.
    #[getter]
    fn faults(&self) -> PyResult<u64> {
        self.0.with(|law| Ok(law.controller.faults()))
    }
}

impl Controller {
    /// Calls `use_it` once an episode has begun.
    fn law<R>(&self, use_it: impl FnOnce(&mut Law) -> PyResult<R>) -> PyResult<R> {
        self.0.with(|law| if law.ready { use_it(law) } else { Err(PyRuntimeError::new_err("call reset first")) })
    }

    fn read<'py>(&self, py: Python<'py>, of: impl FnOnce(&aforce::Controller) -> Vec<f64>) -> Numbers<'py> {
        self.0.with(|law| Ok(PyArray1::from_vec(py, of(&law.controller))))
    }
}

/// The unit vector along a contact axis.
fn direction(axis: &Bound<'_, PyAny>) -> PyResult<UnitVector3<f64>> {
    let axis = Vector3::from_vec(numbers(axis, "contact_axis", &[3])?);
    contact_axis(axis.into()).map_err(value_error)
}

fn seven(pose: &Pose) -> Vec<f64> {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).copied().collect()
}

/// Control samples per second, as the configuration has them, from the length `dt` of a sample (s).
fn samples_per_second(dt: f64) -> PyResult<u32> {
    let rate = (1.0 / dt).round();
    if (1.0..=10_000.0).contains(&rate) && (rate * dt - 1.0).abs() < 1e-9 {
        return Ok(rate as u32);
    }
    Err(value_error(format!(
        "dt = {dt} is not allowed; allowed: one over a whole number of samples per second, 1 to 10000"
    )))
}
