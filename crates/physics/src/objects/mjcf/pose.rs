//! Where an element is, and how it is turned.

use aforce::{Pose, Vector3};
use nalgebra::{Quaternion, Unit, UnitQuaternion};
use roxmltree::Node;

use super::File;
use crate::objects::ReadError;

impl File<'_> {
    /// `pos`, and one of the three orientations.
    pub(super) fn pose(&self, node: Node) -> Result<Pose, ReadError> {
        let source = self.source;
        let position = self.position(node)?;
        let said = ["quat", "euler", "axisangle"].map(|name| node.attribute(name));
        let rotation = match said {
            [None, None, None] => UnitQuaternion::identity(),
            [Some(text), None, None] => {
                let [w, x, y, z] = source.array(node, "quat", text)?;
                let unit = Unit::try_new(Quaternion::new(w, x, y, z), 1e-9);
                unit.ok_or_else(|| source.wrong(node, "a quat of length 0"))?
            }
            [None, Some(text), None] => self.euler(source.array(node, "euler", text)?),
            [None, None, Some(text)] => {
                let [x, y, z, angle] = source.array(node, "axisangle", text)?;
                let axis = Unit::try_new(Vector3::new(x, y, z), 1e-9);
                let axis = axis.ok_or_else(|| source.wrong(node, "axisangle has no direction"))?;
                UnitQuaternion::from_axis_angle(&axis, angle * self.degree)
            }
            _ => return Err(source.wrong(node, "more than one of quat, euler and axisangle")),
        };
        Ok(Pose::from_parts(position.into(), rotation))
    }

    /// `pos` (m); the origin without it.
    pub(super) fn position(&self, node: Node) -> Result<Vector3, ReadError> {
        match node.attribute("pos") {
            Some(text) => Ok(self.source.array::<3>(node, "pos", text)?.into()),
            None => Ok(Vector3::zeros()),
        }
    }

    fn euler(&self, angles: [f64; 3]) -> UnitQuaternion<f64> {
        self.eulerseq.chars().zip(angles).fold(UnitQuaternion::identity(), |rotation, (letter, angle)| {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let turn = UnitQuaternion::from_axis_angle(&axis, angle * self.degree);
            if letter.is_lowercase() { rotation * turn } else { turn * rotation }
        })
    }
}
