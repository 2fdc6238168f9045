//! From edge paths in a refined mesh to a layout file.
//!
//! A refinement has a chain of vertices along each edge of the mesh, and vertices inside its triangles. Only the
//! crossings of an arc with mesh edges are written: their order along each edge determines the embedding up to
//! homotopy.

use std::collections::{HashMap, HashSet};

use super::format::{ArcEnd, FileArc, FileNode, LayoutFile, LayoutFileError, PathPoint};
use super::partial_embedding::PartialEmbedding;
use crate::dual::RefinedMesh;
use crate::layout::embedding::Embedding;
use crate::layout::structure::{Node, QuadLayout};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, MeshSource, TriMesh, VertexId};
use crate::surface::{Crossing, SurfacePoint};

/// Least distance of two points on an edge from each other and from its ends, as a fraction of the edge. Far above
/// rounding errors, so that their order is kept, and far below what is visible.
const MIN_SEPARATION: f64 = 1e-9;

impl LayoutFile {
    /// A complete layout embedded on a refinement of `base`. Nothing is fixed.
    ///
    /// # Errors
    ///
    /// [`LayoutFileError::NotOnMesh`], [`LayoutFileError::OtherRefinement`] or [`LayoutFileError::Ends`] if layout,
    /// embedding and mesh do not match.
    pub fn from_embedding(
        source: MeshSource,
        base: &TriMesh,
        layout: &QuadLayout,
        embedding: &Embedding,
    ) -> Result<Self, LayoutFileError> {
        let Embedding { mesh, base_face, nodes, arcs, .. } = embedding;
        let slots = slots(mesh, &layout.nodes, nodes, arcs)?;
        let mut ends = Vec::with_capacity(arcs.len());
        for (arc, (path, of)) in arcs.iter().zip(&layout.arcs).enumerate() {
            let slot = |edge: (u32, u32)| slots.get(&edge).copied().ok_or(LayoutFileError::NotOnMesh { arc });
            let (first, last) = ((path[0], path[1]), (path[path.len() - 1], path[path.len() - 2]));
            let [p, q] = of.nodes;
            ends.push([ArcEnd { node: p, slot: slot(first)? }, ArcEnd { node: q, slot: slot(last)? }]);
        }
        Refinement { base, mesh, base_face }.write(source, &layout.nodes, nodes, arcs, &ends)
    }

    /// A layout, complete or partial, embedded on a refinement of `base`. Nothing is fixed.
    ///
    /// # Errors
    ///
    /// [`LayoutFileError::NotOnMesh`] if the embedding is not on a refinement of `base`.
    pub fn from_partial_embedding(
        source: MeshSource,
        base: &TriMesh,
        embedding: &PartialEmbedding,
    ) -> Result<Self, LayoutFileError> {
        let PartialEmbedding { mesh, base_face, nodes, layout_nodes, arcs, ends, .. } = embedding;
        Refinement { base, mesh, base_face }.write(source, layout_nodes, nodes, arcs, ends)
    }
}

/// The slot of every edge that leaves a node along an arc of a complete layout, by the edge's two vertices.
fn slots(
    mesh: &RefinedMesh,
    layout_nodes: &[Node],
    nodes: &[u32],
    arcs: &[Vec<u32>],
) -> Result<HashMap<(u32, u32), u32>, LayoutFileError> {
    let leaving: HashSet<(u32, u32)> = arcs
        .iter()
        .filter(|path| path.len() > 1)
        .flat_map(|path| [(path[0], path[1]), (path[path.len() - 1], path[path.len() - 2])])
        .collect();
    let mut slots = HashMap::new();
    for (node, (&v, layout_node)) in nodes.iter().zip(layout_nodes).enumerate() {
        let mut ends = 0;
        for w in mesh.neighbours(v) {
            if leaving.contains(&(v, w)) {
                slots.insert((v, w), ends);
                ends += 1;
            }
        }
        let ends = ends as usize;
        if ends != layout_node.valence + usize::from(layout_node.boundary) {
            return Err(LayoutFileError::Ends { node, valence: layout_node.valence, ends });
        }
    }
    Ok(slots)
}

/// Position on the mesh of a vertex of a refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Position {
    Vertex(VertexId),
    /// With the fraction along the half-edge [`TriMesh::halfedge`].
    Edge(EdgeId, f64),
    Inside(FaceId),
}

/// A mesh and a refinement of it.
struct Refinement<'a> {
    base: &'a TriMesh,
    mesh: &'a RefinedMesh,
    base_face: &'a [u32],
}

