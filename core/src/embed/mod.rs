//! The optimised embedding of quad layouts: along principal directions, without folds (Campen, chapter 6).
//!
//! From a rough drawing of a layout to its [`Net`], the layout on the triangles of the surface up to homotopy; from
//! there to a cross field with exactly the layout's singularities and a seamless map in which every arc is an isoline;
//! nodes then move down the gradient of the map's distortion; in the end arcs are traced and patches cut out.
//!
//! The room knows layouts and drawings, not how they came about.

mod alignment;
mod attach;
mod bending;
mod coarse;
mod collapse;
mod course;
mod cross;
mod descent;
mod emerge;
mod feature_lines;
mod features;
mod finish;
mod foresee;
mod gradient;
mod guides;
mod injective;
mod integer;
mod job;
mod lift;
mod march;
mod measures;
mod moves;
mod net;
mod optimise;
mod patches;
mod refine;
mod relocate;
mod rose;
mod settle;
mod setup;
mod shift;
mod shorter;
mod sizing;
mod snap;
mod solver;
mod spacing;
mod state;
mod straight;
mod trace;
mod voronoi;
mod weld;
mod working;

#[cfg(test)]
mod samples;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use bending::{face_curvature, second_form};
pub use collapse::{CollapsedChord, ShortChord};
pub use descent::Optimizer;
pub use emerge::{EmergeError, Emerged, emerge};
pub use foresee::{Foreseen, foresee};
pub use guides::{feature_guides, shape_guides};
pub use job::{Embedded, EmbeddingReport, FeatureEdges, Job, Next, RemainingFold, Settings, Snapshot, Surface};
pub use measures::{Measures, PatchMeasures, TriangleMeasure, measure_map, measure_patches};
pub use net::{Headings, Net, NetArc, NetNode, headings};
pub use optimise::optimise;
pub use patches::{RectangleError, map_rectangles};
pub use relocate::Hold;
pub use sizing::{SizingSystem, rest_turns};
pub use state::State;
pub use trace::{ArcChain, Folds, TraceError, Traced, preview_arcs, trace_arcs};

use thiserror::Error;

use crate::field::FieldError;
use crate::layout::PatchError;
use crate::mesh::{EdgeId, TriMeshError, VertexId};
use crate::param::ParamError;
use crate::progress::Cancelled;
use crate::solve::SolveError;

/// Why a layout could not be embedded.
#[derive(Debug, Error)]
pub enum EmbeddingError {
    /// A node could not be made a vertex of the mesh.
    #[error("node {node} could not be made a vertex of the mesh")]
    Node {
        /// The node.
        node: usize,
    },
    /// An arc is not a path from node to node.
    #[error("arc {arc} is not a path from node to node")]
    Arc {
        /// The arc.
        arc: usize,
    },
    /// An edge of the surface is missing from the drawing.
    #[error("{edge:?} is missing from the drawing of the layout")]
    Edge {
        /// The edge.
        edge: EdgeId,
    },
    /// The layout's turning numbers do not add up at a vertex.
    #[error("the layout turns by {quarters} quarters too much around {vertex:?}")]
    Turning {
        /// The vertex.
        vertex: VertexId,
        /// How many quarters too much.
        quarters: i32,
    },
    /// The mesh with the nodes inserted is not a manifold.
    #[error("the layout's nodes do not fit into the mesh: {0}")]
    Mesh(#[from] TriMeshError),
    /// No map without folds was found.
    #[error("no map without folds was found")]
    Folded,
    /// The arcs could not be traced in the map.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The arcs missing from a partial layout do not emerge from the map.
    #[error("the missing arcs do not emerge: {0}")]
    Emerge(#[from] EmergeError),
    /// The patches are not the rectangles the layout says.
    #[error(transparent)]
    Rectangle(#[from] RectangleError),
    /// What is left without collapsed chords could not be drawn.
    #[error(transparent)]
    Redraw(#[from] crate::layout::RedrawError),
    /// The mesh could not be simplified to embed the layout on that first.
    #[error(transparent)]
    Proxy(#[from] crate::proxy::ProxyError),
    /// The patches of the drawing could not be mapped.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// A linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The guiding field could not be computed.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The map could not be computed.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
