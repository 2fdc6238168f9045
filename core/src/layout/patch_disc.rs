//! Patches of an embedded layout as discs with four sides.

use std::collections::HashMap;

use thiserror::Error;

use super::embedding::Embedding;
use super::structure::QuadLayout;
use super::submesh::Submesh;
use crate::dual::{Mark, RefinedMesh};
use crate::mesh::{BreadthFirst, HalfedgeId, TriMeshError, VertexId};

/// An embedded patch is not a disc with the four sides of the layout.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PatchShapeError {
    /// The border does not consist of the four sides of the layout.
    #[error("patch {patch} does not have the four sides of the layout")]
    Sides {
        /// The patch.
        patch: usize,
    },
    /// The patch is not a disc.
    #[error("patch {patch} is not a disc: {source}")]
    NoDisc {
        /// The patch.
        patch: usize,
        /// What the mesh kernel says.
        source: TriMeshError,
    },
}

/// A patch cut out of an embedding.
pub(crate) struct PatchDisc {
    pub submesh: Submesh,
    /// Face of the embedding for each face of the submesh, ascending.
    pub faces: Vec<u32>,
    /// Vertices of the submesh along the four sides of the layout's patch, each from corner to corner.
    pub sides: [Vec<u32>; 4],
}

impl PatchDisc {
    /// Cuts patch `p` out of `embedding`, which `lookup` belongs to.
    ///
    /// # Errors
    ///
    /// See [`PatchShapeError`].
    pub(crate) fn cut_out(
        layout: &QuadLayout,
        embedding: &Embedding,
        lookup: &ArcLookup,
        p: usize,
    ) -> Result<Self, PatchShapeError> {
        let on_arc = |h: u32| embedding.mesh.mark(h) != Mark::Free;
        let faces = patch_faces(&embedding.mesh, embedding.seeds[p], on_arc);
        let submesh = Submesh::cut_out(&embedding.mesh, &faces, on_arc)
            .map_err(|source| PatchShapeError::NoDisc { patch: p, source })?;
        let sides = patch_sides(layout, lookup, &submesh, p).ok_or(PatchShapeError::Sides { patch: p })?;
        Ok(Self { submesh, faces, sides })
    }
}

/// The arcs and nodes at edges and vertices of an embedding.
pub(crate) struct ArcLookup {
    /// Arc of each directed edge on an arc, and whether the edge runs in the direction of the arc.
    arc: HashMap<(u32, u32), (u32, bool)>,
    is_node: Vec<bool>,
}

impl ArcLookup {
    pub(crate) fn new(embedding: &Embedding) -> Self {
        let mut arc = HashMap::new();
        for (a, path) in embedding.arcs.iter().enumerate() {
            for w in path.windows(2) {
                arc.insert((w[0], w[1]), (a as u32, true));
                arc.insert((w[1], w[0]), (a as u32, false));
            }
        }
        let mut is_node = vec![false; embedding.mesh.n_vertices()];
        for &v in &embedding.nodes {
            is_node[v as usize] = true;
        }
        Self { arc, is_node }
    }
}

/// The faces reached from `seed` without crossing an arc, ascending.
fn patch_faces(mesh: &RefinedMesh, seed: u32, on_arc: impl Fn(u32) -> bool) -> Vec<u32> {
    let mut search = BreadthFirst::sparse();
    search.start(seed);
    while let Some(f) = search.visit() {
        for t in (3 * f..3 * f + 3).filter(|&h| !on_arc(h)).filter_map(|h| mesh.twin(h)) {
            search.reach(t / 3, ());
        }
    }
    let mut faces = search.reached().to_vec();
    faces.sort_unstable();
    faces
}

/// The vertices of the four sides in the order of the layout's patch, each from corner to corner.
fn patch_sides(layout: &QuadLayout, lookup: &ArcLookup, submesh: &Submesh, p: usize) -> Option<[Vec<u32>; 4]> {
    let mesh = &submesh.mesh;
    let start = mesh.halfedges().find(|&h| mesh.twin(h).is_none())?;
    let mut cycle = vec![start];
    let mut h = start;
    loop {
        // The next border half-edge is the first of the fan of the target.
        h = mesh.vertex_halfedge(mesh.target(h));
        if h == start || cycle.len() > mesh.n_halfedges() {
            break;
        }
        cycle.push(h);
    }
    let parent = |v: VertexId| submesh.parent[v.index()];
    let n = cycle.len();
    let corners: Vec<usize> = (0..n).filter(|&i| lookup.is_node[parent(mesh.origin(cycle[i])) as usize]).collect();
    if corners.len() != 4 {
        return None;
    }
    let side = |k: usize| -> Option<((u32, bool), Vec<u32>)> {
        let (from, to) = (corners[k], if k == 3 { corners[0] + n } else { corners[k + 1] });
        let mut list: Vec<u32> = (from..to).map(|i| mesh.origin(cycle[i % n]).0).collect();
        let first: HalfedgeId = cycle[from];
        let arc = lookup.arc.get(&(parent(mesh.origin(first)), parent(mesh.target(first))))?;
        list.push(mesh.origin(cycle[to % n]).0);
        Some((*arc, list))
    };
    let found: Vec<((u32, bool), Vec<u32>)> = (0..4).map(side).collect::<Option<_>>()?;
    let turn = (0..4).find(|t| (0..4).all(|i| found[(i + t) % 4].0 == layout.patches[p].sides[i]))?;
    Some([0, 1, 2, 3].map(|i| found[(i + turn) % 4].1.clone()))
}
