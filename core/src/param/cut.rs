//! Cutting a surface so that a cross field becomes a pair of vector fields.
//!
//! A spanning tree of the triangles says where not to cut; of the other edges those are closed again that lead to
//! nothing, so that the rest runs between nodes, boundaries and around handles. The tree is chosen such that these
//! cuts are short (Erickson and Whittlesey's greedy system of loops, with all nodes and boundaries as its base):
//! crossed first are the edges far from a shortest path forest. All singularities being nodes, on what remains none
//! can be circled, hence the crosses of all triangles can be turned so that all period jumps vanish
//! but those on the cuts. The result of a map does not depend on where the cuts run, only its cost does.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::ParamError;
use crate::field::{CrossField, Step};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};

/// For an edge that is not cut.
const NO_PATH: (u32, bool) = (u32::MAX, false);

/// A cut surface with combed crosses.
#[derive(Debug, Clone)]
pub struct Cut {
    /// Quarter turns from each triangle's cross angle to its first chart axis.
    pub turn: Vec<i32>,
    /// The chart vertex of each corner (of each half-edge's origin): corners of one vertex that no cut separates.
    pub wedge: Vec<u32>,
    /// Number of chart vertices.
    pub n_wedges: usize,
    /// A triangle of each component.
    pub roots: Vec<FaceId>,
    /// The cuts between nodes, boundaries and forks.
    pub paths: Vec<CutPath>,
    /// For each edge the path it is on and whether in the direction of [`TriMesh::halfedge`].
    path: Vec<(u32, bool)>,
}

/// A cut without forks.
#[derive(Debug, Clone)]
pub struct CutPath {
    /// Consecutive edges.
    pub steps: Vec<Step>,
    /// Period jump from its left to its right side, between combed crosses, 0 to 3.
    pub jump: i32,
}

impl Cut {
    /// Cuts `mesh` for the period jumps of `field`, such that the cuts reach all of `nodes`, among which all
    /// singularities must be.
    ///
    /// # Errors
    ///
    /// [`ParamError::Topology`] if a singularity is not among the nodes.
    pub fn new(mesh: &TriMesh, field: &CrossField, nodes: &[VertexId]) -> Result<Self, ParamError> {
        let mut is_node = vec![false; mesh.n_vertices()];
        for v in nodes {
            is_node[v.index()] = true;
        }
        let (crossed, turn, roots) = comb(mesh, field, &is_node);
        let is_cut = prune(mesh, crossed, &is_node);
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

    /// The cut that crossing `h` leads across, as a position in [`Self::paths`], and whether from its left.
    pub fn crossing(&self, mesh: &TriMesh, h: HalfedgeId) -> Option<(usize, bool)> {
        let e = mesh.edge(h);
        let (path, forward) = self.path[e.index()];
        (path != NO_PATH.0).then(|| (path as usize, forward == (mesh.halfedge(e) == h)))
    }
}

/// Spans the triangles and combs the crosses along the tree: the edges not crossed, the turns and the roots.
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

/// How early each edge is to be crossed: by the length of the loop it closes in a forest of shortest paths from
/// nodes and boundaries; edges of the forest last.
fn crossing_priority(mesh: &TriMesh, is_node: &[bool]) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; mesh.n_vertices()];
    let mut parent: Vec<Option<EdgeId>> = vec![None; mesh.n_vertices()];
    let mut queue = BinaryHeap::new();
    for v in mesh.vertices().filter(|&v| is_node[v.index()] || mesh.is_boundary_vertex(v)) {
        distance[v.index()] = 0.0;
        queue.push(Reverse((0u64, v)));
    }
    for start in mesh.vertices() {
        // The first round spends the queue; later ones only meet components without a base.
        while let Some(Reverse((bits, v))) = queue.pop() {
            if f64::from_bits(bits) > distance[v.index()] {
                continue;
            }
            for h in mesh.outgoing(v).flat_map(|h| [h, mesh.prev(h)]) {
                let w = if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) };
                let far = f64::from_bits(bits) + mesh.vector(h).length();
                if far < distance[w.index()] {
                    distance[w.index()] = far;
                    parent[w.index()] = Some(mesh.edge(h));
                    queue.push(Reverse((far.to_bits(), w)));
                }
            }
        }
        if distance[start.index()].is_infinite() {
            distance[start.index()] = 0.0;
            queue.push(Reverse((0, start)));
        }
    }
    let mut priority: Vec<f64> = mesh
        .edges()
        .map(|e| {
            let [a, b] = mesh.edge_vertices(e);
            let ends = distance[a.index()] + distance[b.index()];
            if ends.is_finite() { ends + mesh.edge_length(e) } else { 0.0 }
        })
        .collect();
    for e in parent.into_iter().flatten() {
        priority[e.index()] = 0.0;
    }
    priority
}

/// Closes the cuts that end at a vertex which is neither a node nor on the boundary.
fn prune(mesh: &TriMesh, mut is_cut: Vec<bool>, is_node: &[bool]) -> Vec<bool> {
    let mut degree = vec![0u32; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| is_cut[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    let leads_nowhere =
        |v: VertexId, degree: &[u32]| degree[v.index()] == 1 && !is_node[v.index()] && !mesh.is_boundary_vertex(v);
    let mut stack: Vec<VertexId> = mesh.vertices().filter(|&v| leads_nowhere(v, &degree)).collect();
    while let Some(v) = stack.pop() {
        let spokes = mesh.outgoing(v).map(|h| mesh.edge(h));
        let Some(e) = spokes.into_iter().find(|e| is_cut[e.index()]) else { continue };
        is_cut[e.index()] = false;
        for w in mesh.edge_vertices(e) {
            degree[w.index()] -= 1;
            if leads_nowhere(w, &degree) {
                stack.push(w);
            }
        }
    }
    is_cut
}

/// Numbers the groups of corners at each vertex that the cuts leave together.
fn wedges(mesh: &TriMesh, is_cut: &[bool]) -> (Vec<u32>, usize) {
    let mut wedge = vec![0; mesh.n_halfedges()];
    let mut count = 0u32;
    for v in mesh.vertices() {
        let fan: Vec<_> = mesh.outgoing(v).collect();
        let first = fan.iter().position(|&h| is_cut[mesh.edge(h).index()]).unwrap_or(0);
        // At the boundary the fan is a chain from its first half-edge, else a cycle that starts behind a cut.
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

/// The cut edges as paths between vertices where not exactly two of them meet, or which are nodes.
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
    // From all nodes first; what is then left are cycles without nodes.
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
