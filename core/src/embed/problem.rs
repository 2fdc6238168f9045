//! What goes into an optimisation, what is seen of it on the way, and what comes out.

use glam::DVec3;
use serde::Serialize;

use crate::embed::parameterise::quality::Measures;
use crate::embed::pipeline::chord_collapse::{CollapsedChord, UncollapsedChord};
use crate::embed::topology::embedding_topology::ArcHeadings;
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::TriMesh;
use crate::surface::{PrincipalCurvature, SurfaceIndex};

/// The surface a layout is embedded on.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Its mesh, of bounding-box diagonal 1.
    pub mesh: &'a TriMesh,
    /// Its points by nearness.
    pub index: &'a SurfaceIndex,
    /// Principal curvatures at its vertices.
    pub curvature: &'a [PrincipalCurvature],
    /// Whether each edge is sharp.
    pub sharp: &'a [bool],
}

/// How an embedding is optimised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Steps of the nodes at most: with least squares, and as many again without folds.
    pub steps: usize,
    /// Halvings of the step at most.
    pub halvings: usize,
    /// By how much an error of direction counts more than one of length.
    pub anisotropy: f64,
    /// Whether lengths may vary over the surface as the field wants it.
    pub sizing: bool,
    /// Least length of an arc in the map, in mean edges of the mesh.
    pub spacing: f64,
    /// The length below which chords are collapsed, on a surface of bounding-box diagonal 1; `None`: they are held apart.
    pub collapse: Option<f64>,
    /// Whether chords are collapsed, one by one, as long as that makes the layout less irregular and the energy no more.
    pub simplify: bool,
    /// The edge length that all chords are to be multiples of in the end, likewise; `None`: lengths are free.
    pub integer: Option<f64>,
}

impl Default for Settings {
    /// Those of the thesis (sections 6.4.3 and 6.5.1); arcs are long enough that triangles can resolve the patches.
    fn default() -> Self {
        Self {
            steps: 25,
            halvings: 5,
            anisotropy: 10.0,
            sizing: true,
            spacing: 1.5,
            collapse: None,
            simplify: false,
            integer: None,
        }
    }
}

/// A layout to be embedded.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// The layout's structure; without patches where arcs are missing.
    pub layout: &'a QuadLayout,
    /// A rough drawing of it.
    pub initial_embedding: &'a Embedding,
    /// The headings of the arcs' sides in the charts of the regions between them.
    pub arc_headings: &'a [ArcHeadings],
    /// Nodes that are to stay where the drawing has them; empty: none.
    pub pinned_nodes: &'a [bool],
    /// Arcs whose ends are to stay where the drawing has them; empty: none. Between its ends an arc is an isoline.
    pub pinned_arcs: &'a [bool],
    /// How to go about it.
    pub settings: Settings,
}

/// The embedding while it is being optimised.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Steps made so far.
    pub step: usize,
    /// The energy of the map, as a fraction of that with which this phase began: least squares and maps without folds
    /// have energies of their own.
    pub energy: f64,
    /// Triangles that the map turns over.
    pub flipped: usize,
    /// Where the nodes are.
    pub nodes: Vec<DVec3>,
    /// The arcs as polylines; `None` for those that cannot be followed because of folds.
    pub arcs: Vec<Option<Vec<DVec3>>>,
}

/// Whether to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Go on.
    Continue,
    /// Finish with the best so far.
    Finish,
}

/// A triangle that the map turns over in the end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RemainingFlip {
    /// A point in it.
    pub at: [f64; 3],
    /// Why it could not be unfolded.
    pub reason: String,
}

/// What an optimisation has achieved.
#[derive(Debug, Clone, Serialize)]
pub struct EmbeddingReport {
    /// Steps of the nodes.
    pub steps: usize,
    /// Energy of the map over the area of the surface, with the nodes where the drawing had them.
    pub energy_before: f64,
    /// The same in the end.
    pub energy_after: f64,
    /// Triangles turned over at first.
    pub flipped_before: usize,
    /// Triangles turned over when the nodes had come to rest, before folds were removed.
    pub flipped_at_rest: usize,
    /// Those left.
    pub folds: Vec<RemainingFlip>,
    /// Chords that were collapsed, in order.
    pub collapsed: Vec<CollapsedChord>,
    /// Chords that were to be collapsed and could not be.
    pub short: Vec<UncollapsedChord>,
    /// Edges of features.
    pub features: FeatureEdges,
    /// Measures of all patches together.
    pub measures: Measures,
}

/// Sharp edges inside the surface, on the mesh that the layout is embedded on, which may be finer than that given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureEdges {
    /// How many there are.
    pub all: usize,
    /// How many lie on isolines of the map: one coordinate is the same at both ends up to 1e-9, in units in which the
    /// surface's bounding-box diagonal is 1.
    pub on_isolines: usize,
    /// The ends of those that do not.
    pub off: Vec<[[f64; 3]; 2]>,
}

/// A layout with its optimised embedding.
#[derive(Debug, Clone)]
pub struct OptimisedEmbedding {
    /// The layout; of a partial one, with the arcs and nodes that have emerged after those given.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// Where chords were collapsed, the rough drawing of what was left of the layout.
    pub initial_embedding: Option<Embedding>,
    /// What was achieved.
    pub report: EmbeddingReport,
}
