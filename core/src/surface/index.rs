//! Spatial index of a mesh: first point on a ray, point nearest to a point in space.
//!
//! A bounding volume hierarchy of single-precision boxes, each grown by its rounding error, selects the triangles,
//! which are tested in double precision. Ties go to the face of smaller id, so the answer depends on the mesh alone.
//! The ray test is the watertight one of Woop, Benthin and Wald (2013): a ray through an edge hits at least one of its
//! triangles.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::point::SurfacePoint;
use crate::mesh::{FaceId, TriMesh};

/// A spatial index of a mesh's triangles.
#[derive(Clone)]
pub struct SurfaceIndex {
    bvh: Bvh2,
    corners: Vec<[DVec3; 3]>,
}

impl std::fmt::Debug for SurfaceIndex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SurfaceIndex").field("n_faces", &self.corners.len()).finish_non_exhaustive()
    }
}

impl SurfaceIndex {
    /// Builds the index over all triangles of `mesh`.
    pub fn new(mesh: &TriMesh) -> Self {
        let corners: Vec<[DVec3; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| mesh.position(v))).collect();
        let boxes: Vec<Aabb> = corners.iter().map(bounding_box).collect();
        // The medium build takes 0.1 s for 100 000 triangles; queries are about a third faster than with the fastest
        // build.
        let bvh = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        Self { bvh, corners }
    }

    /// The first point of the surface on a ray, hit from either side, and its distance from `origin` in units of the mesh.
    ///
    /// `direction` need not have unit length. `None` if the ray misses the surface or `direction` is zero.
    pub fn ray(&self, origin: DVec3, direction: DVec3) -> Option<(SurfacePoint, f64)> {
        let ray = Ray::new(origin, direction)?;
        let mut best: Option<(SurfacePoint, f64)> = None;
        let reach = |best: &Option<(SurfacePoint, f64)>| best.as_ref().map_or(f64::INFINITY, |b| b.1);
        let mut stack = vec![(0u32, 0.0)];
        while let Some((node, entry)) = stack.pop() {
            let Some(node) = self.bvh.nodes.get(node as usize).filter(|_| entry <= reach(&best)) else { continue };
            if node.is_leaf() {
                for face in self.faces_of(node.first_index, node.prim_count) {
                    let Some((weights, distance)) = ray.intersect(&self.corners[face as usize]) else { continue };
                    let point = SurfacePoint { face: FaceId(face), weights };
                    if best.as_ref().is_none_or(|b| (distance, point.face) < (b.1, b.0.face)) {
                        best = Some((point, distance));
                    }
                }
            } else {
                let children = [node.first_index, node.first_index + 1];
                let entry = children.map(|c| ray.box_entry(self.bvh.nodes[c as usize].aabb()));
                push_nearer_last(&mut stack, children, entry, reach(&best));
            }
        }
        best
    }

    /// The point of the surface nearest to `point`. The mesh must have at least one face.
    pub fn nearest(&self, point: DVec3) -> SurfacePoint {
        let mut best = SurfacePoint { face: FaceId(0), weights: [1.0, 0.0, 0.0] };
        let mut best_distance = f64::INFINITY;
        let mut stack = vec![(0u32, 0.0)];
        while let Some((node, least)) = stack.pop() {
            let Some(node) = self.bvh.nodes.get(node as usize).filter(|_| least <= best_distance) else { continue };
            if node.is_leaf() {
                for face in self.faces_of(node.first_index, node.prim_count) {
                    let corners = &self.corners[face as usize];
                    let weights = nearest_in_triangle(point, corners);
                    let distance = interpolate(corners, weights).distance_squared(point);
                    if (distance, FaceId(face)) < (best_distance, best.face) {
                        best_distance = distance;
                        best = SurfacePoint { face: FaceId(face), weights };
                    }
                }
            } else {
                let children = [node.first_index, node.first_index + 1];
                let least = children.map(|c| distance_squared(self.bvh.nodes[c as usize].aabb(), point));
                push_nearer_last(&mut stack, children, least, best_distance);
            }
        }
        best
    }

    fn faces_of(&self, first: u32, count: u32) -> impl Iterator<Item = u32> + '_ {
        self.bvh.primitive_indices[first as usize..(first + count) as usize].iter().copied()
    }
}

