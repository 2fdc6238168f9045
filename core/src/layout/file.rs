//! Layout files: the structure of a layout, complete or not, with a rough embedding of its nodes and arcs.
//!
//! A node is a point of the surface with a valence, the number of quarter sectors around it; its slots number the
//! directions in which an arc may leave it. An arc is named by the slots at both its ends and by the mesh edges that
//! it crosses. Slots without an arc make the layout partial. Patches are not stored: [`LayoutFile::draw`] draws the
//! arcs into the mesh and reads them off. The format is documented in `docs/layout-file.md`.

mod convert;
mod draw;
mod place;
mod regions;
#[cfg(test)]
mod tests;

use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::mesh::{FaceId, MeshSource, TriMesh, VertexId, fingerprint};
use crate::surface::{Crossing, SurfacePoint};

pub use regions::{PartialCorner, PartialEmbedding, PartialRegion};

/// Version of the file format.
const VERSION: u32 = 1;

/// A layout with a rough embedding, as it is kept in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LayoutFile {
    /// Version of the format.
    pub version: u32,
    /// Where the mesh comes from; a relative path is relative to the folder of the file.
    pub mesh: MeshSource,
    /// Fingerprint of the mesh, to notice when it has changed; without one any mesh will do that has the elements
    /// named.
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
    /// Where it lies. Weights of exactly zero put it on an edge or at a vertex.
    pub at: SurfacePoint,
    /// Number of quarter sectors around it: of patch corners, once the layout is complete.
    pub valence: u32,
    /// Whether it is to stay where it is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
}

/// An arc of a [`LayoutFile`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileArc {
    /// Where it starts and where it ends.
    pub ends: [ArcEnd; 2],
    /// Whether it is to stay where it is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
    /// Its way between its two nodes. Of an arc along the boundary it may be left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<PathPoint>,
}

/// An end of an arc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcEnd {
    /// The node.
    pub node: u32,
    /// The direction in which the arc leaves it, in quarters counter-clockwise: below the valence, or, at the
    /// boundary, from 0 (the boundary with the surface to the left) up to the valence (the other side).
    pub slot: u32,
}

/// A place on the way of an arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a place on an arc must be {\"halfedge\", \"t\"} or {\"vertex\"}")]
pub enum PathPoint {
    /// It crosses a mesh edge, out of the triangle of the half-edge.
    Crossing(Crossing),
    /// It passes through a mesh vertex.
    Vertex {
        /// The vertex.
        vertex: VertexId,
    },
}

/// Why a layout file could not be read or written.
#[derive(Debug, Error)]
pub enum LayoutFileError {
    /// The file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not a layout.
    #[error("{path} is not a Plait layout: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// Of a version that this program does not know.
    #[error("the layout has format version {0}; this program reads versions 1 to {VERSION}")]
    Version(u32),
    /// The mesh is not the one that the layout was made on.
    #[error("the mesh {mesh} is not the one this layout was made on (it has changed since)")]
    OtherMesh {
        /// Where it was read.
        mesh: String,
    },
    /// What is to be written was not drawn on a refinement of the mesh.
    #[error("the layout is not drawn on a refinement of this mesh")]
    OtherRefinement,
    /// An arc to be written does not run along edges of a refinement of the mesh, or is not one of the layout.
    #[error("arc {arc} does not lie on the mesh")]
    NotOnMesh {
        /// The arc.
        arc: usize,
    },
    /// A node to be written has not as many arcs as its valence says.
    #[error("node {node} has valence {valence}, but {ends} arcs end there")]
    Ends {
        /// The node.
        node: usize,
        /// Its valence.
        valence: usize,
        /// How many arc ends were found.
        ends: usize,
    },
}

/// A node or an arc of a layout file, by its place in the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// A node.
    Node(u32),
    /// An arc.
    Arc(u32),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(n) => write!(f, "node {n}"),
            Self::Arc(a) => write!(f, "arc {a}"),
        }
    }
}

