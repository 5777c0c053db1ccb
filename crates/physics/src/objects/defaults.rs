//! MJCF's default classes: attributes of elements that do not have them themselves.

use std::collections::HashMap;

use roxmltree::Node;

use super::ReadError;
use super::xml::{Source, elements};

/// Element and attribute.
type Key = (String, String);

/// The classes of a file, each with the attributes that it inherits from the classes around it.
#[derive(Default)]
pub(super) struct Classes(HashMap<String, HashMap<Key, String>>);

/// The class of elements that name none.
const MAIN: &str = "main";

/// Attributes of joints that a class may have.
pub(super) const OF_JOINT: [&str; 10] = [
    "type",
    "axis",
    "range",
    "limited",
    "damping",
    "frictionloss",
    "stiffness",
    "springref",
    "armature",
    "solreflimit",
];
/// Attributes of geoms that a class may have.
pub(super) const OF_GEOM: [&str; 6] = ["type", "size", "density", "friction", "rgba", "condim"];

/// The elements that have defaults here, and the attributes of each.
const KINDS: [(&str, &[&str]); 3] = [("joint", &OF_JOINT), ("geom", &OF_GEOM), ("mesh", &["scale"])];

impl Classes {
    /// Reads a `default` element and those inside it; `around` is the class that encloses it.
    pub fn add(&mut self, source: Source, node: Node, around: Option<&str>) -> Result<(), ReadError> {
        source.allow(node, &["class"], &["default", "joint", "geom", "mesh"])?;
        let name = match (node.attribute("class"), around) {
            (Some(name), _) => name,
            (None, None) => MAIN,
            (None, Some(_)) => return Err(source.wrong(node, "a class within a class needs a name")),
        };
        let mut values = around.map_or_else(HashMap::new, |around| self.0[around].clone());
        for (kind, attributes) in KINDS {
            for element in elements(node).filter(|child| child.has_tag_name(kind)) {
                source.allow(element, attributes, &[])?;
                let said = element.attributes().map(|a| ((kind.into(), a.name().into()), a.value().into()));
                values.extend(said);
            }
        }
        if self.0.insert(name.into(), values).is_some() {
            return Err(source.wrong(node, format!("a second class {name:?}")));
        }
        let mut inner = elements(node).filter(|child| child.has_tag_name("default"));
        inner.try_for_each(|child| self.add(source, child, Some(name)))
    }

    /// The attribute of an element: its own, or its class's. `childclass` is the one that the bodies around the element have.
    pub fn value<'a>(
        &'a self,
        source: Source,
        node: Node<'a, '_>,
        childclass: Option<&str>,
        name: &str,
    ) -> Result<Option<&'a str>, ReadError> {
        if let Some(own) = node.attribute(name) {
            return Ok(Some(own));
        }
        let class = node.attribute("class").or(childclass);
        let Some(values) = self.0.get(class.unwrap_or(MAIN)) else {
            return match class {
                Some(class) => Err(source.wrong(node, format!("there is no default class {class:?}"))),
                None => Ok(None),
            };
        };
        Ok(values.get(&(node.tag_name().name().into(), name.into())).map(String::as_str))
    }
}
