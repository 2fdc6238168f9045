//! Refinement of the mesh around irregular nodes.
//!
//! The map turns by `k` quarters around a node of valence `k`, and the angle of an unflipped triangle is less than half
//! a turn. So a node of valence 12 among six triangles has flipped triangles in any map (Campen, section 6.8). The map
//! of least squares has them much earlier: where a node has few triangles, the field turns by a large angle from each
//! to the next, and no linear map of a triangle fits its neighbours.
//!
//! The triangles near irregular nodes are therefore split 1-to-4, and the edges across from a node bisected until it
//! has enough triangles. The surface does not change, nor does the embedding: chains lead through parts of the same
//! triangles as before.

use glam::DVec3;

use crate::embed::EmbeddingError;
use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc, node_indices};
use crate::embed::topology::period_jumps::{DirectionHint, integer_jumps};
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// Rings of triangles around an irregular node that are split 1-to-4.
const RINGS: usize = 2;
/// Triangles that a node needs for each quarter turn of the map around it: 30° of the map each.
const TRIANGLES_PER_QUARTER: usize = 3;
/// Largest number of rounds in which the edges across from a node are split. Each doubles its triangles: from six to
/// 48, which is enough for valence 16.
const LINK_ROUNDS: usize = 3;

/// A mesh with some edges split at their midpoints.
struct SplitMesh {
    mesh: TriMesh,
    /// Triangle of the input mesh that each triangle is a part of, ascending.
    parent: Vec<FaceId>,
    /// Half-edge of the input mesh that each half-edge lies on; `None` inside a triangle.
    base_halfedge: Vec<Option<HalfedgeId>>,
    /// The ends of the edge that each new vertex is the midpoint of.
    split_edges: Vec<[VertexId; 2]>,
}

/// Attributes of the mesh that are refined with it.
pub(in crate::embed) struct MeshAttributes<T> {
    /// Whether each edge is sharp.
    pub sharp: Vec<bool>,
    /// A value at each vertex; a new vertex takes that of one end of its edge.
    pub at_vertex: Vec<T>,
}

impl EmbeddingTopology {
    /// The topology on the mesh refined around irregular nodes, and the attributes of that mesh; `None` if all nodes
    /// are regular. `angle` holds the angle of direction 0 of the field in each triangle.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::Arc`] where a chain of triangles is not connected; [`EmbeddingError::Solve`].
    pub(in crate::embed) fn refine_at_irregular_nodes<T: Copy>(
        &self,
        angle: &[f64],
        sharp: &[bool],
        at_vertex: &[T],
    ) -> Result<Option<(Self, MeshAttributes<T>)>, EmbeddingError> {
        if self.nodes.iter().all(|n| n.is_regular()) {
            return Ok(None);
        }
        let mut topology = self.clone();
        let mut angle = angle.to_vec();
        let mut attributes = MeshAttributes { sharp: sharp.to_vec(), at_vertex: at_vertex.to_vec() };
        let marks = edges_near_nodes(&topology);
        (topology, angle, attributes) = topology.with_edges_split(&angle, &attributes, &marks)?;
        for _ in 0..LINK_ROUNDS {
            let marks = link_edges(&topology);
            if !marks.contains(&true) {
                break;
            }
            (topology, angle, attributes) = topology.with_edges_split(&angle, &attributes, &marks)?;
        }
        topology.make_jumps_integer(&angle)?;
        Ok(Some((topology, attributes)))
    }

