//! From a rough drawing to the finished embedding: nodes moved, folds removed, arcs traced, patches cut out.

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::descent::{Optimizer, Settings, Surface};
use super::measures::{Measures, measure_patches};
use super::net::Headings;
use super::solver::State;
use super::trace::{ArcChain, Folds, preview_arcs, trace_arcs};
use super::{EmbeddingError, emerge, map_rectangles};
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::VertexId;
use crate::param::{FoldReason, Residual, residuals};
use crate::progress::Progress;

/// How far the isolines that complete a partial layout are followed, in square roots of the surface's area: many times
/// around anything, and yet an end.
const LONGEST: f64 = 100.0;

/// A layout to be embedded.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// The layout's structure; without patches where arcs are missing.
    pub layout: &'a QuadLayout,
    /// A rough drawing of it.
    pub drawing: &'a Embedding,
    /// The headings of the arcs' sides in the charts of the regions between them.
    pub headings: &'a [Headings],
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
    /// The energy of the map.
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
pub struct RemainingFold {
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
    pub folds: Vec<RemainingFold>,
    /// Measures of all patches together.
    pub measures: Measures,
}

/// A layout with its optimised embedding.
#[derive(Debug, Clone)]
pub struct Embedded {
    /// The layout; of a partial one, with the arcs and nodes that have emerged after those given.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// What was achieved.
    pub report: EmbeddingReport,
}

/// Share of the wanted area below which an image is as good as flat.
const FLAT: f64 = 1e-3;

impl State {
    /// Number of triangles that the map turns over, or by more than a right angle away from the field.
    pub fn flipped(&self) -> usize {
        self.folded().iter().filter(|&&f| f).count()
    }

    /// For each triangle whether the map turns it over, or by more than a right angle away from the field.
    pub(super) fn folded(&self) -> Vec<bool> {
        let errors = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        let lengths = |f: usize| self.objective.lengths.get(f).copied().unwrap_or([1.0; 2]);
        let folded = |(f, r): (usize, &Residual)| {
            let [a, b] = lengths(f);
            let (u, v) = (r.u + DVec2::new(a, 0.0), r.v + DVec2::new(0.0, b));
            u.perp_dot(v) <= FLAT * a * b || u.x / a + v.y / b <= 0.0
        };
        errors.iter().enumerate().map(folded).collect()
    }

    fn chains(&self) -> Vec<ArcChain<'_>> {
        let chain = |a: &'_ super::NetArc| (a.start, a.end, a.heading);
        self.net
            .arcs
            .iter()
            .map(|a| {
                let (start, end, heading) = chain(a);
                ArcChain { start, crossed: &a.crossed, end, heading }
            })
            .collect()
    }

    fn vertices(&self) -> Vec<VertexId> {
        self.net.nodes.iter().map(|n| n.vertex).collect()
    }

    fn snapshot(&self, step: usize) -> Snapshot {
        let vertices = self.vertices();
        Snapshot {
            step,
            energy: self.solution.energy,
            flipped: self.flipped(),
            arcs: preview_arcs(&self.net.mesh, &self.solution.map, &vertices, &self.chains()),
            nodes: vertices.iter().map(|&v| self.net.mesh.position(v)).collect(),
        }
    }
}

/// Embeds a layout. `watch` is shown every step that made the embedding better and may ask to finish.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    job: &Job<'_>,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<Embedded, EmbeddingError> {
    progress.report("Embedding the layout", 0.0);
    let mut optimizer = Optimizer::new(job, progress)?;
    let area: f64 = job.surface.mesh.faces().map(|f| job.surface.mesh.face_area(f)).sum();
    let energy_before = optimizer.state().solution.energy / area;
    let flipped_before = optimizer.state().flipped();
    let mut next = watch(&optimizer.state().snapshot(0));
    let mut steps = 0;
    while next == Next::Continue && !optimizer.is_done() {
        progress.report("Moving nodes", 0.05 + 0.75 * steps as f64 / job.settings.steps.max(1) as f64);
        let better = optimizer.step(progress)?;
        steps += 1;
        if better {
            next = watch(&optimizer.state().snapshot(steps));
        }
    }
    let flipped_at_rest = optimizer.state().flipped();
    progress.report("Removing folds", 0.8);
    let (state, folds) = optimizer.finish(progress)?;
    progress.report("Tracing arcs", 0.9);
    let strict = if folds.is_empty() { Folds::Refuse } else { Folds::Cross };
    let (mesh, map) = (&state.net.mesh, &state.solution.map);
    let (layout, traced) = if job.layout.patches.is_empty() {
        let emerged = emerge(mesh, map, &state.vertices(), LONGEST * area.sqrt())?;
        (emerged.layout, emerged.traced)
    } else {
        (job.layout.clone(), trace_arcs(mesh, map, job.layout, &state.vertices(), &state.chains(), strict)?)
    };
    progress.report("Cutting out patches", 0.95);
    let mut maps = map_rectangles(&layout, &traced, progress)?;
    let bending = super::face_curvature(job.surface.mesh, job.surface.curvature, |_| true);
    let mut embedding = traced.embedding;
    // Triangles of the working mesh lie in triangles of the surface.
    let base = |f: &mut u32| *f = state.net.base_face[*f as usize].0;
    embedding.base_face.iter_mut().for_each(base);
    maps.iter_mut().flat_map(|m| &mut m.base_face).for_each(base);
    let (measures, _, _) = measure_patches(&maps, &bending);
    let place = |f: u32| {
        let corners = mesh.face_vertices(crate::mesh::FaceId(f)).map(|v| mesh.position(v));
        ((corners[0] + corners[1] + corners[2]) / 3.0).to_array()
    };
    let reason = |r: FoldReason| match r {
        FoldReason::HighValence { quarters, triangles, .. } => {
            format!("{triangles} triangles cannot span the {quarters} quarter turns around their node")
        }
        FoldReason::Fixed => "the constraints leave it no choice".to_owned(),
        FoldReason::NotResolved => "no map without this fold was found".to_owned(),
    };
    let report = EmbeddingReport {
        steps,
        energy_before,
        energy_after: state.solution.energy / area,
        flipped_before,
        flipped_at_rest,
        folds: folds.iter().map(|f| RemainingFold { at: place(f.triangle), reason: reason(f.reason) }).collect(),
        measures,
    };
    Ok(Embedded { layout, embedding, maps, report })
}
