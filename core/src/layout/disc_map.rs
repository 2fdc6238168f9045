//! Stretch-minimising maps of discs onto convex shapes.
//!
//! With positive weights and the border on a convex curve, a discrete harmonic map is injective (Tutte; Floater).
//! Cotangent weights map a flat disc to itself, but they may be negative and, in slivers, arbitrarily large. Where they
//! flip triangles they are clamped to a positive range.
//!
//! A harmonic map shrinks protrusions to almost nothing. Dividing the weights by the stretch at both ends of each edge
//! and solving again enlarges them (Yoshizawa, Belyaev and Seidel: A fast and simple stretch-minimizing mesh
//! parameterization, 2004). Injectivity holds in exact arithmetic; because of rounding errors each map is checked for
//! flipped triangles.

use glam::DVec2;

use super::embedding::path_lengths;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::solve::{SolveError, SparseHermitian, SpdFactor};

/// Bounds of clamped edge weights. In an equilateral mesh all weights are 0.58. The lower bound keeps weights positive;
/// a ratio of 1000 does not harm the solver.
const WEIGHT_RANGE: (f64, f64) = (0.01, 10.0);
/// Largest number of rounds of stretch minimisation. Usually two or three suffice.
const MAX_ROUNDS: usize = 8;
/// Ratio of the stretch to that of the last round above which no further round follows.
const MAX_STRETCH_RATIO: f64 = 0.9;
/// Bounds of the factor by which a round changes a weight for one of its ends.
const FACTOR_RANGE: (f64, f64) = (1e-2, 1e2);
/// Lower bound of the sine of an angle in a cotangent: it bounds the weights of degenerate triangles.
const MIN_SINE: f64 = 1e-6;

/// The weights of the first harmonic map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InitialWeights {
    /// Cotangents, unless they flip triangles: they preserve angles best.
    Cotangent,
    /// Cotangents clamped to a positive range: the images of slivers keep some width, so that paths can be inserted
    /// across them.
    Clamped,
}

/// An injective map of little stretch with `fixed` vertices at given positions: first harmonic, then with weights
/// divided by the stretch as long as the stretch decreases.
///
/// # Errors
///
/// When the linear system cannot be solved (no vertex of some component is fixed).
pub(crate) fn disc_map(
    mesh: &TriMesh,
    fixed: &[Option<DVec2>],
    initial: InitialWeights,
) -> Result<Vec<DVec2>, SolveError> {
    let exact: Vec<f64> = mesh.edges().map(|e| cotangents(mesh, mesh.halfedge(e))).collect();
    let mut weights: Vec<f64> = exact.iter().map(|w| w.clamp(WEIGHT_RANGE.0, WEIGHT_RANGE.1)).collect();
    let mut map = match initial {
        InitialWeights::Cotangent => solve(mesh, fixed, &exact).ok().filter(|map| count_flipped(mesh, map) == 0),
        InitialWeights::Clamped => None,
    }
    .map_or_else(|| solve(mesh, fixed, &weights), Ok)?;
    if count_flipped(mesh, &map) > 0 {
        // Fallback: equal weights distort more but do not depend on the quality of triangles.
        weights.fill(1.0);
        map = solve(mesh, fixed, &weights)?;
    }
    let mut least = f64::INFINITY;
    let mut best = map.clone();
    for _ in 0..=MAX_ROUNDS {
        let (stretch, at) = stretch(mesh, &map);
        if stretch.is_nan() || stretch >= MAX_STRETCH_RATIO * least {
            break;
        }
        (least, best) = (stretch, map);
        for e in mesh.edges() {
            let [a, b] = mesh.edge_vertices(e);
            weights[e.index()] /= at[a.index()] * at[b.index()];
        }
        match solve(mesh, fixed, &weights) {
            Ok(next) if count_flipped(mesh, &next) == 0 => map = next,
            // Rounding errors flip triangles: keep the last map.
            _ => break,
        }
    }
    Ok(best)
}

