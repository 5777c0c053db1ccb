//! The collision shapes of a URDF.

use aforce::{Pose, Vector3};
use nalgebra::Translation3;
use roxmltree::Node;

use super::element::{child, origin, required, vector};
use super::error::UrdfError;
use crate::scene::Shape;

/// A shape of a link, in the link's frame, or the file that has it.
#[derive(Debug, Clone)]
pub(super) enum Collision {
    Shape {
        shape: Shape,
        pose: Pose,
    },
    /// A mesh in a file, each coordinate multiplied by a factor.
    Mesh {
        file: String,
        scale: [f64; 3],
        pose: Pose,
    },
}

/// The collision shapes of the link `node`, which messages call `at`.
pub(super) fn collisions(node: Node, at: &str) -> Result<Vec<Collision>, UrdfError> {
    node.children().filter(|node| node.has_tag_name("collision")).map(|node| collision(node, at)).collect()
}

fn collision(node: Node, at: &str) -> Result<Collision, UrdfError> {
    let wrong = |what: String| UrdfError::new(format!("{at}: {what}"));
    let geometry = child(node, "geometry").and_then(|geometry| geometry.children().find(Node::is_element));
    let geometry = geometry.ok_or_else(|| wrong("a <collision> has no shape in its <geometry>".into()))?;
    let pose = origin(node, at)?;
    let number = |attribute: &str| {
        let value = required(geometry, attribute, at)?;
        let tag = geometry.tag_name().name();
        if value > 0.0 { Ok(value) } else { Err(wrong(format!("<{tag} {attribute}=\"{value}\">; it must be above 0"))) }
    };
    let shape = match geometry.tag_name().name() {
        "box" => {
            let size = vector(geometry, "size", at)?.ok_or_else(|| wrong("<box> has no size".into()))?;
            let half = Vector3::from(size) / 2.0;
            if half.min() <= 0.0 {
                return Err(wrong(format!("a <box> of the size {size:?}; each must be above 0")));
            }
            Shape::Box(half)
        }
        "cylinder" => Shape::Cylinder { half_length: number("length")? / 2.0, radius: number("radius")? },
        "capsule" => Shape::Capsule { half_length: number("length")? / 2.0, radius: number("radius")? },
        "sphere" => Shape::Sphere { radius: number("radius")? },
        "mesh" => {
            let scale = vector(geometry, "scale", at)?.unwrap_or([1.0; 3]);
            let file = geometry.attribute("filename").unwrap_or_default().into();
            return Ok(Collision::Mesh { file, scale, pose });
        }
        other => {
            return Err(wrong(format!(
                "a collision shape <{other}>; known are box, cylinder, sphere, capsule and mesh"
            )));
        }
    };
    Ok(Collision::Shape { shape, pose })
}

/// Pose of a link's frame in the file, seen from the robot's link frame, which has the same origin and is turned by `turn`.
pub(super) fn turned_back(turn: &nalgebra::UnitQuaternion<f64>) -> Pose {
    Pose::from_parts(Translation3::identity(), turn.inverse())
}
