//! Reads one element of a URDF: its name, its numbers, its pose.

use aforce::Pose;
use nalgebra::UnitQuaternion;
use roxmltree::Node;

use super::error::UrdfError;
use crate::scene::pose;

/// The first element of this kind inside `node`.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|node| node.has_tag_name(tag))
}

/// The element's name, which it must have.
pub(super) fn named(node: Node) -> Result<String, UrdfError> {
    let tag = node.tag_name().name();
    let name = node.attribute("name").filter(|name| !name.is_empty());
    name.map(String::from).ok_or_else(|| UrdfError::new(format!("a <{tag}> has no name")))
}

/// The pose in the element's `origin`.
pub(super) fn origin(node: Node, at: &str) -> Result<Pose, UrdfError> {
    let Some(node) = child(node, "origin") else { return Ok(Pose::identity()) };
    let position = vector(node, "xyz", at)?.unwrap_or_default();
    if let Some([x, y, z, w]) = numbers(node, "quat_xyzw", at)? {
        return Ok(pose(position, [w, x, y, z]));
    }
    let [roll, pitch, yaw] = vector(node, "rpy", at)?.unwrap_or_default();
    Ok(Pose::from_parts(position.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
}

/// Three finite numbers, if there is such an attribute; `at` says where in an error.
pub(super) fn vector(node: Node, attribute: &str, at: &str) -> Result<Option<[f64; 3]>, UrdfError> {
    numbers(node, attribute, at)
}

/// A finite number that must be there.
pub(super) fn required(node: Node, attribute: &str, at: &str) -> Result<f64, UrdfError> {
    let tag = node.tag_name().name();
    let value = optional(node, attribute, at)?;
    value.ok_or_else(|| UrdfError::new(format!("{at}: <{tag}> has no {attribute}")))
}

/// A finite number, if there is such an attribute.
pub(super) fn optional(node: Node, attribute: &str, at: &str) -> Result<Option<f64>, UrdfError> {
    Ok(numbers(node, attribute, at)?.map(|[number]| number))
}

/// Exactly `N` finite numbers, if there is such an attribute.
pub(super) fn numbers<const N: usize>(node: Node, attribute: &str, at: &str) -> Result<Option<[f64; N]>, UrdfError> {
    let Some(text) = node.attribute(attribute) else { return Ok(None) };
    let numbers = text.split_whitespace().map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()));
    let numbers: Option<Vec<f64>> = numbers.collect();
    match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
        Some(numbers) => Ok(Some(numbers)),
        None => {
            let tag = node.tag_name().name();
            let wanted = match N {
                1 => "one number with a decimal point".into(),
                _ => format!("{N} numbers with decimal points, separated by spaces"),
            };
            Err(UrdfError::new(format!("{at}: <{tag} {attribute}={text:?}>; wanted: {wanted}")))
        }
    }
}
