//! The map between a proxy and its original.
//!
//! Each original vertex has an image on the proxy, so each triangle of the original has an image triangle in space. A
//! point of the original is interpolated between the images of its triangle's corners, then projected onto the proxy; a
//! point of the proxy is projected onto the image triangles. Both projections are local: they decrease the distance
//! from triangle to neighbouring triangle, starting near the result, and so do not jump to another sheet of the
//! surface.

use glam::DVec3;

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::surface::{SurfacePoint, nearest_in_triangle};

/// Most starting vertices of the projection of a point of the proxy onto the original.
const STARTS: usize = 4;
/// A projection ends the search for better ones at this distance, in lengths of the proxy's edges.
const FOUND: f64 = 1e-6;

/// A simplified mesh and the map between it and its original.
#[derive(Debug, Clone)]
pub struct Proxy {
    mesh: TriMesh,
    sharp: Vec<bool>,
    /// The original vertex of each vertex of the proxy.
    vertices: Vec<VertexId>,
    /// The image of each original vertex on the proxy, and its position.
    images: Vec<SurfacePoint>,
    image_positions: Vec<DVec3>,
    /// The original vertices with their images in face `f` of the proxy are `inside[first[f]..first[f + 1]]`.
    first: Vec<u32>,
    inside: Vec<u32>,
}

impl Proxy {
    /// The simplified mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// For each edge of the proxy whether it replaces feature edges of the original.
    pub fn sharp(&self) -> &[bool] {
        &self.sharp
    }

    /// The original vertex of a vertex of the proxy.
    pub fn original_vertex(&self, v: VertexId) -> VertexId {
        self.vertices[v.index()]
    }

    /// The image of an original vertex on the proxy.
    pub fn image(&self, v: VertexId) -> SurfacePoint {
        self.images[v.index()]
    }

    /// The positions of the images of all original vertices.
    pub fn image_positions(&self) -> &[DVec3] {
        &self.image_positions
    }

    /// The image on the proxy of a point of the original.
    pub fn to_proxy(&self, original: &TriMesh, point: SurfacePoint) -> SurfacePoint {
        let corners = original.face_vertices(point.face);
        let target = corners.iter().zip(point.weights).map(|(v, w)| self.image_positions[v.index()] * w).sum();
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| point.weights[j].total_cmp(&point.weights[i]));
        let starts = order.into_iter().map(|i| self.images[corners[i].index()]);
        let near = starts.map(|p| (p.nearest_vertex(&self.mesh), self.sufficient_distance(p.face)));
        nearest_around(&self.mesh, self.mesh.positions(), near, target).unwrap_or(point)
    }

    /// The squared distance that ends a search around a face of the proxy.
    fn sufficient_distance(&self, face: FaceId) -> f64 {
        FOUND * FOUND * self.mesh.vector(self.mesh.face_halfedges(face)[0]).length_squared()
    }

    /// The point of the original whose image is a point of the proxy.
    pub fn to_original(&self, original: &TriMesh, point: SurfacePoint) -> SurfacePoint {
        let target = point.position(&self.mesh);
        let corners = self.mesh.face_vertices(point.face);
        let f = point.face.index();
        let inside = &self.inside[self.first[f] as usize..self.first[f + 1] as usize];
        let known = inside.iter().map(|&v| VertexId(v)).chain(corners.map(|v| self.vertices[v.index()]));
        let mut starts = [(f64::INFINITY, VertexId(0)); STARTS];
        for v in known {
            let mut new = (self.image_positions[v.index()].distance_squared(target), v);
            for slot in &mut starts {
                if new < *slot {
                    std::mem::swap(slot, &mut new);
                }
            }
        }
        let found = self.sufficient_distance(point.face);
        let near = starts.into_iter().filter(|s| s.0 < f64::INFINITY).map(|s| (s.1, found));
        nearest_around(original, &self.image_positions, near, target).unwrap_or(point)
    }

    /// Moves the vertices of the proxy; images keep their barycentric coordinates.
    pub(super) fn move_to(&mut self, positions: Vec<DVec3>) {
        let faces: Vec<[u32; 3]> = self.mesh.faces().map(|f| self.mesh.face_vertices(f).map(|v| v.0)).collect();
        // Faces do not change, so the mesh stays a manifold.
        if let Ok(mesh) = TriMesh::from_faces(positions, &faces) {
            self.mesh = mesh;
            self.image_positions = self.images.iter().map(|p| p.position(&self.mesh)).collect();
        }
    }

    /// The proxy with these images of the original's vertices.
    pub(super) fn from_images(
        mesh: TriMesh,
        sharp: Vec<bool>,
        vertices: Vec<VertexId>,
        images: Vec<SurfacePoint>,
    ) -> Self {
        let image_positions = images.iter().map(|p| p.position(&mesh)).collect();
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
        Self { mesh, sharp, vertices, images, image_positions, first, inside }
    }
}

/// The nearest of the local projections of `target` that start around some vertices. Each start has a squared distance
/// that is sufficient; vertices are tried in order until a projection is as near as that.
fn nearest_around(
    mesh: &TriMesh,
    positions: &[DVec3],
    starts: impl Iterator<Item = (VertexId, f64)>,
    target: DVec3,
) -> Option<SurfacePoint> {
    let mut best: Option<(SurfacePoint, f64)> = None;
    for (v, sufficient) in starts {
        let fan = mesh.outgoing(v).map(|h| nearest_in_face(mesh, positions, mesh.face(h), target));
        let Some((start, _)) = fan.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        let here = nearest_from(mesh, positions, start.face, target);
        if best.is_none_or(|b| here.1 < b.1) {
            best = Some(here);
        }
        if here.1 <= sufficient {
            break;
        }
    }
    best.map(|b| b.0)
}

/// The nearest point of a face, and its squared distance.
fn nearest_in_face(mesh: &TriMesh, positions: &[DVec3], face: FaceId, target: DVec3) -> (SurfacePoint, f64) {
    let corners = mesh.face_vertices(face).map(|v| positions[v.index()]);
    let weights = nearest_in_triangle(target, &corners);
    let point: DVec3 = corners.iter().zip(weights).map(|(&p, w)| p * w).sum();
    (SurfacePoint { face, weights }, point.distance_squared(target))
}

/// Local projection of `target` onto the mesh with its vertices at `positions`: goes from a face to neighbouring ones
/// as long as the distance decreases. Returns the nearest point found and its squared distance.
pub(super) fn nearest_from(mesh: &TriMesh, positions: &[DVec3], start: FaceId, target: DVec3) -> (SurfacePoint, f64) {
    let mut here = nearest_in_face(mesh, positions, start, target);
    loop {
        let (point, distance) = here;
        let mut best = here;
        let mut consider = |face: FaceId| {
            let there = nearest_in_face(mesh, positions, face, target);
            if there.1 < best.1 {
                best = there;
            }
        };
        let sides = mesh.face_halfedges(point.face);
        let on = |i: usize| point.weights[i] == 0.0;
        match (0..3).find(|&i| on((i + 1) % 3) && on((i + 2) % 3)) {
            Some(corner) => mesh.outgoing(mesh.origin(sides[corner])).for_each(|h| consider(mesh.face(h))),
            None => {
                if let Some(t) = (0..3).find(|&i| on(i)).and_then(|i| mesh.twin(sides[(i + 1) % 3])) {
                    consider(mesh.face(t));
                }
            }
        }
        // The distance decreases by more than rounding, so the loop ends.
        if best.1 < distance * (1.0 - 1e-9) {
            here = best;
        } else {
            return here;
        }
    }
}
