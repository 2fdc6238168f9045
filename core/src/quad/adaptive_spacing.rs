//! Lines of quads where the surface needs them: nowhere far from it.
//!
//! Lines that make edges short on average ([`super::Spacing::curvature_adapted`]) leave a few quads at tips and in hollows that are
//! far from the surface, since a line there runs along a whole strip. Yet it is these that are seen. So the refinement is
//! measured, lines become denser where its edges are farthest from the surface and fewer elsewhere, and again; the lines
//! are taken with which the farthest edge is nearest.

use glam::DVec3;
use rayon::prelude::*;

use super::ground::Ground;
use super::refine::{QuadMesh, refine};
use super::smooth::project;
use super::spacing::Spacing;
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};
use crate::surface::SurfaceIndex;

/// How often lines are placed anew.
const ROUNDS: usize = 8;
/// Vertices of the surface that are looked at, at most.
const LOOKED_AT: usize = 20_000;
/// Edges farther from the surface than this share of the farthest are to come nearer.
const SHARE: f64 = 0.6;

/// Lines with which no edge is far from the surface, made from others; about as many quads as with these.
///
/// # Errors
///
/// When cancelled.
pub fn adaptive_spacing(
    mut stops: Spacing,
    (layout, embedding, maps): (&QuadLayout, &Embedding, &[PatchMap]),
    base: &TriMesh,
    progress: &Progress,
) -> Result<Spacing, Cancelled> {
    let ground = Ground::new(base);
    let mut best: Option<(f64, Spacing)> = None;
    let mut wanted = None;
    for round in 0..=ROUNDS {
        progress.check()?;
        let mut quads = refine(layout, embedding, maps, &stops);
        project(&mut quads, base);
        let missed = missed(&quads, base);
        let each = quads.quads.par_iter().zip(missed);
        let far: Vec<[f64; 2]> = each.map(|(q, missed)| Distances::of(&quads, q, &ground).sides(missed)).collect();
        let most = far.iter().flatten().fold(0.0, |a: f64, b| a.max(*b));
        tracing::debug!(round, most, quads = quads.quads.len(), "farthest edge");
        let wanted = *wanted.get_or_insert(quads.quads.len() as f64);
        let next = stops.nearer(layout, &far, SHARE * most, wanted);
        let now = std::mem::replace(&mut stops, next);
        if best.as_ref().is_none_or(|b| most < b.0) {
            best = Some((most, now));
        }
    }
    Ok(best.map_or(stops, |b| b.1))
}

/// How far the quads of a mesh on `base` are from it at most, by the middles of quads and edges and by the vertices of the
/// surface.
pub fn resampling_error(mesh: &QuadMesh, base: &TriMesh) -> f64 {
    let ground = Ground::new(base);
    let far = mesh.quads.par_iter().map(|q| Distances::of(mesh, q, &ground).most()).reduce(|| 0.0, f64::max);
    missed(mesh, base).into_iter().fold(far, f64::max)
}

/// For each quad how far vertices of the surface are from it at most that are nearest to it: a tip that pokes through it, or a
/// crease. Of a large mesh as many are looked at as tell.
fn missed(mesh: &QuadMesh, base: &TriMesh) -> Vec<f64> {
    let mut far = vec![0.0; mesh.quads.len()];
    let halves = |&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]];
    let triangles: Vec<[u32; 3]> = mesh.quads.iter().flat_map(halves).collect();
    // What is no manifold has no quads that are near anything.
    let Ok(surface) = TriMesh::from_faces(mesh.positions.clone(), &triangles) else { return far };
    let index = SurfaceIndex::new(&surface);
    let step = base.n_vertices().div_ceil(LOOKED_AT).max(1);
    let places: Vec<DVec3> = base.vertices().step_by(step).map(|v| base.position(v)).collect();
    let found: Vec<(usize, f64)> = places
        .par_iter()
        .map(|&p| {
            let nearest = index.nearest(p);
            (nearest.face.index() / 2, nearest.position(&surface).distance(p))
        })
        .collect();
    for (q, distance) in found {
        far[q] = f64::max(far[q], distance);
    }
    far
}

/// How far a quad is from the surface.
struct Distances {
    /// In the middle of its edges.
    edges: [f64; 4],
    /// In its own middle.
    middle: f64,
}

impl Distances {
    fn of(mesh: &QuadMesh, quad: &[u32; 4], ground: &Ground<'_>) -> Self {
        let at = |i: usize| mesh.positions[quad[i % 4] as usize];
        let far = |p: DVec3, adaptive_spacing: usize| {
            p.distance(ground.follow(p, mesh.base_face[quad[adaptive_spacing] as usize]).0)
        };
        Self {
            edges: std::array::from_fn(|i| far(0.5 * (at(i) + at(i + 1)), i)),
            middle: far(0.25 * (at(0) + at(1) + at(2) + at(3)), 0),
        }
    }

    /// What lines across either side can make less. Of how far its middle is each has a half, and of how far it misses the
    /// surface.
    fn sides(&self, missed: f64) -> [f64; 2] {
        [0, 1].map(|i| self.edges[i].max(self.edges[i + 2]).max(0.5 * self.middle.max(missed)))
    }

    fn most(&self) -> f64 {
        self.edges.iter().fold(self.middle, |a, &b| a.max(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Arrangement;
    use crate::layout::{embed, map_patches};
    use crate::testing::{column, grid, row};

    #[test]
    fn lines_gather_where_a_narrow_hill_would_be_cut_off() {
        let hill = |u: f64, v: f64| (-((u - 0.3).powi(2) + (v - 0.6).powi(2)) / 0.003).exp();
        let mesh = grid(48, 48, [false, false], |u, v| DVec3::new(u, v, 0.1 * hill(u, v)));
        let curves = [row(48, 12, false, 0.5), column(48, 48, 13, false, 0.5)];
        let arrangement = Arrangement::new(&mesh, &curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
        let progress = Progress::new();
        let embedding = embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &progress).unwrap();
        let maps = map_patches(&layout, &embedding, &progress).unwrap();
        let drawn = (&layout, &embedding, &maps[..]);
        let resampling_error = |stops: &Spacing| {
            let mut quads = refine(&layout, &embedding, &maps, stops);
            project(&mut quads, &mesh);
            (resampling_error(&quads, &mesh), quads.quads.len() as f64)
        };
        let first = Spacing::curvature_adapted(&layout, &maps, |_, _| 0.0, 300.0);
        let ((before, n), (after, m)) =
            (resampling_error(&first), resampling_error(&adaptive_spacing(first, drawn, &mesh, &progress).unwrap()));
        assert!(after < 0.7 * before, "{before} {after}");
        assert!((m / n - 1.0).abs() < 0.05, "{n} {m}");
    }
}
