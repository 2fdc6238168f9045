//! Nodes at corners of features.
//!
//! Where features meet in a corner, or a feature bends by about a right angle, the surface itself says which node belongs
//! there: as many quarters as the angles around the corner hold. The nearest node of that valence is brought there, along
//! edges and with its arcs in tow, before anything is solved for; a corner that no node is near enough to stays without.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// How far a node is fetched, as a fraction of the bounding-box diagonal: farther ones belong to other parts.
const REACH: f64 = 0.2;
/// Cosine above which two features at a vertex go straight on: half way to a right angle.
const STRAIGHT: f64 = -std::f64::consts::FRAC_1_SQRT_2;

/// Brings nodes to the corners of features that are theirs; `held` nodes stay.
pub(in crate::embed) fn move_nodes_to_corners(
    net: &mut EmbeddingTopology,
    sharp: &[bool],
    held: impl Fn(usize) -> bool,
) {
    let corners = corners(&net.mesh, sharp);
    let mut pairs: Vec<(f64, usize, VertexId)> = Vec::new();
    for &(corner, valence) in &corners {
        let distance = distances(&net.mesh, corner, |_| true);
        for (i, n) in net.nodes.iter().enumerate() {
            let d = distance[n.vertex.index()];
            if n.valence == valence && !n.boundary && !n.is_regular() && !held(i) && d.0 < REACH {
                pairs.push((d.0, i, corner));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut done = vec![false; net.nodes.len()];
    for (_, node, corner) in pairs {
        let taken = |net: &EmbeddingTopology, v: VertexId| {
            net.nodes.iter().enumerate().any(|(i, n)| i != node && n.vertex == v)
        };
        if done[node] || taken(net, corner) || net.nodes.iter().zip(&done).any(|(n, &d)| d && n.vertex == corner) {
            continue;
        }
        let way = distances(&net.mesh, corner, |v| {
            v == net.nodes[node].vertex || !(taken(net, v) || net.mesh.is_boundary_vertex(v))
        });
        let mut path = Vec::new();
        let mut at = net.nodes[node].vertex;
        while let Some(h) = way[at.index()].1 {
            path.push(h);
            at = net.mesh.target(h);
        }
        if at == corner {
            for h in path {
                net.move_node(node, h);
            }
            done[node] = true;
        }
    }
}

/// The corners of features inside the surface and their numbers of quarters.
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

/// For each vertex its distance along edges from `from` through vertices that are `open`, and the half-edge that leads
/// back there.
fn distances(mesh: &TriMesh, from: VertexId, open: impl Fn(VertexId) -> bool) -> Vec<(f64, Option<HalfedgeId>)> {
    let mut best = vec![(f64::INFINITY, None); mesh.n_vertices()];
    best[from.index()].0 = 0.0;
    let mut queue = BinaryHeap::from([Reverse((0u64, from))]);
    while let Some(Reverse((bits, v))) = queue.pop() {
        let d = f64::from_bits(bits);
        if d > best[v.index()].0 || d > REACH {
            continue;
        }
        for h in mesh.outgoing(v) {
            let (Some(back), w) = (mesh.twin(h), mesh.target(h)) else { continue };
            let far = d + mesh.vector(h).length();
            if open(w) && far < best[w.index()].0 {
                best[w.index()] = (far, Some(back));
                queue.push(Reverse((far.to_bits(), w)));
            }
        }
    }
    best
}
