//! The cut graph: cuts along which a cross field becomes a pair of vector fields.
//!
//! A spanning tree of the dual graph joins all triangles; the edges that the tree does not cross are cut. Cuts with a
//! free end that is neither a node nor on the boundary are removed. The remaining cuts run between nodes and boundaries
//! and around handles. The tree is chosen to keep the cuts short: edges far from a shortest-path forest, rooted at
//! nodes and boundaries, are crossed first (Erickson and Whittlesey, greedy system of loops). If all singularities are
//! nodes, no loop in the cut surface encloses one. Then the crosses can be combed: turned so that all period jumps off
//! the cuts vanish. Where the cuts run affects the cost of solving but not the map.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::ParamError;
use crate::field::{CrossField, Step};
use crate::mesh::{Dijkstra, EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};

/// Entry of [`CutGraph::path`] for an edge that is not cut.
const NO_PATH: (u32, bool) = (u32::MAX, false);

/// The cut graph of a surface, with combed crosses.
#[derive(Debug, Clone)]
pub struct CutGraph {
    /// Quarter turns from each triangle's cross angle to its first chart axis.
    pub turn: Vec<i32>,
    /// The wedge of each corner (of each half-edge's origin): the corners of a vertex that no cut separates.
    pub wedge: Vec<u32>,
    /// Number of wedges.
    pub n_wedges: usize,
    /// One triangle of each component of the surface.
    pub roots: Vec<FaceId>,
    /// The cuts, divided at nodes, boundary vertices and branch points.
    pub paths: Vec<CutPath>,
    /// For each edge its path and whether the path runs in the direction of [`TriMesh::halfedge`].
    path: Vec<(u32, bool)>,
}

/// A cut without branch points.
#[derive(Debug, Clone)]
pub struct CutPath {
    /// Consecutive edges.
    pub steps: Vec<Step>,
    /// Period jump of the combed crosses from the left to the right side, 0 to 3.
    pub jump: i32,
}

impl CutGraph {
    /// Cuts `mesh` for the period jumps of `field`. The cuts reach all of `nodes`, which must include all
    /// singularities.
    ///
    /// # Errors
    ///
    /// [`ParamError::Topology`] if a singularity is not among the nodes.
    pub fn new(mesh: &TriMesh, field: &CrossField, nodes: &[VertexId]) -> Result<Self, ParamError> {
        let mut is_node = vec![false; mesh.n_vertices()];
        for v in nodes {
            is_node[v.index()] = true;
        }
        let (uncrossed, turn, roots) = comb(mesh, field, &is_node);
        let is_cut = prune(mesh, uncrossed, &is_node);
        let combed = |h: HalfedgeId| {
            let beyond = mesh.twin(h).map_or(0, |t| turn[t.index() / 3] - turn[h.index() / 3]);
            (field.jump_across(mesh, h) + beyond).rem_euclid(4)
        };
        let inside = |e: EdgeId| !is_cut[e.index()] && !mesh.is_boundary_edge(e);
        if let Some(edge) = mesh.edges().find(|&e| inside(e) && combed(mesh.halfedge(e)) != 0) {
            return Err(ParamError::Topology { edge });
        }
        let (wedge, n_wedges) = wedges(mesh, &is_cut);
        let mut paths = Vec::new();
        let mut path = vec![NO_PATH; mesh.n_edges()];
        for steps in cut_paths(mesh, &is_cut, &is_node) {
            let jump = |s: Step| s.left(mesh).map_or(0, combed);
            let first = jump(steps[0]);
            if let Some(s) = steps.iter().find(|&&s| jump(s) != first) {
                return Err(ParamError::Topology { edge: s.edge });
            }
            for s in &steps {
                path[s.edge.index()] = (paths.len() as u32, s.forward);
            }
            paths.push(CutPath { steps, jump: first });
        }
        Ok(Self { turn, wedge, n_wedges, roots, paths, path })
    }

    /// The cut on the edge of `h`, as a position in [`Self::paths`], and whether `h` lies to its left.
    pub fn crossing(&self, mesh: &TriMesh, h: HalfedgeId) -> Option<(usize, bool)> {
        let e = mesh.edge(h);
        let (path, forward) = self.path[e.index()];
        (path != NO_PATH.0).then(|| (path as usize, forward == (mesh.halfedge(e) == h)))
    }
}

/// Builds the dual spanning forest and combs the crosses along it. Returns whether each edge is not crossed, the
/// turns and the roots.
fn comb(mesh: &TriMesh, field: &CrossField, is_node: &[bool]) -> (Vec<bool>, Vec<i32>, Vec<FaceId>) {
    let priority = crossing_priority(mesh, is_node);
    let mut uncrossed: Vec<bool> = mesh.edges().map(|e| !mesh.is_boundary_edge(e)).collect();
    let mut turn = vec![0; mesh.n_faces()];
    let mut reached = vec![false; mesh.n_faces()];
    let mut roots = Vec::new();
    let mut queue = BinaryHeap::new();
    for root in mesh.faces() {
        if reached[root.index()] {
            continue;
        }
        reached[root.index()] = true;
        roots.push(root);
        let push = |queue: &mut BinaryHeap<_>, f: FaceId| {
            for h in mesh.face_halfedges(f) {
                let e = mesh.edge(h);
                queue.push((priority[e.index()].to_bits(), Reverse(e), h));
            }
        };
        push(&mut queue, root);
        while let Some((_, Reverse(e), h)) = queue.pop() {
            let Some(g) = mesh.twin(h).map(|t| mesh.face(t)).filter(|g| !reached[g.index()]) else { continue };
            reached[g.index()] = true;
            uncrossed[e.index()] = false;
            turn[g.index()] = (turn[mesh.face(h).index()] - field.jump_across(mesh, h)).rem_euclid(4);
            push(&mut queue, g);
        }
    }
    (uncrossed, turn, roots)
}

