//! Finer triangles around irregular nodes.
//!
//! Around a node of valence `k` the map turns by `k` quarters, and a triangle can take less than half a turn of it: a node
//! of valence 12 in six triangles folds, whatever the map (Campen, section 6.8). Long before that least squares fold,
//! for in a few wide triangles the field turns by so much from one to the next that none fits its neighbours. So the
//! triangles around irregular nodes are made smaller, and those at a node many: edges are halved and triangles split
//! accordingly. The surface stays as it is, and so does the layout on it: chains of triangles lead through the parts of
//! the triangles that they led through before.

use std::collections::VecDeque;

use glam::DVec3;

use crate::embed::EmbeddingError;
use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc};
use crate::embed::topology::period_jumps;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// Rings of triangles around an irregular node that are split in four.
const RINGS: usize = 2;
/// Triangles that a node is to have for each quarter of the field around it: 30° of the map to each.
const PER_QUARTER: usize = 3;
/// Rounds of halving the edges around a node: each doubles its triangles, and eight times as many as six suffice for any
/// valence that a layout can reasonably have.
const FANS: usize = 3;

/// A mesh with some edges halved.
struct Refined {
    mesh: TriMesh,
    /// Triangle that each triangle is a part of.
    parent: Vec<FaceId>,
    /// Half-edge that each half-edge lies on; `None` inside a triangle.
    on: Vec<Option<HalfedgeId>>,
    /// The two ends of the edge that each new vertex halves.
    halves: Vec<[VertexId; 2]>,
}

/// What belongs to the mesh of a net besides the net.
pub(in crate::embed) struct Carried<T> {
    /// Whether each edge is sharp.
    pub sharp: Vec<bool>,
    /// What is known of each vertex.
    pub at_vertex: Vec<T>,
}

impl EmbeddingTopology {
    /// The net with finer triangles around its irregular nodes, for a field of the angles given; `None` if there is none
    /// to be refined.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn refine_at_irregular_nodes<T: Copy>(
        &self,
        angle: &[f64],
        sharp: &[bool],
        at_vertex: &[T],
    ) -> Result<Option<(Self, Carried<T>)>, EmbeddingError> {
        if self.nodes.iter().all(|n| n.is_regular()) {
            return Ok(None);
        }
        let mut net = self.clone();
        let mut angle = angle.to_vec();
        let mut carried = Carried { sharp: sharp.to_vec(), at_vertex: at_vertex.to_vec() };
        let marks = around_nodes(&net);
        (net, angle, carried) = net.halved(&angle, &carried, &marks)?;
        for _ in 0..FANS {
            let marks = link_of_nodes(&net);
            if !marks.contains(&true) {
                break;
            }
            (net, angle, carried) = net.halved(&angle, &carried, &marks)?;
        }
        net.lift(&angle)?;
        Ok(Some((net, carried)))
    }

    /// The net with the marked edges halved, and the field's angles on it. Jumps are right but for full turns.
    fn halved<T: Copy>(
        &self,
        angle: &[f64],
        carried: &Carried<T>,
        marks: &[bool],
    ) -> Result<(Self, Vec<f64>, Carried<T>), EmbeddingError> {
        let fine = Refined::new(&self.mesh, marks)?;
        let mesh = &fine.mesh;
        let jump = mesh.edges().map(|e| fine.on[mesh.halfedge(e).index()].map_or(0, |h| self.jump_across(h))).collect();
        let arcs = self
            .arcs
            .iter()
            .enumerate()
            .map(|(a, arc)| fine.chain(&self.mesh, arc).ok_or(EmbeddingError::Arc { arc: a }));
        let arcs = arcs.collect::<Result<_, _>>()?;
        let border = mesh.halfedges().filter(|&h| mesh.twin(h).is_none());
        let boundary = border.filter_map(|h| Some((h, *self.boundary.get(&fine.on[h.index()]?)?))).collect();
        let (coarse_metric, metric) = (Metric::new(&self.mesh), Metric::new(mesh));
        let turned = |f: FaceId| {
            let parent = fine.parent[f.index()];
            let along = coarse_metric.tangent(&self.mesh, parent, angle[parent.index()]);
            metric.angle_of(mesh, f, along).unwrap_or(0.0)
        };
        let angle: Vec<f64> = mesh.faces().map(turned).collect();
        let sharp = |e| fine.on[mesh.halfedge(e).index()].is_some_and(|h| carried.sharp[self.mesh.edge(h).index()]);
        let mut at_vertex = carried.at_vertex.clone();
        at_vertex.extend(fine.halves.iter().map(|ends| carried.at_vertex[ends[0].index()]));
        let carried = Carried { sharp: mesh.edges().map(sharp).collect(), at_vertex };
        let base_face = fine.parent.iter().map(|f| self.base_face[f.index()]).collect();
        let (nodes, drawn) = (self.nodes.clone(), angle.clone());
        let net = Self { mesh: fine.mesh, base_face, jump, angle: drawn, nodes, arcs, boundary };
        Ok((net, angle, carried))
    }

    /// Makes the jumps whole numbers again that give every node its index.
    fn lift(&mut self, angle: &[f64]) -> Result<(), EmbeddingError> {
        let metric = Metric::new(&self.mesh);
        let guides: Vec<(FaceId, DVec3, i32)> =
            self.mesh.faces().map(|f| (f, metric.tangent(&self.mesh, f, angle[f.index()]), 0)).collect();
        let mut index = vec![0; self.mesh.n_vertices()];
        for n in self.nodes.iter().filter(|n| !n.boundary) {
            index[n.vertex.index()] = n.index();
        }
        (self.jump, self.angle) = period_jumps::lift(&self.mesh, &metric, &self.jump, &guides, &index)?;
        Ok(())
    }
}

