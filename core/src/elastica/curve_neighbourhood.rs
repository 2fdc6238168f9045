//! The vertices near a curve.

use crate::mesh::{Dijkstra, TriMesh, VertexId};
use crate::surface::SurfaceCurve;

/// Memory for finding the vertices near curves, to be kept between them.
#[derive(Debug, Default)]
pub(super) struct CurveNeighbourhood {
    /// A search over the given number of vertices.
    search: Option<(usize, Dijkstra<VertexId, ()>)>,
}

impl CurveNeighbourhood {
    /// The vertices within `radius` of the ends of the edges that `curve` crosses, measured along edges; sorted by index.
    pub(super) fn of(&mut self, mesh: &TriMesh, curve: &SurfaceCurve, radius: f64) -> Vec<VertexId> {
        let n = mesh.n_vertices();
        let search = match self.search.take() {
            Some((size, search)) if size == n => search,
            _ => Dijkstra::new(n),
        };
        let (_, search) = self.search.insert((n, search));
        for v in curve.crossings.iter().flat_map(|c| [mesh.origin(c.halfedge), mesh.target(c.halfedge)]) {
            search.start(v, 0.0);
        }
        while let Some((v, d)) = search.settle() {
            for (h, w) in mesh.spokes(v) {
                let reached = d + mesh.vector(h).length();
                if reached <= radius {
                    search.reach(w, reached, ());
                }
            }
        }
        let mut near = search.reached().to_vec();
        search.clear();
        near.sort_unstable();
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, square, torus};

    #[test]
    fn radius_zero_gives_the_ends_of_the_crossed_edges() {
        let mesh = torus(8, 6);
        let mut memory = CurveNeighbourhood::default();
        let near = memory.of(&mesh, &row(8, 2, true, 0.3), 0.0);
        // The two rows of vertices beside the row of cells.
        assert!(near.into_iter().eq((16..32).map(VertexId)));
    }

    #[test]
    fn a_radius_of_the_whole_mesh_gives_all_vertices_and_leaves_no_trace() {
        let mesh = square(4);
        let mut memory = CurveNeighbourhood::default();
        let curve = row(4, 1, false, 0.5);
        let small = memory.of(&mesh, &curve, 0.1);
        assert_eq!(memory.of(&mesh, &curve, 10.0).len(), mesh.n_vertices());
        assert_eq!(memory.of(&mesh, &curve, 0.1), small);
        // The memory fits itself to another mesh.
        assert_eq!(memory.of(&torus(8, 6), &row(8, 2, true, 0.3), 10.0).len(), 48);
    }
}
