//! Elements of an XML file, and errors that name the line.

use std::path::Path;

use aforce::{Pose, Vector3};
use nalgebra::Unit;
use roxmltree::{Document, Node};

use super::ReadError;

/// A file, which errors name.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub file: &'a Path,
}

impl Source<'_> {
    /// The text of the file.
    pub fn text(self) -> Result<String, ReadError> {
        std::fs::read_to_string(self.file).map_err(|error| self.at(0, error.to_string()))
    }

    /// The elements of the text, whose outermost is called `root`.
    pub fn parse<'t>(self, text: &'t str, root: &str) -> Result<Document<'t>, ReadError> {
        let document = Document::parse(text).map_err(|error| self.at(error.pos().row, error.to_string()))?;
        let found = document.root_element().tag_name().name().to_string();
        if found != root {
            return Err(self.at(1, format!("a file of <{found}>, not of <{root}>")));
        }
        Ok(document)
    }

    fn at(self, line: u32, what: String) -> ReadError {
        ReadError { file: self.file.into(), line, what }
    }

    /// An error about an element.
    pub fn wrong(self, node: Node, what: impl std::fmt::Display) -> ReadError {
        let row = node.document().text_pos_at(node.range().start).row;
        self.at(row, format!("<{}>: {what}", node.tag_name().name()))
    }

    /// Refuses an element with other attributes or children than these, or with text.
    pub fn allow(self, node: Node, attributes: &[&str], children: &[&str]) -> Result<(), ReadError> {
        let list = |names: &[&str]| if names.is_empty() { "none".into() } else { names.join(", ") };
        if let Some(other) = node.attributes().find(|a| !attributes.contains(&a.name())) {
            let row = node.document().text_pos_at(other.range().start).row;
            let what = format!(
                "attribute {:?} of <{}> is not read; read are: {}",
                other.name(),
                node.tag_name().name(),
                list(attributes)
            );
            return Err(self.at(row, what));
        }
        for child in node.children() {
            if child.is_element() && !children.contains(&child.tag_name().name()) {
                let parent = node.tag_name().name();
                return Err(self.wrong(child, format!("not read in <{parent}>; read are: {}", list(children))));
            }
            if child.is_text() && child.text().is_some_and(|text| !text.trim().is_empty()) {
                return Err(self.wrong(node, "text between its elements"));
            }
        }
        Ok(())
    }

    /// The element called `name` below `node`; `None` without one, an error if there are two.
    pub fn only<'a, 'i: 'a>(self, node: Node<'a, 'i>, name: &str) -> Result<Option<Node<'a, 'i>>, ReadError> {
        let mut found = elements(node).filter(|child| child.has_tag_name(name));
        match (found.next(), found.next()) {
            (_, Some(second)) => Err(self.wrong(second, format!("a second one in <{}>", node.tag_name().name()))),
            (first, None) => Ok(first),
        }
    }

    /// Finite numbers separated by spaces, at least one.
    pub fn numbers(self, node: Node, name: &str, text: &str) -> Result<Vec<f64>, ReadError> {
        let number = |word: &str| word.parse::<f64>().ok().filter(|value| value.is_finite());
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(number).collect();
        let found = numbers.filter(|numbers| !numbers.is_empty());
        found.ok_or_else(|| self.wrong(node, format!("{name}={text:?}: finite numbers are wanted")))
    }

    /// Exactly `N` finite numbers.
    pub fn array<const N: usize>(self, node: Node, name: &str, text: &str) -> Result<[f64; N], ReadError> {
        let numbers = self.numbers(node, name, text)?;
        numbers.try_into().map_err(|_| self.wrong(node, format!("{name}={text:?}: {N} numbers are wanted")))
    }

    /// One finite number.
    pub fn number(self, node: Node, name: &str, text: &str) -> Result<f64, ReadError> {
        self.array::<1>(node, name, text).map(|[value]| value)
    }

    /// A finite number that is not negative.
    pub fn size(self, node: Node, name: &str, text: &str) -> Result<f64, ReadError> {
        let value = self.number(node, name, text)?;
        if value >= 0.0 { Ok(value) } else { Err(self.wrong(node, format!("{name}={text:?}: at least 0 is wanted"))) }
    }

    /// A direction of any length above 0.
    pub fn direction(self, node: Node, name: &str, text: &str) -> Result<Unit<Vector3>, ReadError> {
        let vector = Vector3::from(self.array::<3>(node, name, text)?);
        Unit::try_new(vector, 1e-9).ok_or_else(|| self.wrong(node, format!("{name}={text:?} has no direction")))
    }

    /// An attribute that has to be there.
    pub fn required<'n>(self, node: Node<'n, '_>, name: &str) -> Result<&'n str, ReadError> {
        let found = node.attribute(name).filter(|text| !text.is_empty());
        found.ok_or_else(|| self.wrong(node, format!("the attribute {name:?} is missing")))
    }

    /// A colour of red, green, blue and opacity, each from 0 to 1. The opacity must be 1, because pictures show nothing transparent.
    pub fn color(self, node: Node, name: &str, text: &str) -> Result<[u8; 3], ReadError> {
        let rgba = self.array::<4>(node, name, text)?;
        if rgba.iter().any(|part| !(0.0..=1.0).contains(part)) || rgba[3] != 1.0 {
            return Err(
                self.wrong(node, format!("{name}={text:?}: three numbers from 0 to 1 and an opacity of 1 are wanted"))
            );
        }
        Ok([0, 1, 2].map(|i| (rgba[i] * 255.0).round() as u8))
    }
}

/// The elements below `node`.
pub(super) fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// The elements called `name` below `node`.
pub(super) fn called<'a, 'i: 'a>(node: Node<'a, 'i>, name: &'a str) -> impl Iterator<Item = Node<'a, 'i>> {
    elements(node).filter(move |child| child.has_tag_name(name))
}

/// A displacement without rotation.
pub(super) fn shift(by: Vector3) -> Pose {
    Pose::from_parts(by.into(), nalgebra::UnitQuaternion::identity())
}