/// Pushes the children at a distance of at most `reach`, the nearer one last, so that it is popped first.
fn push_nearer_last(stack: &mut Vec<(u32, f64)>, children: [u32; 2], distance: [f64; 2], reach: f64) {
    let order = if distance[0] < distance[1] { [1, 0] } else { [0, 1] };
    for i in order {
        if distance[i].is_finite() && distance[i] <= reach {
            stack.push((children[i], distance[i]));
        }
    }
}

/// A single-precision box that contains the triangle in spite of rounding.
fn bounding_box(corners: &[DVec3; 3]) -> Aabb {
    let [a, b, c] = corners;
    let (min, max) = (a.min(*b).min(*c), a.max(*b).max(*c));
    // Rounding to f32 errs by half a unit in the last place, 2⁻²⁴ of the value; the absolute part serves values near 0.
    let grow = (min.abs().max(max.abs())) * 2f64.powi(-22) + DVec3::splat(1e-30);
    Aabb::new(Vec3A::from((min - grow).as_vec3()), Vec3A::from((max + grow).as_vec3()))
}

fn distance_squared(aabb: &Aabb, point: DVec3) -> f64 {
    let (min, max) = (aabb.min.as_dvec3(), aabb.max.as_dvec3());
    point.distance_squared(point.clamp(min, max))
}

