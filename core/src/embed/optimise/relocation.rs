//! Putting a node somewhere on the surface (Campen, section 6.5.1).
//!
//! A node must be a vertex, but its place is continuous: one of the corners of the triangle it comes to lie in is put
//! there, the one that has to move least, and goes back where it was once the node leaves it. Nothing is inserted and
//! no connection changes. The place is always a point of the surface itself.

use std::collections::{HashMap, VecDeque};

use glam::{DVec2, DVec3};

use crate::embed::optimise::regular_nodes::Crossing;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;
use crate::surface::{SurfaceIndex, trace_geodesic};

/// How often a step that is not possible is halved before the node stays.
const HALVINGS: usize = 4;
/// Doubled area over squared longest side below which triangles around a node may not become thinner than by half: the
/// map's gradients there mean little.
const THIN: f64 = 0.02;
/// Least cosine between normals of triangles before and after.
const TILT: f64 = 0.2;

/// What holds a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeConstraint {
    /// Nothing: it moves freely on the surface.
    Free,
    /// It slides along a feature or the boundary.
    Curve,
    /// It stays.
    Fixed,
}

/// Where nodes may go.
pub(in crate::embed) struct SurfaceProjection<'a> {
    /// The surface.
    pub surface: &'a TriMesh,
    /// Its points by nearness.
    pub index: &'a SurfaceIndex,
    /// Where every vertex is when no node is there.
    pub home: Vec<DVec3>,
    /// Whether each edge of the working mesh is sharp or on the boundary.
    pub curve: Vec<bool>,
    /// Whether each vertex is on such an edge.
    pub on_curve: Vec<bool>,
    /// What holds each node.
    pub hold: Vec<NodeConstraint>,
    /// How close irregular nodes may come to each other.
    pub apart: f64,
}

