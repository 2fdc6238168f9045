//! Principal curvatures by normal cycles, averaged over a ball of chosen radius.
//!
//! Each edge carries the tensor `β |e| ē ēᵀ` (β: signed angle between its two normals, convex positive), whose sum
//! over a region divided by the area converges to the shape operator with its two principal directions swapped
//! (Cohen-Steiner and Morvan 2003). To keep the cost independent of the radius, the tensors are first summed over
//! small patches; a vertex then gathers the patches whose centre it reaches within the radius. Patches end at sharp
//! edges and the gathering does not pass them, so that one side of a crease does not blur the other; the
//! crease itself counts for both.

use std::collections::VecDeque;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::mesh::{TriMesh, VertexId};

/// Patch radius relative to the averaging radius: about 60 patches in a ball, which moves the mean of a linear
/// curvature by less than a percent.
const PATCH_RADIUS: f64 = 0.25;

/// Averaging radius never below this many mean edge lengths around the vertex: a single ring is mostly noise.
const LEAST_RADIUS_IN_EDGES: f64 = 1.5;

/// Principal curvatures and directions at a vertex.
///
/// Curvatures are positive where the surface is convex seen from outside (1/R on a sphere); `k_min ≤ k_max` as
/// signed numbers. Directions are unit, tangent to the surface, orthogonal, and of no particular sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalCurvature {
    /// Smaller curvature.
    pub k_min: f64,
    /// Larger curvature.
    pub k_max: f64,
    /// Direction of `k_min`.
    pub d_min: DVec3,
    /// Direction of `k_max`.
    pub d_max: DVec3,
}

/// Shape tensor and area of a piece of surface, with its centre.
#[derive(Debug, Clone, Copy)]
struct Piece {
    tensor: DMat3,
    area: f64,
    centre: DVec3,
}

/// Principal curvatures at all vertices, averaged over about `radius` (in the units of the mesh); `sharp` has a flag
/// per edge.
pub fn principal_curvature(mesh: &TriMesh, radius: f64, sharp: &[bool]) -> Vec<PrincipalCurvature> {
    let on_crease =
        |v: VertexId| mesh.outgoing(v).any(|h| sharp[mesh.edge(h).index()] || sharp[mesh.edge(mesh.prev(h)).index()]);
    let crease: Vec<bool> = mesh.vertices().map(on_crease).collect();
    let pieces: Vec<Piece> = (0..mesh.n_vertices()).into_par_iter().map(|v| ring(mesh, VertexId::new(v))).collect();
    let (patch_of, patches) = patches(mesh, PATCH_RADIUS * radius, &crease, &pieces);
    let (first, neighbours) = adjacency(mesh, &patch_of, patches.len());
    let wall: Vec<bool> = {
        let mut wall = vec![false; patches.len()];
        for v in mesh.vertices().filter(|v| crease[v.index()]) {
            wall[patch_of[v.index()] as usize] = true;
        }
        wall
    };
    // Visited marks are kept per chunk, so that each costs one allocation and the result no order of threads.
    let chunk = 1024;
    let chunks: Vec<Vec<PrincipalCurvature>> = (0..mesh.n_vertices().div_ceil(chunk))
        .into_par_iter()
        .map(|c| {
            let mut seen = vec![u32::MAX; patches.len()];
            let mut queue = Vec::new();
            (c * chunk..((c + 1) * chunk).min(mesh.n_vertices()))
                .map(|i| {
                    let v = VertexId::new(i);
                    let radius = radius.max(LEAST_RADIUS_IN_EDGES * mean_edge(mesh, v));
                    queue.clear();
                    queue.push(patch_of[i]);
                    seen[patch_of[i] as usize] = i as u32;
                    let (mut tensor, mut area) = (DMat3::ZERO, 0.0);
                    let mut next = 0;
                    while next < queue.len() {
                        let p = queue[next] as usize;
                        next += 1;
                        let distance = patches[p].centre.distance(mesh.position(v));
                        let weight = if next == 1 { 1.0 } else { (1.0 - (distance / radius).powi(2)).max(0.0) };
                        tensor += patches[p].tensor * weight;
                        area += patches[p].area * weight;
                        if weight == 0.0 || (wall[p] && next > 1) {
                            continue;
                        }
                        for &n in &neighbours[first[p] as usize..first[p + 1] as usize] {
                            if seen[n as usize] != i as u32 {
                                seen[n as usize] = i as u32;
                                queue.push(n);
                            }
                        }
                    }
                    let tensor = if area > 0.0 { tensor * (1.0 / area) } else { DMat3::ZERO };
                    principal(tensor, vertex_normal(mesh, v))
                })
                .collect()
        })
        .collect();
    chunks.concat()
}

