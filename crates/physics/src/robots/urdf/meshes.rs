//! The files of a URDF's meshes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::mesh;
use crate::scene::Hull;

/// The beginning of a path in a ROS package.
const PACKAGE: &str = "package://";

/// Where the files of meshes are looked for.
#[derive(Debug, Clone, Default)]
pub struct MeshFolders {
    /// The folder of the URDF, to which paths are relative.
    pub urdf: PathBuf,
    /// Folders of ROS packages by name. A package without an entry is the nearest folder of its name: the URDF's own, one above it, or a
    /// folder in one of these.
    pub packages: BTreeMap<String, PathBuf>,
}

impl MeshFolders {
    /// The hull of all that is in a mesh's file, each coordinate multiplied by its factor in `scale`. The error has the file's name.
    pub(super) fn hull(&self, name: &str, scale: [f64; 3]) -> Result<Hull, String> {
        let hull = mesh::hull(&self.file(name)?).map_err(|error| error.to_string())?;
        hull.scaled(scale).map_err(|error| format!("{name}, scaled by {scale:?}: {error}"))
    }

    fn file(&self, name: &str) -> Result<PathBuf, String> {
        if name.is_empty() {
            return Err("<mesh> has no filename".into());
        }
        let Some(path) = name.strip_prefix(PACKAGE) else {
            return Ok(self.urdf.join(name.strip_prefix("file://").unwrap_or(name)));
        };
        let (package, file) = path.split_once('/').unwrap_or((path, ""));
        match self.packages.get(package).cloned().or_else(|| self.package(package)) {
            Some(folder) => Ok(folder.join(file)),
            None => Err(format!(
                "{name}: no folder {package:?} at the URDF or above it; the key `packages` of a robot file says where the package is"
            )),
        }
    }

    fn package(&self, package: &str) -> Option<PathBuf> {
        // The absolute path, because a relative one has only the ancestors that it names.
        let folder = std::path::absolute(&self.urdf).ok()?;
        let is_it = |folder: &Path| folder.file_name().is_some_and(|name| name == package);
        folder.ancestors().find_map(|above| {
            let inside = above.join(package);
            if is_it(above) { Some(above.to_path_buf()) } else { inside.is_dir().then_some(inside) }
        })
    }
}
