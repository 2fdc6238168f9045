//! A topology on a torus, and checks, for tests of operations on topologies.

use crate::dual::Arrangement;
use crate::embed::EmbeddingTopology;
use crate::embed::arc_headings;
use crate::embed::topology::period_jumps::{fewest_edges, move_index, vertex_index};
use crate::layout::{Embedding, QuadLayout, initial_embedding};
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::Metric;
use crate::testing::{column, row, torus};

/// A layout of two by two patches on a torus of 24 × 12 cells; see [`torus_topology`].
pub fn sample_topology() -> EmbeddingTopology {
    torus_topology([24, 12], [1, 7], [3, 14])
}

/// A layout of two by two patches on a torus of `cells`, between the given rows and columns of cells. Its first node is
/// given valence 3 and its second valence 5, and the jumps along an edge path between them are changed accordingly.
pub fn torus_topology(cells: [u32; 2], rows: [u32; 2], columns: [u32; 2]) -> EmbeddingTopology {
    let mesh = torus(cells[0], cells[1]);
    let (layout, initial) = torus_layout(&mesh, cells, rows, columns);
    let mut topology = EmbeddingTopology::new(&mesh, &initial, &layout, &arc_headings(&layout)).unwrap();
    for (node, valence) in [(0, 3), (1, 5)] {
        topology.nodes[node].valence = valence;
    }
    let [from, to] = [0, 1].map(|node: usize| topology.nodes[node].vertex);
    for h in fewest_edges(&topology.mesh, from, |v| v == to).unwrap() {
        move_index(&topology.mesh, &mut topology.jump, h, -1);
    }
    topology
}

/// The layout of [`torus_topology`], all nodes of which are regular, and its initial embedding.
pub fn torus_layout(mesh: &TriMesh, [n, m]: [u32; 2], rows: [u32; 2], columns: [u32; 2]) -> (QuadLayout, Embedding) {
    let mut curves: Vec<_> = rows.map(|j| row(n, j, true, 0.4)).into();
    curves.extend(columns.map(|i| column(n, m, i, true, 0.6)));
    let arrangement = Arrangement::new(mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
    let initial = initial_embedding(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
    (layout, initial)
}

/// A layout of two by two patches on a torus with regular nodes only, and its topology.
pub fn regular_topology() -> (QuadLayout, EmbeddingTopology) {
    let mesh = torus(12, 8);
    let (layout, initial) = torus_layout(&mesh, [12, 8], [1, 5], [2, 8]);
    let topology = EmbeddingTopology::new(&mesh, &initial, &layout, &arc_headings(&layout)).unwrap();
    (layout, topology)
}

/// The index of every vertex of a closed mesh, in quarter turns.
pub fn indices(mesh: &TriMesh, jump: &[i32]) -> Vec<i32> {
    let metric = Metric::new(mesh);
    mesh.vertices().map(|v| vertex_index(mesh, &metric, jump, v)).collect()
}

/// Whether the chain of an arc is connected and joins the arc's nodes.
pub fn is_chain(topology: &EmbeddingTopology, arc: usize) -> bool {
    let a = &topology.arcs[arc];
    let mut face = topology.mesh.face(a.start);
    let joined = a.crossed.iter().all(|&h| {
        let here = topology.mesh.face(h) == face;
        face = topology.mesh.face(topology.mesh.twin(h).unwrap());
        here
    });
    let ends = [a.start, a.end].map(|h| topology.mesh.origin(h));
    joined && face == topology.mesh.face(a.end) && ends == a.nodes.map(|n| topology.nodes[n as usize].vertex)
}