/// The stretch of the inverse map, from the plane to the surface: its total, and at each vertex relative to the mean.
///
/// At a vertex it is the square root of the ratio of the areas of two rings of triangles, on the surface and in the
/// plane. Unlike the stretch of single triangles, it is not dominated by one sliver.
fn stretch(mesh: &TriMesh, map: &[DVec2]) -> (f64, Vec<f64>) {
    let mut areas = vec![(0.0, 0.0); mesh.n_vertices()];
    for f in mesh.faces() {
        let corners = mesh.face_vertices(f);
        let [a, b, c] = corners.map(|v| map[v.index()]);
        let flat = 0.5 * (b - a).perp_dot(c - a).max(0.0);
        for v in corners {
            let at = &mut areas[v.index()];
            *at = (at.0 + mesh.face_area(f), at.1 + flat);
        }
    }
    let mut wider = areas.clone();
    for e in mesh.edges() {
        let [a, b] = mesh.edge_vertices(e).map(|v| v.index());
        for (to, from) in [(a, b), (b, a)] {
            wider[to] = (wider[to].0 + areas[from].0, wider[to].1 + areas[from].1);
        }
    }
    let areas = wider;
    let squared: Vec<f64> = areas.iter().map(|(area, flat)| area / flat.max(f64::MIN_POSITIVE)).collect();
    let total: f64 = areas.iter().zip(&squared).map(|(a, s)| a.0 * s).sum();
    let mean = total / areas.iter().map(|a| a.0).sum::<f64>();
    (total, squared.into_iter().map(|s| (s / mean).sqrt().clamp(FACTOR_RANGE.0, FACTOR_RANGE.1)).collect())
}

/// Half the sum of the cotangents of the angles opposite an edge.
fn cotangents(mesh: &TriMesh, h: HalfedgeId) -> f64 {
    let cot = |h| {
        let a = mesh.corner_angle(mesh.prev(h));
        if a > 0.0 { a.cos() / a.sin().max(MIN_SINE) } else { 0.0 }
    };
    0.5 * (cot(h) + mesh.twin(h).map_or(0.0, cot))
}

/// The map in which every vertex that is not fixed is the mean of its neighbours, weighted by the `weights` of its
/// edges.
fn solve(mesh: &TriMesh, fixed: &[Option<DVec2>], weights: &[f64]) -> Result<Vec<DVec2>, SolveError> {
    let mut unknown = vec![u32::MAX; mesh.n_vertices()];
    let mut n = 0;
    for v in mesh.vertices() {
        if fixed[v.index()].is_none() {
            unknown[v.index()] = n;
            n += 1;
        }
    }
    let mut map: Vec<DVec2> = fixed.iter().map(|p| p.unwrap_or(DVec2::ZERO)).collect();
    if n == 0 {
        return Ok(map);
    }
    let mut triplets = Vec::with_capacity(3 * mesh.n_edges());
    let mut rhs = [vec![0.0; n as usize], vec![0.0; n as usize]];
    let mut add_row = |v: VertexId, other: VertexId, w: f64, triplets: &mut Vec<(u32, u32, f64)>| {
        let i = unknown[v.index()];
        if i == u32::MAX {
            return;
        }
        triplets.push((i, i, w));
        if let Some(p) = fixed[other.index()] {
            rhs[0][i as usize] += w * p.x;
            rhs[1][i as usize] += w * p.y;
        }
    };
    for e in mesh.edges() {
        let (w, [a, b]) = (weights[e.index()], mesh.edge_vertices(e));
        add_row(a, b, w, &mut triplets);
        add_row(b, a, w, &mut triplets);
        let (i, j) = (unknown[a.index()], unknown[b.index()]);
        if i != u32::MAX && j != u32::MAX {
            triplets.push((i.max(j), i.min(j), -w));
        }
    }
    let matrix = SparseHermitian::from_triplets(n as usize, &triplets);
    let factor = SpdFactor::new(&matrix)?;
    let (x, y) = (factor.solve(&matrix, &rhs[0])?, factor.solve(&matrix, &rhs[1])?);
    for v in mesh.vertices() {
        let i = unknown[v.index()];
        if i != u32::MAX {
            map[v.index()] = DVec2::new(x[i as usize], y[i as usize]);
        }
    }
    Ok(map)
}

