//! The document: which mesh, which options, which strips in which order.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::mesh::{MeshSource, TriMesh, fingerprint};
use crate::surface::SurfaceCurve;
use crate::weave::model::Options;
use crate::weave::proposal::ElasticEnergy;

/// Number of a strip, never used again within one design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StripId(pub u32);

/// A placed strip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strip {
    /// Its number.
    pub id: StripId,
    /// Its spine, on the mesh of the design.
    pub curve: SurfaceCurve,
    /// The same on the proxy it was woven on, if it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_proxy: Option<SurfaceCurve>,
    /// Cost of the loop when it was found.
    pub cost: f64,
    /// Its elastic energy when it was placed, if it was a loop of the graph.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<ElasticEnergy>,
    /// Whether it is drawn.
    pub visible: bool,
}

impl Strip {
    /// Its spine on the mesh that is woven on.
    pub fn woven(&self) -> &SurfaceCurve {
        self.on_proxy.as_ref().unwrap_or(&self.curve)
    }
}

/// A part of the layout that is to stay where it is when the embedding is optimised. It is told by a point of the first
/// drawing of the layout, which is the same for the same strips, on the mesh of bounding-box diagonal 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pin {
    /// The node at this point.
    Node([f64; 3]),
    /// The arc with this point in its middle.
    Arc([f64; 3]),
}

/// Why a design could not be read or written.
#[derive(Debug, Error)]
pub enum DesignError {
    /// The file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not a design.
    #[error("{path} is not a Plait design: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// Written by a newer program.
    #[error("the design has format version {0}; this program reads up to {VERSION}")]
    Version(u32),
    /// The mesh is not the one that the design was made on.
    #[error("the mesh {mesh} is not the one this design was made on (it has changed since)")]
    OtherMesh {
        /// Where it was read.
        mesh: String,
    },
}

/// Version of the file format.
const VERSION: u32 = 1;

/// A design: a value that commands transform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// Version of the format.
    pub version: u32,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// Fingerprint of the mesh, to notice when it has changed.
    pub fingerprint: String,
    /// The options.
    pub options: Options,
    /// Fingerprint of the proxy that strips were woven on, to notice when another program makes another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proxy: Option<String>,
    /// The strips in the order placed.
    pub strips: Vec<Strip>,
    /// What of their layout is to stay where it is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pins: Vec<Pin>,
}

impl Design {
    /// A design without strips.
    pub fn new(source: MeshSource, mesh: &TriMesh, options: Options) -> Self {
        let (proxy, strips, pins) = (None, Vec::new(), Vec::new());
        Self { version: VERSION, mesh: source, fingerprint: fingerprint(mesh), options, proxy, strips, pins }
    }

    /// Reads a design.
    ///
    /// # Errors
    ///
    /// When there is no such file, or it is no design, or a newer one.
    pub fn read(path: &Path) -> Result<Self, DesignError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| DesignError::File { path: path.to_owned(), source })?;
        let design: Self =
            serde_json::from_str(&text).map_err(|source| DesignError::Format { path: path.to_owned(), source })?;
        if design.version > VERSION {
            return Err(DesignError::Version(design.version));
        }
        Ok(design)
    }

    /// Writes the design.
    ///
    /// # Errors
    ///
    /// What the system says.
    pub fn write(&self, path: &Path) -> Result<(), DesignError> {
        let file = |source| DesignError::File { path: path.to_owned(), source };
        let text =
            serde_json::to_string(self).map_err(|source| DesignError::Format { path: path.to_owned(), source })?;
        std::fs::write(path, text + "\n").map_err(file)
    }

    /// Checks that `mesh` is the one the design was made on and that all strips lie on it.
    ///
    /// # Errors
    ///
    /// [`DesignError::OtherMesh`].
    pub fn check_mesh(&self, mesh: &TriMesh) -> Result<(), DesignError> {
        let fits = fingerprint(mesh) == self.fingerprint && self.strips.iter().all(|s| s.curve.check(mesh).is_ok());
        if fits { Ok(()) } else { Err(DesignError::OtherMesh { mesh: self.mesh.to_string() }) }
    }
}
