//! Loading a mesh file: read, triangulate, repair, normalise.
//!
//! The result is an oriented manifold (checked by [`TriMesh::from_faces`]), normalised by its bounding box,
//! so that every tolerance of the library has one meaning. Repairs are listed. What cannot be repaired with certainty is
//! an error that names its place in the file.

use std::path::Path;
use std::sync::Arc;

use super::error::LoadError;
use super::kernel::TriMesh;
use super::normalisation::{Normalisation, NormalisedBy};
use super::read;
use super::repair::{Repair, repair};
use super::triangulate::triangulate;
use crate::progress::Progress;

/// A mesh read from a file.
#[derive(Debug, Clone)]
pub struct LoadedMesh {
    /// The mesh, centred at the origin and of model size 1.
    pub mesh: Arc<TriMesh>,
    /// The similarity that takes it back to the coordinates of the file.
    pub units: Normalisation,
    /// The repairs that made it an oriented manifold, in the order done.
    pub repairs: Vec<Repair>,
    /// The file's name without folder and extension.
    pub name: String,
}

impl LoadedMesh {
    /// The same mesh, normalised by another size. Unchanged if it is normalised so already, or has no area to be normalised
    /// by.
    #[must_use]
    pub fn normalised_by(mut self, by: NormalisedBy) -> Self {
        if self.units.by == by {
            return self;
        }
        let step = match by {
            NormalisedBy::BoundingBox => Normalisation::by_bounding_box(self.mesh.positions()),
            NormalisedBy::Surface => Normalisation::by_surface(&self.mesh),
        };
        if let Some(step) = step {
            self.mesh = Arc::new(self.mesh.mapped(|p| step.from_file(p)));
            self.units =
                Normalisation { by, centre: self.units.to_file(step.centre), scale: self.units.scale * step.scale };
        }
        self
    }

    /// Diagonal of the bounding box, in units of `mesh`.
    pub fn diagonal(&self) -> f64 {
        match self.units.by {
            NormalisedBy::BoundingBox => 1.0,
            NormalisedBy::Surface => Normalisation::by_bounding_box(self.mesh.positions()).map_or(1.0, |n| n.scale),
        }
    }
}

/// Loads a mesh file: OBJ, OFF, PLY or STL, recognised by its content.
///
/// # Errors
///
/// [`LoadError`]: the file cannot be read, or its content is no mesh.
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    // Reading from a pipe or a device might never end.
    if !std::fs::metadata(path)?.is_file() {
        return Err(LoadError::NotAFile);
    }
    parse(&std::fs::read(path)?, &name)
}

/// Loads a mesh from the bytes of a file named `name`.
///
/// # Errors
///
/// See [`LoadError`].
pub fn parse(bytes: &[u8], name: &str) -> Result<LoadedMesh, LoadError> {
    parse_with(bytes, name, &Progress::new())
}

/// As [`parse`]; reports its stages to `progress`.
///
/// # Errors
///
/// See [`LoadError`].
pub fn parse_with(bytes: &[u8], name: &str, progress: &Progress) -> Result<LoadedMesh, LoadError> {
    progress.report("Reading", 0.0);
    let raw = read::read(bytes, name)?;
    progress.report("Repairing", 0.4);
    let triangles = triangulate(&raw)?;
    let (positions, faces, repairs) = repair(raw, triangles)?;
    progress.report("Connecting triangles", 0.8);
    let units = Normalisation::by_bounding_box(&positions).ok_or(LoadError::NoSize)?;
    let mesh = TriMesh::from_faces(positions.into_iter().map(|p| units.from_file(p)).collect(), &faces)?;
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    Ok(LoadedMesh { mesh: Arc::new(mesh), units, repairs, name: stem.to_owned() })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::Topology;
    use crate::testing::research_meshes;

    /// A mesh as listed: file, genus, boundary loops, components, whether it is a manifold.
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
    fn real_meshes_have_the_listed_topology() {
        let Some(folder) = research_meshes() else { return };
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
            let again = Normalisation::by_bounding_box(loaded.mesh.positions()).unwrap();
            assert!((again.scale - 1.0).abs() < 1e-12 && again.centre.length() < 1e-12);
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
    fn the_content_decides_the_format() {
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

    /// Text made of words of all formats, so that random input gets past the first line of a reader.
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

        /// Random faces over few vertices: what loads satisfies the Euler formula.
        #[test]
        fn random_faces_load_as_manifolds_or_are_refused(
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
            if let Some(folder) = research_meshes() {
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