/// The edges of the triangles around irregular nodes.
fn around_nodes(net: &EmbeddingTopology) -> Vec<bool> {
    let mesh = &net.mesh;
    let mut near = vec![false; mesh.n_vertices()];
    for n in net.nodes.iter().filter(|n| !n.is_regular()) {
        near[n.vertex.index()] = true;
    }
    let mut inside = vec![false; mesh.n_faces()];
    for _ in 0..RINGS {
        for f in mesh.faces() {
            inside[f.index()] |= mesh.face_vertices(f).iter().any(|v| near[v.index()]);
        }
        for f in mesh.faces().filter(|f| inside[f.index()]) {
            mesh.face_vertices(f).iter().for_each(|v| near[v.index()] = true);
        }
    }
    let mut marks = vec![false; mesh.n_edges()];
    for f in mesh.faces().filter(|f| inside[f.index()]) {
        mesh.face_halfedges(f).iter().for_each(|&h| marks[mesh.edge(h).index()] = true);
    }
    marks
}

/// The edges across from irregular nodes that have fewer triangles than they need.
fn link_of_nodes(net: &EmbeddingTopology) -> Vec<bool> {
    let mesh = &net.mesh;
    let mut marks = vec![false; mesh.n_edges()];
    for n in net.nodes.iter().filter(|n| !n.is_regular()) {
        let fan: Vec<HalfedgeId> = mesh.outgoing(n.vertex).collect();
        if fan.len() < PER_QUARTER * n.valence {
            fan.iter().for_each(|&h| marks[mesh.edge(mesh.next(h)).index()] = true);
        }
    }
    marks
}

impl Refined {
    fn new(mesh: &TriMesh, marks: &[bool]) -> Result<Self, EmbeddingError> {
        let mut positions = mesh.positions().to_vec();
        let mut halves = Vec::new();
        let middle: Vec<Option<u32>> = mesh
            .edges()
            .map(|e| {
                marks[e.index()].then(|| {
                    let ends = mesh.edge_vertices(e);
                    positions.push(0.5 * (mesh.position(ends[0]) + mesh.position(ends[1])));
                    halves.push(ends);
                    (positions.len() - 1) as u32
                })
            })
            .collect();
        let (mut faces, mut parent, mut on) = (Vec::new(), Vec::new(), Vec::new());
        for f in mesh.faces() {
            let corners = mesh.face_vertices(f).map(|v| v.0);
            let sides = mesh.face_halfedges(f);
            for (face, lies_on) in parts(corners, sides, sides.map(|h| middle[mesh.edge(h).index()]), &positions) {
                faces.push(face);
                parent.push(f);
                on.extend(lies_on);
            }
        }
        Ok(Self { mesh: TriMesh::from_faces(positions, &faces)?, parent, on, halves })
    }

