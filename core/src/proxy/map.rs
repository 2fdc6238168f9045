//! The map between a proxy and its original.
//!
//! Each original vertex has an image on the proxy. Thus the original is laid onto the proxy, triangle by triangle, and
//! a point goes to and fro by being found there: from the images of its triangle's corners to the nearest place on
//! the proxy, or from the proxy to the nearest triangle of images. Nearest means downhill from where the point must be
//! near to, over neighbouring triangles only, and so never on another sheet.

use glam::DVec3;

use super::ProxyError;
use super::collapse::Simplifier;
use super::connectivity::Connectivity;
use super::shape::Kind;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::{SurfacePoint, nearest_in_triangle};

/// How many starts are tried at most to find a point of the proxy on the original.
const STARTS: usize = 4;
/// An image is found when it is this near, in lengths of the proxy's edges.
const FOUND: f64 = 1e-6;

/// A simplified mesh and the map between it and its original.
#[derive(Debug, Clone)]
pub struct Proxy {
    mesh: TriMesh,
    sharp: Vec<bool>,
    /// The original vertex of each vertex of the proxy.
    vertices: Vec<VertexId>,
    /// Where each original vertex lies on the proxy.
    images: Vec<SurfacePoint>,
    /// The same in space.
    places: Vec<DVec3>,
    /// The original vertices in each face of the proxy: those from `first[f]` to `first[f + 1]`.
    first: Vec<u32>,
    inside: Vec<u32>,
}

impl Proxy {
    /// The simplified mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// For each edge of the proxy whether it is a feature, as those of the original it came from.
    pub fn sharp(&self) -> &[bool] {
        &self.sharp
    }

    /// The original vertex at which a vertex of the proxy is.
    pub fn original_vertex(&self, v: VertexId) -> VertexId {
        self.vertices[v.index()]
    }

    /// Where an original vertex lies on the proxy.
    pub fn image(&self, v: VertexId) -> SurfacePoint {
        self.images[v.index()]
    }

    /// The images of all original vertices, in space.
    pub fn places(&self) -> &[DVec3] {
        &self.places
    }

    /// The point of the proxy for a point of the original.
    pub fn to_proxy(&self, original: &TriMesh, point: SurfacePoint) -> SurfacePoint {
        let corners = original.face_vertices(point.face);
        let target = corners.iter().zip(point.weights).map(|(v, w)| self.places[v.index()] * w).sum();
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| point.weights[j].total_cmp(&point.weights[i]));
        let starts = order.into_iter().map(|i| self.images[corners[i].index()]);
        let near = starts.map(|p| (p.nearest_vertex(&self.mesh), self.found(p.face)));
        nearest_near(&self.mesh, self.mesh.positions(), near, target).unwrap_or(point)
    }

    /// The squared distance at which a point counts as found around a face of the proxy.
    fn found(&self, face: FaceId) -> f64 {
        FOUND * FOUND * self.mesh.vector(self.mesh.face_halfedges(face)[0]).length_squared()
    }

    /// The point of the original for a point of the proxy.
    pub fn to_original(&self, original: &TriMesh, point: SurfacePoint) -> SurfacePoint {
        let target = point.position(&self.mesh);
        let corners = self.mesh.face_vertices(point.face);
        let f = point.face.index();
        let inside = &self.inside[self.first[f] as usize..self.first[f + 1] as usize];
        let known = inside.iter().map(|&v| VertexId(v)).chain(corners.map(|v| self.vertices[v.index()]));
        let mut starts = [(f64::INFINITY, VertexId(0)); STARTS];
        for v in known {
            let mut new = (self.places[v.index()].distance_squared(target), v);
            for slot in &mut starts {
                if new < *slot {
                    std::mem::swap(slot, &mut new);
                }
            }
        }
        let found = self.found(point.face);
        let near = starts.into_iter().filter(|s| s.0 < f64::INFINITY).map(|s| (s.1, found));
        nearest_near(original, &self.places, near, target).unwrap_or(point)
    }

    /// Moves the vertices of the proxy, and all images with them.
    pub(super) fn move_to(&mut self, positions: Vec<DVec3>) {
        let faces: Vec<[u32; 3]> = self.mesh.faces().map(|f| self.mesh.face_vertices(f).map(|v| v.0)).collect();
        // The same faces as before over finite positions: a manifold as before.
        if let Ok(mesh) = TriMesh::from_faces(positions, &faces) {
            self.mesh = mesh;
            self.places = self.images.iter().map(|p| p.position(&self.mesh)).collect();
        }
    }

    /// Puts a finished simplification together.
    pub(super) fn finish(
        original: &TriMesh,
        work: &Simplifier<'_>,
        normals: &[DVec3],
        progress: &Progress,
    ) -> Result<Self, ProxyError> {
        let (mesh, vertices, face_of) = compact(original, &work.mesh)?;
        let sharp = features(&mesh, &work.mesh, &face_of);
        let tracked = |v: VertexId| {
            let (slot, weights) = work.tracked.place(v.0).unwrap_or_else(|| {
                let h = work.mesh.spoke(v.0);
                (h / 3, [0, 1, 2].map(|i| f64::from(i == h % 3)))
            });
            SurfacePoint { face: FaceId(face_of[slot as usize]), weights }
        };
        let mut images = Vec::with_capacity(original.n_vertices());
        for v in original.vertices() {
            let smooth = work.kinds[v.index()] == Kind::Smooth && !work.mesh.has_vertex(v.0);
            let normal = normals[v.index()];
            images.push(if smooth { projected(&mesh, tracked(v), original.position(v), normal) } else { tracked(v) });
            if v.0.is_multiple_of(1 << 16) {
                progress.check()?;
                progress.report("Mapping", v.index() as f64 / original.n_vertices() as f64);
            }
        }
        let places = images.iter().map(|p| p.position(&mesh)).collect();
        let mut first = vec![0u32; mesh.n_faces() + 1];
        for p in &images {
            first[p.face.index() + 1] += 1;
        }
        for f in 0..mesh.n_faces() {
            first[f + 1] += first[f];
        }
        let mut fill = first.clone();
        let mut inside = vec![0u32; images.len()];
        for (v, p) in images.iter().enumerate() {
            inside[fill[p.face.index()] as usize] = v as u32;
            fill[p.face.index()] += 1;
        }
        Ok(Self { mesh, sharp, vertices, images, places, first, inside })
    }
}

