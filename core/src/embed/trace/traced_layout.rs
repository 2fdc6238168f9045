//! A layout whose arcs are isolines: the result of tracing and of completion.

use crate::embed::trace::error::TraceError;
use crate::embed::trace::isolines::corner_uv;
use crate::embed::trace::overlay::Overlay;
use crate::layout::{Embedding, Patch, QuadLayout};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// A layout embedded such that its arcs are isolines of a map.
#[derive(Debug, Clone)]
pub struct TracedLayout {
    /// The layout on the refined mesh, in which arcs are edge paths.
    pub embedding: Embedding,
    /// The refined mesh.
    pub mesh: TriMesh,
    /// The map on the refined mesh; every triangle has the chart of the triangle of the input mesh that it lies in.
    pub map: SeamlessMap,
}

impl TracedLayout {
    /// The embedding of `layout` with the given vertices as nodes and edge paths as arcs. The paths are marked in
    /// the refined mesh of `overlay`.
    ///
    /// # Errors
    ///
    /// [`TraceError::Patch`] where a patch has no triangle beside its first side.
    pub(super) fn new(
        overlay: Overlay,
        layout: &QuadLayout,
        nodes: Vec<u32>,
        arcs: Vec<Vec<u32>>,
    ) -> Result<Self, TraceError> {
        let Overlay { mesh, refined, base_face, map, .. } = overlay;
        let seeds = patch_seeds(layout, &mesh, &arcs)?;
        let arc_parameters = arcs.iter().map(|p| arc_parameters(&mesh, &map, p)).collect();
        let embedding = Embedding { mesh: refined, base_face, nodes, arcs, arc_parameters, seeds };
        Ok(Self { embedding, mesh, map })
    }
}

/// A triangle of each patch: that to the left of its first side.
fn patch_seeds(layout: &QuadLayout, mesh: &TriMesh, paths: &[Vec<u32>]) -> Result<Vec<u32>, TraceError> {
    let seed = |(patch, p): (usize, &Patch)| {
        let (arc, forward) = p.sides[0];
        let path = &paths[arc as usize];
        let n = path.len();
        let (from, to) = if forward { (path[0], path[1]) } else { (path[n - 1], path[n - 2]) };
        let h = mesh.outgoing(VertexId(from)).find(|&h| mesh.target(h) == VertexId(to));
        h.map(|h| mesh.face(h).0).ok_or(TraceError::Patch { patch })
    };
    layout.patches.iter().enumerate().map(seed).collect()
}

/// The length in the map along an edge path, up to each of its vertices.
fn arc_parameters(mesh: &TriMesh, map: &SeamlessMap, path: &[u32]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in path.windows(2) {
        let joins = |h: HalfedgeId| mesh.target(h) == VertexId(w[1]);
        let ahead = mesh.outgoing(VertexId(w[0])).find(|&h| joins(h));
        // On the boundary only one of the two directions has a half-edge.
        let back = || mesh.outgoing(VertexId(w[1])).find(|&h| mesh.target(h) == VertexId(w[0]));
        let step = ahead.or_else(back).map_or(0.0, |h| corner_uv(map, h).distance(corner_uv(map, mesh.next(h))));
        along.push(along[along.len() - 1] + step);
    }
    along
}