    /// The chain of an arc through the parts of its triangles.
    fn chain(&self, coarse: &TriMesh, arc: &TopologyArc) -> Option<TopologyArc> {
        let (first, last) = (coarse.origin(arc.start), coarse.origin(arc.end));
        let (mut at, start) = self.corner(self.parts_of(coarse.face(arc.start)), first)?;
        // Any part of the first triangle at the node may be the first.
        let mut crossed = Vec::new();
        for &h in &arc.crossed {
            let exit = |f: FaceId| self.mesh.face_halfedges(f).into_iter().find(|g| self.on[g.index()] == Some(h));
            crossed.extend(self.walk(at, |f| exit(f).is_some())?);
            at = self.after(at, &crossed);
            let out = exit(at)?;
            crossed.push(out);
            at = self.mesh.face(self.mesh.twin(out)?);
        }
        let at_last = |f: FaceId| self.corner([f], last).is_some();
        crossed.extend(self.walk(at, at_last)?);
        at = self.after(at, &crossed);
        let end = self.corner([at], last)?.1;
        Some(TopologyArc { start, crossed, end, ..arc.clone() })
    }

    /// The triangle one is in after crossing half-edges, or `at` if there are none.
    fn after(&self, at: FaceId, crossed: &[HalfedgeId]) -> FaceId {
        crossed.last().and_then(|&h| self.mesh.twin(h)).map_or(at, |t| self.mesh.face(t))
    }

    fn parts_of(&self, f: FaceId) -> impl Iterator<Item = FaceId> {
        let first = self.parent.partition_point(|p| p.0 < f.0);
        let last = self.parent.partition_point(|p| p.0 <= f.0);
        (first..last).map(FaceId::new)
    }

    /// The first of the triangles that has a corner at `v`, and the corner.
    fn corner(&self, faces: impl IntoIterator<Item = FaceId>, v: VertexId) -> Option<(FaceId, HalfedgeId)> {
        let at = |f: FaceId| self.mesh.face_halfedges(f).into_iter().find(|&h| self.mesh.origin(h) == v);
        faces.into_iter().find_map(|f| at(f).map(|h| (f, h)))
    }

    /// The half-edges crossed from `from` to the nearest part of the same triangle that `wanted` accepts.
    fn walk(&self, from: FaceId, wanted: impl Fn(FaceId) -> bool) -> Option<Vec<HalfedgeId>> {
        let mut ways = VecDeque::from([(from, Vec::new())]);
        let mut seen = vec![from];
        while let Some((f, way)) = ways.pop_front() {
            if wanted(f) {
                return Some(way);
            }
            for h in self.mesh.face_halfedges(f).into_iter().filter(|h| self.on[h.index()].is_none()) {
                let Some(g) = self.mesh.twin(h).map(|t| self.mesh.face(t)) else { continue };
                if !seen.contains(&g) {
                    seen.push(g);
                    ways.push_back((g, way.iter().copied().chain([h]).collect()));
                }
            }
        }
        None
    }
}

/// A triangle, and for each of its sides the half-edge it lies on.
type Part = ([u32; 3], [Option<HalfedgeId>; 3]);

