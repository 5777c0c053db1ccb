//! The convex hulls that geoms name.

use std::path::Path;

use aforce::Vector3;
use roxmltree::Node;

use super::File;
use crate::mesh;
use crate::objects::ReadError;
use crate::scene::Hull;

impl File<'_> {
    pub(super) fn take_mesh(&mut self, node: Node, folder: &Path) -> Result<(), ReadError> {
        let source = self.source;
        source.allow(node, &["name", "class", "file", "vertex", "scale"], &[])?;
        let hull = match (node.attribute("file"), node.attribute("vertex")) {
            (Some(file), None) => mesh::hull(&folder.join(file)).map_err(|error| source.wrong(node, error))?,
            (None, Some(text)) => {
                let numbers = source.numbers(node, "vertex", text)?;
                let (points, rest) = numbers.as_chunks::<3>();
                if !rest.is_empty() {
                    return Err(source.wrong(node, "vertex: three numbers for each point are wanted"));
                }
                let points: Vec<Vector3> = points.iter().map(|&point| point.into()).collect();
                Hull::new(&points).map_err(|error| source.wrong(node, error))?
            }
            _ => return Err(source.wrong(node, "a mesh has either a file or vertex")),
        };
        let hull = match self.classes.value(source, node, None, "scale")? {
            Some(text) => hull.scaled(source.array(node, "scale", text)?).map_err(|error| source.wrong(node, error))?,
            None => hull,
        };
        // In MuJoCo a mesh without a name has that of its file.
        let stem = node.attribute("file").and_then(|file| Path::new(file).file_stem()?.to_str());
        let Some(name) = node.attribute("name").or(stem) else {
            return Err(source.wrong(node, "the attribute \"name\" is missing"));
        };
        match self.meshes.insert(name.into(), hull) {
            None => Ok(()),
            Some(_) => Err(source.wrong(node, format!("a second mesh {name:?}"))),
        }
    }
}
