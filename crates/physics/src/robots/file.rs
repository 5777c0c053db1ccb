//! A robot from a file: a URDF by itself, or a robot file: TOML that names a URDF and adds what the URDF does not have.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use aforce::{ConfigError, JointVector, Pose, record};
use nalgebra::UnitQuaternion;
use serde::Deserialize;
use thiserror::Error;

use super::urdf::{self, Choices, Document, UrdfError};
use super::{Mount, Robot, fr3};

/// Why no robot was read from a file.
#[derive(Debug, Error)]
pub enum RobotFileError {
    /// The file cannot be read.
    #[error("{file}: {error}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        error: std::io::Error,
    },
    /// The robot file is not TOML, or has a key that is unknown, missing or of the wrong type.
    #[error("{file}: {problem}")]
    Toml {
        /// The file.
        file: String,
        /// What is wrong.
        problem: record::Problem,
    },
    /// The URDF is not valid, or has no arm that can be simulated.
    #[error("{file}: {error}")]
    Urdf {
        /// The file.
        file: String,
        /// What is wrong.
        error: UrdfError,
    },
    /// A list has not one number for each joint.
    #[error("{file}: {key} has {found} values; the arm has {joints} joints")]
    Length {
        /// The robot file.
        file: String,
        /// The key.
        key: &'static str,
        /// Values in it.
        found: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// The arm does not reach the start pose of the tasks.
    #[error(
        "{file}: the arm does not reach to where the Panda's flange is at the start of an episode, its z facing down. The key `home` of a \
         robot file gives joint angles to start from, `mount` where the arm stands, and `flange` turns a tool's frame whose z does not point \
         out of the arm"
    )]
    OutOfReach {
        /// The file.
        file: String,
    },
    /// A value is not allowed.
    #[error("{file}: {error}")]
    Value {
        /// The file.
        file: String,
        /// Which, and what is allowed.
        error: ConfigError,
    },
}