impl SurfaceProjection<'_> {
    /// Moves a free node in polar direction and length `step`; returns how far it got.
    pub(in crate::embed) fn glide(
        &self,
        net: &mut EmbeddingTopology,
        metric: &Metric,
        node: usize,
        step: DVec2,
        cell: &[u32],
    ) -> f64 {
        let v = net.nodes[node].vertex;
        let mut length = step.length();
        for _ in 0..=HALVINGS {
            let trace = trace_geodesic(&net.mesh, metric, v, step.to_angle().rem_euclid(std::f64::consts::TAU), length);
            let own = net.mesh.face_vertices(trace.end.face).iter().any(|w| cell[w.index()] == node as u32);
            let place = self.index.nearest(trace.end.position(&net.mesh)).position(self.surface);
            if !trace.hit_boundary && own && self.keeps_apart(net, node, place) {
                let strip = strip(&net.mesh, trace.first, &trace.crossed);
                if self.settle(net, node, place, trace.end.face, &strip) {
                    return length;
                }
            }
            length *= 0.5;
        }
        0.0
    }

    /// Whether a node at `place` is far enough from the others, or at least no closer than it was. Irregular nodes that
    /// come close together circle each other and wind up their arcs.
    fn keeps_apart(&self, net: &EmbeddingTopology, node: usize, place: DVec3) -> bool {
        let old = net.mesh.position(net.nodes[node].vertex);
        net.nodes[node].is_regular()
            || net.nodes.iter().enumerate().filter(|&(i, n)| i != node && !n.is_regular()).all(|(_, n)| {
                let other = net.mesh.position(n.vertex);
                let (before, after) = (other.distance(old), other.distance(place));
                after > before || after > self.apart
            })
    }

    /// Puts the node at `place` in `face`, by one of its corners; nothing changes if none will do.
    fn settle(&self, net: &mut EmbeddingTopology, node: usize, place: DVec3, face: FaceId, strip: &[FaceId]) -> bool {
        let from = net.nodes[node].vertex;
        let taken: Vec<VertexId> = net.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
        let mut corners: Vec<VertexId> = net.mesh.face_vertices(face).to_vec();
        // A triangle with nodes at two corners has little choice in the map, one with three none at all.
        let beside = |v: VertexId| net.mesh.outgoing(v).any(|h| taken.contains(&net.mesh.target(h)));
        corners.retain(|&v| v == from || !(taken.contains(&v) || self.on_curve[v.index()] || beside(v)));
        corners.sort_by(|a, b| self.home[a.index()].distance(place).total_cmp(&self.home[b.index()].distance(place)));
        for to in corners {
            let path = edge_path(&net.mesh, strip, from, to, |v| taken.contains(&v));
            if path.is_some_and(|path| self.bring(net, node, (&path, to), place)) {
                return true;
            }
        }
        false
    }

    /// The net with a node put at a crossing by one of the corners of its triangle, those first that have to move least; on
    /// a feature that is `held` by an end of that edge.
    pub(in crate::embed) fn put_at<'n>(
        &'n self,
        net: &'n EmbeddingTopology,
        node: usize,
        at: &'n Crossing,
        held: impl Fn(HalfedgeId) -> bool,
    ) -> impl Iterator<Item = EmbeddingTopology> + 'n {
        let from = net.nodes[node].vertex;
        let sides = net.mesh.face_halfedges(at.face);
        let place = self.index.nearest(at.place).position(self.surface);
        let taken: Vec<VertexId> = net.nodes.iter().map(|n| n.vertex).filter(|&v| v != from).collect();
        let on = (0..3).find(|&k| at.weights[(k + 2) % 3] == 0.0 && held(sides[k])).map(|k| sides[k]);
        let allowed = |v: VertexId| match on {
            Some(h) => (v == net.mesh.origin(h) || v == net.mesh.target(h)) && self.along(&net.mesh, v).len() == 2,
            None => !net.mesh.outgoing(v).any(&held) && !net.mesh.is_boundary_vertex(v),
        };
        let mut list = net.mesh.face_vertices(at.face).to_vec();
        list.retain(|v| allowed(*v) && !taken.contains(v));
        list.sort_by(|a, b| self.home[a.index()].distance(place).total_cmp(&self.home[b.index()].distance(place)));
        list.into_iter().filter_map(move |to| {
            let path = edge_path(&net.mesh, &at.strip, from, to, |v| taken.contains(&v))?;
            let mut moved = net.clone();
            self.bring(&mut moved, node, (&path, to), place).then_some(moved)
        })
    }

    /// Brings a node along edges to a vertex that is put at `place`; nothing changes if triangles would suffer.
    fn bring(
        &self,
        net: &mut EmbeddingTopology,
        node: usize,
        (path, to): (&[HalfedgeId], VertexId),
        place: DVec3,
    ) -> bool {
        let from = net.nodes[node].vertex;
        let old = net.mesh.position(from);
        let before = self.at_rest(&net.mesh, from, to);
        net.mesh.set_position(from, self.home[from.index()]);
        net.mesh.set_position(to, place);
        if sound(&net.mesh, &before) {
            path.iter().for_each(|&h| net.move_node(node, h));
            return true;
        }
        net.mesh.set_position(to, self.home[to.index()]);
        net.mesh.set_position(from, old);
        false
    }

    /// The triangles around two vertices as they are when no node is there.
    fn at_rest(&self, mesh: &TriMesh, a: VertexId, b: VertexId) -> Vec<AtRest> {
        let mut faces: Vec<FaceId> = [a, b].iter().flat_map(|&v| mesh.outgoing(v).map(|h| mesh.face(h))).collect();
        faces.sort_unstable();
        faces.dedup();
        let at = |v: VertexId| if v == a || v == b { self.home[v.index()] } else { mesh.position(v) };
        faces
            .into_iter()
            .map(|f| {
                let (area, longest) = spread(mesh.face_vertices(f).map(at));
                AtRest { face: f, normal: area.normalize_or_zero(), width: area.length() / longest }
            })
            .collect()
    }

    /// Slides a node along its curve by `length`, the way that agrees most with `direction`; returns how far it got.
    pub(in crate::embed) fn slide(
        &self,
        net: &mut EmbeddingTopology,
        node: usize,
        direction: DVec3,
        length: f64,
    ) -> f64 {
        let mut left = length;
        let mut at = net.mesh.position(net.nodes[node].vertex);
        let mut v = net.nodes[node].vertex;
        let mut path: Vec<HalfedgeId> = Vec::new();
        let mut last: Option<VertexId> = None;
        let mut heading = direction;
        loop {
            let ends = self.along(&net.mesh, v);
            let onward = ends.into_iter().filter(|&(_, w)| Some(w) != last).max_by(|a, b| {
                let cosine = |w: VertexId| (self.home[w.index()] - at).normalize_or_zero().dot(heading);
                cosine(a.1).total_cmp(&cosine(b.1))
            });
            let Some((h, w)) = onward else { break };
            let goal = self.home[w.index()];
            let stretch = goal.distance(at);
            let taken = net.nodes.iter().any(|n| n.vertex == w);
            let corner = self.along(&net.mesh, w).len() != 2;
            if left <= stretch || taken || corner {
                // Between `v` and `w`: whichever is nearer by its own place takes the node, if it may.
                let most = if taken || corner { 0.5 * stretch } else { stretch };
                let place = at + (goal - at).normalize_or_zero() * left.min(most);
                let free = !(taken || corner);
                let nearer = self.home[w.index()].distance(place) < self.home[v.index()].distance(place);
                if free && nearer {
                    path.push(h);
                }
                return self.put(net, node, &path, place, length - left + left.min(most));
            }
            path.push(h);
            left -= stretch;
            heading = (goal - at).normalize_or_zero();
            at = goal;
            (last, v) = (Some(v), w);
            if path.len() > net.mesh.n_edges() {
                break;
            }
        }
        0.0
    }

    fn put(&self, net: &mut EmbeddingTopology, node: usize, path: &[HalfedgeId], place: DVec3, moved: f64) -> f64 {
        let from = net.nodes[node].vertex;
        let mut to = from;
        for &h in path {
            to = if net.mesh.origin(h) == to { net.mesh.target(h) } else { net.mesh.origin(h) };
        }
        let old = net.mesh.position(from);
        let before = self.at_rest(&net.mesh, from, to);
        net.mesh.set_position(from, self.home[from.index()]);
        net.mesh.set_position(to, place);
        if sound(&net.mesh, &before) {
            for &h in path {
                net.move_node(node, h);
            }
            return moved;
        }
        net.mesh.set_position(to, self.home[to.index()]);
        net.mesh.set_position(from, old);
        0.0
    }

    /// The curve edges at a vertex: a half-edge of each (leaving `v` where there is one) and the other end.
    fn along(&self, mesh: &TriMesh, v: VertexId) -> Vec<(HalfedgeId, VertexId)> {
        let mut ends: Vec<_> =
            mesh.outgoing(v).filter(|&h| self.curve[mesh.edge(h).index()]).map(|h| (h, mesh.target(h))).collect();
        if mesh.is_boundary_vertex(v) {
            let h = mesh.incoming_boundary(v);
            ends.push((h, mesh.origin(h)));
        }
        ends
    }
}