fn interpolate(corners: &[DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners.iter().zip(weights).map(|(&p, w)| p * w).sum()
}

/// Barycentric coordinates of the point of a triangle nearest to `p`; the triangle may be degenerate.
pub(crate) fn nearest_in_triangle(p: DVec3, corners: &[DVec3; 3]) -> [f64; 3] {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    if area > 0.0 {
        let inner = [
            (c - b).cross(p - b).dot(normal) / area,
            (a - c).cross(p - c).dot(normal) / area,
            (b - a).cross(p - a).dot(normal) / area,
        ];
        // Otherwise the nearest point is on an edge. This also covers triangles too thin for a meaningful normal.
        if inner.iter().all(|&w| w >= 0.0) {
            let sum: f64 = inner.iter().sum();
            return inner.map(|w| w / sum);
        }
    }
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    for i in 0..3 {
        let (s, t) = (corners[i], corners[(i + 1) % 3]);
        let along = (t - s).length_squared();
        let at = if along > 0.0 { ((p - s).dot(t - s) / along).clamp(0.0, 1.0) } else { 0.0 };
        let mut weights = [0.0; 3];
        weights[i] = 1.0 - at;
        weights[(i + 1) % 3] = at;
        let distance = interpolate(corners, weights).distance_squared(p);
        if distance < best.1 {
            best = (weights, distance);
        }
    }
    best.0
}

/// A ray prepared for intersection tests: a permutation of axes and a shear map its direction to the last axis.
struct Ray {
    origin: DVec3,
    inverse: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Ray {
    fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let direction = direction.try_normalize()?;
        let size = direction.abs();
        let z = (1..3).fold(0, |z, i| if size[i] > size[z] { i } else { z });
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let along = direction[z];
        let shear = DVec3::new(direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along);
        Some(Self { origin, inverse: direction.recip(), axes, shear })
    }

    /// Distance at which the ray enters a box, infinite if it misses.
    fn box_entry(&self, aabb: &Aabb) -> f64 {
        let (min, max) = (aabb.min.as_dvec3(), aabb.max.as_dvec3());
        let (mut enters, mut leaves) = (0.0f64, f64::INFINITY);
        for i in 0..3 {
            let (s, t) = ((min[i] - self.origin[i]) * self.inverse[i], (max[i] - self.origin[i]) * self.inverse[i]);
            // A ray parallel to a slab and exactly on its face gives NaN, which `min` and `max` ignore.
            enters = enters.max(s.min(t));
            leaves = leaves.min(s.max(t));
        }
        // The factors cover the rounding of the products above.
        if enters <= leaves * (1.0 + 1e-12) { enters * (1.0 - 1e-12) } else { f64::INFINITY }
    }

    /// Barycentric coordinates and distance of the intersection with a triangle.
    fn intersect(&self, corners: &[DVec3; 3]) -> Option<([f64; 3], f64)> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            DVec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        let weights = [c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x];
        if weights.iter().any(|&w| w < 0.0) && weights.iter().any(|&w| w > 0.0) {
            return None;
        }
        let sum: f64 = weights.iter().sum();
        if sum == 0.0 || !sum.is_finite() {
            return None;
        }
        let weights = weights.map(|w| (w / sum).max(0.0));
        let distance = weights[0] * a.z + weights[1] * b.z + weights[2] * c.z;
        (distance >= 0.0).then_some((weights, distance))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::EdgeId;

    /// A deformed sphere of diameter about 1, with slivers at its poles.
    fn sphere() -> TriMesh {
        let (n, m) = (24u32, 12u32);
        let at = |i: u32, j: u32| {
            let (a, b) = (
                f64::from(i) / f64::from(n) * std::f64::consts::TAU,
                f64::from(j) / f64::from(m) * std::f64::consts::PI,
            );
            DVec3::new(b.sin() * a.cos(), b.sin() * a.sin(), b.cos()) * (0.5 + 0.1 * (3.0 * a).sin() * b.sin())
        };
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for j in 0..=m {
            for i in 0..n {
                positions.push(at(i, j));
                let (k, next) = (j * n + i, j * n + (i + 1) % n);
                if j < m {
                    faces.extend([[k, k + n, next], [next, k + n, next + n]]);
                }
            }
        }
        TriMesh::from_faces(positions, &faces).unwrap()
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0f64..1.0).prop_map(DVec3::from_array)
    }

    proptest! {
        #[test]
        fn a_ray_hits_the_triangle_that_brute_force_finds(origin in vector(), direction in vector()) {
            let mesh = sphere();
            let index = SurfaceIndex::new(&mesh);
            let ray = Ray::new(origin, direction).unwrap();
            let all = index.corners.iter().enumerate().filter_map(|(f, c)| Some((ray.intersect(c)?.1, f)));
            let expected = all.min_by(|a, b| a.partial_cmp(b).unwrap());
            let found = index.ray(origin, direction);
            prop_assert_eq!(expected, found.map(|(p, d)| (d, p.face.index())));
            if let Some((p, d)) = found {
                let q = origin + direction.normalize() * d;
                prop_assert!(p.position(&mesh).distance(q) < 1e-12);
                prop_assert!((p.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                prop_assert!(p.weights.iter().all(|&w| w >= 0.0));
            }
        }

        #[test]
        fn no_sample_is_nearer_than_the_nearest_point(point in vector()) {
            let mesh = sphere();
            let index = SurfaceIndex::new(&mesh);
            let found = index.nearest(point);
            let distance = found.position(&mesh).distance(point);
            prop_assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(found.weights.iter().all(|&w| w >= 0.0));
            for corners in &index.corners {
                for i in 0..=8u32 {
                    for j in 0..=8 - i {
                        let weights = [i, j, 8 - i - j].map(|w| f64::from(w) / 8.0);
                        prop_assert!(distance <= interpolate(corners, weights).distance(point) + 1e-12);
                    }
                }
            }
            let brute = index.corners.iter().map(|c| interpolate(c, nearest_in_triangle(point, c)).distance(point));
            prop_assert!((brute.fold(f64::INFINITY, f64::min) - distance).abs() < 1e-15);
        }
    }

    #[test]
    fn a_ray_through_an_edge_or_a_vertex_hits() {
        let mesh = sphere();
        let index = SurfaceIndex::new(&mesh);
        // At the poles rounding leaves a gap in the sphere.
        let inner = |e: &EdgeId| !mesh.edge_vertices(*e).iter().any(|&v| mesh.is_boundary_vertex(v));
        for e in mesh.edges().filter(inner) {
            let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v));
            for t in [0.0, 0.3, 0.5] {
                assert!(index.ray(DVec3::ZERO, a.lerp(b, t)).is_some());
            }
        }
        assert!(index.ray(DVec3::ZERO, DVec3::ZERO).is_none());
        assert!(index.ray(DVec3::X * 3.0, DVec3::X).is_none());
    }

    #[test]
    fn a_point_of_the_surface_is_its_own_nearest_point() {
        let mesh = sphere();
        let index = SurfaceIndex::new(&mesh);
        for face in mesh.faces().filter(|&f| mesh.face_area(f) > 1e-6) {
            let p = SurfacePoint { face, weights: [0.2, 0.3, 0.5] };
            let q = index.nearest(p.position(&mesh));
            assert!(q.face == face && q.position(&mesh).distance(p.position(&mesh)) < 1e-14);
        }
        assert_eq!(index.nearest(DVec3::NAN).face, FaceId(0));
    }
}
