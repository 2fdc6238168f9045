//! Smoothing a quad mesh on the surface.
//!
//! Every quad asks its corners to form a rectangle in the surface's tangent plane, of its own mean sides drawn
//! towards the mean of its row; a vertex goes to the mean of what its quads ask for and back to the surface.
//! The rectangle is laid out counter-clockwise around the *surface's* normal, so a folded quad asks to be
//! turned over. The structure of the mesh never changes.

use glam::DVec3;
use rayon::prelude::*;

use super::project::follow;
use super::refine::QuadMesh;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Rounds of smoothing; differences are invisible after.
const ROUNDS: usize = 150;
/// Fraction of the way that a vertex goes in one round: damps oscillation between neighbours.
const STEP: f64 = 0.8;
/// How much of a side's length is its quad's own; the rest is the mean of its patch row. Own lengths alone
/// let quads crowd at bottlenecks.
const OWN: f64 = 0.6;
/// Boundary vertices whose boundary turns by more than this (radians) stay where they are.
const CORNER: f64 = 0.6;

/// Scaled Jacobian of every quad: the smallest sine of its corner angles, negative where it is folded.
pub fn scaled_jacobians(mesh: &QuadMesh) -> Vec<f64> {
    let p = |v: u32| mesh.positions[v as usize];
    mesh.quads
        .iter()
        .map(|q| {
            let n = (p(q[2]) - p(q[0])).cross(p(q[3]) - p(q[1])).normalize_or_zero();
            (0..4)
                .map(|k| {
                    let o = p(q[k]);
                    let (x, y) = (p(q[(k + 1) % 4]) - o, p(q[(k + 3) % 4]) - o);
                    x.cross(y).dot(n) / (x.length() * y.length()).max(f64::MIN_POSITIVE)
                })
                .fold(f64::INFINITY, f64::min)
        })
        .collect()
}

/// Number of folded quads and mean scaled Jacobian.
pub fn quality(mesh: &QuadMesh) -> (usize, f64) {
    let all = scaled_jacobians(mesh);
    let folded = all.iter().filter(|&&s| s <= 0.0).count();
    (folded, all.iter().sum::<f64>() / all.len().max(1) as f64)
}

/// Smooths `mesh` on `base`; keeps the better of before and after.
///
/// # Errors
///
/// When cancelled; `mesh` is then as before.
pub fn smooth(mesh: &mut QuadMesh, base: &TriMesh, progress: &Progress) -> Result<(), Cancelled> {
    let around = Incidence::new(mesh);
    let rail = Rail::new(mesh, base);
    let mut work = mesh.clone();
    let mut best = (quality(mesh), None);
    for round in 0..ROUNDS {
        progress.check()?;
        step(&mut work, base, &around, &rail);
        if round % 25 == 24 || round + 1 == ROUNDS {
            let now = quality(&work);
            let better = now.0 < best.0.0 || (now.0 == best.0.0 && now.1 > best.0.1);
            if better && work.positions.iter().all(|p| p.is_finite()) {
                best = (now, Some(work.clone()));
            }
        }
    }
    if let (_, Some(better)) = best {
        *mesh = better;
    }
    Ok(())
}

/// The corners of quads at each vertex: quad and place in it.
struct Incidence {
    corners: Vec<Vec<(u32, u8)>>,
    /// The two neighbours along the boundary, of boundary vertices.
    along: Vec<Option<[u32; 2]>>,
}

impl Incidence {
    fn new(mesh: &QuadMesh) -> Self {
        let n = mesh.positions.len();
        let mut corners = vec![Vec::new(); n];
        let mut directed = std::collections::HashSet::new();
        for (q, quad) in mesh.quads.iter().enumerate() {
            for k in 0..4 {
                corners[quad[k] as usize].push((q as u32, k as u8));
                directed.insert((quad[k], quad[(k + 1) % 4]));
            }
        }
        let mut along = vec![None; n];
        for quad in &mesh.quads {
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) % 4]);
                if !directed.contains(&(b, a)) {
                    along[a as usize].get_or_insert([u32::MAX; 2])[1] = b;
                    along[b as usize].get_or_insert([u32::MAX; 2])[0] = a;
                }
            }
        }
        Self { corners, along }
    }
}

/// Where boundary vertices may go: along the boundary of the surface, or nowhere.
struct Rail {
    fixed: Vec<bool>,
}

impl Rail {
    fn new(mesh: &QuadMesh, base: &TriMesh) -> Self {
        // Corners of the surface's boundary hold the vertices that lie on them.
        let turn = |v: VertexId| {
            let angle: f64 = base.outgoing(v).map(|h| base.corner_angle(h)).sum();
            (std::f64::consts::PI - angle).abs()
        };
        let sharp: Vec<DVec3> = base
            .vertices()
            .filter(|&v| base.is_boundary_vertex(v) && turn(v) > CORNER)
            .map(|v| base.position(v))
            .collect();
        let fixed = mesh
            .positions
            .iter()
            .zip(&mesh.boundary)
            .map(|(p, &b)| b && sharp.iter().any(|s| s.distance_squared(*p) < 1e-18))
            .collect();
        Self { fixed }
    }
}