impl Refinement<'_> {
    /// The file for nodes and arcs given by vertices of the refinement.
    fn write(
        &self,
        source: MeshSource,
        layout_nodes: &[Node],
        nodes: &[u32],
        arcs: &[Vec<u32>],
        ends: &[[ArcEnd; 2]],
    ) -> Result<LayoutFile, LayoutFileError> {
        let crossings: Vec<Vec<(u32, Option<HalfedgeId>)>> =
            arcs.iter().enumerate().map(|(a, path)| self.crossings(a, path)).collect::<Result<_, _>>()?;
        let used = nodes.iter().copied().chain(crossings.iter().flatten().map(|c| c.0));
        let positions = self.positions(used.collect())?;
        let mut file = LayoutFile::new(source, self.base);
        for (&v, layout_node) in nodes.iter().zip(layout_nodes) {
            file.nodes.push(FileNode {
                at: self.point(v, positions[&v]),
                valence: layout_node.valence as u32,
                fixed: false,
            });
        }
        for (places, &ends) in crossings.into_iter().zip(ends) {
            let point = |(v, crossed): (u32, Option<HalfedgeId>)| match (positions[&v], crossed) {
                (Position::Edge(e, t), Some(halfedge)) => {
                    let t = if self.base.halfedge(e) == halfedge { t } else { 1.0 - t };
                    PathPoint::Crossing(Crossing { halfedge, t })
                }
                _ => PathPoint::Vertex { vertex: VertexId(v) },
            };
            file.arcs.push(FileArc { ends, fixed: false, path: places.into_iter().map(point).collect() });
        }
        Ok(file)
    }

    /// The vertices at which an arc crosses an edge, each with the half-edge in the triangle that the arc leaves, and
    /// the vertices of the mesh on its path. Empty for a boundary arc.
    fn crossings(&self, arc: usize, path: &[u32]) -> Result<Vec<(u32, Option<HalfedgeId>)>, LayoutFileError> {
        let mut places = Vec::new();
        let mut current = None;
        let mut on_boundary = true;
        for w in path.windows(2) {
            if (w[0] as usize) < self.base.n_vertices() && w[0] != path[0] {
                places.push((w[0], None));
                current = None;
            }
            let Some(h) = self.mesh.find(w[0], w[1]) else {
                return Err(LayoutFileError::NotOnMesh { arc });
            };
            let twin = self.mesh.twin(h);
            on_boundary &= twin.is_none();
            let [left, right] = [Some(h), twin].map(|h| h.map(|h| self.base_face[h as usize / 3]));
            if left != right {
                continue;
            }
            if let (Some(f), Some(g)) = (current, left)
                && f != g
            {
                let halfedge = self.between(f, g).ok_or(LayoutFileError::NotOnMesh { arc })?;
                places.push((w[0], Some(halfedge)));
            }
            current = left;
        }
        Ok(if on_boundary { Vec::new() } else { places })
    }

    /// The half-edge of triangle `f` towards triangle `g`.
    fn between(&self, f: u32, g: u32) -> Option<HalfedgeId> {
        if f as usize >= self.base.n_faces() {
            return None;
        }
        let towards = |&h: &HalfedgeId| self.base.twin(h).is_some_and(|t| self.base.face(t).0 == g);
        self.base.face_halfedges(FaceId(f)).into_iter().find(towards)
    }

    /// Whether half-edge `h` of the refinement lies on an edge of the mesh.
    fn on_edge(&self, h: u32) -> bool {
        self.mesh.twin(h).is_none_or(|t| self.base_face[t as usize / 3] != self.base_face[h as usize / 3])
    }

    /// The positions of the vertices `used`. Those on an edge are separated by at least [`MIN_SEPARATION`].
    fn positions(&self, used: Vec<u32>) -> Result<HashMap<u32, Position>, LayoutFileError> {
        let n_base = self.base.n_vertices() as u32;
        let mut positions: HashMap<u32, Position> = HashMap::new();
        for v in used {
            let face = FaceId(self.base_face[self.mesh.outgoing(v)[0] as usize / 3]);
            positions.insert(v, if v < n_base { Position::Vertex(VertexId(v)) } else { Position::Inside(face) });
        }
        for e in self.base.edges() {
            let chain = self.chain(self.base.halfedge(e)).ok_or(LayoutFileError::OtherRefinement)?;
            let along = self.along(&chain);
            let on_edge: Vec<usize> = (1..chain.len() - 1).filter(|&i| positions.contains_key(&chain[i])).collect();
            let fractions = separated(on_edge.iter().map(|&i| along[i]).collect());
            for (i, t) in on_edge.into_iter().zip(fractions) {
                positions.insert(chain[i], Position::Edge(e, t));
            }
        }
        Ok(positions)
    }

    /// The vertices of the refinement along a half-edge of the mesh, its ends included.
    fn chain(&self, h: HalfedgeId) -> Option<Vec<u32>> {
        let (start, end, face) = (self.base.origin(h).0, self.base.target(h).0, self.base.face(h).0);
        // Only the next edge along `h` leaves a vertex on `h` with the triangle of `h` to its left.
        let next = |v: u32| {
            let along = |&g: &u32| self.base_face[g as usize / 3] == face && self.on_edge(g);
            self.mesh.outgoing(v).into_iter().find(along).map(|g| self.mesh.target(g))
        };
        let mut chain = vec![start, next(start)?];
        while chain[chain.len() - 1] >= self.base.n_vertices() as u32 && chain.len() <= self.mesh.n_vertices() {
            chain.push(next(chain[chain.len() - 1])?);
        }
        (chain[chain.len() - 1] == end).then_some(chain)
    }

    /// Fractions of the length along a chain of vertices.
    fn along(&self, chain: &[u32]) -> Vec<f64> {
        let position = |v: u32| self.mesh.positions[v as usize];
        let mut along = vec![0.0];
        for w in chain.windows(2) {
            along.push(along[along.len() - 1] + position(w[0]).distance(position(w[1])));
        }
        let total = along[along.len() - 1].max(f64::MIN_POSITIVE);
        along.into_iter().map(|s| s / total).collect()
    }

    /// The point of the mesh where a vertex lies.
    fn point(&self, v: u32, position: Position) -> SurfacePoint {
        match position {
            Position::Vertex(v) => {
                let h = self.base.vertex_halfedge(v);
                corner_weights(h, [1.0, 0.0, 0.0])
            }
            Position::Edge(e, t) => corner_weights(self.base.halfedge(e), [1.0 - t, t, 0.0]),
            Position::Inside(face) => {
                let [a, b, c] = self.base.face_vertices(face).map(|v| self.base.position(v));
                let p = self.mesh.positions[v as usize];
                let normal = self.base.face_normal(face);
                // Weights are kept positive: on the border of the triangle the file would mean another position.
                let parts = [(b, c), (c, a), (a, b)].map(|(x, y)| (x - p).cross(y - p).dot(normal));
                let total = parts.iter().map(|w| w.max(0.0)).sum::<f64>().max(f64::MIN_POSITIVE);
                let inner = parts.map(|w| (w / total).max(MIN_SEPARATION));
                let sum: f64 = inner.iter().sum();
                SurfacePoint { face, weights: inner.map(|w| w / sum) }
            }
        }
    }
}

