//! Moving nodes to corners of features.
//!
//! At a vertex where features meet, or where one bends by about a right angle, the surface determines the valence of
//! the node that fits there: the angle around the vertex in quarter turns, rounded. Before anything is solved for, the
//! nearest irregular node of that valence is moved to the corner along edges, nearest pairs first. A corner without a
//! node near enough stays without one.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{Dijkstra, HalfedgeId, TriMesh, VertexId};

/// Distance along edges below which a node is moved to a corner, as a fraction of the model size: farther
/// nodes belong to other parts of the surface.
const REACH: f64 = 0.2;
/// Cosine of the angle between two feature edges at a vertex up to which they continue each other: 135°, half way
/// between straight and a right angle.
const STRAIGHT: f64 = -std::f64::consts::FRAC_1_SQRT_2;

/// Moves nodes to the corners of features where they fit; `pinned` nodes stay. `sharp` tells for each edge whether it
/// is one of a feature.
pub(in crate::embed) fn move_nodes_to_corners(
    topology: &mut EmbeddingTopology,
    sharp: &[bool],
    pinned: impl Fn(usize) -> bool,
) {
    let corners = corners(&topology.mesh, sharp);
    let mut pairs: Vec<(f64, usize, VertexId)> = Vec::new();
    for &(corner, valence) in &corners {
        let search = paths_to(&topology.mesh, corner, |_| true);
        for (i, n) in topology.nodes.iter().enumerate() {
            let distance = search.distance(n.vertex);
            if n.valence == valence && !n.boundary && !n.is_regular() && !pinned(i) && distance < REACH {
                pairs.push((distance, i, corner));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut placed = vec![false; topology.nodes.len()];
    for (_, node, corner) in pairs {
        let taken = |topology: &EmbeddingTopology, v: VertexId| {
            topology.nodes.iter().enumerate().any(|(i, n)| i != node && n.vertex == v)
        };
        if placed[node] || taken(topology, corner) {
            continue;
        }
        let towards = paths_to(&topology.mesh, corner, |v| {
            v == topology.nodes[node].vertex || !(taken(topology, v) || topology.mesh.is_boundary_vertex(v))
        });
        let mut path = Vec::new();
        let mut at = topology.nodes[node].vertex;
        while let Some(h) = towards.via(at) {
            path.push(h);
            at = topology.mesh.target(h);
        }
        if at == corner {
            for h in path {
                topology.move_node(node, h);
            }
            placed[node] = true;
        }
    }
}

/// The corners of features inside the surface, and the valence that fits each; those of valence 4 need no irregular
/// node.
fn corners(mesh: &TriMesh, sharp: &[bool]) -> Vec<(VertexId, usize)> {
    let inner = mesh.vertices().filter(|&v| !mesh.is_boundary_vertex(v));
    inner
        .filter(|&v| {
            let along = |h: &HalfedgeId| sharp[mesh.edge(*h).index()];
            let rays: Vec<DVec3> = mesh.outgoing(v).filter(along).map(|h| mesh.vector(h).normalize_or_zero()).collect();
            rays.len() >= 3 || (rays.len() == 2 && rays[0].dot(rays[1]) > STRAIGHT)
        })
        .map(|v| (v, (mesh.outgoing(v).map(|h| mesh.corner_angle(h)).sum::<f64>() / FRAC_PI_2).round() as usize))
        .filter(|c| c.1 != 4)
        .collect()
}

/// The shortest edge paths to `corner` from vertices within [`REACH`], through vertices that are `open`: each vertex is
/// reached by its half-edge towards the corner.
fn paths_to(mesh: &TriMesh, corner: VertexId, open: impl Fn(VertexId) -> bool) -> Dijkstra<VertexId, HalfedgeId> {
    let mut search = Dijkstra::new(mesh.n_vertices());
    search.start(corner, 0.0);
    while let Some((v, distance)) = search.settle() {
        if distance > REACH {
            break;
        }
        for h in mesh.outgoing(v) {
            let (Some(back), w) = (mesh.twin(h), mesh.target(h)) else { continue };
            if open(w) {
                search.reach(w, distance + mesh.vector(h).length(), back);
            }
        }
    }
    search
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::samples::cells;

    #[test]
    fn the_corners_of_a_cube_fit_nodes_of_valence_three() {
        let mesh = cells(&[[0, 0, 0]], 3);
        let normal = |h: HalfedgeId| mesh.face_normal(mesh.face(h));
        let sharp: Vec<bool> = mesh
            .edges()
            .map(|e| {
                let h = mesh.halfedge(e);
                normal(h).dot(normal(mesh.twin(h).unwrap())) < 0.5
            })
            .collect();
        let found = corners(&mesh, &sharp);
        assert_eq!(found.len(), 8, "vertices along straight edges are no corners");
        assert!(found.iter().all(|&(_, valence)| valence == 3));
    }

    #[test]
    fn paths_to_a_corner_stay_on_open_vertices() {
        let mesh = cells(&[[0, 0, 0]], 2);
        let corner = VertexId(0);
        let ring: Vec<VertexId> = mesh.outgoing(corner).map(|h| mesh.target(h)).collect();
        let search = paths_to(&mesh, corner, |v| v != ring[0]);
        assert_eq!(search.distance(corner), 0.0);
        assert!(search.distance(ring[0]).is_infinite());
        let along = search.via(ring[1]).unwrap();
        assert_eq!((mesh.origin(along), mesh.target(along)), (ring[1], corner));
        let enclosed = paths_to(&mesh, corner, |v| !ring.contains(&v));
        assert_eq!(enclosed.reached(), [corner]);
    }
}
