//! Where the mesh of a document comes from, and how to notice that it has changed since.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::builtin::builtin;
use super::kernel::TriMesh;
use super::load::{LoadError, LoadedMesh, load};

/// Where the mesh of a document comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshSource {
    /// A model that comes with the program.
    Builtin(String),
    /// A file.
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
    /// What reading says.
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

/// A short text that changes with the connectivity or the shape of the mesh (FNV-1a over all of it).
pub fn fingerprint(mesh: &TriMesh) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut eat = |bytes: &[u8]| {
        for &b in bytes {
            hash = (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for h in mesh.halfedges() {
        eat(&mesh.origin(h).0.to_le_bytes());
    }
    for p in mesh.positions() {
        // Rounded, so that a file read back with fewer digits is still the same mesh.
        for x in p.to_array() {
            eat(&((x * 1e6).round() as i64).to_le_bytes());
        }
    }
    format!("{}-{}-{hash:016x}", mesh.n_vertices(), mesh.n_faces())
}
