//! The embedding of the layout as the window shows it: initial, during its optimisation, and optimised.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;
use plait_core::embed::{EmbeddingError, FeatureEdges, Next, OptimisedEmbedding, Snapshot, measure_patches};
use plait_core::layout::{Node, QuadLayout};
use plait_core::mesh::TriMesh;
use plait_core::progress::Progress;
use plait_core::surface::{SurfaceIndex, face_curvature};
use plait_core::weave::{
    self, InitialLayout, MeshRole, PinnedElements, Session, WeaveError, embedding_polylines, face_distortion,
    largest_aspect, move_ends, smoothed_polyline,
};

use crate::engine::{
    EmbeddingStep, EmbeddingSummary, EngineError, LayoutArc, LayoutNode, LayoutPreview, RegionColour, Remark,
};
use crate::texts;

/// The layout with its initial embedding, and how it is shown.
pub(super) struct InitialPreview {
    pub(super) layout: InitialLayout,
    pub(super) preview: LayoutPreview,
}

/// An optimised embedding, and how it is shown.
pub(super) struct OptimisedPreview {
    pub(super) embedding: OptimisedEmbedding,
    pub(super) preview: LayoutPreview,
    pub(super) summary: Arc<EmbeddingSummary>,
}

impl InitialPreview {
    /// Computes the layout of a session and its initial embedding.
    pub(super) fn new(session: &Session, progress: &Progress) -> Result<Self, WeaveError> {
        let layout = weave::initial_layout(session, progress)?;
        let (nodes, arcs) = embedding_polylines(&layout.embedding);
        let model = session.model();
        let on_surface = |p| model.index.nearest(p).position(&model.loaded.mesh);
        // Inner arcs have kinks where they cross strips, and are smoothed for display. Boundary arcs lie on the
        // boundary.
        let boundary = |i: usize| layout.layout.arcs[i].boundary;
        let arcs = arcs.into_iter().enumerate();
        let arcs = arcs.map(|(i, arc)| if boundary(i) { arc } else { smoothed_polyline(&arc, on_surface) });
        Ok(Self { preview: preview(&layout.layout, &nodes, arcs), layout })
    }
}

fn preview(layout: &QuadLayout, nodes: &[DVec3], arcs: impl Iterator<Item = Vec<DVec3>>) -> LayoutPreview {
    let node = |(node, &position): (&Node, &DVec3)| LayoutNode {
        position,
        valence: node.valence as u32,
        irregular: !node.is_regular(),
        pinned: false,
    };
    LayoutPreview {
        arcs: arcs.map(|points| LayoutArc { points, ..LayoutArc::default() }).collect(),
        nodes: layout.nodes.iter().zip(nodes).map(node).collect(),
    }
}

/// The preview, with the pinned nodes and arcs marked.
pub(super) fn with_pins(preview: &LayoutPreview, pinned: &PinnedElements) -> LayoutPreview {
    let mut preview = preview.clone();
    for (node, &pinned) in preview.nodes.iter_mut().zip(&pinned.nodes) {
        node.pinned = pinned;
    }
    for (arc, &pinned) in preview.arcs.iter_mut().zip(&pinned.arcs) {
        arc.pinned = pinned;
    }
    preview
}

/// Optimises the embedding, starting from the `last` result if there is one.
pub(super) fn optimise(
    session: &Session,
    initial: &InitialPreview,
    last: Option<&OptimisedPreview>,
    watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
    progress: &Progress,
) -> Result<OptimisedPreview, EngineError> {
    let pinned = initial.layout.pinned(&session.design().pins);
    let start = last.map_or(&initial.preview, |l| &l.preview);
    let layout = with_pins(start, &pinned);
    let mut from = |initial: &InitialLayout| {
        let model = session.model();
        let ends = initial.layout.arcs.iter().map(|a| a.nodes).collect();
        let layout = layout.clone();
        let mut steps = StepPreview { index: &model.index, mesh: &model.loaded.mesh, ends, layout };
        let mut relay = |snapshot: &Snapshot| match watch(steps.next(snapshot)) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Finish,
        };
        weave::optimise(session, initial, &pinned, progress, &mut relay).map_err(|error| failed(&error, progress))
    };
    let last = last.map(|l| InitialLayout {
        layout: initial.layout.layout.clone(),
        embedding: l.embedding.embedding.clone(),
        mesh_role: initial.layout.mesh_role,
    });
    // The last result comes first: pinned nodes stay where they are shown, not where the initial embedding has them.
    let embedding = match last.as_ref().map(&mut from) {
        Some(Ok(embedding)) => embedding,
        Some(Err(EngineError::Cancelled)) => return Err(EngineError::Cancelled),
        Some(Err(error)) => {
            tracing::debug!(%error, "the optimisation restarts from the initial embedding");
            from(&initial.layout)?
        }
        None => from(&initial.layout)?,
    };
    Ok(optimised_preview(session, &initial.layout, embedding))
}

