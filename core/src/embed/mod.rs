//! The optimised embedding of quad layouts: along principal directions, without flipped triangles (Campen, chapter 6).
//!
//! Data flows through the sub-rooms in this order, and each knows only those before it:
//!
//! - `topology`: the layout on the triangles of the surface, every arc up to homotopy.
//! - `parameterise`: for nodes at given vertices, a cross field with exactly the layout's singularities and a
//!   seamless map in which every arc is an isoline; the gradient of its energy at the nodes; quality measures.
//! - `trace`: arcs traced as isolines of the map, the overlay of arcs and mesh, patches as rectangles.
//! - `optimise`: nodes move down the gradient, first with a least-squares map, then with an injective map; features
//!   become isolines.
//! - `pipeline`: the phases of an optimisation, from the initial embedding to the result.
//!
//! `problem` is the input, [`optimise_embedding`] the entry. The room knows layouts and initial embeddings, not how
//! they came about.

mod error;
mod optimise;
mod parameterise;
mod pipeline;
mod problem;
mod topology;
mod trace;

pub use error::EmbeddingError;
pub use optimise::optimiser::Optimiser;
pub use optimise::relocation::NodeConstraint;
pub use parameterise::quality::{Measures, PatchMeasures, TriangleMeasure, measure_map, measure_patches};
pub use parameterise::state::{FeatureEdges, State};
pub use pipeline::coarse_to_fine::optimise_embedding;
pub use pipeline::fit_prediction::{PredictedFit, predict_fit};
pub use pipeline::report::{
    CollapsedChord, EmbeddingReport, Next, OptimisedEmbedding, RemainingFlip, Snapshot, UncollapsedChord,
};
pub use problem::{Problem, Settings, Surface};
pub use topology::embedding_topology::{ArcHeadings, EmbeddingTopology, TopologyArc, TopologyNode, arc_headings};
pub use trace::arcs::{FlippedTriangles, preview_arcs, trace_arcs};
pub use trace::completion::{CompletedLayout, CompletionError, complete_layout};
pub use trace::error::TraceError;
pub use trace::rectangles::{RectangleError, map_rectangles};
pub use trace::separatrix_matching::ArcChain;
pub use trace::traced_layout::TracedLayout;
