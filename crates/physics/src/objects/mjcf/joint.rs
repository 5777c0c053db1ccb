//! The joint between a body and its parent.

use aforce::Vector3;

use super::element::Element;
use crate::objects::defaults::OF_JOINT;
use crate::objects::{ReadError, plain_axis};
use crate::scene::{Axis, Joint, Stop};

/// The joint of a body, in the body's frame as it is in the file.
pub(super) struct Placed {
    pub joint: Joint,
    /// A point of its axis (m).
    pub at: Vector3,
    /// Whether its end stop is MuJoCo's default.
    pub default_stop: bool,
}

impl Placed {
    /// A joint that has neither axis nor end.
    pub fn without_axis(joint: Joint) -> Self {
        Self { joint, at: Vector3::zeros(), default_stop: false }
    }
}

/// Attributes of a hinge or a slide that are not read from a class.
const ATTRIBUTES: [&str; 3] = ["name", "class", "pos"];

impl Element<'_> {
    /// The joint of the body called `body`.
    pub fn joint(self, body: &str) -> Result<Placed, ReadError> {
        if self.node.has_tag_name("freejoint") {
            self.allow(&["name"])?;
            return Ok(Placed::without_axis(Joint::Free));
        }
        let kind = self.value("type")?.unwrap_or("hinge");
        if kind == "free" {
            self.check_free()?;
            return Ok(Placed::without_axis(Joint::Free));
        }
        self.allow(&[&ATTRIBUTES[..], &OF_JOINT].concat())?;
        let (joint, unit): (fn(Axis) -> Joint, f64) = match kind {
            "hinge" => (Joint::Hinge, self.file.degree),
            "slide" => (Joint::Slide, 1.0),
            other => return Err(self.wrong(format!("type={other:?}; read are hinge, slide and free"))),
        };
        let mut axis = self.axis(body)?;
        if let Some([rest]) = self.array("springref")? {
            axis.rest = rest * unit;
        }
        if let Some(range) = self.range()? {
            axis.range = range.map(|end| end * unit);
        }
        let stop = self.stop()?;
        axis.stop = stop.unwrap_or(axis.stop);
        Ok(Placed { joint: joint(axis), at: self.file.position(self.node)?, default_stop: stop.is_none() })
    }

    /// In MuJoCo a `joint` of type free has the joint attributes of its class, a `freejoint` has not.
    fn check_free(self) -> Result<(), ReadError> {
        self.allow(&["name", "type", "class"])?;
        for name in ["damping", "frictionloss", "stiffness", "armature"] {
            if self.array(name)?.is_some_and(|[value]| value != 0.0) {
                return Err(self.wrong(format!("a free joint with {name} is not read; <freejoint/> has none")));
            }
        }
        Ok(())
    }

    /// Direction, and what acts along or about it.
    fn axis(self, body: &str) -> Result<Axis, ReadError> {
        let direction = match self.value("axis")? {
            Some(text) => self.file.source.direction(self.node, "axis", text)?,
            None => Vector3::z_axis(),
        };
        Ok(Axis {
            damping: self.size("damping")?,
            friction: self.size("frictionloss")?,
            spring: self.size("stiffness")?,
            armature: self.size("armature")?,
            ..plain_axis(self.node.attribute("name").unwrap_or(body), direction)
        })
    }

    /// The joint's range in the file's units; `None` if it has no ends.
    fn range(self) -> Result<Option<[f64; 2]>, ReadError> {
        let limited = self.value("limited")?;
        if !matches!(limited, None | Some("auto" | "true" | "false")) {
            return Err(self.wrong("limited: auto, true or false is wanted"));
        }
        match (self.value("range")?, limited) {
            (Some(_), Some("false")) => Ok(None),
            (Some(_), _) => self.array("range"),
            (None, Some("true")) => Err(self.wrong("limited, and no range")),
            (None, _) => Ok(None),
        }
    }

    /// What stops it at the ends; `None` is MuJoCo's default.
    fn stop(self) -> Result<Option<Stop>, ReadError> {
        let Some([stiffness, damping]) = self.array("solreflimit")?.filter(|stop| *stop != [0.02, 1.0]) else {
            return Ok(None);
        };
        if stiffness > 0.0 || damping > 0.0 {
            return Err(self.wrong("solreflimit is read as \"0.02 1\", or as minus a stiffness and minus a damping"));
        }
        Ok(Some(Stop::Spring { stiffness: -stiffness, damping: -damping }))
    }
}