fn failed(error: &EmbeddingError, progress: &Progress) -> EngineError {
    if progress.is_cancelled() { EngineError::Cancelled } else { EngineError::failed(error.to_string()) }
}

/// The layout as it was last shown during an optimisation.
struct StepPreview<'a> {
    index: &'a SurfaceIndex,
    mesh: &'a TriMesh,
    /// Nodes at the ends of each arc.
    ends: Vec<[u32; 2]>,
    layout: LayoutPreview,
}

impl StepPreview<'_> {
    /// The layout after a step. Arcs that cannot be traced in the map of this step move with their nodes.
    fn next(&mut self, snapshot: &Snapshot) -> EmbeddingStep {
        for (node, &position) in self.layout.nodes.iter_mut().zip(&snapshot.nodes) {
            node.position = position;
        }
        for (i, arc) in self.layout.arcs.iter_mut().enumerate() {
            match snapshot.arcs.get(i).and_then(Option::as_ref) {
                Some(points) => arc.points.clone_from(points),
                None => {
                    let ends = self.ends[i].map(|n| snapshot.nodes[n as usize]);
                    move_ends(&mut arc.points, ends, |p| self.index.nearest(p).position(self.mesh));
                }
            }
            arc.approximate = snapshot.arcs.get(i).is_none_or(Option::is_none);
        }
        EmbeddingStep {
            step: snapshot.step,
            energy: snapshot.energy,
            flipped: snapshot.flipped,
            layout: self.layout.clone(),
        }
    }
}

fn optimised_preview(session: &Session, initial: &InitialLayout, embedding: OptimisedEmbedding) -> OptimisedPreview {
    let model = session.model();
    let surface = model.surface(initial.mesh_role);
    let curvature = face_curvature(surface.mesh, surface.curvature, |_| true);
    let (_, patches, triangles) = measure_patches(&embedding.maps, &curvature);
    let report = &embedding.report;
    let mut distortion = face_distortion(surface.mesh.n_faces(), &embedding.maps, &triangles);
    if initial.mesh_role == MeshRole::Proxy {
        distortion = model.woven_face_points().iter().map(|p| distortion[p.face.index()]).collect();
    }
    let flipped = report.remaining_flips.iter().map(|f| (f.reason.as_str(), DVec3::from_array(f.at)));
    let summary = EmbeddingSummary {
        steps: report.steps,
        energy: [report.energy_before, report.energy_after],
        flipped: [report.flipped_before, report.remaining_flips.len()],
        conformal: report.measures.conformal,
        alignment: report.measures.alignment,
        planar: report.measures.planar,
        aspect: largest_aspect(&embedding.maps, &patches),
        features: features(&report.features),
        flip_remarks: flip_remarks(flipped),
        triangles: distortion,
    };
    let (nodes, arcs) = embedding_polylines(&embedding.embedding);
    let preview = preview(&initial.layout, &nodes, arcs.into_iter());
    OptimisedPreview { preview, summary: Arc::new(summary), embedding }
}

/// Number of feature edges on isolines, number of all, and the midpoint of the first that is not on an isoline.
fn features(edges: &FeatureEdges) -> (usize, usize, Option<DVec3>) {
    let middle = |ends: &[[f64; 3]; 2]| ends.iter().map(|&p| DVec3::from_array(p)).sum::<DVec3>() / 2.0;
    (edges.on_isolines, edges.total, edges.off_isolines.first().map(middle))
}

/// One remark for each reason of flipped triangles, with the place of the first.
fn flip_remarks<'a>(flipped: impl Iterator<Item = (&'a str, DVec3)>) -> Vec<Remark> {
    let mut groups: Vec<(&str, usize, DVec3)> = Vec::new();
    for (reason, place) in flipped {
        match groups.iter_mut().find(|g| g.0 == reason) {
            Some(group) => group.1 += 1,
            None => groups.push((reason, 1, place)),
        }
    }
    let remark = |(reason, n, place): (&str, usize, DVec3)| {
        let triangles = texts::count(n, "flipped triangle", "flipped triangles");
        Remark { colour: RegionColour::Red, text: format!("{triangles}: {reason}"), place: Some(place) }
    };
    groups.into_iter().map(remark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flipped_triangles_are_counted_by_reason() {
        let all = [("too narrow", DVec3::X), ("fixed", DVec3::Y), ("too narrow", DVec3::Z)];
        let remarks = flip_remarks(all.into_iter());
        let texts: Vec<_> = remarks.iter().map(|r| r.text.as_str()).collect();
        assert_eq!(texts, ["2 flipped triangles: too narrow", "1 flipped triangle: fixed"]);
        assert_eq!(remarks[0].place, Some(DVec3::X));
    }
}
