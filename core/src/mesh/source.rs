//! The source of a document's mesh, and a fingerprint that tells whether the mesh has changed since.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::builtin::builtin;
use super::error::LoadError;
use super::kernel::TriMesh;
use super::load::{LoadedMesh, load};

/// Source of the mesh of a document.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshSource {
    /// A built-in model, by name.
    Builtin(String),
    /// A file; a relative path is relative to the folder of the document.
    File(PathBuf),
}

impl MeshSource {
    /// The built-in model of this name, or else the file at this path.
    pub fn from_name(name: &str) -> Self {
        if builtin(name).is_some() { Self::Builtin(name.to_owned()) } else { Self::File(PathBuf::from(name)) }
    }

    /// Reads the mesh; a relative path is relative to `folder`.
    ///
    /// # Errors
    ///
    /// See [`LoadError`].
    pub fn load(&self, folder: &Path) -> Result<LoadedMesh, LoadError> {
        match self {
            Self::Builtin(name) => builtin(name).ok_or_else(|| LoadError::UnknownModel(name.clone())),
            Self::File(path) => load(&folder.join(path)),
        }
    }
}

impl fmt::Display for MeshSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Builtin(name) => f.write_str(name),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// Numbers of vertices and faces, and a hash (64-bit FNV-1a) of connectivity and positions. Positions count rounded to
/// 1e-6 of the units of `mesh`, so that a file with fewer digits has the same fingerprint.
pub fn fingerprint(mesh: &TriMesh) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |bytes: &[u8]| {
        for &b in bytes {
            hash = (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for h in mesh.halfedges() {
        add(&mesh.origin(h).0.to_le_bytes());
    }
    for p in mesh.positions() {
        for x in p.to_array() {
            add(&((x * 1e6).round() as i64).to_le_bytes());
        }
    }
    format!("{}-{}-{hash:016x}", mesh.n_vertices(), mesh.n_faces())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::torus;

    #[test]
    fn a_name_is_a_built_in_model_or_a_path() {
        assert_eq!(MeshSource::from_name("torus"), MeshSource::Builtin("torus".to_owned()));
        assert_eq!(MeshSource::from_name("torus.obj"), MeshSource::File(PathBuf::from("torus.obj")));
        let unknown = MeshSource::Builtin("no such model".to_owned());
        assert!(matches!(unknown.load(Path::new("")), Err(LoadError::UnknownModel(name)) if name == "no such model"));
    }

    #[test]
    fn a_fingerprint_changes_with_positions_and_connectivity_but_not_with_rounding() {
        let mesh = torus(8, 6);
        let moved = |by: f64| {
            let mut positions = mesh.positions().to_vec();
            positions[5].x += by;
            let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
            TriMesh::from_faces(positions, &faces).unwrap()
        };
        assert_eq!(fingerprint(&moved(0.0)), fingerprint(&mesh));
        assert_ne!(fingerprint(&moved(1e-5)), fingerprint(&mesh));
        assert_ne!(fingerprint(&torus(6, 8)), fingerprint(&mesh));
        assert!(fingerprint(&mesh).starts_with("48-96-"));
    }
}
