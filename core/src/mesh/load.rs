//! Opening a mesh file: read, cut into triangles, repair, normalise.
//!
//! Afterwards the mesh is an oriented manifold (checked by [`TriMesh::from_faces`]) in a frame of its own, centred
//! and of bounding-box diagonal 1, so that every tolerance of the program has one meaning. What had to be
//! changed is listed; what cannot be repaired with certainty is refused with its place in the file.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use super::kernel::{TriMesh, TriMeshError};
use super::read;
use super::repair::{Repair, repair};
use super::triangulate::triangulate;
use crate::progress::Progress;

/// A mesh read from a file.
#[derive(Debug, Clone)]
pub struct LoadedMesh {
    /// The mesh, centred at the origin and of bounding-box diagonal 1.
    pub mesh: Arc<TriMesh>,
    /// The way back to the coordinates of the file.
    pub units: Normalisation,
    /// What was changed to make it an oriented manifold, in the order done.
    pub repairs: Vec<Repair>,
    /// The file's name without folder and extension.
    pub name: String,
}

/// The similarity between file coordinates and the normalised frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Normalisation {
    /// Centre of the bounding box, in file units.
    pub center: DVec3,
    /// Diagonal of the bounding box: file units per normalised unit.
    pub scale: f64,
}

impl Normalisation {
    /// The frame in which `positions` have their bounding box centred and of diagonal 1; `None` where they have no
    /// extent that floating point can express.
    pub fn of(positions: &[DVec3]) -> Option<Self> {
        let min = positions.iter().copied().reduce(DVec3::min)?;
        let max = positions.iter().copied().reduce(DVec3::max)?;
        let scale = (max - min).length();
        let center = min + 0.5 * (max - min);
        (scale.is_normal() && center.is_finite()).then_some(Self { center, scale })
    }

    /// From the normalised frame to file coordinates.
    pub fn to_file(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.center
    }

    /// From file coordinates to the normalised frame.
    pub fn from_file(&self, p: DVec3) -> DVec3 {
        (p - self.center) / self.scale
    }
}

/// A face as the file numbers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceRef {
    /// Its number, counted as the format does: from 1 in OBJ, from 0 elsewhere.
    pub number: usize,
    /// Its line, for text formats.
    pub line: Option<usize>,
}

impl fmt::Display for FaceRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "face {} (line {line})", self.number),
            None => write!(f, "face {}", self.number),
        }
    }
}

/// A vertex as the file numbers it, and where it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexRef {
    /// Its number, counted as the format does: from 1 in OBJ, from 0 elsewhere. Where vertices were welded by
    /// position it is the number after welding.
    pub number: usize,
    /// Its position in file units.
    pub position: DVec3,
}

impl fmt::Display for VertexRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DVec3 { x, y, z } = self.position;
        write!(f, "vertex {} at ({x}, {y}, {z})", self.number)
    }
}

/// Why a file cannot be opened as a mesh.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// No built-in model of this name.
    #[error("there is no built-in model named “{0}”")]
    UnknownModel(String),
    /// A folder, a pipe or a device.
    #[error("this is not a regular file")]
    NotAFile,
    /// There is nothing in the file.
    #[error("the file is empty")]
    Empty,
    /// Neither content nor name tell a known format.
    #[error("this is no mesh file that can be read (OBJ, OFF, PLY or STL)")]
    UnknownFormat,
    /// The text does not follow the format.
    #[error("{}{message}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Syntax {
        /// The line, where there is one.
        line: Option<usize>,
        /// What is wrong.
        message: String,
    },
    /// More elements than 32-bit ids can name.
    #[error("the mesh is too large: more than a thousand million corners")]
    TooLarge,
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex, as the file numbers it.
        vertex: usize,
    },
    /// A face names a vertex that the file does not have.
    #[error("{face} names vertex {vertex}, but there are only {count} vertices")]
    UnknownVertex {
        /// The face.
        face: FaceRef,
        /// The vertex, as the file numbers it.
        vertex: usize,
        /// The number of vertices.
        count: usize,
    },
    /// A face has so many corners that it cannot be meant as one.
    #[error("{face} has {corners} corners; more than {limit} are not supported")]
    HugeFace {
        /// The face.
        face: FaceRef,
        /// Its corners.
        corners: usize,
        /// The most corners a face may have.
        limit: usize,
    },
    /// There is no face, or none that spans anything.
    #[error("the file has no faces ({vertices} vertices)")]
    NoFaces {
        /// The number of vertices.
        vertices: usize,
    },
    /// All vertices coincide, or are too far apart to be measured.
    #[error("the mesh has no measurable size")]
    NoSize,
    /// More than two faces share an edge.
    #[error("{count} faces share the edge from {from} to {to} (among them {first} and {second}); at most two may")]
    NonManifoldEdge {
        /// One end.
        from: VertexRef,
        /// The other end.
        to: VertexRef,
        /// How many faces share it.
        count: usize,
        /// The first of them.
        first: FaceRef,
        /// The second of them.
        second: FaceRef,
    },
    /// A component has only one side, like a Moebius strip.
    #[error("the surface has only one side, like a Möbius strip: it cannot be oriented at {face}, near {near}")]
    NonOrientable {
        /// A face where both orientations meet.
        face: FaceRef,
        /// A vertex of it.
        near: VertexRef,
    },
    /// The repaired mesh is still not a manifold.
    #[error("the mesh could not be repaired: {0}")]
    Mesh(#[from] TriMeshError),
}

