//! The contents of a layout file, reading and writing.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::mesh::{MeshSource, NormalisedBy, TriMesh, VertexId, fingerprint};
use crate::output::{self, FileKind, OutputError};
use crate::surface::{Crossing, SurfacePoint};

/// Version of the file format that is written.
const VERSION: u32 = 1;

/// A layout, complete or partial, with a rough embedding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LayoutFile {
    /// Version of the format.
    pub version: u32,
    /// The source of the mesh; a relative path is relative to the folder of the file.
    pub mesh: MeshSource,
    /// What the mesh is normalised by. The embedding is optimised in these coordinates.
    #[serde(default = "NormalisedBy::unnamed", skip_serializing_if = "NormalisedBy::is_unnamed")]
    pub normalised_by: NormalisedBy,
    /// Fingerprint of the normalised mesh, to detect that it has changed. Without one, any mesh with the named elements is
    /// accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
    /// The nodes.
    pub nodes: Vec<FileNode>,
    /// The arcs.
    pub arcs: Vec<FileArc>,
}

/// A node of a [`LayoutFile`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileNode {
    /// Its position. Weights of exactly zero place it on an edge or at a vertex.
    pub at: SurfacePoint,
    /// Number of quarter sectors around it; in a complete layout, of patch corners.
    pub valence: u32,
    /// Whether it is fixed in the optimisation.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
}

/// An arc of a [`LayoutFile`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileArc {
    /// Its start and its end.
    pub ends: [ArcEnd; 2],
    /// Whether it is fixed in the optimisation.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
    /// Its path between its two nodes. May be empty for an arc along the boundary.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<PathPoint>,
}

/// An end of an arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcEnd {
    /// The node.
    pub node: u32,
    /// The direction in which the arc leaves the node, in quarter sectors counter-clockwise. Below the valence at an
    /// inner node; from 0 (the boundary with the surface to the left) to the valence (the other side) at a boundary
    /// node.
    pub slot: u32,
}

/// A point of the path of an arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a point of a path must be {\"halfedge\", \"t\"} or {\"vertex\"}")]
pub enum PathPoint {
    /// The path crosses a mesh edge, out of the triangle of the half-edge.
    Crossing(Crossing),
    /// The path passes through a mesh vertex.
    Vertex {
        /// The vertex.
        vertex: VertexId,
    },
}

/// Why a layout file could not be read or written.
#[derive(Debug, Error)]
pub enum LayoutFileError {
    /// The file could not be read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] OutputError),
    /// The file is not a layout file.
    #[error("{path} is not a Plait layout: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// The place and kind of the error.
        source: serde_json::Error,
    },
    /// The version of the format is unknown.
    #[error("the layout has format version {0}; this program reads versions 1 to {VERSION}")]
    Version(u32),
    /// The mesh differs from the one that the layout was made on.
    #[error("the mesh {mesh} is not the one this layout was made on (it has changed since)")]
    OtherMesh {
        /// Its source.
        mesh: String,
    },
    /// The embedding to be written is not on a refinement of the mesh.
    #[error("the embedding of the layout is not on a refinement of this mesh")]
    OtherRefinement,
    /// An arc to be written is not a path of edges of a refinement of the mesh, or not an arc of the layout.
    #[error("arc {arc} does not lie on the mesh")]
    NotOnMesh {
        /// The arc.
        arc: usize,
    },
    /// The number of arcs at a node to be written differs from its valence.
    #[error("node {node} has valence {valence}, but {ends} arcs end there")]
    Ends {
        /// The node.
        node: usize,
        /// Its valence.
        valence: usize,
        /// Number of arc ends.
        ends: usize,
    },
}

/// The version, read first to decide whether the rest can be parsed.
#[derive(Deserialize)]
struct Head {
    version: u32,
}

impl LayoutFile {
    /// A layout without nodes on `mesh`. If that is not normalised by its bounding box, `normalised_by` is to be set.
    pub fn new(source: MeshSource, mesh: &TriMesh) -> Self {
        let (normalised_by, fingerprint) = (NormalisedBy::unnamed(), Some(fingerprint(mesh)));
        Self { version: VERSION, mesh: source, normalised_by, fingerprint, nodes: Vec::new(), arcs: Vec::new() }
    }

    /// Reads a layout file.
    ///
    /// # Errors
    ///
    /// [`LayoutFileError::File`], [`LayoutFileError::Format`] or [`LayoutFileError::Version`].
    pub fn read(path: &Path) -> Result<Self, LayoutFileError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| LayoutFileError::File { path: path.to_owned(), source })?;
        let format = |source| LayoutFileError::Format { path: path.to_owned(), source };
        let head: Head = serde_json::from_str(&text).map_err(format)?;
        if !(1..=VERSION).contains(&head.version) {
            return Err(LayoutFileError::Version(head.version));
        }
        serde_json::from_str(&text).map_err(format)
    }

    /// Writes the layout file. It replaces an older layout file, but no other file.
    ///
    /// # Errors
    ///
    /// [`LayoutFileError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), LayoutFileError> {
        let text =
            serde_json::to_string(self).map_err(|source| LayoutFileError::Format { path: path.to_owned(), source })?;
        Ok(output::write(path, FileKind::Layout, |out| writeln!(out, "{text}"))?)
    }

    /// Checks that `mesh` has the fingerprint of the file, if there is one.
    ///
    /// # Errors
    ///
    /// [`LayoutFileError::OtherMesh`].
    pub fn check_mesh(&self, mesh: &TriMesh) -> Result<(), LayoutFileError> {
        match &self.fingerprint {
            Some(own) if *own != fingerprint(mesh) => Err(LayoutFileError::OtherMesh { mesh: self.mesh.to_string() }),
            _ => Ok(()),
        }
    }
}