/// Priority of crossing each edge, high first: the length of the loop that the edge closes in the forest of shortest
/// paths from nodes and boundaries; 0 for edges of the forest.
fn crossing_priority(mesh: &TriMesh, is_node: &[bool]) -> Vec<f64> {
    let mut search = Dijkstra::new(mesh.n_vertices());
    for v in mesh.vertices().filter(|&v| is_node[v.index()] || mesh.is_boundary_vertex(v)) {
        search.start(v, 0.0);
    }
    for start in mesh.vertices() {
        // The first pass searches from all nodes and boundaries. Later passes only reach components without them.
        while let Some((v, distance)) = search.settle() {
            for (h, w) in mesh.spokes(v) {
                search.reach(w, distance + mesh.vector(h).length(), h);
            }
        }
        if search.distance(start).is_infinite() {
            search.start(start, 0.0);
        }
    }
    let mut priority: Vec<f64> = mesh
        .edges()
        .map(|e| {
            let [a, b] = mesh.edge_vertices(e);
            let ends = search.distance(a) + search.distance(b);
            if ends.is_finite() { ends + mesh.edge_length(e) } else { 0.0 }
        })
        .collect();
    for h in mesh.vertices().filter_map(|v| search.via(v)) {
        priority[mesh.edge(h).index()] = 0.0;
    }
    priority
}

/// Removes cuts that end at a vertex which is neither a node nor on the boundary.
fn prune(mesh: &TriMesh, mut is_cut: Vec<bool>, is_node: &[bool]) -> Vec<bool> {
    let mut degree = vec![0u32; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| is_cut[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    let is_loose_end =
        |v: VertexId, degree: &[u32]| degree[v.index()] == 1 && !is_node[v.index()] && !mesh.is_boundary_vertex(v);
    let mut stack: Vec<VertexId> = mesh.vertices().filter(|&v| is_loose_end(v, &degree)).collect();
    while let Some(v) = stack.pop() {
        let spokes = mesh.outgoing(v).map(|h| mesh.edge(h));
        let Some(e) = spokes.into_iter().find(|e| is_cut[e.index()]) else { continue };
        is_cut[e.index()] = false;
        for w in mesh.edge_vertices(e) {
            degree[w.index()] -= 1;
            if is_loose_end(w, &degree) {
                stack.push(w);
            }
        }
    }
    is_cut
}

/// Numbers the wedges: the groups of corners of each vertex between cuts.
fn wedges(mesh: &TriMesh, is_cut: &[bool]) -> (Vec<u32>, usize) {
    let mut wedge = vec![0; mesh.n_halfedges()];
    let mut count = 0u32;
    for v in mesh.vertices() {
        let fan: Vec<_> = mesh.outgoing(v).collect();
        let first = fan.iter().position(|&h| is_cut[mesh.edge(h).index()]).unwrap_or(0);
        // At the boundary the fan is a chain from its first half-edge; inside it is a cycle that starts behind a cut.
        let first = if mesh.is_boundary_vertex(v) { 0 } else { first };
        for i in 0..fan.len() {
            let h = fan[(first + i) % fan.len()];
            if i > 0 && is_cut[mesh.edge(h).index()] {
                count += 1;
            }
            wedge[h.index()] = count;
        }
        count += 1;
    }
    (wedge, count as usize)
}

/// The cut edges as paths, divided at nodes, boundary vertices and vertices where not exactly two cut edges meet.
fn cut_paths(mesh: &TriMesh, is_cut: &[bool], is_node: &[bool]) -> Vec<Vec<Step>> {
    let mut at: Vec<Vec<Step>> = vec![Vec::new(); mesh.n_vertices()];
    for edge in mesh.edges().filter(|e| is_cut[e.index()]) {
        let step = Step { edge, forward: true };
        at[step.from(mesh).index()].push(step);
        at[step.to(mesh).index()].push(step.reversed());
    }
    let ends = |v: VertexId| at[v.index()].len() != 2 || is_node[v.index()] || mesh.is_boundary_vertex(v);
    let mut used = vec![false; mesh.n_edges()];
    let mut paths = Vec::new();
    // Start from division points first; the cut edges then left are cycles.
    let starts = mesh.vertices().filter(|&v| ends(v)).chain(mesh.vertices());
    for &first in starts.flat_map(|v| at[v.index()].iter()) {
        if used[first.edge.index()] {
            continue;
        }
        let mut steps = Vec::new();
        let mut next = Some(first);
        while let Some(step) = next {
            used[step.edge.index()] = true;
            steps.push(step);
            let v = step.to(mesh);
            next = if ends(v) { None } else { at[v.index()].iter().find(|s| !used[s.edge.index()]).copied() };
        }
        paths.push(steps);
    }
    paths
}
