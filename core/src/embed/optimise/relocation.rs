//! Relocation of nodes on the surface (Campen, section 6.5.1).
//!
//! A node must be a vertex, but its position is continuous. So a corner of the triangle that the position lies in is
//! moved there, the one that moves least, and returns to its rest position once the node leaves it. No vertex is
//! inserted and no connectivity changes. Positions are projected onto the surface of the problem; a position is
//! refused, and the step halved, where triangles around it would flip or degenerate.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::{Metric, SurfaceIndex, trace_geodesic};

/// Halvings of a step that is not possible before the node stays. Chosen by hand.
const HALVINGS: usize = 4;
/// Ratio of a triangle's doubled area to its squared longest side, 0 to √3/2. A triangle must stay above this bound, or
/// above half its own ratio where it is thinner already: initial embeddings leave slivers along arcs, and a node beside
/// one must be able to move. Gradients of the map in thinner triangles mean little.
const MIN_THICKNESS: f64 = 0.02;
/// Least cosine between the normals of a triangle before and after; 1 would forbid any tilt, 0 allows a right angle.
const MIN_NORMAL_COSINE: f64 = 0.2;

/// The freedom of a node to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeConstraint {
    /// It moves freely on the surface.
    Free,
    /// It moves along a feature or the boundary.
    Curve,
    /// It does not move.
    Fixed,
}

/// The surface with what restricts the positions of nodes on it.
pub(super) struct SurfaceProjection<'a> {
    /// The mesh of the problem.
    pub surface: &'a TriMesh,
    /// Its spatial index.
    pub index: &'a SurfaceIndex,
    /// The position of each vertex of the working mesh while no node is there.
    pub rest_position: Vec<DVec3>,
    /// Whether each edge of the working mesh is sharp or on the boundary.
    pub curve: Vec<bool>,
    /// Whether each vertex of the working mesh is on such an edge.
    pub on_curve: Vec<bool>,
    /// The freedom of each node.
    pub node_constraint: Vec<NodeConstraint>,
    /// Least distance between irregular nodes.
    pub min_distance: f64,
}

/// The point where two isolines cross.
pub(super) struct CrossingPoint {
    /// The triangle it lies in.
    pub face: FaceId,
    /// Its barycentric coordinates there.
    pub weights: [f64; 3],
    /// Its position in space.
    pub position: DVec3,
    /// Adjacent triangles from there back to the node.
    pub strip: Vec<FaceId>,
}