/// The mesh that is left, the vertex each of its vertices was, and its face for each face of the original.
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

/// The features, by edge of the compact mesh.
fn features(mesh: &TriMesh, work: &Connectivity, face_of: &[u32]) -> Vec<bool> {
    let mut sharp = vec![false; mesh.n_edges()];
    for (slot, &f) in face_of.iter().enumerate().filter(|s| *s.1 != u32::MAX) {
        for (i, h) in mesh.face_halfedges(FaceId(f)).into_iter().enumerate() {
            sharp[mesh.edge(h).index()] |= work.is_feature((3 * slot + i) as u32);
        }
    }
    sharp
}

/// The place nearest to `position` around where a vertex was tracked to: there the map is most like a projection, and
/// curves keep their shape. What is tracked stays where the surface is too rough for that.
fn projected(mesh: &TriMesh, tracked: SurfacePoint, position: DVec3, normal: DVec3) -> SurfacePoint {
    let (nearest, _) = nearest_from(mesh, mesh.positions(), tracked.face, position);
    let size = mesh.vector(mesh.face_halfedges(tracked.face)[0]).length_squared();
    let moved = nearest.position(mesh).distance_squared(tracked.position(mesh));
    if mesh.face_normal(nearest.face).dot(normal) > 0.0 && moved < size { nearest } else { tracked }
}

/// The best of what is found downhill from around some vertices, tried in order until one is found as near as wanted
/// (squared).
fn nearest_near(
    mesh: &TriMesh,
    positions: &[DVec3],
    starts: impl Iterator<Item = (VertexId, f64)>,
    target: DVec3,
) -> Option<SurfacePoint> {
    let mut best: Option<(SurfacePoint, f64)> = None;
    for (v, found) in starts {
        let fan = mesh.outgoing(v).map(|h| measure(mesh, positions, mesh.face(h), target));
        let Some((start, _)) = fan.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        let here = nearest_from(mesh, positions, start.face, target);
        if best.is_none_or(|b| here.1 < b.1) {
            best = Some(here);
        }
        if here.1 <= found {
            break;
        }
    }
    best.map(|b| b.0)
}

/// The nearest point of a face, and its squared distance.
fn measure(mesh: &TriMesh, positions: &[DVec3], face: FaceId, target: DVec3) -> (SurfacePoint, f64) {
    let corners = mesh.face_vertices(face).map(|v| positions[v.index()]);
    let weights = nearest_in_triangle(target, &corners);
    let place: DVec3 = corners.iter().zip(weights).map(|(&p, w)| p * w).sum();
    (SurfacePoint { face, weights }, place.distance_squared(target))
}

/// Goes downhill from a face to the point nearest to `target`, over the mesh with its vertices at `positions`; with the
/// squared distance that is left.
fn nearest_from(mesh: &TriMesh, positions: &[DVec3], start: FaceId, target: DVec3) -> (SurfacePoint, f64) {
    let mut here = measure(mesh, positions, start, target);
    loop {
        let (point, distance) = here;
        let mut best = here;
        let mut meet = |face: FaceId| {
            let there = measure(mesh, positions, face, target);
            if there.1 < best.1 {
                best = there;
            }
        };
        let sides = mesh.face_halfedges(point.face);
        let on = |i: usize| point.weights[i] == 0.0;
        match (0..3).find(|&i| on((i + 1) % 3) && on((i + 2) % 3)) {
            Some(corner) => mesh.outgoing(mesh.origin(sides[corner])).for_each(|h| meet(mesh.face(h))),
            None => {
                if let Some(t) = (0..3).find(|&i| on(i)).and_then(|i| mesh.twin(sides[(i + 1) % 3])) {
                    meet(mesh.face(t));
                }
            }
        }
        // Strictly downhill, with room for rounding, so it ends.
        if best.1 < distance * (1.0 - 1e-9) {
            here = best;
        } else {
            return here;
        }
    }
}
