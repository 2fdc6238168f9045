//! Adaptive spacing of isolines: denser where quads are far from the surface.
//!
//! Isolines that make edges short on average ([`Spacing::curvature_adapted`]) leave a few quads at tips and in hollows
//! far from the surface, since an isoline extends along a whole chord; and these quads are the visible ones. So the
//! refinement is measured, isolines become denser where its edges are farthest from the surface and sparser elsewhere,
//! and this is repeated. The result is the spacing with the least greatest distance of an edge.

use glam::DVec3;
use rayon::prelude::*;

use super::projection::Projection;
use super::quad_mesh::QuadMesh;
use super::refine::refine;
use super::smooth::project;
use super::spacing::Spacing;
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};
use crate::surface::SurfaceIndex;

/// Rounds in which isolines are placed anew.
const ROUNDS: usize = 8;
/// Most vertices of the surface that are measured; of a larger mesh a regular subset.
const MEASURED_VERTICES: usize = 20_000;
/// Isolines become denser across edges farther from the surface than this fraction of the greatest distance.
const BOUND: f64 = 0.6;

/// A spacing with a small greatest distance of edges from the surface, found from `spacing`, with about as many quads.
///
/// # Errors
///
/// When cancelled.
pub fn adaptive_spacing(
    mut spacing: Spacing,
    (layout, embedding, maps): (&QuadLayout, &Embedding, &[PatchMap]),
    base: &TriMesh,
    progress: &Progress,
) -> Result<Spacing, Cancelled> {
    let surface = Projection::new(base);
    let mut best: Option<(f64, Spacing)> = None;
    let mut total = None;
    for round in 0..=ROUNDS {
        progress.check()?;
        let mut quads = refine(layout, embedding, maps, &spacing);
        project(&mut quads, base);
        let of_vertices = vertex_distances(&quads, base);
        let each = quads.quads.par_iter().zip(of_vertices);
        let distances: Vec<[f64; 2]> =
            each.map(|(q, of_vertices)| QuadDistances::new(&quads, q, &surface).by_axis(of_vertices)).collect();
        let greatest = distances.iter().flatten().fold(0.0, |a: f64, b| a.max(*b));
        tracing::debug!(round, greatest, quads = quads.quads.len(), "greatest distance of an edge from the surface");
        let total = *total.get_or_insert(quads.quads.len() as f64);
        let next = spacing.denser(layout, &distances, BOUND * greatest, total);
        let now = std::mem::replace(&mut spacing, next);
        if best.as_ref().is_none_or(|b| greatest < b.0) {
            best = Some((greatest, now));
        }
    }
    Ok(best.map_or(spacing, |b| b.1))
}

/// The resampling error of a quad mesh on `base`: the greatest distance of its quads from the surface, at the midpoints
/// of quads and edges, and of vertices of the surface from the quads, in units of the mesh.
pub fn resampling_error(mesh: &QuadMesh, base: &TriMesh) -> f64 {
    let surface = Projection::new(base);
    let of_quads =
        mesh.quads.par_iter().map(|q| QuadDistances::new(mesh, q, &surface).greatest()).reduce(|| 0.0, f64::max);
    vertex_distances(mesh, base).into_iter().fold(of_quads, f64::max)
}

/// For each quad the greatest distance of the surface's vertices that are nearest to it; large at a tip or a crease
/// that the quad cuts off. At most [`MEASURED_VERTICES`] vertices are measured.
fn vertex_distances(mesh: &QuadMesh, base: &TriMesh) -> Vec<f64> {
    let mut greatest = vec![0.0; mesh.quads.len()];
    let halves = |&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]];
    let triangles: Vec<[u32; 3]> = mesh.quads.iter().flat_map(halves).collect();
    // A refinement that is no manifold cannot be indexed; then only the distances of quads count.
    let Ok(surface) = TriMesh::from_faces(mesh.positions.clone(), &triangles) else { return greatest };
    let index = SurfaceIndex::new(&surface);
    let step = base.n_vertices().div_ceil(MEASURED_VERTICES).max(1);
    let points: Vec<DVec3> = base.vertices().step_by(step).map(|v| base.position(v)).collect();
    let found: Vec<(usize, f64)> = points
        .par_iter()
        .map(|&p| {
            let nearest = index.nearest(p);
            (nearest.face.index() / 2, nearest.position(&surface).distance(p))
        })
        .collect();
    for (q, distance) in found {
        greatest[q] = f64::max(greatest[q], distance);
    }
    greatest
}

/// Distances of a quad from the surface.
struct QuadDistances {
    /// At the midpoints of its edges.
    edges: [f64; 4],
    /// At its own midpoint.
    middle: f64,
}

impl QuadDistances {
    fn new(mesh: &QuadMesh, quad: &[u32; 4], surface: &Projection<'_>) -> Self {
        let at = |i: usize| mesh.positions[quad[i % 4] as usize];
        // `corner` is the corner from whose triangle the projection starts.
        let distance =
            |p: DVec3, corner: usize| p.distance(surface.project(p, mesh.base_face[quad[corner] as usize]).0);
        Self {
            edges: std::array::from_fn(|i| distance(0.5 * (at(i) + at(i + 1)), i)),
            middle: distance(0.25 * (at(0) + at(1) + at(2) + at(3)), 0),
        }
    }

    /// For each axis the distance that denser isolines across it can reduce: that of its two edges, or half of the
    /// distance of the midpoint or of the surface's vertices, which both axes share.
    fn by_axis(&self, of_vertices: f64) -> [f64; 2] {
        [0, 1].map(|i| self.edges[i].max(self.edges[i + 2]).max(0.5 * self.middle.max(of_vertices)))
    }

    fn greatest(&self) -> f64 {
        self.edges.iter().fold(self.middle, |a, &b| a.max(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Arrangement;
    use crate::layout::{initial_embedding, map_patches};
    use crate::testing::{column, grid, row};

    #[test]
    fn isolines_become_denser_at_a_narrow_hill() {
        let hill = |u: f64, v: f64| (-((u - 0.3).powi(2) + (v - 0.6).powi(2)) / 0.003).exp();
        let mesh = grid(48, 48, [false, false], |u, v| DVec3::new(u, v, 0.1 * hill(u, v)));
        let curves = [row(48, 12, false, 0.5), column(48, 48, 13, false, 0.5)];
        let arrangement = Arrangement::new(&mesh, &curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
        let progress = Progress::new();
        let embedding = initial_embedding(&arrangement, &layout, &vec![None; layout.nodes.len()], &progress).unwrap();
        let maps = map_patches(&layout, &embedding, &progress).unwrap();
        let embedded = (&layout, &embedding, &maps[..]);
        let error = |spacing: &Spacing| {
            let mut quads = refine(&layout, &embedding, &maps, spacing);
            project(&mut quads, &mesh);
            (resampling_error(&quads, &mesh), quads.quads.len() as f64)
        };
        let first = Spacing::curvature_adapted(&layout, &maps, |_, _| 0.0, 300.0);
        let ((before, n), (after, m)) =
            (error(&first), error(&adaptive_spacing(first, embedded, &mesh, &progress).unwrap()));
        assert!(after < 0.7 * before, "{before} {after}");
        assert!((m / n - 1.0).abs() < 0.05, "{n} {m}");
    }
}