fn mean_edge(mesh: &TriMesh, v: VertexId) -> f64 {
    let (sum, n) = mesh.outgoing(v).fold((0.0, 0.0), |(s, n), h| (s + mesh.vector(h).length(), n + 1.0));
    sum / n
}

fn vertex_normal(mesh: &TriMesh, v: VertexId) -> DVec3 {
    let angle_weighted: DVec3 = mesh.outgoing(v).map(|h| mesh.face_normal(mesh.face(h)) * mesh.corner_angle(h)).sum();
    angle_weighted.try_normalize().unwrap_or(DVec3::Z)
}

/// What belongs to one vertex: half of its edges, a third of its triangles.
fn ring(mesh: &TriMesh, v: VertexId) -> Piece {
    let (mut tensor, mut area) = (DMat3::ZERO, 0.0);
    for h in mesh.outgoing(v) {
        area += mesh.face_area(mesh.face(h)) / 3.0;
        let Some(twin) = mesh.twin(h) else { continue };
        let vector = mesh.vector(h);
        let length = vector.length();
        let Some(e) = vector.try_normalize() else { continue };
        let (n0, n1) = (mesh.face_normal(mesh.face(h)), mesh.face_normal(mesh.face(twin)));
        let angle = n0.cross(n1).dot(e).atan2(n0.dot(n1));
        tensor += outer(e) * (0.5 * angle * length);
    }
    Piece { tensor, area, centre: mesh.position(v) }
}

fn outer(e: DVec3) -> DMat3 {
    DMat3::from_cols(e * e.x, e * e.y, e * e.z)
}

/// Groups vertices into patches of the given radius, greedily in order; vertices on creases stay alone.
fn patches(mesh: &TriMesh, radius: f64, crease: &[bool], pieces: &[Piece]) -> (Vec<u32>, Vec<Piece>) {
    let mut patch_of = vec![u32::MAX; mesh.n_vertices()];
    let mut patches = Vec::new();
    let mut queue = VecDeque::new();
    for seed in mesh.vertices() {
        if patch_of[seed.index()] != u32::MAX {
            continue;
        }
        let id = patches.len() as u32;
        patch_of[seed.index()] = id;
        queue.push_back(seed);
        let (mut tensor, mut area, mut moment, mut centre, mut count) =
            (DMat3::ZERO, 0.0, DVec3::ZERO, DVec3::ZERO, 0.0);
        while let Some(v) = queue.pop_front() {
            let piece = &pieces[v.index()];
            tensor += piece.tensor;
            area += piece.area;
            moment += piece.centre * piece.area;
            centre += piece.centre;
            count += 1.0;
            if crease[v.index()] {
                continue;
            }
            for h in mesh.outgoing(v) {
                // The target of each spoke; the last spoke of a boundary fan is the target of `next`.
                for w in [mesh.target(h), mesh.opposite(h)] {
                    let near = mesh.position(w).distance(mesh.position(seed)) <= radius;
                    if patch_of[w.index()] == u32::MAX && !crease[w.index()] && near {
                        patch_of[w.index()] = id;
                        queue.push_back(w);
                    }
                }
            }
        }
        let centre = if area > 0.0 { moment / area } else { centre / count };
        patches.push(Piece { tensor, area, centre });
    }
    (patch_of, patches)
}

/// Which patches touch, as compressed rows.
fn adjacency(mesh: &TriMesh, patch_of: &[u32], n: usize) -> (Vec<u32>, Vec<u32>) {
    let mut pairs: Vec<(u32, u32)> = mesh
        .edges()
        .flat_map(|e| {
            let [a, b] = mesh.edge_vertices(e).map(|v| patch_of[v.index()]);
            [(a, b), (b, a)]
        })
        .filter(|(a, b)| a != b)
        .collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    let mut first = vec![0u32; n + 1];
    for &(a, _) in &pairs {
        first[a as usize + 1] += 1;
    }
    for i in 0..n {
        first[i + 1] += first[i];
    }
    (first, pairs.into_iter().map(|(_, b)| b).collect())
}

