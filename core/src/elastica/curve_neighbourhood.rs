//! The vertices near a curve.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::mesh::{TriMesh, VertexId};
use crate::surface::SurfaceCurve;

/// Memory for finding the vertices near curves, to be kept between them.
#[derive(Debug, Default)]
pub(super) struct Vicinity {
    /// Per vertex the distance, infinite between uses.
    dist: Vec<f64>,
    queue: BinaryHeap<Reverse<(u64, VertexId)>>,
}

impl Vicinity {
    /// The vertices within `radius` of the edges that `curve` crosses, measured along edges; sorted.
    pub(super) fn of(&mut self, mesh: &TriMesh, curve: &SurfaceCurve, radius: f64) -> Vec<VertexId> {
        if self.dist.len() != mesh.n_vertices() {
            self.dist = vec![f64::INFINITY; mesh.n_vertices()];
        }
        let (dist, mut near) = (&mut self.dist, Vec::new());
        for v in curve.crossings.iter().flat_map(|c| [mesh.origin(c.halfedge), mesh.target(c.halfedge)]) {
            if dist[v.index()] > 0.0 {
                dist[v.index()] = 0.0;
                near.push(v);
                self.queue.push(Reverse((0, v)));
            }
        }
        while let Some(Reverse((key, v))) = self.queue.pop() {
            let d = f64::from_bits(key);
            if d > dist[v.index()] {
                continue;
            }
            for h in mesh.outgoing(v) {
                for (w, side) in [(mesh.target(h), h), (mesh.opposite(h), mesh.prev(h))] {
                    let reached = d + mesh.vector(side).length();
                    if reached < dist[w.index()] && reached <= radius {
                        if dist[w.index()] == f64::INFINITY {
                            near.push(w);
                        }
                        dist[w.index()] = reached;
                        self.queue.push(Reverse((reached.to_bits(), w)));
                    }
                }
            }
        }
        for v in &near {
            dist[v.index()] = f64::INFINITY;
        }
        near.sort_unstable();
        near
    }
}
