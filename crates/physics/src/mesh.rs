//! Hulls of meshes in files: Wavefront OBJ and STL, text or binary. Numbers are taken for metres; [`Hull::scaled`] changes that.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use aforce::Vector3;
use thiserror::Error;

use crate::scene::{Hull, HullError};

/// Why no hull was made from a file, with the file's name.
#[derive(Debug, Error)]
#[error("{}: {fault}", file.display())]
pub struct MeshError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub fault: MeshFault,
}

/// What is wrong with a file.
#[derive(Debug, Error)]
pub enum MeshFault {
    /// It cannot be read.
    #[error("{0}")]
    Read(#[from] std::io::Error),
    /// It is neither an OBJ nor an STL by its name.
    #[error("a mesh ends in .obj or .stl")]
    Kind,
    /// It is called an OBJ and is none.
    #[error("no OBJ: {0}")]
    Obj(#[from] tobj::LoadError),
    /// It is called an STL and is none.
    #[error("no STL: {0}")]
    Stl(std::io::Error),
    /// No triangle in it.
    #[error("it has no faces")]
    Empty,
    /// Its faces do not enclose a volume.
    #[error("{part}the mesh is not closed: {edges} edges belong to one face only, one of them from {from:?} to {to:?}")]
    Open {
        /// The group, if there are several.
        part: String,
        /// How many edges belong to an odd number of faces.
        edges: usize,
        /// One end of one of them, in the file's units.
        from: [f64; 3],
        /// Its other end.
        to: [f64; 3],
    },
    /// Its corners have no hull.
    #[error("{part}{fault}")]
    Hull {
        /// The group, if there are several.
        part: String,
        /// What is wrong.
        fault: HullError,
    },
}

/// Faces as triples of corners.
type Triangles = Vec<[Vector3; 3]>;

/// The convex hull of all faces of one file.
///
/// # Errors
/// If the file cannot be read, its mesh is not closed, or its corners have no hull ([`Hull::new`]).
pub fn hull(file: &Path) -> Result<Hull, MeshError> {
    let whole = |groups: Vec<(String, Triangles)>| {
        let triangles: Triangles = groups.into_iter().flat_map(|(_, triangles)| triangles).collect();
        closed_hull("", &triangles)
    };
    read(file).and_then(whole).map_err(|fault| MeshError { file: file.into(), fault })
}

/// The convex hulls of a body that was cut into convex parts: one of each file, and in an OBJ one of each of its groups (`o` or
/// `g`).
///
/// # Errors
/// As [`hull`], for every part by itself.
pub fn parts(files: &[PathBuf]) -> Result<Vec<Hull>, MeshError> {
    let mut hulls = vec![];
    for file in files {
        let found = read(file).and_then(|groups| {
            let several = groups.len() > 1;
            let of = |(name, triangles): &(String, Triangles)| {
                closed_hull(&if several { format!("group {name:?}: ") } else { String::new() }, triangles)
            };
            groups.iter().map(of).collect::<Result<Vec<_>, _>>()
        });
        hulls.extend(found.map_err(|fault| MeshError { file: file.clone(), fault })?);
    }
    Ok(hulls)
}

/// The groups of a file, each with its name.
fn read(file: &Path) -> Result<Vec<(String, Triangles)>, MeshFault> {
    let kind = file.extension().map(|kind| kind.to_string_lossy().to_lowercase());
    let groups = match kind.as_deref() {
        Some("obj") => read_obj(&std::fs::read(file)?)?,
        Some("stl") => read_stl(&std::fs::read(file)?)?,
        _ => return Err(MeshFault::Kind),
    };
    if groups.iter().all(|(_, triangles)| triangles.is_empty()) { Err(MeshFault::Empty) } else { Ok(groups) }
}

fn read_obj(bytes: &[u8]) -> Result<Vec<(String, Triangles)>, MeshFault> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    // Materials are not needed.
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(bytes), &options, |_| Ok(Default::default()))?;
    let group = |model: tobj::Model| {
        let positions = model.mesh.positions.as_chunks::<3>().0;
        let faces = model.mesh.indices.as_chunks::<3>().0;
        (model.name, faces.iter().map(|face| face.map(|i| Vector3::from(positions[i as usize]))).collect())
    };
    Ok(models.into_iter().map(group).collect())
}

fn read_stl(bytes: &[u8]) -> Result<Vec<(String, Triangles)>, MeshFault> {
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(MeshFault::Stl)?;
    let corner = |i: usize| Vector3::from(mesh.vertices[i].0.map(f64::from));
    let triangles = mesh.faces.iter().map(|face| face.vertices.map(corner)).collect();
    Ok(vec![(String::new(), triangles)])
}

