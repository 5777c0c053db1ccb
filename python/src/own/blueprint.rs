//! Makes an environment of a task's class, whose attributes are read and checked once.

use std::collections::HashMap;
use std::path::PathBuf;

use physics::camera::Camera;
use physics::robots::RobotChoice;
use physics::scene::Joint;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use serde::Deserialize;
use tasks::{Change, Env, EnvConfig, OwnDisturbance, TaskKind, TaskName, register_anew};

use super::answer::Part;
use super::for_ever;
use super::scene::{Stage, Tool};
use super::task::{PythonTask, Sayings, Scaling, Trouble};
use super::values::entries;
use crate::keywords::config_of;
use crate::value_error;

/// An environment of the task that `make` makes, a class or a function without arguments.
///
/// # Errors
/// `TypeError` or `ValueError` with the class and the part in which something is wrong; what its methods raise.
pub fn env(make: &Bound<'_, PyAny>, config: Option<PathBuf>, keywords: &Bound<'_, PyDict>) -> PyResult<(Env, Trouble)> {
    let object = make.call0()?;
    let class = object.get_type();
    let class_name = class.name()?.to_string();
    let part = |name| Part { class: &class_name, name };
    if !object.is_instance(&make.py().import("aforce.task")?.getattr("Task")?)? {
        return Err(PyTypeError::new_err(format!(
            "task makes a {class_name}; an object of a class below aforce.Task is wanted"
        )));
    }
    let tool = match object.getattr("tool")?.extract::<String>().unwrap_or_default().as_str() {
        "gripper" => Tool::Gripper,
        "wiping-tool" => Tool::WipingTool,
        _ => {
            return Err(part("tool")
                .value(format!("{}; \"gripper\" or \"wiping-tool\" is wanted", object.getattr("tool")?.repr()?)));
        }
    };
    let fingers = tool == Tool::Gripper;
    let Ok(moves_fingers) = object.getattr("gripper")?.extract::<bool>() else {
        return Err(
            part("gripper").kind("True or False is wanted: whether the last entry of an action moves the fingers")
        );
    };
    let gripper = fingers && moves_fingers;

    // Registering needs the scene, whose bodies and joints can be disturbed. The settings, which name the robot, can be read only then, so
    // the scene is read with the default robot first.
    let scene = object.getattr("scene")?;
    let trial = Stage::read(part("scene"), &scene, &RobotChoice::default().robot(), tool)?;
    let name = register(part, &object, &class, &trial)?;
    let defaults = object.getattr("defaults")?;
    let Ok(defaults) = defaults.cast::<PyDict>() else {
        return Err(part("defaults").kind("a dict of settings is wanted"));
    };
    let config: EnvConfig = config_of(name, Some((&format!("{class_name}.defaults"), defaults)), config, keywords)?;
    let stage = Stage::read(part("scene"), &scene, &config.robot.robot(), tool)?;
    let sayings = Sayings {
        name: name.as_str(),
        gripper,
        achievement: achievement(part("achievement"), &object)?,
        camera: camera(part("camera"), &object.getattr("camera")?)?,
        scaling: scaling(part("scaling"), &object.getattr("scaling")?)?,
        units: units(part("units"), &object.getattr("units")?)?,
        class: class_name.clone(),
    };
    let trouble = Trouble::default();
    let task = PythonTask::new(object.unbind(), sayings, stage, fingers, trouble.clone());
    let made = make.py().detach(|| Env::with_task(Box::new(task), config, 0));
    trouble.check()?;
    Ok((made.map_err(value_error)?, trouble))
}

/// Registers the task under its name, with its disturbances.
fn register<'a>(
    part: impl Fn(&'a str) -> Part<'a>,
    object: &Bound<'_, PyAny>,
    class: &Bound<'_, PyType>,
    stage: &Stage,
) -> PyResult<TaskName> {
    let Ok(name) = object.getattr("name")?.extract::<Option<String>>() else {
        return Err(part("name").kind("a string or None is wanted"));
    };
    let name = match name {
        Some(name) => name,
        None => kebab(&class.name()?.to_string()),
    };
    let own = &stage.scene.bodies[stage.first..];
    let mut built_in = vec![];
    if own.iter().any(|body| body.joint == Joint::Free) {
        built_in.push("cube_mass");
    }
    if own.iter().any(|body| matches!(&body.joint, Joint::Hinge(axis) if axis.name == "hinge")) {
        built_in.extend(["hinge_damping", "hinge_spring"]);
    }
    let purpose = achievement(part("achievement"), object)?;
    let disturbances = disturbances(part("disturbances"), &object.getattr("disturbances")?, stage)?;
    let kind = TaskKind::made_elsewhere(for_ever(&name), purpose)
        .disturbed_by(built_in.leak())
        .own_disturbances(disturbances.leak());
    register_anew(kind).map_err(value_error)
}

/// What success is, in words.
fn achievement(part: Part<'_>, object: &Bound<'_, PyAny>) -> PyResult<&'static str> {
    let words = object.getattr("achievement")?.extract::<String>();
    words.map(|words| for_ever(&words)).map_err(|_| part.kind("a string is wanted: a verb and its object"))
}

