//! Principal curvatures at vertices by normal cycles (Cohen-Steiner and Morvan 2003), averaged over a ball.
//!
//! Each edge carries the tensor `β |e| ē ēᵀ` (`β`: signed dihedral angle, positive where convex; `ē`: unit vector along
//! the edge). Their sum over a region, divided by its area, converges to the shape operator with its two principal
//! directions swapped. To make the cost independent of the radius, tensors are first summed over small patches of
//! vertices; a vertex then sums the patches with centres within the radius. Patches end at sharp edges and the
//! breadth-first traversal of patches stops there, so that one side of a crease does not blur the other; the crease
//! itself counts for both.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::tangent_tensor::{outer, plane_eigen};
use crate::mesh::{BreadthFirst, TriMesh, VertexId};

/// Radius of a patch, as a fraction of the averaging radius. A ball then holds about 60 patches, which moves the mean
/// of a linearly varying curvature by less than a percent.
const PATCH_RADIUS: f64 = 0.25;

/// Least averaging radius, in mean edge lengths around the vertex. A single ring of triangles gives mostly noise.
const LEAST_RADIUS_IN_EDGES: f64 = 1.5;

/// Vertices that share one array of visited marks. Marks are kept per chunk and not per thread, so that the result does
/// not depend on the number of threads.
const CHUNK: usize = 1024;

/// Principal curvatures and directions at a vertex.
///
/// Curvatures are positive where the surface is convex seen from outside (1/R on a sphere); `k_min ≤ k_max` as
/// signed numbers. Directions are unit vectors, tangent to the surface, orthogonal, and of no particular sign.
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

/// Normal-cycle tensor, area and centre of a piece of surface.
#[derive(Debug, Clone, Copy)]
struct Piece {
    tensor: DMat3,
    area: f64,
    centre: DVec3,
}

