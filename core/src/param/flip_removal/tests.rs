//! Removal of flipped triangles from maps of grids and fans.

use glam::DVec2;

use super::stiffening::assemble;
use super::*;
use crate::solve::{Constraint, Reduction, SpdFactor, eliminate};

/// A surface with a map.
pub(super) struct Sheet {
    pub triangles: Vec<OrientedTriangle>,
    pub reduction: Reduction,
    pub quarters: Vec<u32>,
}

impl Sheet {
    pub fn problem(&self) -> OrientationProblem<'_> {
        OrientationProblem { triangles: &self.triangles, reduction: &self.reduction, quarters: &self.quarters }
    }
}

/// The least-squares solution.
pub(super) fn solved(problem: &OrientationProblem) -> Vec<f64> {
    let (matrix, rhs) = assemble(problem, &vec![1.0; problem.triangles.len()]);
    SpdFactor::new(&matrix).unwrap().solve(&matrix, &rhs).unwrap()
}

/// A triangle whose corner `i` has the full variables `2 w[i]` and `2 w[i] + 1`.
fn triangle(layout: [DVec2; 3], vertices: [u32; 3], wedges: [u32; 3]) -> OrientedTriangle {
    let area = 0.5 * (layout[1] - layout[0]).perp_dot(layout[2] - layout[0]);
    OrientedTriangle {
        layout,
        axis: DVec2::X,
        lengths: DVec2::ONE,
        weight: area,
        ratio: 1.0,
        vertices,
        corners: wedges.map(|w| [(2 * w, 1.0), (2 * w + 1, 1.0)]),
    }
}

/// The vertex of a grid of `n` × `n` unit cells.
fn at(n: u32, i: u32, j: u32) -> u32 {
    j * (n + 1) + i
}

fn point(n: u32, v: u32) -> DVec2 {
    DVec2::new(f64::from(v % (n + 1)), f64::from(v / (n + 1)))
}

fn grid_triangles(n: u32) -> Vec<OrientedTriangle> {
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let faces = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(n, i, j), at(n, i + 1, j), at(n, i + 1, j + 1), at(n, i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    faces.map(|f| triangle(f.map(|v| point(n, v)), f, f)).collect()
}

fn fix(v: u32, to: DVec2) -> [Constraint; 2] {
    [0, 1].map(|k| Constraint { terms: vec![(2 * v + k, 1.0)], rhs: to[k as usize] })
}

/// A grid of `n` × `n` unit cells with the origin and the given vertices fixed where said.
fn pinned(n: u32, pins: &[(u32, DVec2)]) -> Sheet {
    let mut constraints: Vec<_> = fix(0, DVec2::ZERO).to_vec();
    constraints.extend(pins.iter().flat_map(|&(v, to)| fix(v, to)));
    let quarters = (0..(n + 1) * (n + 1))
        .map(|v| if [v % (n + 1), v / (n + 1)].iter().all(|&c| c > 0 && c < n) { 4 } else { 0 })
        .collect();
    let variables = vec![1; 2 * ((n + 1) * (n + 1)) as usize];
    Sheet { triangles: grid_triangles(n), reduction: eliminate(&variables, &constraints).unwrap(), quarters }
}

/// A grid with a vertex in its middle dragged over its neighbours and a fixed boundary.
pub(super) fn dragged(n: u32) -> Sheet {
    let mut pins = boundary(n);
    let v = at(n, n / 2, n / 2);
    pins.push((v, point(n, v) + DVec2::new(3.1, 1.6)));
    pinned(n, &pins)
}

fn boundary(n: u32) -> Vec<(u32, DVec2)> {
    (0..(n + 1) * (n + 1))
        .filter(|v| [v % (n + 1), v / (n + 1)].iter().any(|&c| c == 0 || c == n))
        .map(|v| (v, point(n, v)))
        .collect()
}

/// A disc of `rings` rings of triangles around vertex 0, with `sectors` triangles in the first ring. The angle of
/// vertex 0 in the map is `quarters` quarter turns. Each sector has its own chart; neighbouring charts differ by
/// quarter turns.
fn fan(sectors: u32, quarters: u32, rings: u32, pins: &[(u32, u32, u32, DVec2)]) -> Sheet {
    let angle = std::f64::consts::TAU / f64::from(sectors);
    // Vertex (ring, sector, step) lies on the side of the ring from one ray to the next.
    let vertex = |r: u32, s: u32, k: u32| {
        if r == 0 { 0 } else { 1 + sectors * r * (r - 1) / 2 + (s * r + k) % (sectors * r) }
    };
    let n_vertices = 1 + sectors * rings * (rings + 1) / 2;
    let place = |r: u32, k: u32| f64::from(r - k) * DVec2::X + f64::from(k) * DVec2::from_angle(angle);
    let (mut triangles, mut constraints) = (Vec::new(), Vec::new());
    // Each sector has wedges of its own: coordinates are cut along all rays.
    let per_sector = (rings + 1) * (rings + 2) / 2;
    let wedge = |r: u32, s: u32, k: u32| s * per_sector + r * (r + 1) / 2 + k;
    for s in 0..sectors {
        // The field turns with the sector: evenly spread over the angle of the map.
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarters) / f64::from(sectors) * f64::from(s);
        let chart = (turn / std::f64::consts::FRAC_PI_2).round();
        let axis = DVec2::from_angle(std::f64::consts::FRAC_PI_2 * chart - turn);
        for r in 0..rings {
            for k in 0..=r {
                let mut add = |corners: [(u32, u32); 3]| {
                    triangles.push(OrientedTriangle {
                        axis,
                        ..triangle(
                            corners.map(|(r, k)| place(r, k)),
                            corners.map(|(r, k)| vertex(r, s, k)),
                            corners.map(|(r, k)| wedge(r, s, k)),
                        )
                    });
                };
                add([(r, k), (r + 1, k), (r + 1, k + 1)]);
                if k < r {
                    add([(r, k), (r + 1, k + 1), (r, k + 1)]);
                }
            }
        }
        // Along the ray after this sector: w_next = i^-p w.
        let next = (s + 1) % sectors;
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarters) / f64::from(sectors) * f64::from(s + 1);
        let chart_next = (turn / std::f64::consts::FRAC_PI_2).round();
        let p = (chart_next - chart) as i32;
        for r in 0..=rings {
            let (a, b) = (2 * wedge(r, s, r), 2 * wedge(r, next, 0));
            let rows = [(0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0)];
            let (iu, su) = rows[p.rem_euclid(4) as usize];
            let (iv, sv) = rows[(p + 1).rem_euclid(4) as usize];
            constraints.push(Constraint { terms: vec![(b, 1.0), (a + iu, -su)], rhs: 0.0 });
            constraints.push(Constraint { terms: vec![(b + 1, 1.0), (a + iv, -sv)], rhs: 0.0 });
        }
    }
    let variables = vec![1; (2 * sectors * per_sector) as usize];
    constraints.extend(fix(0, DVec2::ZERO));
    constraints.extend(pins.iter().flat_map(|&(r, s, k, to)| fix(wedge(r, s, k), to)));
    let inner = vertex(rings, 0, 0);
    let quarters = (0..n_vertices).map(|v| if v == 0 { quarters } else { 4 * u32::from(v < inner) }).collect();
    Sheet { triangles, reduction: eliminate(&variables, &constraints).unwrap(), quarters }
}