/// `PullDrawer` as `pull-drawer`.
fn kebab(name: &str) -> String {
    let mut words = String::new();
    for (i, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && i > 0 {
            words.push('-');
        }
        words.extend(if letter == '_' { vec!['-'] } else { letter.to_lowercase().collect() });
    }
    words
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DisturbanceSpec {
    body_mass: Option<String>,
    body_friction: Option<String>,
    joint_friction: Option<String>,
    joint_damping: Option<String>,
    joint_spring: Option<String>,
    allowed: [f64; 2],
}

/// Makes a disturbance of the body or joint with the given name.
type Makes = fn(&'static str) -> Change;

fn disturbances(part: Part<'_>, value: &Bound<'_, PyAny>, stage: &Stage) -> PyResult<Vec<OwnDisturbance>> {
    let specs: HashMap<String, Bound<'_, PyAny>> =
        value.extract().map_err(|_: PyErr| part.kind("a dict of names and dicts is wanted"))?;
    let own = &stage.scene.bodies[stage.first..];
    let has_joint = |name: &str| {
        own.iter().any(|body| matches!(&body.joint, Joint::Hinge(axis) | Joint::Slide(axis) if axis.name == name))
    };
    let mut list = vec![];
    for (key, spec) in &specs {
        let spec: DisturbanceSpec = part.read(spec, key)?;
        let makers: [(Option<String>, bool, Makes); 5] = [
            (spec.body_mass, false, Change::BodyMass),
            (spec.body_friction, false, Change::BodyFriction),
            (spec.joint_friction, true, Change::JointFriction),
            (spec.joint_damping, true, Change::JointDamping),
            (spec.joint_spring, true, Change::JointSpring),
        ];
        let mut said = makers.into_iter().filter_map(|(name, joint, make)| Some((name?, joint, make)));
        let (Some((name, joint, make)), None) = (said.next(), said.next()) else {
            let words =
                "exactly one of body_mass, body_friction, joint_friction, joint_damping, joint_spring is wanted";
            return Err(part.value(format!("{key}: {words}")));
        };
        let known = if joint { has_joint(&name) } else { own.iter().any(|body| body.name == name) };
        if !known {
            let kind = if joint { "joint" } else { "body" };
            return Err(part.value(format!("{key}: the scene has no {kind} {name:?}")));
        }
        list.push(OwnDisturbance { key: for_ever(key), change: make(for_ever(&name)), allowed: spec.allowed });
    }
    list.sort_by_key(|own| own.key);
    Ok(list)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct CameraSpec {
    eye: [f64; 3],
    target: [f64; 3],
    field_of_view: f64,
}

impl Default for CameraSpec {
    fn default() -> Self {
        CameraSpec { eye: [0.95, -0.95, 1.5], target: [-0.22, 0.0, 1.04], field_of_view: 0.76 }
    }
}

fn camera(part: Part<'_>, value: &Bound<'_, PyAny>) -> PyResult<Camera> {
    let CameraSpec { eye, target, field_of_view } = part.read(value, "")?;
    if !eye.iter().chain(&target).all(|number| number.is_finite()) || eye == target {
        return Err(part.value("eye and target; two places, in finite numbers, are wanted"));
    }
    if !(field_of_view > 0.0 && field_of_view < std::f64::consts::PI) {
        return Err(part.value(format!("field_of_view {field_of_view}; an angle above 0 and below pi (rad) is wanted")));
    }
    Ok(Camera { eye, target, field_of_view })
}

/// Typical values and typical deviations by name.
fn scaling(part: Part<'_>, value: &Bound<'_, PyAny>) -> PyResult<HashMap<String, Scaling>> {
    let pairs: HashMap<String, Bound<'_, PyAny>> = value
        .extract()
        .map_err(|_: PyErr| part.kind("a dict of names and pairs (typical value, typical deviation) is wanted"))?;
    let mut all = HashMap::new();
    for (name, pair) in pairs {
        let (centre, deviation): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair
            .extract()
            .map_err(|_: PyErr| part.kind(format!("{name:?}: a pair (typical value, typical deviation) is wanted")))?;
        let both = PyDict::new(value.py());
        both.set_item(format!("{name}: typical value"), centre)?;
        both.set_item(format!("{name}: typical deviation"), deviation)?;
        let mut numbers = entries(part, both.as_any())?.into_iter().map(|(_, numbers)| numbers);
        let (centre, deviation) = (numbers.next().unwrap_or_default(), numbers.next().unwrap_or_default());
        // The observation is multiplied by the inverse of the deviation, which has to be finite in 32 bits.
        if deviation.iter().any(|deviation| *deviation < 1e-30) {
            return Err(part
                .value(format!("{name:?}: a typical deviation of {deviation:?}; above 0 is wanted, at least 1e-30")));
        }
        all.insert(name, Scaling { centre, deviation });
    }
    Ok(all)
}

fn units(part: Part<'_>, value: &Bound<'_, PyAny>) -> PyResult<HashMap<String, &'static str>> {
    let units: HashMap<String, String> =
        value.extract().map_err(|_: PyErr| part.kind("a dict of names and units is wanted"))?;
    Ok(units.into_iter().map(|(name, unit)| (name, for_ever(&unit))).collect())
}