    /// The topology with the marked edges split, and the angles of the field on its mesh. Jumps are right modulo 4.
    fn with_edges_split<T: Copy>(
        &self,
        angle: &[f64],
        attributes: &MeshAttributes<T>,
        marks: &[bool],
    ) -> Result<(Self, Vec<f64>, MeshAttributes<T>), EmbeddingError> {
        let fine = SplitMesh::new(&self.mesh, marks)?;
        let mesh = &fine.mesh;
        let jump = mesh
            .edges()
            .map(|e| fine.base_halfedge[mesh.halfedge(e).index()].map_or(0, |h| self.jump_across(h)))
            .collect();
        let arcs = self
            .arcs
            .iter()
            .enumerate()
            .map(|(a, arc)| fine.refine_chain(&self.mesh, arc).ok_or(EmbeddingError::Arc { arc: a }));
        let arcs = arcs.collect::<Result<_, _>>()?;
        let border = mesh.halfedges().filter(|&h| mesh.twin(h).is_none());
        let boundary = border.filter_map(|h| Some((h, *self.boundary.get(&fine.base_halfedge[h.index()]?)?))).collect();
        let (coarse_metric, metric) = (Metric::new(&self.mesh), Metric::new(mesh));
        let refined_angle = |f: FaceId| {
            let parent = fine.parent[f.index()];
            let along = coarse_metric.tangent(&self.mesh, parent, angle[parent.index()]);
            metric.angle_of(mesh, f, along).unwrap_or(0.0)
        };
        let angle: Vec<f64> = mesh.faces().map(refined_angle).collect();
        let sharp = |e| {
            fine.base_halfedge[mesh.halfedge(e).index()].is_some_and(|h| attributes.sharp[self.mesh.edge(h).index()])
        };
        let mut at_vertex = attributes.at_vertex.clone();
        at_vertex.extend(fine.split_edges.iter().map(|ends| attributes.at_vertex[ends[0].index()]));
        let attributes = MeshAttributes { sharp: mesh.edges().map(sharp).collect(), at_vertex };
        let base_face = fine.parent.iter().map(|f| self.base_face[f.index()]).collect();
        let (nodes, first_angle) = (self.nodes.clone(), angle.clone());
        let topology = Self { mesh: fine.mesh, base_face, jump, angle: first_angle, nodes, arcs, boundary };
        Ok((topology, angle, attributes))
    }

    /// Replaces the jumps, given modulo 4, by the integers that give every node its index.
    fn make_jumps_integer(&mut self, angle: &[f64]) -> Result<(), EmbeddingError> {
        let metric = Metric::new(&self.mesh);
        let hint = |face: FaceId| {
            let vector = metric.tangent(&self.mesh, face, angle[face.index()]);
            DirectionHint { face, vector, direction: 0 }
        };
        let hints: Vec<DirectionHint> = self.mesh.faces().map(hint).collect();
        let index = node_indices(&self.mesh, &self.nodes);
        (self.jump, self.angle) = integer_jumps(&self.mesh, &metric, &self.jump, &hints, &index)?;
        Ok(())
    }
}

/// Marks the edges of the triangles within [`RINGS`] rings around irregular nodes.
fn edges_near_nodes(topology: &EmbeddingTopology) -> Vec<bool> {
    let mesh = &topology.mesh;
    let mut near = vec![false; mesh.n_vertices()];
    for n in topology.nodes.iter().filter(|n| !n.is_regular()) {
        near[n.vertex.index()] = true;
    }
    mesh.dilate_vertices(&mut near, RINGS - 1);
    let inside = mesh.faces_touching(&near);
    let mut marks = vec![false; mesh.n_edges()];
    for f in mesh.faces().filter(|f| inside[f.index()]) {
        mesh.face_halfedges(f).iter().for_each(|&h| marks[mesh.edge(h).index()] = true);
    }
    marks
}

/// Marks the edges across from irregular nodes that have fewer triangles than they need.
fn link_edges(topology: &EmbeddingTopology) -> Vec<bool> {
    let mesh = &topology.mesh;
    let mut marks = vec![false; mesh.n_edges()];
    for n in topology.nodes.iter().filter(|n| !n.is_regular()) {
        let fan: Vec<HalfedgeId> = mesh.outgoing(n.vertex).collect();
        if fan.len() < TRIANGLES_PER_QUARTER * n.valence {
            fan.iter().for_each(|&h| marks[mesh.edge(mesh.next(h)).index()] = true);
        }
    }
    marks
}