/// The hull of `triangles`, if they form a closed surface.
fn closed_hull(part: &str, triangles: &Triangles) -> Result<Hull, MeshFault> {
    let hull = Hull::new(triangles.as_flattened()).map_err(|fault| MeshFault::Hull { part: part.into(), fault })?;
    // Corners are compared by their coordinates, because an STL repeats a corner for each of its faces.
    let key = |p: &Vector3| [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
    let mut edges = HashMap::new();
    for triangle in triangles {
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (&triangle[a], &triangle[b])) {
            let ends = [key(from), key(to)];
            let ends = if ends[0] < ends[1] { ends } else { [ends[1], ends[0]] };
            *edges.entry(ends).or_insert(0usize) += 1;
        }
    }
    // A triangle with two equal corners has one edge of no length, which is left out, and its other edge twice.
    let open: Vec<_> = edges.iter().filter(|(ends, count)| *count % 2 == 1 && ends[0] != ends[1]).collect();
    let Some(first) = open.iter().map(|(ends, _)| **ends).min() else { return Ok(hull) };
    let [from, to] = first.map(|point| point.map(f64::from_bits));
    Err(MeshFault::Open { part: part.into(), edges: open.len(), from, to })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Inertial, Shape};

    /// A tetrahedron with legs of 1, 2 and 3, and a second one apart from it.
    const OBJ: &str = "o first\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n\
                       g second\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 0 1\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf -3 -2 -1\n";

    fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        (folder, file)
    }

    fn volume(hull: &Hull) -> f64 {
        Inertial::solid(&Shape::Convex(hull.clone()), 1.0).mass
    }

    /// The four faces of the first tetrahedron.
    fn faces() -> [[[f32; 3]; 3]; 4] {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
        [[p[0], p[2], p[1]], [p[0], p[1], p[3]], [p[0], p[3], p[2]], [p[1], p[2], p[3]]]
    }

    fn ascii_stl(faces: &[[[f32; 3]; 3]]) -> String {
        let mut text = String::from("solid part\n");
        for face in faces {
            text += "facet normal 0 0 0\n outer loop\n";
            face.iter().for_each(|[x, y, z]| text += &format!("  vertex {x} {y} {z}\n"));
            text += " endloop\nendfacet\n";
        }
        text + "endsolid part\n"
    }

    fn binary_stl(faces: &[[[f32; 3]; 3]]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes.extend((faces.len() as u32).to_le_bytes());
        for face in faces {
            bytes.extend([0; 12]);
            bytes.extend(face.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn an_obj_is_one_hull_or_one_for_each_group() {
        let (_folder, file) = written("two.obj", OBJ.as_bytes());
        let hulls = parts(std::slice::from_ref(&file)).unwrap();
        let volumes: Vec<f64> = hulls.iter().map(volume).collect();
        assert!(volumes.len() == 2 && (volumes[0] - 1.0).abs() < 1e-12 && (volumes[1] - 1.0 / 6.0).abs() < 1e-12);
        assert_eq!(hull(&file).unwrap().corners().len(), 6, "(1, 0, 0) and (5, 0, 0) are on an edge");
    }

    #[test]
    fn both_kinds_of_stl_are_read() {
        for (bytes, kind) in [(ascii_stl(&faces()).into_bytes(), "ascii"), (binary_stl(&faces()), "binary")] {
            let (_folder, file) = written("part.STL", &bytes);
            let millimetres = hull(&file).unwrap().scaled([1e-3; 3]).unwrap();
            assert!((volume(&millimetres) / 1e-9 - 1.0).abs() < 1e-9, "{kind}");
        }
    }

    #[test]
    fn what_is_no_body_is_refused_by_name() {
        let mut nan = faces();
        nan[0][1][2] = f32::NAN;
        nan[1][2][2] = f32::NAN;
        let flat = faces().map(|face| face.map(|[x, y, _]| [x, y, 0.0]));
        let third_away = OBJ.replace("f 1 4 3\n", "");
        for (name, bytes, answer) in [
            ("open.obj", third_away.clone().into_bytes(), "the mesh is not closed: 3 edges belong to one face only"),
            ("open.stl", ascii_stl(&faces()[..3]).into_bytes(), "the mesh is not closed: 3 edges belong to"),
            ("three.stl", binary_stl(&faces()[..1]), "3 different points; a body has at least 4"),
            ("flat.stl", binary_stl(&flat), "3 different points; a body has at least 4"),
            ("plane.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 4 3 2 1\n".to_vec(), "in one plane"),
            ("nan.stl", binary_stl(&nan), "is not finite"),
            ("empty.obj", b"v 0 0 0\n".to_vec(), "it has no faces"),
            ("cut.stl", binary_stl(&faces())[..120].to_vec(), "no STL"),
            ("words.obj", b"v 0 zero 0\n".to_vec(), "no OBJ"),
            ("part.ply", vec![], "a mesh ends in .obj or .stl"),
        ] {
            let (_folder, file) = written(name, &bytes);
            let error = hull(&file).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(answer) && !error.contains('\n'), "{error}");
        }
        let (_folder, file) = written("open.obj", third_away.as_bytes());
        let error = parts(&[file]).unwrap_err().to_string();
        assert!(error.contains("open.obj: group \"first\": the mesh is not closed"), "{error}");
        assert!(hull(Path::new("nowhere.obj")).unwrap_err().to_string().starts_with("nowhere.obj: "));
    }
}
