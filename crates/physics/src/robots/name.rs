//! The robots by name.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use aforce::record;
use serde::{Deserialize, Serialize};

use super::{Robot, fr3, iiwa14, panda, ur5e};

/// The robots that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RobotName {
    /// A Panda with the round numbers of robosuite: results are comparable with what is published for its tasks.
    #[default]
    Robosuite,
    /// A Panda with parameters that were identified on a real arm.
    Identified,
    /// A Franka Research 3 with its maker's parameters.
    Fr3,
    /// A KUKA LBR iiwa 14 R820.
    Iiwa14,
    /// A Universal Robots UR5e: six joints.
    Ur5e,
}

impl RobotName {
    /// All robots.
    pub const ALL: [RobotName; 5] =
        [RobotName::Robosuite, RobotName::Identified, RobotName::Fr3, RobotName::Iiwa14, RobotName::Ur5e];

    /// The name used in files and on command lines.
    pub fn as_str(self) -> &'static str {
        match self {
            RobotName::Robosuite => "robosuite",
            RobotName::Identified => "identified",
            RobotName::Fr3 => "fr3",
            RobotName::Iiwa14 => "iiwa14",
            RobotName::Ur5e => "ur5e",
        }
    }

    /// The robot itself.
    pub fn robot(self) -> Robot {
        match self {
            RobotName::Robosuite => panda::robosuite(),
            RobotName::Identified => panda::identified(),
            RobotName::Fr3 => fr3::fr3(),
            RobotName::Iiwa14 => iiwa14::iiwa14(),
            RobotName::Ur5e => ur5e::ur5e(),
        }
    }
}

impl Display for RobotName {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for RobotName {
    type Err = String;

    /// `panda` and `panda-identified` are the two Pandas, too.
    fn from_str(text: &str) -> Result<Self, String> {
        let text = match text {
            "panda" => "robosuite",
            "panda-identified" => "identified",
            other => other,
        };
        let names = Self::ALL.map(Self::as_str);
        let known = Self::ALL.into_iter().find(|robot| robot.as_str() == text);
        known.ok_or_else(|| {
            let hint = record::nearest(text, &names).map(|name| format!("did you mean {name:?}? "));
            format!(
                "no robot is called {text:?}; {}known are {}, or a file that ends with .toml or .urdf",
                hint.unwrap_or_default(),
                names.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_goes_by_its_name() {
        for name in RobotName::ALL {
            assert_eq!(name.robot().name, name.as_str());
            assert_eq!(name.as_str().parse(), Ok(name));
        }
        assert_eq!("panda".parse(), Ok(RobotName::Robosuite));
        assert_eq!("panda-identified".parse(), Ok(RobotName::Identified));
        let error = "ur5".parse::<RobotName>().unwrap_err();
        let known = "known are robosuite, identified, fr3, iiwa14, ur5e, or a file that ends with .toml or .urdf";
        assert_eq!(error, format!("no robot is called \"ur5\"; did you mean \"ur5e\"? {known}"));
        assert_eq!("gantry".parse::<RobotName>().unwrap_err(), format!("no robot is called \"gantry\"; {known}"));
    }
}
