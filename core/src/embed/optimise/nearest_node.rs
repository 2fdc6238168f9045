//! The discrete Voronoi diagram of the nodes by Dijkstra's algorithm along edges: a step stays in the cell of its node
//! (Campen, section 6.6.2).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::mesh::{TriMesh, VertexId};

/// For each vertex the index of the nearest of `nodes`; `u32::MAX` where none can be reached.
pub(super) fn nearest_nodes(mesh: &TriMesh, nodes: &[VertexId]) -> Vec<u32> {
    let mut distance = vec![f64::INFINITY; mesh.n_vertices()];
    let mut cell = vec![u32::MAX; mesh.n_vertices()];
    let mut queue = BinaryHeap::new();
    for (i, v) in nodes.iter().enumerate() {
        distance[v.index()] = 0.0;
        cell[v.index()] = i as u32;
        // Non-negative numbers compare like their bits, which are totally ordered.
        queue.push(Reverse((0u64, *v)));
    }
    while let Some(Reverse((bits, v))) = queue.pop() {
        let d = f64::from_bits(bits);
        if d > distance[v.index()] {
            continue;
        }
        for h in mesh.outgoing(v).flat_map(|h| [h, mesh.prev(h)]) {
            let w = if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) };
            let far = d + mesh.vector(h).length();
            if far < distance[w.index()] {
                distance[w.index()] = far;
                cell[w.index()] = cell[v.index()];
                queue.push(Reverse((far.to_bits(), w)));
            }
        }
    }
    cell
}