/// Opens a mesh file: OBJ, OFF, PLY or STL, told by its content.
///
/// # Errors
///
/// The file cannot be read, or its content is refused; see [`LoadError`].
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // Reading a pipe or a device might never end.
    if !std::fs::metadata(path)?.is_file() {
        return Err(LoadError::NotAFile);
    }
    parse(&std::fs::read(path)?, &name)
}

/// Reads a mesh from the bytes of a file called `name`.
///
/// # Errors
///
/// The content is refused; see [`LoadError`].
pub fn parse(bytes: &[u8], name: &str) -> Result<LoadedMesh, LoadError> {
    parse_with(bytes, name, &Progress::new())
}

/// As [`parse`]; reports its stages.
///
/// # Errors
///
/// The content is refused; see [`LoadError`].
pub fn parse_with(bytes: &[u8], name: &str, progress: &Progress) -> Result<LoadedMesh, LoadError> {
    progress.report("Reading", 0.0);
    let raw = read::read(bytes, name)?;
    progress.report("Repairing", 0.4);
    let triangles = triangulate(&raw)?;
    let (positions, faces, repairs) = repair(raw, triangles)?;
    progress.report("Connecting triangles", 0.8);
    let units = Normalisation::of(&positions).ok_or(LoadError::NoSize)?;
    let mesh = TriMesh::from_faces(positions.into_iter().map(|p| units.from_file(p)).collect(), &faces)?;
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    Ok(LoadedMesh { mesh: Arc::new(mesh), units, repairs, name: stem.to_owned() })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use proptest::prelude::*;

    use super::*;
    use crate::mesh::Topology;

    /// The folder of real meshes, if there is one.
    fn meshes() -> Option<PathBuf> {
        let folder = std::env::var_os("PLAIT_MESHES")
            .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/meshes")), PathBuf::from);
        let found = folder.join("MANIFEST.tsv").is_file();
        if !found {
            eprintln!("skipped: no meshes in {}", folder.display());
        }
        found.then_some(folder)
    }

    /// What the list of meshes says of one: file, genus, boundary loops, components, whether it is a manifold.
    type Row = (String, Option<usize>, usize, usize, bool);

    fn manifest(folder: &Path) -> Vec<Row> {
        let text = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
        let row = |line: &str| {
            let cells: Vec<&str> = line.split('\t').collect();
            let number = |i: usize| cells[i].parse().ok();
            (cells[1].to_owned(), number(5), number(6).unwrap(), number(7).unwrap(), cells[8].starts_with("yes"))
        };
        text.lines().skip(1).map(row).collect()
    }

    #[test]
    fn real_meshes_have_the_topology_they_should() {
        let Some(folder) = meshes() else { return };
        for (file, genus, boundary_loops, components, manifold) in manifest(&folder) {
            let loaded = match load(&folder.join(&file)) {
                Ok(loaded) => loaded,
                Err(e) => {
                    assert!(!manifold && e.to_string().contains("Möbius"), "{file}: {e}");
                    continue;
                }
            };
            let t = Topology::new(&loaded.mesh);
            if manifold {
                let found = (Some(t.genus), t.boundary_loops.len(), t.components.len());
                assert_eq!(found, (genus, boundary_loops, components), "{file} {:?}", loaded.repairs);
                let harmless =
                    |r: &Repair| matches!(r, Repair::DroppedUnusedVertices { .. } | Repair::TurnedOutwards { .. });
                assert!(loaded.repairs.iter().all(harmless), "{file}: {:?}", loaded.repairs);
            } else {
                assert!(matches!(loaded.repairs[0], Repair::SplitVertices { .. }), "{file}: {:?}", loaded.repairs);
            }
            let again = Normalisation::of(loaded.mesh.positions()).unwrap();
            assert!((again.scale - 1.0).abs() < 1e-12 && again.center.length() < 1e-12);
        }
    }

    #[test]
    fn empty_and_unknown_files_are_refused() {
        assert!(matches!(parse(b"", "a.obj"), Err(LoadError::Empty)));
        assert!(matches!(parse(b" \n\n", "a.stl"), Err(LoadError::Empty)));
        assert!(matches!(parse(b"hello world", "a.txt"), Err(LoadError::UnknownFormat)));
        assert!(matches!(load(Path::new(env!("CARGO_MANIFEST_DIR"))), Err(LoadError::NotAFile)));
        assert!(matches!(load(Path::new("/nowhere/at/all.obj")), Err(LoadError::Io(_))));
    }

    #[test]
    fn the_content_tells_the_format() {
        let off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        assert_eq!(parse(off, "misnamed.obj").unwrap().mesh.n_faces(), 1);
        assert_eq!(parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "misnamed.ply").unwrap().name, "misnamed");
    }

    #[test]
    fn loose_triangles_are_welded() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 -0\nf 1 2 3\nf 4 5 6\n";
        let m = parse(text.as_bytes(), "soup.obj").unwrap();
        assert_eq!((m.mesh.n_vertices(), &m.repairs[..]), (4, &[Repair::Welded { count: 2 }][..]));
    }

    /// Pieces of all text formats, to come upon more than the first line of a reader by chance.
    fn mesh_like_text() -> impl Strategy<Value = String> {
        let word = prop_oneof![
            Just("v "),
            Just("f "),
            Just("\n"),
            Just("\n"),
            Just(" "),
            Just("0 "),
            Just("1 "),
            Just("2 "),
            Just("3 "),
            Just("4 "),
            Just("-1 "),
            Just("0.5 "),
            Just("1e400 "),
            Just("nan "),
            Just("99999999999999999999 "),
            Just("4000000000 "),
            Just("/"),
            Just("\\\n"),
            Just("#"),
            Just("vertex "),
            Just("facet "),
            Just("endfacet\n"),
            Just("element face "),
            Just("element vertex "),
            Just("property list uchar int vertex_indices\n"),
            Just("property float x\nproperty float y\nproperty float z\n"),
            Just("end_header\n"),
        ];
        let head = prop_oneof![
            Just(""),
            Just("OFF\n"),
            Just("OFF\n4 4 6\n"),
            Just("solid \n"),
            Just("ply\nformat ascii 1.0\n"),
            Just("ply\nformat binary_big_endian 1.0\n"),
            Just("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"),
        ];
        (head, prop::collection::vec(word, 0..120)).prop_map(|(head, words)| head.to_owned() + &words.concat())
    }

    proptest! {
        #[test]
        fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..600), ext in 0usize..4) {
            let _ = parse(&bytes, ["a.obj", "a.off", "a.ply", "a.stl"][ext]);
        }

        #[test]
        fn mesh_like_text_never_panics(text in mesh_like_text(), ext in 0usize..4) {
            let _ = parse(text.as_bytes(), ["a.obj", "a.off", "a.ply", "a.stl"][ext]);
        }

        /// Random triangles over few vertices: whatever loads is an oriented manifold with sound topology.
        #[test]
        fn random_faces_load_as_manifolds_or_not_at_all(
            faces in prop::collection::vec(prop::collection::vec(1u32..8, 3..6), 1..8),
        ) {
            let mut text: String = (0..7).map(|i| format!("v {} {} {}\n", i, (i * i) % 5, (i * 3) % 7)).collect();
            for face in &faces {
                text += "f";
                for v in face {
                    text += &format!(" {v}");
                }
                text += "\n";
            }
            match parse(text.as_bytes(), "random.obj") {
                Ok(m) => {
                    let t = Topology::new(&m.mesh);
                    let b = t.boundary_loops.len() as i64;
                    prop_assert_eq!(t.euler, 2 * t.components.len() as i64 - 2 * t.genus as i64 - b);
                }
                Err(e) => prop_assert!(!matches!(e, LoadError::Mesh(_)), "{e}"),
            }
        }

        #[test]
        fn truncated_and_damaged_files_never_panic(
            file in 0usize..64, at in 0.0f64..1.0, damage in prop::collection::vec((0.0f64..1.0, any::<u8>()), 0..4),
        ) {
            if let Some(folder) = meshes() {
                let rows = manifest(&folder);
                let file = &rows[file % rows.len()].0;
                let mut bytes = std::fs::read(folder.join(file)).unwrap();
                // The smallest files are enough, and fast.
                if bytes.len() < 200_000 {
                    bytes.truncate((at * bytes.len() as f64) as usize);
                    for (place, byte) in damage {
                        let place = (place * bytes.len() as f64) as usize;
                        bytes.get_mut(place).into_iter().for_each(|b| *b = byte);
                    }
                    let _ = parse(&bytes, file);
                }
            }
        }
    }
}