/// The point with these weights of the origin, the target and the opposite corner of a half-edge.
fn corner_weights(h: HalfedgeId, weights: [f64; 3]) -> SurfacePoint {
    let mut point = SurfacePoint { face: FaceId(h.0 / 3), weights: [0.0; 3] };
    for (i, w) in weights.into_iter().enumerate() {
        point.weights[(h.0 as usize + i) % 3] = w;
    }
    point
}

/// Moves ascending fractions minimally such that they have the least distance from each other and from 0 and 1.
fn separated(mut fractions: Vec<f64>) -> Vec<f64> {
    let gap = MIN_SEPARATION.min(0.5 / (fractions.len() + 1) as f64);
    let mut least = gap;
    for t in &mut fractions {
        *t = t.max(least);
        least = *t + gap;
    }
    let mut most = 1.0 - gap;
    for t in fractions.iter_mut().rev() {
        *t = t.min(most);
        most = *t - gap;
    }
    fractions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separated_fractions_keep_their_order_and_distance() {
        let fractions = separated(vec![0.0, 0.0, 0.5, 0.5, 1.0]);
        assert!(fractions[0] > 0.0 && fractions[4] < 1.0);
        assert!(fractions.windows(2).all(|w| w[1] - w[0] > 0.5 * MIN_SEPARATION), "{fractions:?}");
        assert!((fractions[2] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn fractions_that_are_apart_do_not_move() {
        assert_eq!(separated(vec![0.1, 0.2, 0.9]), [0.1, 0.2, 0.9]);
        assert_eq!(separated(Vec::new()), Vec::<f64>::new());
    }
}