/// A grid with two neighbouring vertices in the middle, each constrained to two distant vertices that draw it over the
/// other.
fn constrained(n: u32) -> Sheet {
    let mut constraints: Vec<_> = boundary(n).iter().flat_map(|&(v, to)| fix(v, to)).collect();
    let mut tie =
        |a: u32, b: u32, rhs: f64| constraints.push(Constraint { terms: vec![(2 * a, 1.0), (2 * b, -1.0)], rhs });
    let (m, q) = (n / 2, n / 6);
    tie(at(n, m, m), at(n, m, q), 0.0);
    tie(at(n, m, m), at(n, m, n - q), 6.0);
    tie(at(n, m + 1, m), at(n, m + 1, q), 0.0);
    tie(at(n, m + 1, m), at(n, m + 1, n - q), -6.0);
    let quarters = vec![0; ((n + 1) * (n + 1)) as usize];
    let variables = vec![1; 2 * ((n + 1) * (n + 1)) as usize];
    Sheet { triangles: grid_triangles(n), reduction: eliminate(&variables, &constraints).unwrap(), quarters }
}

fn removed(sheet: &Sheet) -> (Vec<f64>, FlipRemoval) {
    let y = solved(&sheet.problem());
    let out = remove_flips(&sheet.problem(), &y, Effort::Thorough, &Progress::new()).unwrap();
    assert_eq!(out.flipped.len(), sheet.problem().flipped(&sheet.reduction.expand(&out.y)).len());
    (y, out)
}

#[test]
fn dragged_vertex_leaves_no_flipped_triangle() {
    let (_, out) = removed(&dragged(24));
    assert!(out.flipped_before > 0 && out.flipped.is_empty());
    assert!(out.energy > out.energy_before && out.energy < 3.0 * out.energy_before);
}

