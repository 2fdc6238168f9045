//! Extraction of arcs, patches and quality measures from the final map (Campen, section 6.4.2).

use crate::embed::error::EmbeddingError;
use crate::embed::parameterise::quality::measure_patches;
use crate::embed::parameterise::state::State;
use crate::embed::pipeline::report::{EmbeddingReport, OptimisedEmbedding, RemainingFlip, arc_chains};
use crate::embed::problem::Problem;
use crate::embed::trace::arcs::{FlippedTriangles, trace_arcs};
use crate::embed::trace::completion::complete_layout;
use crate::embed::trace::rectangles::map_rectangles;
use crate::mesh::FaceId;
use crate::param::{FlipReason, FlippedTriangle};
use crate::progress::Progress;
use crate::surface::face_curvature;

/// Largest length of an isoline that completes a partial layout, in square roots of the surface's area: a bound that
/// only isolines without an end reach.
const MAX_ISOLINE_LENGTH: f64 = 100.0;

/// The embedding that a final state defines: traced arcs, or the completed layout where arcs are missing, and the
/// rectangles of its patches. The report holds only what the final state determines; steps, energy and flips before it
/// are zero.
pub(super) fn extract_embedding(
    problem: &Problem<'_>,
    (state, sharp): (&State, &[bool]),
    flipped: &[FlippedTriangle],
    progress: &Progress,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    let Problem { surface, layout: given, .. } = *problem;
    let area = problem.area();
    progress.report("Tracing arcs", 0.9);
    let strict = if flipped.is_empty() { FlippedTriangles::Refuse } else { FlippedTriangles::Cross };
    let (mesh, map) = (&state.topology.mesh, &state.solution.map);
    let (layout, traced) = if given.patches.is_empty() {
        let completed = complete_layout(mesh, map, &state.vertices(), MAX_ISOLINE_LENGTH * area.sqrt())?;
        (completed.layout, completed.traced)
    } else {
        (given.clone(), trace_arcs(mesh, map, given, &state.vertices(), &arc_chains(state), strict)?)
    };
    progress.report("Cutting out patches", 0.95);
    let mut maps = map_rectangles(&layout, &traced, progress)?;
    let curvature = face_curvature(surface.mesh, surface.curvature, |_| true);
    let mut embedding = traced.embedding;
    // Triangles of the working mesh lie in triangles of the surface.
    let base = |f: &mut u32| *f = state.topology.base_face[*f as usize].0;
    embedding.base_face.iter_mut().for_each(base);
    maps.iter_mut().flat_map(|m| &mut m.base_face).for_each(base);
    let (measures, _, _) = measure_patches(&maps, &curvature);
    let centroid = |f: u32| {
        let corners = mesh.face_vertices(FaceId(f)).map(|v| mesh.position(v));
        ((corners[0] + corners[1] + corners[2]) / 3.0).to_array()
    };
    let remaining = |f: &FlippedTriangle| RemainingFlip { at: centroid(f.triangle), reason: description(f.reason) };
    let report = EmbeddingReport {
        steps: 0,
        energy_before: 0.0,
        energy_after: state.least_squares() / area,
        flipped_before: 0,
        flipped_after_least_squares: 0,
        remaining_flips: flipped.iter().map(remaining).collect(),
        collapsed_chords: Vec::new(),
        uncollapsed_chords: Vec::new(),
        features: state.feature_edges(sharp),
        measures,
    };
    Ok(OptimisedEmbedding { layout, embedding, maps, initial_embedding: None, report })
}

/// Why a flipped triangle remains, for the report.
fn description(reason: FlipReason) -> String {
    match reason {
        FlipReason::HighValence { quarters, triangles, .. } => {
            format!("{triangles} triangles cannot span the {quarters} quarter turns around their node")
        }
        FlipReason::Fixed => "its constraints determine it".to_owned(),
        FlipReason::NotResolved => "no map in which it is not flipped was found".to_owned(),
    }
}