/// Why a layout cannot be drawn on a mesh. Nodes and arcs are counted from 0, as in the file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PartialEmbeddingError {
    /// A node lies in a triangle that the mesh does not have.
    #[error("node {node} lies in triangle {}, which the mesh does not have", face.0)]
    UnknownFace {
        /// The node.
        node: u32,
        /// The triangle it names.
        face: FaceId,
    },
    /// A node's weights are not those of a point of a triangle.
    #[error("the weights of node {node} are not finite numbers from 0 to 1 of sum 1")]
    Weights {
        /// The node.
        node: u32,
    },
    /// A node without any sector, or with more than can be.
    #[error("node {node} has valence {valence}; valences go from 1 to {MAX_VALENCE}")]
    Valence {
        /// The node.
        node: u32,
        /// Its valence.
        valence: u32,
    },
    /// An arc ends at a node that does not exist.
    #[error("arc {arc} ends at node {node}, but there are only {count} nodes")]
    UnknownNode {
        /// The arc.
        arc: u32,
        /// The node it names.
        node: u32,
        /// Number of nodes.
        count: usize,
    },
    /// An arc ends in a slot that its node does not have.
    #[error("arc {arc} ends in slot {slot} of node {node}, whose last slot is {last}")]
    UnknownSlot {
        /// The arc.
        arc: u32,
        /// The node.
        node: u32,
        /// The slot it names.
        slot: u32,
        /// The last slot there is.
        last: u32,
    },
    /// Two arcs, or both ends of one, in one slot.
    #[error("arcs {} and {} both end in slot {slot} of node {node}", arcs[0], arcs[1])]
    SlotTaken {
        /// The node.
        node: u32,
        /// The slot.
        slot: u32,
        /// The two arcs.
        arcs: [u32; 2],
    },
    /// A place on an arc that the mesh does not have, or that is no place for an arc.
    #[error("arc {arc}, place {place} of its path: {reason}")]
    Place {
        /// The arc.
        arc: u32,
        /// The place in its path.
        place: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Two places in a row on an arc that no triangle has in common; the first is counted from 0 at the start node.
    #[error("arc {arc} has a gap: no triangle joins place {step} and the next, counted from its first node")]
    Gap {
        /// The arc.
        arc: u32,
        /// The place before the gap: 0 is the start node, 1 the first place of the path.
        step: usize,
    },
    /// Two nodes or arcs at one place.
    #[error("{first} and {second} meet")]
    Meet {
        /// One.
        first: Part,
        /// The other.
        second: Part,
    },
    /// Two arcs that cross, or one that crosses itself.
    #[error("{}, in triangle {}", crossing(*first, *second), face.0)]
    Cross {
        /// One.
        first: u32,
        /// The other, or the same.
        second: u32,
        /// Where.
        face: FaceId,
    },
    /// There is no way for an arc, though no other one is in its way.
    #[error("arc {arc} finds no way through triangle {}", face.0)]
    NoWay {
        /// The arc.
        arc: u32,
        /// Where.
        face: FaceId,
    },
    /// An arc between the outer slots of two boundary nodes does not run along the boundary from one to the other.
    #[error("arc {arc} has the slots of an arc along the boundary, but does not run along it from node to node")]
    OffBoundary {
        /// The arc.
        arc: u32,
    },
    /// An arc runs along the boundary, or touches it, and has not the slots for that.
    #[error("arc {arc} touches the boundary between its nodes, but its slots are not those of a boundary arc")]
    OnBoundary {
        /// The arc.
        arc: u32,
    },
    /// The slots at a node are not in the order in which the arcs leave it.
    #[error("the slots at node {node} contradict the order of its arcs, counter-clockwise {}", list(arcs))]
    SlotOrder {
        /// The node.
        node: u32,
        /// The arcs in the order in which they leave the node, counter-clockwise; at the boundary from slot 0 on.
        arcs: Vec<u32>,
    },
    /// A node at which no arc ends, off the boundary.
    #[error("arcs are missing: none ends at node {node}")]
    Isolated {
        /// The node.
        node: u32,
    },
    /// A region between arcs that is not a disc, so that its directions are not determined.
    #[error("arcs are missing: the region of triangle {} ({}) is not a disc", face.0, bounded(arcs))]
    NotADisc {
        /// The region.
        region: u32,
        /// A triangle of it.
        face: FaceId,
        /// The arcs around it.
        arcs: Vec<u32>,
    },
    /// Corners of a region that do not add up to one turn.
    #[error(
        "the valences contradict the arcs: the corners of the region of triangle {} ({}) turn by {quarters} quarters \
         instead of 4", face.0, bounded(arcs)
    )]
    Turning {
        /// The region.
        region: u32,
        /// A triangle of it.
        face: FaceId,
        /// The arcs around it.
        arcs: Vec<u32>,
        /// The sum of its turns.
        quarters: i64,
    },
}

/// Most sectors at a node: far above what a layout has a use for, far below what could overflow sums.
const MAX_VALENCE: u32 = 1000;

fn crossing(first: u32, second: u32) -> String {
    if first == second { format!("arc {first} crosses itself") } else { format!("arcs {first} and {second} cross") }
}

fn bounded(arcs: &[u32]) -> String {
    if arcs.is_empty() { "with no arc around it".into() } else { format!("between arcs {}", list(arcs)) }
}

fn list(numbers: &[u32]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// The first thing read of a file: whether the rest can be understood.
#[derive(Deserialize)]
struct Head {
    version: u32,
}

impl LayoutFile {
    /// A layout without nodes on `mesh`.
    pub fn new(source: MeshSource, mesh: &TriMesh) -> Self {
        let fingerprint = Some(fingerprint(mesh));
        Self { version: VERSION, mesh: source, fingerprint, nodes: Vec::new(), arcs: Vec::new() }
    }

    /// Reads a layout.
    ///
    /// # Errors
    ///
    /// When there is no such file, or it is no layout, or of an unknown version.
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

    /// Writes the layout.
    ///
    /// # Errors
    ///
    /// What the system says.
    pub fn write(&self, path: &Path) -> Result<(), LayoutFileError> {
        let text =
            serde_json::to_string(self).map_err(|source| LayoutFileError::Format { path: path.to_owned(), source })?;
        std::fs::write(path, text + "\n").map_err(|source| LayoutFileError::File { path: path.to_owned(), source })
    }

    /// Checks that `mesh` is the one the layout was made on, where the file says which one that is.
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

    /// Draws nodes and arcs on `mesh` and reads off the regions between them.
    ///
    /// # Errors
    ///
    /// See [`PartialEmbeddingError`].
    pub fn draw(&self, mesh: &TriMesh) -> Result<PartialEmbedding, PartialEmbeddingError> {
        PartialEmbedding::new(self, draw::draw(self, mesh)?)
    }
}