/// The map of a disc onto the unit disc, with each side on an equal share of the circle.
pub(super) fn unit_disc_map(disc: &TriMesh, sides: &[Vec<u32>]) -> Result<Vec<DVec2>, SolveError> {
    let mut fixed = vec![None; disc.n_vertices()];
    for (k, side) in sides.iter().enumerate() {
        let along = path_lengths(disc.positions(), side);
        let total = along[along.len() - 1].max(f64::MIN_POSITIVE);
        for (&v, s) in side.iter().zip(along).take(side.len() - 1) {
            let turn = (k as f64 + s / total) / sides.len() as f64;
            fixed[v as usize] = Some(DVec2::from_angle(std::f64::consts::TAU * turn));
        }
    }
    disc_map(disc, &fixed, InitialWeights::Clamped)
}

/// Number of triangles that `map` flips or makes degenerate.
pub(crate) fn count_flipped(mesh: &TriMesh, map: &[DVec2]) -> usize {
    mesh.faces()
        .filter(|&f| {
            let [a, b, c] = mesh.face_vertices(f).map(|v| map[v.index()]);
            (b - a).perp_dot(c - a) <= 0.0
        })
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    #[test]
    fn flat_disc_is_mapped_to_itself() {
        let mesh =
            grid(8, 8, [false, false], |u, v| glam::DVec3::new(u + 0.03 * (9.0 * v).sin() * u * (1.0 - u), v, 0.0));
        let fixed: Vec<Option<DVec2>> =
            mesh.vertices().map(|v| mesh.is_boundary_vertex(v).then(|| mesh.position(v).truncate())).collect();
        for (v, at) in mesh.vertices().zip(disc_map(&mesh, &fixed, InitialWeights::Cotangent).unwrap()) {
            assert!(mesh.position(v).truncate().distance(at) < 1e-12);
        }
    }

    #[test]
    fn stretch_minimisation_enlarges_protrusions_without_flips() {
        let bump = |u: f64, v: f64| 2.0 * (-40.0 * ((u - 0.5).powi(2) + (v - 0.5).powi(2))).exp();
        let mesh = grid(24, 24, [false, false], |u, v| glam::DVec3::new(u, v, bump(u, v)));
        let fixed: Vec<Option<DVec2>> =
            mesh.vertices().map(|v| mesh.is_boundary_vertex(v).then(|| mesh.position(v).truncate())).collect();
        let weights: Vec<f64> = mesh.edges().map(|e| cotangents(&mesh, mesh.halfedge(e))).collect();
        let harmonic = solve(&mesh, &fixed, &weights).unwrap();
        let map = disc_map(&mesh, &fixed, InitialWeights::Cotangent).unwrap();
        assert_eq!(count_flipped(&mesh, &map), 0);
        assert!(stretch(&mesh, &map).0 < 0.5 * stretch(&mesh, &harmonic).0);
    }

    #[test]
    fn fixed_vertices_stay_and_flipped_triangles_are_counted() {
        let mesh = grid(2, 2, [false, false], |u, v| glam::DVec3::new(u, v, 0.0));
        let mut map: Vec<DVec2> = mesh.vertices().map(|v| mesh.position(v).truncate()).collect();
        let fixed: Vec<Option<DVec2>> = map.iter().map(|&p| Some(2.0 * p)).collect();
        let fixed_map = disc_map(&mesh, &fixed, InitialWeights::Cotangent).unwrap();
        assert!(fixed_map.iter().zip(&fixed).all(|(p, q)| Some(*p) == *q));
        assert_eq!(count_flipped(&mesh, &map), 0);
        map.iter_mut().for_each(|p| p.x = -p.x);
        assert_eq!(count_flipped(&mesh, &map), mesh.n_faces());
    }
}
