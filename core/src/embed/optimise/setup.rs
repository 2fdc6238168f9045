//! What of a surface carries over to the working mesh of a net: sharp edges, and what holds its nodes.

use glam::DVec3;

use crate::embed::optimise::relocation::{NodeConstraint, SurfaceProjection};
use crate::embed::problem::{Settings, Surface};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{TriMesh, VertexId};

/// How close irregular nodes may come to each other on the surface, in least lengths of arcs.
const APART: f64 = 1.5;

/// The sharp edges of the working mesh: those of the surface and their halves where a node was inserted.
pub(in crate::embed) fn sharp_edges(surface: &Surface<'_>, net: &EmbeddingTopology) -> Vec<bool> {
    let n = surface.mesh.n_vertices();
    let pair = |a: VertexId, b: VertexId| (a.min(b), a.max(b));
    let sharp: std::collections::BTreeSet<_> = surface
        .mesh
        .edges()
        .filter(|e| surface.sharp[e.index()])
        .map(|e| surface.mesh.edge_vertices(e))
        .map(|[a, b]| pair(a, b))
        .collect();
    net.mesh
        .edges()
        .map(|e| {
            let [a, b] = net.mesh.edge_vertices(e);
            if a.index() < n && b.index() < n {
                return sharp.contains(&pair(a, b));
            }
            // A half of a sharp edge: on it lies the inserted vertex, between the two ends.
            let (new, old) = if a.index() >= n { (a, b) } else { (b, a) };
            let p = net.mesh.position(new);
            let q = net.mesh.position(old);
            net.mesh.outgoing(new).map(|h| net.mesh.target(h)).any(|w| {
                let r = net.mesh.position(w);
                let flat = (q - p).cross(r - p).length() < 1e-9 * q.distance(r).powi(2) && (q - p).dot(r - p) < 0.0;
                w.index() < n && old.index() < n && flat && sharp.contains(&pair(old, w))
            })
        })
        .collect()
}

pub(in crate::embed) fn ground<'a>(
    surface: &Surface<'a>,
    net: &EmbeddingTopology,
    sharp: &[bool],
    pinned: impl Fn(usize) -> bool,
    settings: Settings,
) -> SurfaceProjection<'a> {
    let mesh = &net.mesh;
    let curve: Vec<bool> = mesh.edges().map(|e| sharp[e.index()] || mesh.is_boundary_edge(e)).collect();
    let mut degree = vec![0; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| curve[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    let hold = net
        .nodes
        .iter()
        .enumerate()
        .map(|(i, n)| match degree[n.vertex.index()] {
            _ if pinned(i) => NodeConstraint::Fixed,
            0 => NodeConstraint::Free,
            2 if !turns(mesh, &curve, n.vertex) => NodeConstraint::Curve,
            _ => NodeConstraint::Fixed,
        })
        .collect();
    let on_curve = degree.iter().map(|&d| d > 0).collect();
    SurfaceProjection {
        surface: surface.mesh,
        index: surface.index,
        home: mesh.positions().to_vec(),
        curve,
        on_curve,
        hold,
        apart: APART * settings.spacing * mean_edge(mesh),
    }
}

pub(in crate::embed) fn mean_edge(mesh: &TriMesh) -> f64 {
    mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges().max(1) as f64
}

/// Cosine below which a curve has a corner: half way to a right angle.
const CORNER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Whether the two curve edges at `v` meet in a corner.
fn turns(mesh: &TriMesh, curve: &[bool], v: VertexId) -> bool {
    let ends: Vec<DVec3> = mesh
        .outgoing(v)
        .flat_map(|h| [h, mesh.prev(h)])
        .filter(|&h| curve[mesh.edge(h).index()])
        .map(|h| if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) })
        .map(|w| (mesh.position(w) - mesh.position(v)).normalize_or_zero())
        .collect();
    ends.iter().any(|a| ends.iter().all(|b| a == b || -a.dot(*b) < CORNER))
}
