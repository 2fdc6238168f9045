//! The vertices near a curve.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::mesh::{TriMesh, VertexId};
use crate::surface::SurfaceCurve;

/// Memory for finding the vertices near curves, to be kept between them.
#[derive(Debug, Default)]
pub(super) struct CurveNeighbourhood {
    /// Per vertex the distance; infinite between uses.
    distance: Vec<f64>,
    queue: BinaryHeap<Reverse<(u64, VertexId)>>,
}

impl CurveNeighbourhood {
    /// The vertices within `radius` of the ends of the edges that `curve` crosses, measured along edges; sorted by index.
    pub(super) fn of(&mut self, mesh: &TriMesh, curve: &SurfaceCurve, radius: f64) -> Vec<VertexId> {
        if self.distance.len() != mesh.n_vertices() {
            self.distance = vec![f64::INFINITY; mesh.n_vertices()];
        }
        let (distance, mut near) = (&mut self.distance, Vec::new());
        for v in curve.crossings.iter().flat_map(|c| [mesh.origin(c.halfedge), mesh.target(c.halfedge)]) {
            if distance[v.index()] > 0.0 {
                distance[v.index()] = 0.0;
                near.push(v);
                self.queue.push(Reverse((0, v)));
            }
        }
        // Distances are not negative, so their bits order like them.
        while let Some(Reverse((key, v))) = self.queue.pop() {
            let d = f64::from_bits(key);
            if d > distance[v.index()] {
                continue;
            }
            for h in mesh.outgoing(v) {
                for (w, side) in [(mesh.target(h), h), (mesh.opposite(h), mesh.prev(h))] {
                    let reached = d + mesh.vector(side).length();
                    if reached < distance[w.index()] && reached <= radius {
                        if distance[w.index()] == f64::INFINITY {
                            near.push(w);
                        }
                        distance[w.index()] = reached;
                        self.queue.push(Reverse((reached.to_bits(), w)));
                    }
                }
            }
        }
        for v in &near {
            distance[v.index()] = f64::INFINITY;
        }
        near.sort_unstable();
        near
    }
}
