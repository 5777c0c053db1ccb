//! An element, some of whose attributes may stand in a default class.

use std::fmt::Display;

use roxmltree::Node;

use super::File;
use crate::objects::ReadError;

/// A joint or a geom.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    pub file: &'a File<'a>,
    pub node: Node<'a, 'a>,
    /// The `childclass` that the bodies around the element have.
    pub childclass: Option<&'a str>,
}

impl<'a> Element<'a> {
    /// An attribute: the element's own, or its class's.
    pub fn value(self, name: &str) -> Result<Option<&'a str>, ReadError> {
        self.file.classes.value(self.file.source, self.node, self.childclass, name)
    }

    /// Numbers of an attribute, if it is there.
    pub fn array<const N: usize>(self, name: &str) -> Result<Option<[f64; N]>, ReadError> {
        self.value(name)?.map(|text| self.file.source.array(self.node, name, text)).transpose()
    }

    /// A number that is not negative; 0 without the attribute.
    pub fn size(self, name: &str) -> Result<f64, ReadError> {
        self.value(name)?.map_or(Ok(0.0), |text| self.file.source.size(self.node, name, text))
    }

    /// Refuses other attributes than these.
    pub fn allow(self, attributes: &[&str]) -> Result<(), ReadError> {
        self.file.source.allow(self.node, attributes, &[])
    }

    /// An error about the element.
    pub fn wrong(self, what: impl Display) -> ReadError {
        self.file.source.wrong(self.node, what)
    }
}
