//! A task's scene, from a dict, with the robot, its tool, floor and table.

use std::collections::HashMap;
use std::path::PathBuf;

use physics::model::Model;
use physics::robots::Robot;
use physics::scene::{Role, Scene};
use physics::scenes::{Table, add_fixtures};
use physics::{gripper, wiping_tool};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use super::answer::Part;
use super::bodies::{add, read_body, read_scene};

/// The scene of a task with a robot in it.
pub struct Stage {
    /// All bodies, joints of objects at zero.
    pub scene: Scene,
    /// The body that carries the tool point.
    pub tool: usize,
    /// The tool point in the frame of that body (m).
    pub site: [f64; 3],
    /// Index of the task's first body.
    pub first: usize,
    /// Name of the shape of which a geom is a part, by the geom's name, where the two differ.
    pub parts: HashMap<String, String>,
}

/// The arm's tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    /// Two fingers.
    Gripper,
    /// The pad of Wipe.
    WipingTool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TableSpec {
    height: f64,
    centre: [f64; 2],
    size: [f64; 2],
    friction: f64,
}

impl Default for TableSpec {
    fn default() -> Self {
        TableSpec { height: 0.8, centre: [0.0; 2], size: [0.8; 2], friction: 1.0 }
    }
}

impl Stage {
    /// Reads a task's scene: a dict, or an MJCF or URDF file.
    ///
    /// # Errors
    /// `TypeError` or `ValueError` with the name of what is wrong.
    pub fn read(part: Part<'_>, scene: &Bound<'_, PyAny>, robot: &Robot, tool: Tool) -> PyResult<Stage> {
        let (mut table, mut bodies, mut prediction) = (TableSpec::default(), vec![], None);
        if let Ok(file) = scene.extract::<PathBuf>() {
            bodies.push(read_scene(file).map_err(|words| part.value(words))?);
        } else {
            let Ok(dict) = scene.cast::<PyDict>() else {
                let kind = scene.get_type().name()?;
                return Err(part.kind(format!("a {kind}; a dict or the name of an MJCF or URDF file is wanted")));
            };
            for (key, value) in dict {
                match key.extract::<String>().as_deref() {
                    Ok("table") => table = part.read(&value, "table")?,
                    Ok("bodies") => {
                        let Ok(list) = value.try_iter() else {
                            return Err(part.kind("bodies: a list of dicts is wanted"));
                        };
                        for (i, body) in list.enumerate() {
                            bodies.push(read_body(part, &body?, i)?);
                        }
                    }
                    Ok("prediction") => {
                        let Ok(distance) = value.extract() else {
                            return Err(part.kind("prediction: a distance (m) is wanted"));
                        };
                        prediction = Some(distance);
                    }
                    _ => {
                        return Err(
                            part.kind(format!("unknown key {}; known are table, bodies, prediction", key.repr()?))
                        );
                    }
                }
            }
        }
        for (what, value) in [("height", table.height), ("size", table.size[0]), ("size", table.size[1])] {
            if !(value > 0.05 && value.is_finite()) {
                return Err(part.value(format!("table: {what} {value} m; above 0.05 is wanted")));
            }
        }
        let mut scene = Scene { prediction, ..Scene::default() };
        let [x, y] = table.centre;
        let top =
            Table { size: [table.size[0], table.size[1], 0.05], top: [x, y, table.height], friction: table.friction };
        let base = add_fixtures(&mut scene, robot, &top);
        let hand = robot.add_to(&mut scene, base);
        let (tool, site) = match tool {
            Tool::Gripper => (gripper::add_gripper(&mut scene, robot, hand), gripper::GRIP_SITE),
            Tool::WipingTool => {
                let tool = wiping_tool::add_wiping_tool(&mut scene, hand);
                let model = Model::new(&scene, tool, wiping_tool::GRIP_SITE);
                scene.pad = Some(wiping_tool::pad(&model, &robot.home, scene.geom("table")));
                (tool, wiping_tool::GRIP_SITE)
            }
        };
        let first = scene.bodies.len();
        let mut parts = HashMap::new();
        for mut group in bodies {
            parts.extend(std::mem::take(&mut group.parts));
            add(&mut scene, group, first).map_err(|words| part.value(words))?;
        }
        for index in first..scene.bodies.len() {
            let role = if scene.moving_root(index).0.is_some() { Role::Object } else { Role::Fixture };
            scene.bodies[index].geoms.iter_mut().for_each(|geom| geom.role = role);
        }
        scene.check().map_err(|wrong| part.value(wrong))?;
        Ok(Stage { scene, tool, site, first, parts })
    }
}
