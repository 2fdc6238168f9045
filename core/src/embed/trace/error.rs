//! Why the arcs of a layout could not be traced.

use thiserror::Error;

use crate::mesh::{FaceId, TriMeshError};

/// Why the arcs of a layout could not be traced in a map.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TraceError {
    /// A chain of triangles is not connected or does not join the nodes of its arc.
    #[error("the chain of triangles of arc {arc} does not join its nodes")]
    Chain {
        /// The arc.
        arc: usize,
    },
    /// An arc has no positive length along its heading: its nodes coincide in the map, or have changed their order.
    #[error("arc {arc} has length {length} along its heading in the map, which is not positive")]
    Length {
        /// The arc.
        arc: usize,
        /// Its length.
        length: f64,
    },
    /// The patches around a node do not form one fan.
    #[error("the patches around node {node} do not form one fan")]
    Order {
        /// The node.
        node: usize,
    },
    /// A node has another number of isolines than of arcs: triangles at the node are flipped.
    #[error("{found} isolines leave node {node}, which has {expected} arcs")]
    Node {
        /// The node.
        node: usize,
        /// The number of isolines.
        found: usize,
        /// The number of arcs.
        expected: usize,
    },
    /// The isoline of an arc runs into a flipped triangle.
    #[error("the isoline of arc {arc} runs into triangle {}, which is flipped", face.0)]
    FlippedTriangle {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// The isoline of an arc leaves the surface, does not continue at a vertex, or meets no node within the arc's
    /// length.
    #[error("the isoline of arc {arc} ends in triangle {} without a node", face.0)]
    Lost {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// The isoline of an arc ends at another node, or after another length, than its chain says.
    #[error(
        "the isoline of arc {arc} ends at node {node} after length {length}, not at node {expected_node} after {expected}"
    )]
    WrongEnd {
        /// The arc.
        arc: usize,
        /// The node it ends at.
        node: usize,
        /// Its length.
        length: f64,
        /// The node it should end at.
        expected_node: usize,
        /// The length it should have.
        expected: f64,
    },
    /// Two arcs meet other than at a node.
    #[error("arcs {} and {} meet in triangle {}", arcs[0], arcs[1], face.0)]
    Crossing {
        /// The arcs.
        arcs: [u32; 2],
        /// The triangle.
        face: FaceId,
    },
    /// The first side of a patch has no triangle on its left.
    #[error("patch {patch} has no triangle beside its first side")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// The refined mesh is not a manifold.
    #[error("the refined mesh is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
}
