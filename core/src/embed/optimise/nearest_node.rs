//! The discrete Voronoi diagram of the nodes by Dijkstra's algorithm along edges: a step stays in the cell of its node
//! (Campen, section 6.6.2).

use crate::mesh::{Dijkstra, TriMesh, VertexId};

/// For each vertex the index of the nearest of `nodes`; `u32::MAX` where none can be reached.
pub(super) fn nearest_nodes(mesh: &TriMesh, nodes: &[VertexId]) -> Vec<u32> {
    let mut search = Dijkstra::new(mesh.n_vertices());
    let mut nearest = vec![u32::MAX; mesh.n_vertices()];
    for (i, &v) in nodes.iter().enumerate() {
        search.start(v, 0.0);
        nearest[v.index()] = i as u32;
    }
    while let Some((v, distance)) = search.settle() {
        for (h, w) in mesh.spokes(v) {
            if search.reach(w, distance + mesh.vector(h).length(), ()) {
                nearest[w.index()] = nearest[v.index()];
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{square, torus};

    #[test]
    fn every_vertex_belongs_to_the_node_nearest_along_edges() {
        // A strip of five vertices per row: nodes at both ends of the first row.
        let mesh = square(4);
        let cells = nearest_nodes(&mesh, &[VertexId(0), VertexId(4)]);
        assert_eq!(cells[..5], [0, 0, 0, 1, 1]);
    }

    #[test]
    fn without_nodes_no_vertex_has_one() {
        let mesh = torus(6, 5);
        assert!(nearest_nodes(&mesh, &[]).iter().all(|&c| c == u32::MAX));
        assert!(nearest_nodes(&mesh, &[VertexId(7)]).iter().all(|&c| c == 0));
    }
}