/// Principal curvatures of a normal-cycle tensor in the plane with normal `n`.
fn principal(tensor: DMat3, n: DVec3) -> PrincipalCurvature {
    let (x, y) = n.any_orthonormal_pair();
    let (a, b, c) = (x.dot(tensor * x), x.dot(tensor * y), y.dot(tensor * y));
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let root = difference.hypot(b);
    let angle = 0.5 * b.atan2(difference);
    // The tensor stretches along the edges: its larger eigenvalue belongs across, see the head of the file.
    let along = x * angle.cos() + y * angle.sin();
    PrincipalCurvature { k_min: mean - root, k_max: mean + root, d_min: along, d_max: n.cross(along) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    fn circle(u: f64) -> DVec3 {
        let a = u * std::f64::consts::TAU;
        DVec3::new(a.cos(), a.sin(), 0.0)
    }

    fn curvature(mesh: &TriMesh, radius: f64) -> Vec<PrincipalCurvature> {
        principal_curvature(mesh, radius, &vec![false; mesh.n_edges()])
    }

    #[test]
    fn a_cylinder_curves_across_its_axis() {
        let mesh = grid(60, 40, [true, false], |u, v| circle(u) * 0.5 + DVec3::Z * 4.0 * v);
        for radius in [0.0, 0.3] {
            for (v, c) in mesh.vertices().zip(curvature(&mesh, radius)) {
                let z = mesh.position(v).z;
                if (0.5..3.5).contains(&z) {
                    assert!((c.k_max - 2.0).abs() < 0.1 && c.k_min.abs() < 0.05, "{radius} {c:?}");
                    assert!(c.d_min.z.abs() > 0.99 && c.d_max.z.abs() < 0.1, "{radius} {c:?}");
                }
            }
        }
    }

    #[test]
    fn a_sphere_is_convex_in_all_directions() {
        // A band of the sphere of radius 2, without its poles.
        let mesh = grid(80, 40, [true, false], |u, v| {
            let b = (v - 0.5) * 2.6;
            (circle(u) * b.cos() + DVec3::Z * b.sin()) * 2.0
        });
        for (v, c) in mesh.vertices().zip(curvature(&mesh, 0.4)) {
            if mesh.position(v).z.abs() < 1.2 {
                assert!((c.k_max - 0.5).abs() < 0.06 && (c.k_min - 0.5).abs() < 0.06, "{c:?}");
            }
        }
    }

    #[test]
    fn a_torus_has_its_textbook_curvatures() {
        let (big, small) = (1.0, 0.4);
        let tau = std::f64::consts::TAU;
        let mesh = grid(120, 60, [true, true], |u, v| {
            circle(u) * (big + small * (v * tau).cos()) + DVec3::Z * small * (v * tau).sin()
        });
        for (v, c) in mesh.vertices().zip(curvature(&mesh, 0.12)) {
            let p = mesh.position(v);
            let rho = p.x.hypot(p.y);
            let across = (rho - big) / small / rho;
            assert!((c.k_max - 1.0 / small).abs() < 0.15, "{c:?}");
            assert!((c.k_min - across).abs() < 0.15, "{c:?} at {rho}, expected {across}");
            // The smaller curvature runs the long way round.
            let round = DVec3::Z.cross(p).normalize();
            assert!(c.d_min.dot(round).abs() > 0.98, "{c:?}");
        }
    }

    #[test]
    fn directions_are_a_frame_and_flat_pieces_stay_finite() {
        let flat = grid(6, 3, [true, false], |u, v| circle(u) * (1.0 + v));
        for c in curvature(&flat, 0.5) {
            assert_eq!((c.k_min, c.k_max), (0.0, 0.0));
            assert!(c.d_min.is_normalized() && c.d_max.is_normalized() && c.d_min.dot(c.d_max).abs() < 1e-12);
        }
    }
}
