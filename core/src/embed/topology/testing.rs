//! A net for tests of what is done to nets.

use std::collections::VecDeque;

use crate::dual::Arrangement;
use crate::embed::EmbeddingTopology;
use crate::embed::arc_headings;
use crate::embed::topology::period_jumps::vertex_index;
use crate::layout::{QuadLayout, embed};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::Metric;
use crate::testing::{column, row, torus};

/// A layout of two by two patches on a torus, whose first node is given the index of a node of valence 3 and whose
/// second that of one of valence 5, with jumps along edges from one to the other.
pub fn net() -> EmbeddingTopology {
    let mesh = torus(24, 12);
    let mut curves = vec![row(24, 1, true, 0.4), row(24, 7, true, 0.4)];
    curves.extend([3, 14].map(|i| column(24, 12, i, true, 0.6)));
    let arrangement = Arrangement::new(&mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
    let initial_embedding = embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
    let mut net = EmbeddingTopology::new(&mesh, &initial_embedding, &layout, &arc_headings(&layout)).unwrap();
    for (node, valence) in [(0, 3), (1, 5)] {
        net.nodes[node].valence = valence;
    }
    for h in path(&net.mesh, net.nodes[0].vertex, net.nodes[1].vertex) {
        let edge = net.mesh.edge(h);
        net.jump[edge.index()] += if net.mesh.halfedge(edge) == h { 1 } else { -1 };
    }
    net
}

/// Half-edges from one vertex to another, on a surface without boundary.
fn path(mesh: &TriMesh, from: VertexId, to: VertexId) -> Vec<HalfedgeId> {
    let mut by: Vec<Option<HalfedgeId>> = vec![None; mesh.n_vertices()];
    let mut queue = VecDeque::from([from]);
    while let Some(v) = queue.pop_front() {
        for h in mesh.outgoing(v).filter(|&h| mesh.target(h) != from) {
            if by[mesh.target(h).index()].is_none() {
                by[mesh.target(h).index()] = Some(h);
                queue.push_back(mesh.target(h));
            }
        }
    }
    let mut out = Vec::new();
    let mut at = to;
    while at != from {
        let h = by[at.index()].unwrap();
        out.push(h);
        at = mesh.origin(h);
    }
    out.reverse();
    out
}

/// The index of every vertex, in quarters.
pub fn indices(mesh: &TriMesh, jump: &[i32]) -> Vec<i32> {
    let metric = Metric::new(mesh);
    mesh.vertices().map(|v| vertex_index(mesh, &metric, jump, v)).collect()
}

/// Whether the chain of an arc leads without a gap from its first node to its last.
pub fn is_chain(net: &EmbeddingTopology, arc: usize) -> bool {
    let a = &net.arcs[arc];
    let mut face = net.mesh.face(a.start);
    let joined = a.crossed.iter().all(|&h| {
        let here = net.mesh.face(h) == face;
        face = net.mesh.face(net.mesh.twin(h).unwrap());
        here
    });
    let ends = [a.start, a.end].map(|h| net.mesh.origin(h));
    joined && face == net.mesh.face(a.end) && ends == a.nodes.map(|n| net.nodes[n as usize].vertex)
}
