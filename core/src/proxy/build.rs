//! Construction of a proxy: simplification and improvement in turn, then the map.

use glam::DVec3;
use thiserror::Error;

use super::collapse::Simplifier;
use super::connectivity::Connectivity;
use super::map::{Proxy, nearest_from};
use super::triangle_shape::equilateral_length;
use super::vertex_kinds::{VertexKind, vertex_kinds, vertex_normals};
use crate::mesh::{FaceId, TriMesh, TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::SurfacePoint;

/// Rounds of flips and vertex shifts half way and at the end. Each round gains less than the one before; after these
/// the triangles change little.
const IMPROVEMENT_ROUNDS: [usize; 2] = [1, 4];

/// The improvement half way takes place at this multiple of the target.
const HALF_WAY: usize = 3;

/// Vertices between two reports of progress.
const REPORT_INTERVAL: u32 = 1 << 16;

/// Why a proxy cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ProxyError {
    /// The list of sharp edges does not have one flag per edge of the mesh.
    #[error("the list of sharp edges has {given} flags, the mesh {edges} edges")]
    Sharp {
        /// Number of flags.
        given: usize,
        /// Number of edges.
        edges: usize,
    },
    /// The result is not a manifold.
    #[error("the simplified mesh is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Proxy {
    /// Simplifies `original` to about `target` triangles, or as far as topology, features and shape allow.
    ///
    /// `sharp` has a flag for each edge that is a feature. Features and boundaries are kept, their corners exactly. An
    /// original of no more than `target` triangles is its own proxy.
    ///
    /// # Errors
    ///
    /// A `sharp` of wrong length, or [`Cancelled`].
    pub fn new(original: &TriMesh, sharp: &[bool], target: usize, progress: &Progress) -> Result<Self, ProxyError> {
        if sharp.len() != original.n_edges() {
            return Err(ProxyError::Sharp { given: sharp.len(), edges: original.n_edges() });
        }
        let kinds = vertex_kinds(original, sharp);
        let normals = vertex_normals(original);
        let length = equilateral_length(original, target);
        let mut work = Simplifier::new(original, sharp, kinds, &normals, length);
        if original.n_faces() > target {
            if original.n_faces() > HALF_WAY * target {
                work.reduce(HALF_WAY * target, progress)?;
                work.improve(IMPROVEMENT_ROUNDS[0], progress)?;
            }
            work.reduce(target, progress)?;
            work.improve(IMPROVEMENT_ROUNDS[1], progress)?;
        }
        finish(original, &work, &normals, progress)
    }
}

/// The proxy of a finished simplification.
fn finish(
    original: &TriMesh,
    work: &Simplifier<'_>,
    normals: &[DVec3],
    progress: &Progress,
) -> Result<Proxy, ProxyError> {
    let (mesh, vertices, face_of) = compact(original, &work.mesh)?;
    let sharp = features(&mesh, &work.mesh, &face_of);
    let tracked = |v: VertexId| {
        let (slot, weights) = work.tracked.location(v.0).unwrap_or_else(|| {
            let h = work.mesh.spoke(v.0);
            (h / 3, [0, 1, 2].map(|i| f64::from(i == h % 3)))
        });
        SurfacePoint { face: FaceId(face_of[slot as usize]), weights }
    };
    let mut images = Vec::with_capacity(original.n_vertices());
    for v in original.vertices() {
        let smooth = work.kinds[v.index()] == VertexKind::Smooth && !work.mesh.has_vertex(v.0);
        let normal = normals[v.index()];
        images.push(if smooth { projected(&mesh, tracked(v), original.position(v), normal) } else { tracked(v) });
        if v.0.is_multiple_of(REPORT_INTERVAL) {
            progress.check()?;
            progress.report("Mapping", v.index() as f64 / original.n_vertices() as f64);
        }
    }
    Ok(Proxy::from_images(mesh, sharp, vertices, images))
}

/// The remaining mesh, the original vertex of each of its vertices, and its face for each face of the original.
fn compact(original: &TriMesh, work: &Connectivity) -> Result<(TriMesh, Vec<VertexId>, Vec<u32>), ProxyError> {
    let mut new = vec![0u32; original.n_vertices()];
    let mut vertices = Vec::new();
    for v in original.vertices().filter(|v| work.has_vertex(v.0)) {
        new[v.index()] = vertices.len() as u32;
        vertices.push(v);
    }
    let mut face_of = vec![u32::MAX; original.n_faces()];
    let mut faces = Vec::with_capacity(work.n_faces());
    for f in original.faces().filter(|f| work.has(3 * f.0)) {
        face_of[f.index()] = faces.len() as u32;
        faces.push(work.corners(f.0).map(|v| new[v as usize]));
    }
    let positions = vertices.iter().map(|&v| original.position(v)).collect();
    Ok((TriMesh::from_faces(positions, &faces)?, vertices, face_of))
}

/// For each edge of the compact mesh whether it is a feature.
fn features(mesh: &TriMesh, work: &Connectivity, face_of: &[u32]) -> Vec<bool> {
    let mut sharp = vec![false; mesh.n_edges()];
    for (slot, &f) in face_of.iter().enumerate().filter(|s| *s.1 != u32::MAX) {
        for (i, h) in mesh.face_halfedges(FaceId(f)).into_iter().enumerate() {
            sharp[mesh.edge(h).index()] |= work.is_feature((3 * slot + i) as u32);
        }
    }
    sharp
}

/// The point of the proxy nearest to `position`, searched from where the vertex was tracked to. There the map is close
/// to a projection, and curves keep their shape. Falls back to the tracked point where the surface is too rough: where
/// the projection is farther away than an edge, or on a triangle that faces the other way.
fn projected(mesh: &TriMesh, tracked: SurfacePoint, position: DVec3, normal: DVec3) -> SurfacePoint {
    let (nearest, _) = nearest_from(mesh, mesh.positions(), tracked.face, position);
    let size = mesh.vector(mesh.face_halfedges(tracked.face)[0]).length_squared();
    let moved = nearest.position(mesh).distance_squared(tracked.position(mesh));
    if mesh.face_normal(nearest.face).dot(normal) > 0.0 && moved < size { nearest } else { tracked }
}
