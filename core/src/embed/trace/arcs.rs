//! The arcs of a layout traced as isolines of a seamless map (Campen, section 6.4.2).
//!
//! Isolines are traced from all nodes and matched with the arcs; the mesh is refined along those of arcs, so that arcs
//! become edge paths. A vertex that an isoline passes through is moved onto it in the map, not on the surface: arcs are
//! exact isolines. A map without flipped triangles whose nodes are where the chains say can always be traced.

use glam::DVec3;

use crate::embed::trace::error::TraceError;
use crate::embed::trace::isoline_points::{Point, degenerate_crossing, isoline_points, snap_vertices};
use crate::embed::trace::isolines::{Isolines, Step, map_rounding, nodes_at};
use crate::embed::trace::overlay::{Meeting, overlay};
use crate::embed::trace::separatrix_matching::{ArcChain, ChainEnd, LENGTH_TOLERANCE, SeparatrixMatching};
use crate::embed::trace::traced_layout::TracedLayout;
use crate::layout::QuadLayout;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// How far the isoline of an arc may end from where it should to be shown in a preview, relative to the arc's length.
///
const PREVIEW_TOLERANCE: f64 = 1e-3;

/// What to do where an arc meets a triangle that the map flips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlippedTriangles {
    /// It is an error.
    Refuse,
    /// The arc passes through it. It is an isoline all the same, and the arcs separate the patches as long as they do
    /// not meet in flipped triangles, which is checked. The triangles stay flipped in their patch.
    Cross,
}

/// Traces the arcs of `layout` in `map`. The nodes are the vertices `node_vertex`, and arc `i` is homotopic to
/// `chains[i]`.
///
/// # Errors
///
/// See [`TraceError`].
pub fn trace_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    layout: &QuadLayout,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
    flipped: FlippedTriangles,
) -> Result<TracedLayout, TraceError> {
    let node = nodes_at(mesh, node_vertex);
    let cross_flipped = flipped == FlippedTriangles::Cross;
    let isolines = Isolines { mesh, map, node: &node, rounding: map_rounding(map), cross_flipped };
    let traced = SeparatrixMatching::new(&isolines, layout, node_vertex, chains)?.arcs()?;
    let mut exact = map.clone();
    for (isoline, _) in &traced {
        snap_vertices(&isolines, &mut exact, &isoline.steps[1..isoline.steps.len() - 1]);
    }
    let isolines = Isolines { map: &exact, ..isolines };
    let mut arcs = Vec::with_capacity(traced.len());
    for (arc, (isoline, backward)) in traced.iter().enumerate() {
        let mut points: Vec<Point> = isoline_points(&isolines, &isoline.steps);
        if let Some(face) = degenerate_crossing(mesh, &points) {
            return Err(TraceError::Lost { arc, face });
        }
        if *backward {
            points.reverse();
            points = points.iter().map(|p| p.reversed(mesh, &exact)).collect();
        }
        arcs.push(points);
    }
    let mut overlay = overlay(mesh, &exact, &arcs, Meeting::Refuse)?;
    let paths = std::mem::take(&mut overlay.paths);
    TracedLayout::new(overlay, layout, node_vertex.iter().map(|v| v.0).collect(), paths)
}

/// The arcs as polylines in a map that may have flipped triangles, each traced by itself; `None` for those whose
/// isolines do not end at their node.
pub fn preview_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
) -> Vec<Option<Vec<DVec3>>> {
    let node = nodes_at(mesh, node_vertex);
    let isolines = Isolines { mesh, map, node: &node, rounding: map_rounding(map), cross_flipped: true };
    let trace = |from: HalfedgeId, heading: u8, to: HalfedgeId, length: f64| -> Option<Vec<DVec3>> {
        let outgoing = isolines.outgoing(mesh.origin(from));
        isolines.with_heading(&outgoing, from, heading).into_iter().find_map(|i| {
            let limit = length * (1.0 + LENGTH_TOLERANCE) + isolines.rounding;
            let traced = isolines.trace(outgoing[i], limit).ok()?;
            let Step::Vertex(end, _) = *traced.steps.last()? else { return None };
            let at_node = mesh.origin(end) == mesh.origin(to);
            let right = at_node && (traced.length - length).abs() <= PREVIEW_TOLERANCE * length;
            right.then(|| isoline_points(&isolines, &traced.steps).iter().map(|p| p.position(mesh)).collect())
        })
    };
    let from_either_end = |chain: &ArcChain| {
        let end = ChainEnd::new(mesh, map, chain).filter(|r| r.length > 0.0)?;
        trace(chain.start, chain.heading, chain.end, end.length).or_else(|| {
            let mut back = trace(chain.end, end.back, chain.start, end.length)?;
            back.reverse();
            Some(back)
        })
    };
    chains.iter().map(from_either_end).collect()
}
