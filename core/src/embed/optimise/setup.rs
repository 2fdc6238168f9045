//! Setup of an optimisation: topology, sharp edges and curvature of the working mesh, and the freedom of its nodes.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::relocation::{NodeConstraint, SurfaceProjection};
use crate::embed::problem::{Problem, Settings, Surface};
use crate::embed::topology::corner_nodes::move_nodes_to_corners;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{TriMesh, VertexId};
use crate::surface::PrincipalCurvature;

/// Least distance of irregular nodes on the surface, in least arc lengths. Closer ones circle each other and wind up
/// their arcs. Chosen by hand.
const MIN_NODE_DISTANCE: f64 = 1.5;
/// Cosine between successive curve edges below which a curve has a corner: half way from straight to a right angle.
const CORNER_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The topology of an embedding with attributes of its mesh.
pub(in crate::embed) struct PreparedTopology {
    /// The topology.
    pub topology: EmbeddingTopology,
    /// Whether each edge is sharp.
    pub sharp: Vec<bool>,
    /// Principal curvatures at the vertices.
    pub curvature: Vec<PrincipalCurvature>,
}

impl PreparedTopology {
    /// The topology of the initial embedding on the mesh of the problem.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn new(problem: &Problem<'_>) -> Result<Self, EmbeddingError> {
        let Problem { surface, layout, initial_embedding, arc_headings, .. } = *problem;
        let mut topology = EmbeddingTopology::new(surface.mesh, initial_embedding, layout, arc_headings)?;
        let sharp = sharp_edges(&surface, &topology);
        let pinned = problem.pinned();
        move_nodes_to_corners(&mut topology, &sharp, |i| pinned[i]);
        let nearest = |v: usize| {
            if v < surface.mesh.n_vertices() {
                return surface.curvature[v];
            }
            let at = surface.index.nearest(topology.mesh.position(VertexId::new(v)));
            surface.curvature[at.nearest_vertex(surface.mesh).index()]
        };
        let curvature: Vec<PrincipalCurvature> = (0..topology.mesh.n_vertices()).map(nearest).collect();
        Ok(Self { topology, sharp, curvature })
    }

    /// As [`Self::new`], with enough triangles around irregular nodes for an injective map.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn refined(problem: &Problem<'_>) -> Result<Self, EmbeddingError> {
        let Self { topology, sharp, curvature } = Self::new(problem)?;
        Ok(match topology.refine_at_irregular_nodes(&topology.angle, &sharp, &curvature)? {
            Some((topology, carried)) => Self { topology, sharp: carried.sharp, curvature: carried.at_vertex },
            None => Self { topology, sharp, curvature },
        })
    }
}

/// Whether each edge of the working mesh is sharp: sharp edges of the surface, and their halves where a node was
/// inserted.
fn sharp_edges(surface: &Surface<'_>, topology: &EmbeddingTopology) -> Vec<bool> {
    let n = surface.mesh.n_vertices();
    let pair = |a: VertexId, b: VertexId| (a.min(b), a.max(b));
    let sharp: BTreeSet<_> = surface
        .mesh
        .edges()
        .filter(|e| surface.sharp[e.index()])
        .map(|e| surface.mesh.edge_vertices(e))
        .map(|[a, b]| pair(a, b))
        .collect();
    topology
        .mesh
        .edges()
        .map(|e| {
            let [a, b] = topology.mesh.edge_vertices(e);
            if a.index() < n && b.index() < n {
                return sharp.contains(&pair(a, b));
            }
            // A half of a sharp edge: the inserted vertex lies on the edge, between its two ends.
            // The test for that is collinearity up to rounding errors.
            let (new, old) = if a.index() >= n { (a, b) } else { (b, a) };
            let p = topology.mesh.position(new);
            let q = topology.mesh.position(old);
            topology.mesh.outgoing(new).map(|h| topology.mesh.target(h)).any(|w| {
                let r = topology.mesh.position(w);
                let flat = (q - p).cross(r - p).length() < 1e-9 * q.distance(r).powi(2) && (q - p).dot(r - p) < 0.0;
                w.index() < n && old.index() < n && flat && sharp.contains(&pair(old, w))
            })
        })
        .collect()
}

/// The surface with the freedom of every node: nodes on curves move along them, and nodes at corners of curves are
/// fixed like pinned ones.
pub(super) fn surface_projection<'a>(
    surface: &Surface<'a>,
    topology: &EmbeddingTopology,
    sharp: &[bool],
    pinned: impl Fn(usize) -> bool,
    settings: Settings,
) -> SurfaceProjection<'a> {
    let mesh = &topology.mesh;
    let curve: Vec<bool> = mesh.edges().map(|e| sharp[e.index()] || mesh.is_boundary_edge(e)).collect();
    let mut degree = vec![0; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| curve[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    let node_constraint = topology
        .nodes
        .iter()
        .enumerate()
        .map(|(i, n)| match degree[n.vertex.index()] {
            _ if pinned(i) => NodeConstraint::Fixed,
            0 => NodeConstraint::Free,
            2 if !is_corner(mesh, &curve, n.vertex) => NodeConstraint::Curve,
            _ => NodeConstraint::Fixed,
        })
        .collect();
    let on_curve = degree.iter().map(|&d| d > 0).collect();
    SurfaceProjection {
        surface: surface.mesh,
        index: surface.index,
        rest_position: mesh.positions().to_vec(),
        curve,
        on_curve,
        node_constraint,
        min_distance: MIN_NODE_DISTANCE * settings.spacing * mean_edge_length(mesh),
    }
}

/// The mean length of the edges of a mesh.
pub(super) fn mean_edge_length(mesh: &TriMesh) -> f64 {
    mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges().max(1) as f64
}

/// Whether the two curve edges at `v` meet in a corner.
fn is_corner(mesh: &TriMesh, curve: &[bool], v: VertexId) -> bool {
    let ends: Vec<DVec3> = mesh
        .outgoing(v)
        .flat_map(|h| [h, mesh.prev(h)])
        .filter(|&h| curve[mesh.edge(h).index()])
        .map(|h| if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) })
        .map(|w| (mesh.position(w) - mesh.position(v)).normalize_or_zero())
        .collect();
    ends.iter().any(|a| ends.iter().all(|b| a == b || -a.dot(*b) < CORNER_COSINE))
}