/// A robot file. A list has a number for each joint that moves.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    /// Path of the URDF, relative to this file.
    urdf: PathBuf,
    /// The robot's name in tables and messages; without it that of the file.
    name: Option<String>,
    base: Option<String>,
    tool: Option<String>,
    #[serde(default)]
    flange: Frame,
    home: Option<Vec<f64>>,
    mount: Option<MountFile>,
    rotors: Option<Vec<f64>>,
    damping: Option<Vec<f64>>,
    friction: Option<Vec<f64>>,
    drives: Option<Vec<f64>>,
    range: Option<Vec<[f64; 2]>>,
    speed_max: Option<Vec<f64>>,
    torque_max: Option<Vec<f64>>,
    torque_rate_max: Option<Vec<f64>>,
    #[serde(default)]
    shapes: Shapes,
    /// Folders of ROS packages by name, relative to this file.
    #[serde(default)]
    packages: BTreeMap<String, PathBuf>,
    #[serde(default)]
    capsules: Vec<CapsuleFile>,
    #[serde(default)]
    never_touch: Vec<[String; 2]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Frame {
    xyz: [f64; 3],
    rpy: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MountFile {
    height: f64,
    behind_table: f64,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Shapes {
    #[default]
    Collision,
    None,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CapsuleFile {
    link: String,
    from: [f64; 3],
    to: [f64; 3],
    radius: f64,
}

/// Whether this name of a robot is that of a file.
pub fn is_file(text: &str) -> bool {
    [".toml", ".urdf"].iter().any(|end| text.to_lowercase().ends_with(end))
}

/// The robot of a file: `.urdf`, or else a robot file. What the file does not give is the FR3's: gripper, rotor inertia, drives, limits on
/// torque rates, mount. Without a home the arm starts with its flange where the Panda's is.
///
/// # Errors
/// Names the file, and the key, link or joint.
pub fn read(path: &Path) -> Result<Robot, RobotFileError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let file = path.display().to_string();
    if file.to_lowercase().ends_with(".urdf") {
        let robot = Robot { name, ..urdf_of(path, Choices::default())? };
        return finished(robot, None, &file);
    }
    let own: RobotFile =
        record::parse(&text_of(path)?).map_err(|problem| RobotFileError::Toml { file: file.clone(), problem })?;
    own.robot(path, name)
}

fn text_of(path: &Path) -> Result<String, RobotFileError> {
    fs::read_to_string(path).map_err(|error| RobotFileError::Unreadable { file: path.display().to_string(), error })
}

fn urdf_of(path: &Path, mut choices: Choices) -> Result<Robot, RobotFileError> {
    let wrong = |error| RobotFileError::Urdf { file: path.display().to_string(), error };
    let document = Document::parse(&text_of(path)?).map_err(wrong)?;
    choices.meshes.urdf = path.parent().unwrap_or(Path::new("")).into();
    urdf::robot(&document, &choices, &fr3::fr3()).map_err(wrong)
}

impl RobotFile {
    fn robot(self, path: &Path, stem: String) -> Result<Robot, RobotFileError> {
        let file = path.display().to_string();
        let [roll, pitch, yaw] = self.flange.rpy;
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let capsules = self.capsules.iter().cloned();
        let mut choices = Choices {
            base: self.base.clone(),
            tool: self.tool.clone(),
            flange: Pose::from_parts(self.flange.xyz.into(), turn),
            without_shapes: matches!(self.shapes, Shapes::None),
            capsules: capsules
                .map(|CapsuleFile { link, from, to, radius }| urdf::Capsule { link, from, to, radius })
                .collect(),
            never_touch: self.never_touch.clone(),
            ..Choices::default()
        };
        (choices.range, choices.speed_max, choices.torque_max) =
            (self.range.clone(), self.speed_max.clone(), self.torque_max.clone());
        let folder = path.parent().unwrap_or(Path::new(""));
        let packages = self.packages.iter().map(|(name, place)| (name.clone(), folder.join(place)));
        choices.meshes.packages = packages.collect();
        let urdf = folder.join(&self.urdf);
        let mut robot = Robot { name: self.name.clone().unwrap_or(stem), ..urdf_of(&urdf, choices)? };
        let joints = robot.joints;
        for (key, list) in self.lists() {
            let found = list.unwrap_or(joints);
            if found != joints {
                return Err(RobotFileError::Length { file, key, found, joints });
            }
        }
        for (link, own) in robot.links.iter_mut().zip(self.damping.iter().flatten()) {
            link.damping = *own;
        }
        for (link, own) in robot.links.iter_mut().zip(self.friction.iter().flatten()) {
            link.friction = *own;
        }
        for (values, own) in [
            (&mut robot.arm.rotor_inertia, &self.rotors),
            (&mut robot.arm.torque_rate_max, &self.torque_rate_max),
            (&mut robot.drives, &self.drives),
        ] {
            values.iter_mut().zip(own.iter().flatten()).for_each(|(value, own)| *value = *own);
        }
        if let Some(MountFile { height, behind_table }) = self.mount {
            robot.mount = Mount::column(height, behind_table);
        }
        finished(robot, self.home.as_deref(), &file)
    }

    /// The lists that have a value for each joint, and how many they have.
    fn lists(&self) -> [(&'static str, Option<usize>); 9] {
        let of = |list: &Option<Vec<f64>>| list.as_ref().map(Vec::len);
        [
            ("home", of(&self.home)),
            ("rotors", of(&self.rotors)),
            ("damping", of(&self.damping)),
            ("friction", of(&self.friction)),
            ("drives", of(&self.drives)),
            ("range", self.range.as_ref().map(Vec::len)),
            ("speed_max", of(&self.speed_max)),
            ("torque_max", of(&self.torque_max)),
            ("torque_rate_max", of(&self.torque_rate_max)),
        ]
    }
}

/// Sets the given home, or else a found one, and checks every value.
fn finished(mut robot: Robot, home: Option<&[f64]>, file: &str) -> Result<Robot, RobotFileError> {
    robot.home = match home {
        Some(home) => JointVector::from_fn(|i, _| home.get(i).copied().unwrap_or(0.0)),
        None => robot.home_like_the_pandas().ok_or_else(|| RobotFileError::OutOfReach { file: file.into() })?,
    };
    robot.validate().map_err(|error| RobotFileError::Value { file: file.into(), error })?;
    Ok(robot)
}
