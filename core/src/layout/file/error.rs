//! Why the layout of a file cannot be embedded on a mesh.

use std::fmt;

use thiserror::Error;

use crate::mesh::FaceId;

/// A node or an arc of a layout file, by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayoutElement {
    /// A node.
    Node(u32),
    /// An arc.
    Arc(u32),
}

impl fmt::Display for LayoutElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(n) => write!(f, "node {n}"),
            Self::Arc(a) => write!(f, "arc {a}"),
        }
    }
}

/// Why the layout of a file cannot be embedded on a mesh. Nodes and arcs are numbered from 0, as in the file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PartialEmbeddingError {
    /// A node lies in a triangle that does not exist.
    #[error("node {node} lies in triangle {}, which the mesh does not have", face.0)]
    UnknownFace {
        /// The node.
        node: u32,
        /// The triangle.
        face: FaceId,
    },
    /// The weights of a node are not barycentric coordinates of a point of a triangle.
    #[error("the weights of node {node} are not finite numbers from 0 to 1 with sum 1")]
    Weights {
        /// The node.
        node: u32,
    },
    /// The valence of a node is out of range.
    #[error("node {node} has valence {valence}; the valence must be from 1 to {MAX_VALENCE}")]
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
        /// The node.
        node: u32,
        /// Number of nodes.
        count: usize,
    },
    /// An arc ends in a slot that does not exist.
    #[error("arc {arc} ends in slot {slot} of node {node}, whose last slot is {last}")]
    UnknownSlot {
        /// The arc.
        arc: u32,
        /// The node.
        node: u32,
        /// The slot.
        slot: u32,
        /// The last slot of the node.
        last: u32,
    },
    /// Two arcs, or both ends of one, share a slot.
    #[error("arcs {} and {} both end in slot {slot} of node {node}", arcs[0], arcs[1])]
    SlotTaken {
        /// The node.
        node: u32,
        /// The slot.
        slot: u32,
        /// The two arcs.
        arcs: [u32; 2],
    },
    /// A point of a path is invalid.
    #[error("arc {arc}, point {point} of its path: {reason}")]
    PathPoint {
        /// The arc.
        arc: u32,
        /// The index in its path.
        point: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Two consecutive points of an arc have no triangle in common.
    #[error("arc {arc} has a gap: no triangle contains its points {step} and {} (0 is its first node)", step + 1)]
    Gap {
        /// The arc.
        arc: u32,
        /// The point before the gap: 0 is the first node, 1 the first point of the path.
        step: usize,
    },
    /// Two nodes or arcs touch.
    #[error("{first} and {second} meet")]
    Meet {
        /// One.
        first: LayoutElement,
        /// The other.
        second: LayoutElement,
    },
    /// Two arcs cross, or one crosses itself.
    #[error("{}, in triangle {}", crossing(*first, *second), face.0)]
    Cross {
        /// One.
        first: u32,
        /// The other, or the same.
        second: u32,
        /// The triangle.
        face: FaceId,
    },
    /// There is no path for an arc, although no other arc obstructs it.
    #[error("no path for arc {arc} through triangle {}", face.0)]
    NoPath {
        /// The arc.
        arc: u32,
        /// The triangle.
        face: FaceId,
    },
    /// An arc between the outer slots of two boundary nodes does not run along the boundary.
    #[error("arc {arc} has the slots of a boundary arc but does not run along the boundary from node to node")]
    OffBoundary {
        /// The arc.
        arc: u32,
    },
    /// An arc runs along the boundary or touches it but does not have the slots of a boundary arc.
    #[error("arc {arc} touches the boundary between its nodes but does not have the slots of a boundary arc")]
    OnBoundary {
        /// The arc.
        arc: u32,
    },
    /// The slots at a node contradict the order of its arcs.
    #[error("the slots at node {node} contradict the order of its arcs, counter-clockwise {}", list(arcs))]
    SlotOrder {
        /// The node.
        node: u32,
        /// The arcs counter-clockwise around the node; at the boundary from slot 0 on.
        arcs: Vec<u32>,
    },
    /// An inner node has no arc.
    #[error("arcs are missing: none ends at node {node}")]
    Isolated {
        /// The node.
        node: u32,
    },
    /// A region between arcs is not a disc. The directions of its arcs are not determined.
    #[error("arcs are missing: the region of triangle {} ({}) is not a disc", face.0, bounded(arcs))]
    NotADisc {
        /// The region.
        region: u32,
        /// A triangle of the region.
        face: FaceId,
        /// The arcs on its border.
        arcs: Vec<u32>,
    },
    /// The turning angles of the corners of a region do not add up to a full turn.
    #[error(
        "the valences contradict the arcs: the corners of the region of triangle {} ({}) turn by {quarters} quarters \
         instead of 4", face.0, bounded(arcs)
    )]
    Turning {
        /// The region.
        region: u32,
        /// A triangle of the region.
        face: FaceId,
        /// The arcs on its border.
        arcs: Vec<u32>,
        /// The sum of the turning angles, in quarter turns.
        quarters: i64,
    },
}

/// Largest valence of a node in a file: far above useful valences, and small enough that sums of valences do not
/// overflow.
pub(super) const MAX_VALENCE: u32 = 1000;

fn crossing(first: u32, second: u32) -> String {
    if first == second { format!("arc {first} crosses itself") } else { format!("arcs {first} and {second} cross") }
}

fn bounded(arcs: &[u32]) -> String {
    if arcs.is_empty() { "with no arc on its border".into() } else { format!("between arcs {}", list(arcs)) }
}

fn list(numbers: &[u32]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
