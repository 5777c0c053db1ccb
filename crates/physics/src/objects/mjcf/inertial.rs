//! The `inertial` element of a body.

use aforce::Vector3;
use nalgebra::{Matrix3, UnitQuaternion};
use roxmltree::Node;

use super::File;
use crate::objects::ReadError;
use crate::scene::Inertial;

impl File<'_> {
    pub(super) fn inertial(&self, node: Node) -> Result<Inertial, ReadError> {
        let source = self.source;
        let attributes = ["pos", "quat", "euler", "axisangle", "mass", "diaginertia", "fullinertia"];
        source.allow(node, &attributes, &[])?;
        let mass = source.size(node, "mass", source.required(node, "mass")?)?;
        let pose = self.pose(node)?;
        let inertia = match (node.attribute("diaginertia"), node.attribute("fullinertia")) {
            (Some(text), None) => Matrix3::from_diagonal(&source.array(node, "diaginertia", text)?.into()),
            (None, Some(text)) => {
                if pose.rotation != UnitQuaternion::identity() {
                    return Err(
                        source.wrong(node, "fullinertia is along the body's axes; an orientation contradicts it")
                    );
                }
                let [xx, yy, zz, xy, xz, yz] = source.array(node, "fullinertia", text)?;
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
            _ => return Err(source.wrong(node, "either diaginertia or fullinertia is wanted")),
        };
        Ok(Inertial { mass, com: Vector3::zeros(), inertia }.transformed(&pose))
    }
}