impl SplitMesh {
    fn new(mesh: &TriMesh, marks: &[bool]) -> Result<Self, EmbeddingError> {
        let mut positions = mesh.positions().to_vec();
        let mut split_edges = Vec::new();
        let middle: Vec<Option<u32>> = mesh
            .edges()
            .map(|e| {
                marks[e.index()].then(|| {
                    let ends = mesh.edge_vertices(e);
                    positions.push(0.5 * (mesh.position(ends[0]) + mesh.position(ends[1])));
                    split_edges.push(ends);
                    (positions.len() - 1) as u32
                })
            })
            .collect();
        let (mut faces, mut parent, mut base_halfedge) = (Vec::new(), Vec::new(), Vec::new());
        for f in mesh.faces() {
            let corners = mesh.face_vertices(f).map(|v| v.0);
            let sides = mesh.face_halfedges(f);
            for (face, lies_on) in parts(corners, sides, sides.map(|h| middle[mesh.edge(h).index()]), &positions) {
                faces.push(face);
                parent.push(f);
                base_halfedge.extend(lies_on);
            }
        }
        Ok(Self { mesh: TriMesh::from_faces(positions, &faces)?, parent, base_halfedge, split_edges })
    }

    /// The chain of an arc through parts of its triangles.
    fn refine_chain(&self, coarse: &TriMesh, arc: &TopologyArc) -> Option<TopologyArc> {
        let (first, last) = (coarse.origin(arc.start), coarse.origin(arc.end));
        let (mut at, start) = self.corner(self.parts_of(coarse.face(arc.start)), first)?;
        let mut crossed = Vec::new();
        for &h in &arc.crossed {
            let exit =
                |f: FaceId| self.mesh.face_halfedges(f).into_iter().find(|g| self.base_halfedge[g.index()] == Some(h));
            crossed.extend(self.walk_inside(at, |f| exit(f).is_some())?);
            at = self.face_after(at, &crossed);
            let out = exit(at)?;
            crossed.push(out);
            at = self.mesh.face(self.mesh.twin(out)?);
        }
        let at_last = |f: FaceId| self.corner([f], last).is_some();
        crossed.extend(self.walk_inside(at, at_last)?);
        at = self.face_after(at, &crossed);
        let end = self.corner([at], last)?.1;
        Some(TopologyArc { start, crossed, end, ..arc.clone() })
    }

    /// The triangle behind the last half-edge crossed, or `at` if there is none.
    fn face_after(&self, at: FaceId, crossed: &[HalfedgeId]) -> FaceId {
        crossed.last().and_then(|&h| self.mesh.twin(h)).map_or(at, |t| self.mesh.face(t))
    }

    /// The parts of triangle `f` of the input mesh.
    fn parts_of(&self, f: FaceId) -> impl Iterator<Item = FaceId> {
        let first = self.parent.partition_point(|p| p.0 < f.0);
        let last = self.parent.partition_point(|p| p.0 <= f.0);
        (first..last).map(FaceId::new)
    }

    /// The first of `faces` that has a corner at `v`, and that corner.
    fn corner(&self, faces: impl IntoIterator<Item = FaceId>, v: VertexId) -> Option<(FaceId, HalfedgeId)> {
        let at = |f: FaceId| self.mesh.face_halfedges(f).into_iter().find(|&h| self.mesh.origin(h) == v);
        faces.into_iter().find_map(|f| at(f).map(|h| (f, h)))
    }

    /// The half-edges crossed from `from` to the nearest part of the same triangle that satisfies `is_target`.
    fn walk_inside(&self, from: FaceId, is_target: impl Fn(FaceId) -> bool) -> Option<Vec<HalfedgeId>> {
        let mut search = BreadthFirst::sparse();
        search.start(from);
        while let Some(f) = search.visit() {
            if is_target(f) {
                return search.path_to(f, |&h| self.mesh.face(h));
            }
            for (h, g) in self.mesh.adjacent_faces(f).filter(|(h, _)| self.base_halfedge[h.index()].is_none()) {
                search.reach(g, h);
            }
        }
        None
    }
}

