//! Harmonic maps of discs onto convex shapes (Tutte; Floater).
//!
//! With positive weights and the border on a convex curve the map is one to one. Cotangents as they are map a flat disc
//! to itself, but may be negative and, in slivers, of any size; where that does harm they are kept positive and of
//! bounded ratio.
//!
//! A harmonic map shrinks limbs to almost nothing. Dividing the weights by the stretch at both their ends and
//! mapping again gives them room, and the map stays one to one (Yoshizawa, Belyaev, Seidel: A fast and simple
//! stretch-minimizing mesh parameterization, 2004).

use glam::DVec2;

use crate::mesh::{TriMesh, VertexId};
use crate::solve::{SolveError, SparseHermitian, SpdFactor};

/// Bounds of an edge's weight. An equilateral mesh has 0.58 everywhere; the lower bound keeps the weights
/// positive, and a ratio of 1000 is harmless to the solver.
const WEIGHTS: (f64, f64) = (0.01, 10.0);

/// Rounds of making the stretch less at most; most discs need two or three.
const ROUNDS: usize = 8;
/// By what factor a round must make the stretch less for another to follow.
const LESS: f64 = 0.9;
/// Bounds of the factor by which one round changes a weight at one end.
const FACTOR: (f64, f64) = (1e-2, 1e2);

/// With which weights a map is made at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum First {
    /// Cotangents as they are, if they do not fold it: angles are kept best.
    Conformal,
    /// Positive ones of bounded ratio: slivers keep some width, as is wanted where lines are to be drawn across them.
    Robust,
}

/// A one-to-one map of little stretch, with `fixed` vertices where they are told to be: harmonic at first, then
/// again with weights divided by the stretch, for as long as that makes the stretch less.
///
/// # Errors
///
/// When the linear system cannot be solved (no vertex of some component is fixed).
pub(crate) fn relaxed(mesh: &TriMesh, fixed: &[Option<DVec2>], first: First) -> Result<Vec<DVec2>, SolveError> {
    let exact: Vec<f64> = mesh.edges().map(|e| cotangents(mesh, mesh.halfedge(e))).collect();
    let mut weights: Vec<f64> = exact.iter().map(|w| w.clamp(WEIGHTS.0, WEIGHTS.1)).collect();
    let mut map = match first {
        First::Conformal => solve(mesh, fixed, &exact).ok().filter(|map| flipped(mesh, map) == 0),
        First::Robust => None,
    }
    .map_or_else(|| solve(mesh, fixed, &weights), Ok)?;
    if flipped(mesh, &map) > 0 {
        // Equal weights are coarser in shape, but untouched by bad triangles.
        weights.fill(1.0);
        map = solve(mesh, fixed, &weights)?;
    }
    let mut least = f64::INFINITY;
    let mut best = map.clone();
    for _ in 0..=ROUNDS {
        let (stretch, at) = stretch(mesh, &map);
        if stretch.is_nan() || stretch >= LESS * least {
            break;
        }
        (least, best) = (stretch, map);
        for e in mesh.edges() {
            let [a, b] = mesh.edge_vertices(e);
            weights[e.index()] /= at[a.index()] * at[b.index()];
        }
        match solve(mesh, fixed, &weights) {
            Ok(next) if flipped(mesh, &next) == 0 => map = next,
            // Rounding has the better of it: the last map stands.
            _ => break,
        }
    }
    Ok(best)
}

/// The stretch of a map from the plane to the surface, of the whole and at every vertex relative to the mean.
///
/// At a vertex it is the root of the ratio of areas of two rings of triangles, on the surface and in the plane:
/// unlike the stretch of single triangles, one sliver cannot dominate it.
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
    (total, squared.into_iter().map(|s| (s / mean).sqrt().clamp(FACTOR.0, FACTOR.1)).collect())
}

/// Half the sum of the cotangents of the angles opposite an edge.
fn cotangents(mesh: &TriMesh, h: crate::mesh::HalfedgeId) -> f64 {
    let cot = |h| {
        let a = mesh.corner_angle(mesh.prev(h));
        if a > 0.0 { a.cos() / a.sin().max(1e-6) } else { 0.0 }
    };
    0.5 * (cot(h) + mesh.twin(h).map_or(0.0, cot))
}

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
    let mut pull = |v: VertexId, other: VertexId, w: f64, triplets: &mut Vec<(u32, u32, f64)>| {
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
        pull(a, b, w, &mut triplets);
        pull(b, a, w, &mut triplets);
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

/// The triangles that `map` turns over or flattens.
pub(crate) fn flipped(mesh: &TriMesh, map: &[DVec2]) -> usize {
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
    fn a_flat_disc_stays_as_it_is() {
        let mesh =
            grid(8, 8, [false, false], |u, v| glam::DVec3::new(u + 0.03 * (9.0 * v).sin() * u * (1.0 - u), v, 0.0));
        let fixed: Vec<Option<DVec2>> =
            mesh.vertices().map(|v| mesh.is_boundary_vertex(v).then(|| mesh.position(v).truncate())).collect();
        for (v, at) in mesh.vertices().zip(relaxed(&mesh, &fixed, First::Conformal).unwrap()) {
            assert!(mesh.position(v).truncate().distance(at) < 1e-12);
        }
    }

    #[test]
    fn a_limb_gets_room_in_a_map_that_stays_one_to_one() {
        let bump = |u: f64, v: f64| 2.0 * (-40.0 * ((u - 0.5).powi(2) + (v - 0.5).powi(2))).exp();
        let mesh = grid(24, 24, [false, false], |u, v| glam::DVec3::new(u, v, bump(u, v)));
        let fixed: Vec<Option<DVec2>> =
            mesh.vertices().map(|v| mesh.is_boundary_vertex(v).then(|| mesh.position(v).truncate())).collect();
        let weights: Vec<f64> = mesh.edges().map(|e| cotangents(&mesh, mesh.halfedge(e))).collect();
        let harmonic = solve(&mesh, &fixed, &weights).unwrap();
        let map = relaxed(&mesh, &fixed, First::Conformal).unwrap();
        assert_eq!(flipped(&mesh, &map), 0);
        assert!(stretch(&mesh, &map).0 < 0.5 * stretch(&mesh, &harmonic).0);
    }
}
