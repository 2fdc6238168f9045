//! What an optimisation shows while it runs, and what it returns.

use glam::DVec3;
use serde::Serialize;

use crate::embed::parameterise::quality::Measures;
use crate::embed::parameterise::state::{FeatureEdges, State};
use crate::embed::topology::embedding_topology::TopologyArc;
use crate::embed::trace::arcs::preview_arcs;
use crate::embed::trace::separatrix_matching::ArcChain;
use crate::layout::{Embedding, PatchMap, QuadLayout};

/// The embedding while it is being optimised.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Number of node steps so far.
    pub step: usize,
    /// Energy of the map as a fraction of the energy at the start of the present phase. Phases cannot be compared: the
    /// least-squares map and the injective map have different energies.
    pub energy: f64,
    /// Number of flipped triangles.
    pub flipped: usize,
    /// Positions of the nodes.
    pub nodes: Vec<DVec3>,
    /// The arcs as polylines; `None` for arcs that cannot be traced because of flipped triangles.
    pub arcs: Vec<Option<Vec<DVec3>>>,
}

impl Snapshot {
    /// The snapshot of a state after `step` steps, in a phase that began with the energy `initial_energy`.
    pub(super) fn new(state: &State, step: usize, initial_energy: f64) -> Self {
        let vertices = state.vertices();
        Self {
            step,
            energy: if initial_energy > 0.0 { state.solution.energy / initial_energy } else { 1.0 },
            flipped: state.flipped(),
            arcs: preview_arcs(&state.topology.mesh, &state.solution.map, &vertices, &arc_chains(state)),
            nodes: vertices.iter().map(|&v| state.topology.mesh.position(v)).collect(),
        }
    }
}

/// The arcs of a state as the input of the tracing.
pub(super) fn arc_chains(state: &State) -> Vec<ArcChain<'_>> {
    let chain = |a: &'_ TopologyArc| (a.start, a.end, a.heading);
    state
        .topology
        .arcs
        .iter()
        .map(|a| {
            let (start, end, heading) = chain(a);
            ArcChain { start, crossed: &a.crossed, end, heading }
        })
        .collect()
}

/// The answer of the observer of an optimisation: whether to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Go on.
    Continue,
    /// Finish with the best state so far.
    Finish,
}

/// A triangle that is flipped in the final map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RemainingFlip {
    /// Its centroid.
    pub at: [f64; 3],
    /// Why the flip could not be removed.
    pub reason: String,
}

/// A chord that was collapsed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CollapsedChord {
    /// Its index in the layout of the problem.
    pub chord: u32,
    /// The length of its arcs in the last map that had it.
    pub length: f64,
    /// Number of patches it ran through.
    pub patches: usize,
}

/// A chord that was to be collapsed and remains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UncollapsedChord {
    /// Its index in the layout of the problem.
    pub chord: u32,
    /// The length of its arcs.
    pub length: f64,
    /// Why it could not be collapsed.
    pub reason: String,
}

/// The outcome of an optimisation in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct EmbeddingReport {
    /// Number of node steps.
    pub steps: usize,
    /// Least-squares energy of the map over the area of the surface, with the nodes at their initial positions.
    pub energy_before: f64,
    /// The same of the final map.
    pub energy_after: f64,
    /// Number of flipped triangles of the first map.
    pub flipped_before: usize,
    /// Number of flipped triangles of the least-squares map after its last node step, before flips were removed.
    pub flipped_after_least_squares: usize,
    /// The triangles that are flipped in the final map.
    pub remaining_flips: Vec<RemainingFlip>,
    /// Chords that were collapsed, in order.
    pub collapsed_chords: Vec<CollapsedChord>,
    /// Chords that were to be collapsed and remain.
    pub uncollapsed_chords: Vec<UncollapsedChord>,
    /// Feature edges, and how many lie on isolines.
    pub features: FeatureEdges,
    /// Quality measures of all patches together.
    pub measures: Measures,
}

/// A layout with its optimised embedding.
#[derive(Debug, Clone)]
pub struct OptimisedEmbedding {
    /// The layout. Of a partial layout the completed one: given nodes first, then those found at crossings of isolines.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The maps of its patches onto rectangles.
    pub maps: Vec<PatchMap>,
    /// Where chords were collapsed, the initial embedding of the layout that remained.
    pub initial_embedding: Option<Embedding>,
    /// The outcome in numbers.
    pub report: EmbeddingReport,
}