/// Vertices of a triangle, and for each of its sides the half-edge of the input mesh that it lies on.
type Part = ([u32; 3], [Option<HalfedgeId>; 3]);

/// The parts of a triangle of which some sides are split at the vertices `middle`. A quadrilateral left over is cut
/// along its shorter diagonal.
fn parts(corners: [u32; 3], sides: [HalfedgeId; 3], middle: [Option<u32>; 3], positions: &[DVec3]) -> Vec<Part> {
    let n_split = middle.iter().flatten().count();
    // Rotated so that the first side is split, and of two the second as well.
    let turn = match n_split {
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
    use crate::embed::topology::testing::{indices, is_chain, sample_topology};

    #[test]
    fn refinement_keeps_surface_arcs_and_indices() {
        let topology = sample_topology();
        let sharp: Vec<bool> = topology.mesh.edges().map(|e| e.0 % 3 == 0).collect();
        let mark: Vec<u32> = (0..topology.mesh.n_vertices() as u32).collect();
        let (fine, attributes) = topology.refine_at_irregular_nodes(&topology.angle, &sharp, &mark).unwrap().unwrap();
        assert!(fine.mesh.n_faces() > topology.mesh.n_faces());
        assert_eq!(fine.mesh.euler_characteristic(), topology.mesh.euler_characteristic());

        let mut area = vec![0.0; topology.mesh.n_faces()];
        for f in fine.mesh.faces() {
            area[fine.base_face[f.index()].index()] += fine.mesh.face_area(f);
        }
        for f in topology.mesh.faces() {
            assert!((area[f.index()] - topology.mesh.face_area(f)).abs() < 1e-12, "{f:?} has the area of its parts");
        }
        let length = |mesh: &TriMesh, sharp: &[bool]| -> f64 {
            let sharp = mesh.edges().filter(|e| sharp[e.index()]);
            sharp.map(|e| mesh.vector(mesh.halfedge(e)).length()).sum()
        };
        assert!((length(&fine.mesh, &attributes.sharp) - length(&topology.mesh, &sharp)).abs() < 1e-9);
        assert_eq!(attributes.at_vertex[..mark.len()], mark);
        assert_eq!(attributes.at_vertex.len(), fine.mesh.n_vertices());

        assert_eq!(fine.nodes, topology.nodes);
        assert!((0..fine.arcs.len()).all(|a| is_chain(&fine, a)));
        assert_eq!(indices(&fine.mesh, &fine.jump), node_indices(&fine.mesh, &fine.nodes));
    }

    #[test]
    fn link_edges_are_split_until_an_irregular_node_has_enough_triangles() {
        let mut topology = sample_topology();
        // Six triangles cannot span this angle without a flip.
        topology.nodes[1].valence = 12;
        let mark = vec![(); topology.mesh.n_vertices()];
        let mut fine = topology.clone();
        let mut attributes = MeshAttributes { sharp: vec![false; topology.mesh.n_edges()], at_vertex: mark };
        for _ in 0..LINK_ROUNDS {
            let marks = link_edges(&fine);
            (fine, _, attributes) = fine.with_edges_split(&fine.angle, &attributes, &marks).unwrap();
        }
        for n in fine.nodes.iter().filter(|n| !n.is_regular()) {
            assert!(fine.mesh.outgoing(n.vertex).count() >= TRIANGLES_PER_QUARTER * n.valence);
        }
        assert!((0..fine.arcs.len()).all(|a| is_chain(&fine, a)));
    }

    #[test]
    fn without_irregular_nodes_there_is_no_refinement() {
        let mut topology = sample_topology();
        topology.nodes.iter_mut().for_each(|n| n.valence = 4);
        let (sharp, mark) = (vec![false; topology.mesh.n_edges()], vec![(); topology.mesh.n_vertices()]);
        assert!(topology.refine_at_irregular_nodes(&topology.angle, &sharp, &mark).unwrap().is_none());
    }
}