impl SurfaceProjection<'_> {
    /// Moves a free node along a straightest geodesic, given by the vector `step` of its polar map; returns the length
    /// moved.
    pub(super) fn move_free(
        &self,
        topology: &mut EmbeddingTopology,
        metric: &Metric,
        node: usize,
        step: DVec2,
        cell: &[u32],
    ) -> f64 {
        let v = topology.nodes[node].vertex;
        let mut length = step.length();
        for _ in 0..=HALVINGS {
            let direction = step.to_angle().rem_euclid(std::f64::consts::TAU);
            let trace = trace_geodesic(&topology.mesh, metric, v, direction, length);
            let own = topology.mesh.face_vertices(trace.end.face).iter().any(|w| cell[w.index()] == node as u32);
            let position = self.index.nearest(trace.end.position(&topology.mesh)).position(self.surface);
            // A node stays in its cell, so that simultaneous steps of neighbours do not collide (section 6.6.2).
            if !trace.hit_boundary && own && self.keeps_distance(topology, node, position) {
                let strip = strip(&topology.mesh, trace.first, &trace.crossed);
                if self.put_in_face(topology, node, position, trace.end.face, &strip) {
                    return length;
                }
            }
            length *= 0.5;
        }
        0.0
    }

    /// Whether a node at `position` keeps the least distance from other irregular nodes, or at least comes no closer.
    /// Irregular nodes close together circle each other and wind up their arcs.
    fn keeps_distance(&self, topology: &EmbeddingTopology, node: usize, position: DVec3) -> bool {
        let old = topology.mesh.position(topology.nodes[node].vertex);
        topology.nodes[node].is_regular()
            || topology.nodes.iter().enumerate().filter(|&(i, n)| i != node && !n.is_regular()).all(|(_, n)| {
                let other = topology.mesh.position(n.vertex);
                let (before, after) = (other.distance(old), other.distance(position));
                after > before || after > self.min_distance
            })
    }

    /// Puts the node at `position` in `face` by one of its corners. Returns whether that is possible; if not, nothing
    /// changes.
    fn put_in_face(
        &self,
        topology: &mut EmbeddingTopology,
        node: usize,
        position: DVec3,
        face: FaceId,
        strip: &[FaceId],
    ) -> bool {
        let from = topology.nodes[node].vertex;
        let taken: Vec<VertexId> = topology.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
        let mut corners: Vec<VertexId> = topology.mesh.face_vertices(face).to_vec();
        // Nodes must not share triangles: one with nodes at two corners is nearly determined in the map, one with three
        // entirely.
        let beside = |v: VertexId| topology.mesh.outgoing(v).any(|h| taken.contains(&topology.mesh.target(h)));
        corners.retain(|&v| v == from || !(taken.contains(&v) || self.on_curve[v.index()] || beside(v)));
        self.sort_by_rest_distance(&mut corners, position);
        for to in corners {
            let path = edge_path(&topology.mesh, strip, from, to, |v| taken.contains(&v));
            if path.is_some_and(|path| self.move_to_vertex(topology, node, (&path, to), position)) {
                return true;
            }
        }
        false
    }

    /// The topologies with a node put at a crossing by one of the corners of its triangle, in order of how far the
    /// corner moves. A crossing on an edge for which `is_feature` holds is put there by an end of that edge.
    pub(super) fn put_at<'n>(
        &'n self,
        topology: &'n EmbeddingTopology,
        node: usize,
        at: &'n CrossingPoint,
        is_feature: impl Fn(HalfedgeId) -> bool,
    ) -> impl Iterator<Item = EmbeddingTopology> + 'n {
        let from = topology.nodes[node].vertex;
        let sides = topology.mesh.face_halfedges(at.face);
        let position = self.index.nearest(at.position).position(self.surface);
        let taken: Vec<VertexId> = topology.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
        let on = (0..3).find(|&k| at.weights[(k + 2) % 3] == 0.0 && is_feature(sides[k])).map(|k| sides[k]);
        let allowed = |v: VertexId| match on {
            Some(h) => {
                (v == topology.mesh.origin(h) || v == topology.mesh.target(h))
                    && self.curve_edges(&topology.mesh, v).len() == 2
            }
            None => !topology.mesh.outgoing(v).any(&is_feature) && !topology.mesh.is_boundary_vertex(v),
        };
        let mut list = topology.mesh.face_vertices(at.face).to_vec();
        list.retain(|v| allowed(*v) && !taken.contains(v));
        self.sort_by_rest_distance(&mut list, position);
        list.into_iter().filter_map(move |to| {
            let path = edge_path(&topology.mesh, &at.strip, from, to, |v| taken.contains(&v))?;
            let mut moved = topology.clone();
            self.move_to_vertex(&mut moved, node, (&path, to), position).then_some(moved)
        })
    }

    /// Sorts vertices by the distance of their rest positions to `position`.
    fn sort_by_rest_distance(&self, vertices: &mut [VertexId], position: DVec3) {
        let distance = |v: &VertexId| self.rest_position[v.index()].distance(position);
        vertices.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    }

    /// Moves a node along a path of edges to the vertex `to`, which is put at `position`. Returns whether the triangles
    /// around allow that; if not, nothing changes.
    fn move_to_vertex(
        &self,
        topology: &mut EmbeddingTopology,
        node: usize,
        (path, to): (&[HalfedgeId], VertexId),
        position: DVec3,
    ) -> bool {
        let from = topology.nodes[node].vertex;
        let old = topology.mesh.position(from);
        let before = self.triangles_at_rest(&topology.mesh, from, to);
        topology.mesh.set_position(from, self.rest_position[from.index()]);
        topology.mesh.set_position(to, position);
        if are_sound(&topology.mesh, &before) {
            path.iter().for_each(|&h| topology.move_node(node, h));
            return true;
        }
        topology.mesh.set_position(to, self.rest_position[to.index()]);
        topology.mesh.set_position(from, old);
        false
    }

    /// The triangles around two vertices at rest.
    fn triangles_at_rest(&self, mesh: &TriMesh, a: VertexId, b: VertexId) -> Vec<TriangleAtRest> {
        let mut faces: Vec<FaceId> = [a, b].iter().flat_map(|&v| mesh.outgoing(v).map(|h| mesh.face(h))).collect();
        faces.sort_unstable();
        faces.dedup();
        let at = |v: VertexId| if v == a || v == b { self.rest_position[v.index()] } else { mesh.position(v) };
        faces
            .into_iter()
            .map(|f| {
                let (area, longest) = area_and_longest(mesh.face_vertices(f).map(at));
                TriangleAtRest { face: f, normal: area.normalize_or_zero(), thickness: area.length() / longest }
            })
            .collect()
    }

    /// Moves a node along its curve by `length`, in the sense that agrees most with `direction`; returns the length
    /// moved. It stops half an edge before a corner or another node.
    pub(super) fn move_along_curve(
        &self,
        topology: &mut EmbeddingTopology,
        node: usize,
        direction: DVec3,
        length: f64,
    ) -> f64 {
        let mut left = length;
        let mut at = topology.mesh.position(topology.nodes[node].vertex);
        let mut v = topology.nodes[node].vertex;
        let mut path: Vec<HalfedgeId> = Vec::new();
        let mut last: Option<VertexId> = None;
        let mut heading = direction;
        loop {
            let ends = self.curve_edges(&topology.mesh, v);
            let onward = ends.into_iter().filter(|&(_, w)| Some(w) != last).max_by(|a, b| {
                let cosine = |w: VertexId| (self.rest_position[w.index()] - at).normalize_or_zero().dot(heading);
                cosine(a.1).total_cmp(&cosine(b.1))
            });
            let Some((h, w)) = onward else { break };
            let goal = self.rest_position[w.index()];
            let stretch = goal.distance(at);
            let taken = topology.nodes.iter().any(|n| n.vertex == w);
            let corner = self.curve_edges(&topology.mesh, w).len() != 2;
            if left <= stretch || taken || corner {
                // The position lies between `v` and `w`: the node goes to the nearer one that it may have.
                let most = if taken || corner { 0.5 * stretch } else { stretch };
                let position = at + (goal - at).normalize_or_zero() * left.min(most);
                let free = !(taken || corner);
                let nearer =
                    self.rest_position[w.index()].distance(position) < self.rest_position[v.index()].distance(position);
                if free && nearer {
                    path.push(h);
                }
                let to = if free && nearer { w } else { v };
                let moved = self.move_to_vertex(topology, node, (&path, to), position);
                return if moved { length - left + left.min(most) } else { 0.0 };
            }
            path.push(h);
            left -= stretch;
            heading = (goal - at).normalize_or_zero();
            at = goal;
            (last, v) = (Some(v), w);
            if path.len() > topology.mesh.n_edges() {
                break;
            }
        }
        0.0
    }

    /// The curve edges at a vertex: a half-edge of each (leaving `v` where there is one) and the other end.
    fn curve_edges(&self, mesh: &TriMesh, v: VertexId) -> Vec<(HalfedgeId, VertexId)> {
        let mut ends: Vec<_> =
            mesh.outgoing(v).filter(|&h| self.curve[mesh.edge(h).index()]).map(|h| (h, mesh.target(h))).collect();
        if mesh.is_boundary_vertex(v) {
            let h = mesh.incoming_boundary(v);
            ends.push((h, mesh.origin(h)));
        }
        ends
    }
}