/// The triangles from `first` across `crossed`.
fn strip(mesh: &TriMesh, first: FaceId, crossed: &[HalfedgeId]) -> Vec<FaceId> {
    let mut faces = vec![first];
    faces.extend(crossed.iter().filter_map(|&h| mesh.twin(h)).map(|t| mesh.face(t)));
    faces
}

/// A path of half-edges within a strip of triangles that avoids vertices that are `taken` and the boundary.
pub(in crate::embed) fn edge_path(
    mesh: &TriMesh,
    strip: &[FaceId],
    from: VertexId,
    to: VertexId,
    taken: impl Fn(VertexId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let mut reached: HashMap<VertexId, HalfedgeId> = HashMap::new();
    let mut queue = VecDeque::from([from]);
    let mut spokes: HashMap<VertexId, Vec<HalfedgeId>> = HashMap::new();
    for &f in strip {
        for h in mesh.face_halfedges(f) {
            spokes.entry(mesh.origin(h)).or_default().push(h);
            if let Some(t) = mesh.twin(h) {
                spokes.entry(mesh.origin(t)).or_default().push(t);
            }
        }
    }
    while let Some(v) = queue.pop_front() {
        if v == to {
            break;
        }
        for &h in spokes.get(&v).into_iter().flatten() {
            let w = mesh.target(h);
            let free = !taken(w) && !mesh.is_boundary_vertex(w);
            if w != from && free && !reached.contains_key(&w) {
                reached.insert(w, h);
                queue.push_back(w);
            }
        }
    }
    let mut path = Vec::new();
    let mut at = to;
    while at != from {
        let &h = reached.get(&at)?;
        path.push(h);
        at = mesh.origin(h);
    }
    path.reverse();
    Some(path)
}

/// A triangle when no node is at its corners.
struct AtRest {
    face: FaceId,
    normal: DVec3,
    /// Its doubled area over the square of its longest side.
    width: f64,
}

/// Whether triangles are neither turned over nor squashed against what they were.
fn sound(mesh: &TriMesh, before: &[AtRest]) -> bool {
    before.iter().all(|&AtRest { face, normal, width }| {
        let (area, longest) = spread(mesh.face_vertices(face).map(|v| mesh.position(v)));
        let upright = area.dot(normal) > TILT * area.length();
        // A triangle that was degenerate before says nothing.
        normal == DVec3::ZERO || (upright && area.length() > THIN.min(0.5 * width) * longest)
    })
}

/// The normal of a triangle, as long as its doubled area, and the square of its longest side.
fn spread([a, b, c]: [DVec3; 3]) -> (DVec3, f64) {
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    ((b - a).cross(c - a), longest)
}