#[test]
fn map_without_flips_is_returned_unchanged() {
    let sheet = pinned(6, &[(at(6, 3, 3), DVec2::new(3.2, 3.1))]);
    let (y, out) = removed(&sheet);
    assert_eq!((out.y, out.flipped_before), (y, 0));
}

#[test]
fn swapped_vertices_are_reported_as_not_resolved() {
    let n = 10;
    let pins = [(at(n, 5, 5), DVec2::new(6.0, 5.0)), (at(n, 6, 5), DVec2::new(5.0, 5.0))];
    let (_, out) = removed(&pinned(n, &pins));
    assert!(!out.flipped.is_empty() && out.flipped.len() <= out.flipped_before);
    assert!(out.flipped.iter().all(|f| f.reason == FlipReason::NotResolved));
}

#[test]
fn flips_beside_unresolvable_ones_are_removed() {
    let n = 30;
    let mut pins = boundary(n);
    pins.extend([(at(n, 15, 15), DVec2::new(16.0, 15.0)), (at(n, 16, 15), DVec2::new(15.0, 15.0))]);
    // Near enough to share a domain with the swapped ones.
    let v = at(n, 19, 17);
    pins.push((v, point(n, v) + DVec2::new(2.6, -1.3)));
    let sheet = pinned(n, &pins);
    let (_, out) = removed(&sheet);
    let swapped = |t: u32| {
        let vertices = sheet.triangles[t as usize].vertices;
        vertices.contains(&at(n, 15, 15)) || vertices.contains(&at(n, 16, 15))
    };
    assert!(!out.flipped.is_empty() && out.flipped.len() < out.flipped_before);
    assert!(out.flipped.iter().all(|f| swapped(f.triangle)), "{:?}", out.flipped);
}

#[test]
fn triangle_determined_by_constraints_is_reported_as_fixed() {
    let n = 8;
    let pins = [(4, 4, 4.0, 4.0), (5, 4, 4.0, 5.0), (5, 5, 5.0, 4.0)];
    let (_, out) = removed(&pinned(n, &pins.map(|(i, j, x, y)| (at(n, i, j), DVec2::new(x, y)))));
    let fixed = FlippedTriangle { triangle: 2 * (4 * n + 4), reason: FlipReason::Fixed };
    assert!(out.flipped.contains(&fixed), "{:?}", out.flipped);
}

#[test]
fn constrained_vertices_move_together() {
    let sheet = constrained(30);
    let (_, out) = removed(&sheet);
    assert!(out.flipped_before > 0 && out.flipped.is_empty());
    assert!(out.energy < 2.0 * out.energy_before);
}

#[test]
fn flips_are_removed_across_seams_with_quarter_turns() {
    // On the ray between two sectors of a vertex of valence 5.
    let pin = 4.0 * DVec2::from_angle(0.5) + DVec2::new(4.0, -4.0);
    let sheet = fan(6, 5, 8, &[(4, 2, 4, pin)]);
    assert!(
        sheet
            .triangles
            .iter()
            .flat_map(|t| &t.corners)
            .flatten()
            .any(|&(x, _)| { sheet.reduction.expression(x as usize).0.iter().any(|&(_, c)| c == -1.0) })
    );
    let (_, out) = removed(&sheet);
    assert!(out.flipped_before > 0 && out.flipped.is_empty());
    assert!(out.energy < 1.5 * out.energy_before);
}

#[test]
fn vertex_of_too_high_valence_is_reported() {
    let reason = FlipReason::HighValence { vertex: 0, quarters: 12, triangles: 6 };
    let (_, out) = removed(&fan(6, 12, 6, &[]));
    assert_eq!(out.flipped.len(), 6);
    assert!(out.flipped.iter().all(|f| f.reason == reason));
    // Flipped triangles elsewhere are removed, and six triangles can span eleven quarter turns.
    let pins = [(4, 0, 2, DVec2::new(7.5, 1.0))];
    let (_, out) = removed(&fan(6, 12, 6, &pins));
    assert!(out.flipped_before > out.flipped.len() && out.flipped.iter().all(|f| f.reason == reason), "{out:?}");
    assert!(removed(&fan(6, 11, 6, &[])).1.flipped.is_empty());
}

#[test]
fn removal_can_be_cancelled_and_returns_nan_unchanged() {
    let sheet = dragged(12);
    let progress = Progress::new();
    let nonsense = vec![f64::NAN; sheet.reduction.n_free()];
    let out = remove_flips(&sheet.problem(), &nonsense, Effort::Thorough, &progress).unwrap();
    assert!(!out.flipped.is_empty() && out.y.iter().all(|y| y.is_nan()));
    progress.cancel();
    assert_eq!(remove_flips(&sheet.problem(), &solved(&sheet.problem()), Effort::Thorough, &progress), Err(Cancelled));
}