/// The triangles from `first` across the half-edges `crossed`.
fn strip(mesh: &TriMesh, first: FaceId, crossed: &[HalfedgeId]) -> Vec<FaceId> {
    let mut faces = vec![first];
    faces.extend(crossed.iter().filter_map(|&h| mesh.twin(h)).map(|t| mesh.face(t)));
    faces
}

/// A shortest path of edges within a strip of triangles that avoids the boundary and vertices that are `taken`.
pub(super) fn edge_path(
    mesh: &TriMesh,
    strip: &[FaceId],
    from: VertexId,
    to: VertexId,
    taken: impl Fn(VertexId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let mut spokes: HashMap<VertexId, Vec<HalfedgeId>> = HashMap::new();
    for &f in strip {
        for h in mesh.face_halfedges(f) {
            spokes.entry(mesh.origin(h)).or_default().push(h);
            if let Some(t) = mesh.twin(h) {
                spokes.entry(mesh.origin(t)).or_default().push(t);
            }
        }
    }
    let mut search = BreadthFirst::sparse();
    search.start(from);
    while let Some(v) = search.visit().filter(|&v| v != to) {
        for &h in spokes.get(&v).into_iter().flatten() {
            let w = mesh.target(h);
            if !taken(w) && !mesh.is_boundary_vertex(w) {
                search.reach(w, h);
            }
        }
    }
    search.path_to(to, |&h| mesh.origin(h))
}

/// A triangle with its corners at their rest positions.
struct TriangleAtRest {
    face: FaceId,
    normal: DVec3,
    /// Its doubled area over its squared longest side.
    thickness: f64,
}

/// Whether no triangle is flipped or much thinner than at rest.
fn are_sound(mesh: &TriMesh, before: &[TriangleAtRest]) -> bool {
    before.iter().all(|&TriangleAtRest { face, normal, thickness }| {
        let (area, longest) = area_and_longest(mesh.face_vertices(face).map(|v| mesh.position(v)));
        let upright = area.dot(normal) > MIN_NORMAL_COSINE * area.length();
        // A triangle that is degenerate at rest has no normal to compare with.
        normal == DVec3::ZERO || (upright && area.length() > MIN_THICKNESS.min(0.5 * thickness) * longest)
    })
}

/// The normal of a triangle, with its doubled area for length, and its squared longest side.
fn area_and_longest([a, b, c]: [DVec3; 3]) -> (DVec3, f64) {
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    ((b - a).cross(c - a), longest)
}