/// One round over all vertices.
fn step(mesh: &mut QuadMesh, base: &TriMesh, around: &Incidence, rail: &Rail) {
    let lengths = row_lengths(mesh);
    let targets: Vec<[DVec3; 4]> =
        mesh.quads.par_iter().enumerate().map(|(q, quad)| rectangle(mesh, base, quad, lengths[q])).collect();
    let moved: Vec<(DVec3, u32)> = (0..mesh.positions.len())
        .into_par_iter()
        .map(|v| {
            let old = (mesh.positions[v], mesh.base_face[v]);
            if rail.fixed[v] {
                return old;
            }
            let list = &around.corners[v];
            let sum: DVec3 = list.iter().map(|&(q, k)| targets[q as usize][k as usize]).sum();
            let wanted = old.0.lerp(sum / list.len() as f64, STEP);
            match around.along[v] {
                Some(ends) if mesh.boundary[v] => slide(base, wanted, old, ends.map(|e| mesh.positions[e as usize])),
                _ => follow(base, wanted, old.1),
            }
        })
        .collect();
    for (v, (p, f)) in moved.into_iter().enumerate() {
        mesh.positions[v] = p;
        mesh.base_face[v] = f;
    }
}

/// The point of the surface's boundary near `wanted`, reached from `old` without passing its neighbours.
fn slide(base: &TriMesh, wanted: DVec3, old: (DVec3, u32), ends: [DVec3; 2]) -> (DVec3, u32) {
    // Boundary half-edges within reach: those of the fan around the old place, both ways.
    let reach = ends[0].distance(old.0).max(ends[1].distance(old.0));
    let Some(start) = nearest_boundary(base, old) else { return old };
    let mut best = (wanted.distance_squared(old.0), old);
    for forward in [true, false] {
        let mut h = start;
        let mut walked = 0.0;
        while walked <= reach {
            let (a, b) = (base.position(base.origin(h)), base.position(base.target(h)));
            let t = ((wanted - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let p = a.lerp(b, t);
            let d = p.distance_squared(wanted);
            if d < best.0 {
                best = (d, (p, base.face(h).0));
            }
            walked += a.distance(b).max(1e-9);
            h = if forward { base.vertex_halfedge(base.target(h)) } else { boundary_before(base, h) };
            if h == start {
                break;
            }
        }
    }
    best.1
}

/// The boundary half-edge that ends where `h` starts.
fn boundary_before(base: &TriMesh, h: crate::mesh::HalfedgeId) -> crate::mesh::HalfedgeId {
    let last = base.outgoing(base.origin(h)).last().unwrap_or(h);
    base.prev(last)
}

/// The boundary half-edge nearest to a point on the boundary, among those around its triangle.
fn nearest_boundary(base: &TriMesh, (p, f): (DVec3, u32)) -> Option<crate::mesh::HalfedgeId> {
    let around = base.face_vertices(FaceId(f)).into_iter().filter(|&v| base.is_boundary_vertex(v));
    let edges = around.flat_map(|v| {
        let h = base.vertex_halfedge(v);
        [h, boundary_before(base, h)]
    });
    edges.min_by(|&g, &h| {
        let d = |h| {
            let (a, b) = (base.position(base.origin(h)), base.position(base.target(h)));
            let t = ((p - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            a.lerp(b, t).distance_squared(p)
        };
        d(g).total_cmp(&d(h))
    })
}

/// Mean side lengths of the quads of every patch, as the lengths that its quads are drawn to.
fn row_lengths(mesh: &QuadMesh) -> Vec<[f64; 2]> {
    let n_patches = mesh.patch.iter().max().map_or(0, |&p| p as usize + 1);
    let mut sum = vec![[0.0; 2]; n_patches];
    let mut count = vec![0.0; n_patches];
    let sides: Vec<[f64; 2]> = mesh.quads.iter().map(|q| own_lengths(mesh, q)).collect();
    for (s, &p) in sides.iter().zip(&mesh.patch) {
        sum[p as usize][0] += s[0];
        sum[p as usize][1] += s[1];
        count[p as usize] += 1.0;
    }
    sides
        .iter()
        .zip(&mesh.patch)
        .map(|(s, &p)| {
            let p = p as usize;
            [0, 1].map(|i| OWN * s[i] + (1.0 - OWN) * sum[p][i] / count[p])
        })
        .collect()
}

/// Mean lengths of the two pairs of opposite sides.
fn own_lengths(mesh: &QuadMesh, q: &[u32; 4]) -> [f64; 2] {
    let d = |i: usize, j: usize| mesh.positions[q[i] as usize].distance(mesh.positions[q[j] as usize]);
    [0.5 * (d(0, 1) + d(3, 2)), 0.5 * (d(1, 2) + d(0, 3))]
}

/// The rectangle that a quad asks for.
fn rectangle(mesh: &QuadMesh, base: &TriMesh, q: &[u32; 4], [a, b]: [f64; 2]) -> [DVec3; 4] {
    let p = q.map(|v| mesh.positions[v as usize]);
    let center = (p[0] + p[1] + p[2] + p[3]) / 4.0;
    let normal: DVec3 = q.iter().map(|&v| base.face_normal(FaceId(mesh.base_face[v as usize]))).sum();
    let own = (p[2] - p[0]).cross(p[3] - p[1]);
    let n = normal.normalize_or(own.normalize_or(DVec3::Z));
    let u = p[1] + p[2] - p[0] - p[3];
    let v = p[2] + p[3] - p[0] - p[1];
    // The mean of one direction and of the other turned back by a right angle, each of unit length.
    let flat = |w: DVec3| (w - n * n.dot(w)).normalize_or_zero();
    let x = (flat(u) + flat(v).cross(n)).normalize_or(n.any_orthonormal_vector());
    let y = n.cross(x);
    let (x, y) = (x * (0.5 * a), y * (0.5 * b));
    [center - x - y, center + x - y, center + x + y, center - x + y]
}