/// The parts of a triangle of which some sides are halved.
fn parts(corners: [u32; 3], sides: [HalfedgeId; 3], middle: [Option<u32>; 3], positions: &[DVec3]) -> Vec<Part> {
    let n_halved = middle.iter().flatten().count();
    // Turned so that the first side is halved, and with two the second as well.
    let turn = match n_halved {
        1 => (0..3).find(|&i| middle[i].is_some()),
        2 => (0..3).find(|&i| middle[i].is_some() && middle[(i + 1) % 3].is_some()),
        _ => None,
    }
    .unwrap_or(0);
    let at = |i: usize| (turn + i) % 3;
    let ([a, b, c], [x, y, z]) = ([0, 1, 2].map(|i| corners[at(i)]), [0, 1, 2].map(|i| Some(sides[at(i)])));
    match [0, 1, 2].map(|i| middle[at(i)]) {
        [Some(m), None, None] => vec![([a, m, c], [x, None, z]), ([m, b, c], [x, y, None])],
        [Some(m), Some(n), None] => {
            let distance = |p: u32, q: u32| positions[p as usize].distance_squared(positions[q as usize]);
            let tip = ([m, b, n], [x, y, None]);
            if distance(a, n) < distance(m, c) {
                vec![tip, ([a, m, n], [x, None, None]), ([a, n, c], [None, y, z])]
            } else {
                vec![tip, ([m, n, c], [None, y, None]), ([a, m, c], [x, None, z])]
            }
        }
        [Some(m), Some(n), Some(o)] => vec![
            ([a, m, o], [x, None, z]),
            ([m, b, n], [x, y, None]),
            ([o, n, c], [None, y, z]),
            ([m, n, o], [None; 3]),
        ],
        _ => vec![([a, b, c], [x, y, z])],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::{indices, is_chain, net};

    #[test]
    fn the_surface_the_layout_and_its_indices_stay() {
        let net = net();
        let sharp: Vec<bool> = net.mesh.edges().map(|e| e.0 % 3 == 0).collect();
        let mark: Vec<u32> = (0..net.mesh.n_vertices() as u32).collect();
        let (fine, carried) = net.refine_at_irregular_nodes(&net.angle, &sharp, &mark).unwrap().unwrap();
        assert!(fine.mesh.n_faces() > net.mesh.n_faces());
        assert_eq!(fine.mesh.euler_characteristic(), net.mesh.euler_characteristic());

        let mut area = vec![0.0; net.mesh.n_faces()];
        for f in fine.mesh.faces() {
            area[fine.base_face[f.index()].index()] += fine.mesh.face_area(f);
        }
        for f in net.mesh.faces() {
            assert!((area[f.index()] - net.mesh.face_area(f)).abs() < 1e-12, "{f:?} is covered once by its parts");
        }
        let length = |mesh: &TriMesh, sharp: &[bool]| -> f64 {
            let sharp = mesh.edges().filter(|e| sharp[e.index()]);
            sharp.map(|e| mesh.vector(mesh.halfedge(e)).length()).sum()
        };
        assert!((length(&fine.mesh, &carried.sharp) - length(&net.mesh, &sharp)).abs() < 1e-9);
        assert_eq!(carried.at_vertex[..mark.len()], mark);
        assert_eq!(carried.at_vertex.len(), fine.mesh.n_vertices());

        assert_eq!(fine.nodes, net.nodes);
        assert!((0..fine.arcs.len()).all(|a| is_chain(&fine, a)));
        let mut wanted = vec![0; fine.mesh.n_vertices()];
        fine.nodes.iter().for_each(|n| wanted[n.vertex.index()] = n.index());
        assert_eq!(indices(&fine.mesh, &fine.jump), wanted);
    }

    #[test]
    fn every_quarter_around_an_irregular_node_has_its_triangles() {
        let mut net = net();
        // As many as six triangles can never hold.
        net.nodes[1].valence = 12;
        let mark = vec![(); net.mesh.n_vertices()];
        let mut fine = net.clone();
        let mut carried = Carried { sharp: vec![false; net.mesh.n_edges()], at_vertex: mark };
        for _ in 0..FANS {
            let marks = link_of_nodes(&fine);
            (fine, _, carried) = fine.halved(&fine.angle, &carried, &marks).unwrap();
        }
        for n in fine.nodes.iter().filter(|n| !n.is_regular()) {
            assert!(fine.mesh.outgoing(n.vertex).count() >= PER_QUARTER * n.valence);
        }
        assert!((0..fine.arcs.len()).all(|a| is_chain(&fine, a)));
    }

    #[test]
    fn without_irregular_nodes_nothing_is_refined() {
        let mut net = net();
        net.nodes.iter_mut().for_each(|n| n.valence = 4);
        let (sharp, mark) = (vec![false; net.mesh.n_edges()], vec![(); net.mesh.n_vertices()]);
        assert!(net.refine_at_irregular_nodes(&net.angle, &sharp, &mark).unwrap().is_none());
    }
}