/// Principal curvatures at all vertices, averaged over about `radius` (in units of the mesh); `sharp` has a flag per
/// edge.
pub fn principal_curvature(mesh: &TriMesh, radius: f64, sharp: &[bool]) -> Vec<PrincipalCurvature> {
    let patches = Patches::new(mesh, PATCH_RADIUS * radius, sharp);
    let chunks: Vec<Vec<PrincipalCurvature>> = (0..mesh.n_vertices().div_ceil(CHUNK))
        .into_par_iter()
        .map(|c| {
            let mut visited = Visited { by: vec![u32::MAX; patches.pieces.len()], queue: Vec::new() };
            (c * CHUNK..((c + 1) * CHUNK).min(mesh.n_vertices()))
                .map(|i| {
                    let v = VertexId::new(i);
                    let radius = radius.max(LEAST_RADIUS_IN_EDGES * mean_edge(mesh, v));
                    of_normal_cycles(patches.mean_tensor(mesh, v, radius, &mut visited), vertex_normal(mesh, v))
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

/// The share of a vertex: half of its edges, a third of its triangles.
fn vertex_piece(mesh: &TriMesh, v: VertexId) -> Piece {
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

/// Marks of one breadth-first traversal of patches after another.
struct Visited {
    /// The last vertex from which each patch was reached.
    by: Vec<u32>,
    queue: Vec<u32>,
}

/// A partition of the vertices into patches.
struct Patches {
    /// The patch of each vertex.
    of_vertex: Vec<u32>,
    pieces: Vec<Piece>,
    /// Whether a patch is a vertex on a crease.
    on_crease: Vec<bool>,
    /// The neighbours of patch `p` are `neighbours[first[p]..first[p + 1]]`.
    first: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Patches {
    fn new(mesh: &TriMesh, radius: f64, sharp: &[bool]) -> Self {
        let on_crease = |v: VertexId| {
            mesh.outgoing(v).any(|h| sharp[mesh.edge(h).index()] || sharp[mesh.edge(mesh.prev(h)).index()])
        };
        let crease: Vec<bool> = mesh.vertices().map(on_crease).collect();
        let shares: Vec<Piece> =
            (0..mesh.n_vertices()).into_par_iter().map(|v| vertex_piece(mesh, VertexId::new(v))).collect();
        let (of_vertex, pieces) = group(mesh, radius, &crease, &shares);
        let (first, neighbours) = adjacency(mesh, &of_vertex, pieces.len());
        let mut on_crease = vec![false; pieces.len()];
        for v in mesh.vertices().filter(|v| crease[v.index()]) {
            on_crease[of_vertex[v.index()] as usize] = true;
        }
        Self { of_vertex, pieces, on_crease, first, neighbours }
    }

    /// Tensor per area around a vertex: the mean over patches within `radius`, weighted by `1 − (distance / radius)²`;
    /// the patch of the vertex has weight 1.
    fn mean_tensor(&self, mesh: &TriMesh, v: VertexId, radius: f64, visited: &mut Visited) -> DMat3 {
        let (home, stamp) = (self.of_vertex[v.index()], v.index() as u32);
        let Visited { by, queue } = visited;
        queue.clear();
        queue.push(home);
        by[home as usize] = stamp;
        let (mut tensor, mut area) = (DMat3::ZERO, 0.0);
        let mut next = 0;
        while next < queue.len() {
            let p = queue[next] as usize;
            next += 1;
            let distance = self.pieces[p].centre.distance(mesh.position(v));
            let weight = if next == 1 { 1.0 } else { (1.0 - (distance / radius).powi(2)).max(0.0) };
            tensor += self.pieces[p].tensor * weight;
            area += self.pieces[p].area * weight;
            if weight == 0.0 || (self.on_crease[p] && next > 1) {
                continue;
            }
            for &n in &self.neighbours[self.first[p] as usize..self.first[p + 1] as usize] {
                if by[n as usize] != stamp {
                    by[n as usize] = stamp;
                    queue.push(n);
                }
            }
        }
        if area > 0.0 { tensor * (1.0 / area) } else { DMat3::ZERO }
    }
}

/// Groups vertices into patches of the given radius, greedily in order of ids; a vertex on a crease is a patch of its
/// own.
fn group(mesh: &TriMesh, radius: f64, crease: &[bool], shares: &[Piece]) -> (Vec<u32>, Vec<Piece>) {
    let mut patch_of = vec![u32::MAX; mesh.n_vertices()];
    let mut patches = Vec::new();
    let mut search: BreadthFirst<VertexId, ()> = BreadthFirst::new(mesh.n_vertices());
    for seed in mesh.vertices() {
        if !search.start(seed) {
            continue;
        }
        let id = patches.len() as u32;
        let (mut tensor, mut area, mut moment, mut centre, mut count) =
            (DMat3::ZERO, 0.0, DVec3::ZERO, DVec3::ZERO, 0.0);
        while let Some(v) = search.visit() {
            patch_of[v.index()] = id;
            let share = &shares[v.index()];
            tensor += share.tensor;
            area += share.area;
            moment += share.centre * share.area;
            centre += share.centre;
            count += 1.0;
            if crease[v.index()] {
                continue;
            }
            for (_, w) in mesh.spokes(v) {
                if !crease[w.index()] && mesh.position(w).distance(mesh.position(seed)) <= radius {
                    search.reach(w, ());
                }
            }
        }
        let centre = if area > 0.0 { moment / area } else { centre / count };
        patches.push(Piece { tensor, area, centre });
    }
    (patch_of, patches)
}

/// Adjacency of patches in compressed sparse row form: offsets and neighbours.
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

/// Principal curvatures of a normal-cycle tensor in the plane with unit normal `n`.
fn of_normal_cycles(tensor: DMat3, n: DVec3) -> PrincipalCurvature {
    let eigen = plane_eigen(tensor, n);
    // The eigenvector of the larger eigenvalue is the direction of the smaller curvature: see the head of the file.
    PrincipalCurvature { k_min: eigen.low, k_max: eigen.high, d_min: eigen.axis, d_max: n.cross(eigen.axis) }
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
    fn a_cylinder_is_curved_across_its_axis() {
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
    fn a_sphere_has_equal_positive_curvatures() {
        // A sphere of radius 2 without its poles.
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
    fn a_torus_has_its_analytic_curvatures() {
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
            // The smaller curvature is along the larger circle.
            let along = DVec3::Z.cross(p).normalize();
            assert!(c.d_min.dot(along).abs() > 0.98, "{c:?}");
        }
    }

    #[test]
    fn a_flat_mesh_has_curvature_zero_and_orthonormal_directions() {
        let flat = grid(6, 3, [true, false], |u, v| circle(u) * (1.0 + v));
        for c in curvature(&flat, 0.5) {
            assert_eq!((c.k_min, c.k_max), (0.0, 0.0));
            assert!(c.d_min.is_normalized() && c.d_max.is_normalized() && c.d_min.dot(c.d_max).abs() < 1e-12);
        }
    }
}
