//! A robot in a configuration: its name, or all its numbers.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::{Robot, RobotName};

/// One of the built-in robots by its name, or a user's own robot.
///
/// A run keeps its configuration, and may be continued on a machine where the robot's file is missing or has changed.
/// So the configuration has every number that was read from the file of a user's own robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum RobotChoice {
    /// By name.
    Named(RobotName),
    /// With every number.
    Own(Box<Robot>),
}

impl RobotChoice {
    /// The robot itself.
    pub fn robot(&self) -> Robot {
        match self {
            RobotChoice::Named(name) => name.robot(),
            RobotChoice::Own(robot) => Robot::clone(robot),
        }
    }

    /// What the robot is called.
    pub fn name(&self) -> &str {
        match self {
            RobotChoice::Named(name) => name.as_str(),
            RobotChoice::Own(robot) => &robot.name,
        }
    }
}

impl Default for RobotChoice {
    fn default() -> Self {
        RobotChoice::Named(RobotName::default())
    }
}

impl From<RobotName> for RobotChoice {
    fn from(name: RobotName) -> Self {
        RobotChoice::Named(name)
    }
}

impl<'de> Deserialize<'de> for RobotChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrTable;
        impl<'de> Visitor<'de> for NameOrTable {
            type Value = RobotChoice;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a robot's name in quotes, or a file that ends with .toml or .urdf")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<RobotChoice, E> {
                text.parse().map(RobotChoice::Named).map_err(E::custom)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RobotChoice, A::Error> {
                let robot = Robot::deserialize(MapAccessDeserializer::new(map))?;
                Ok(RobotChoice::Own(Box::new(robot)))
            }
        }
        deserializer.deserialize_any(NameOrTable)
    }
}
