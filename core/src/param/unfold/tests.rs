//! Maps that fold, and what becomes of them.

use glam::DVec2;

use super::stiffen::assemble;
use super::*;
use crate::solve::{Constraint, SpdFactor, eliminate};

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

/// A grid with a vertex of its middle dragged over its neighbours, the boundary kept.
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

fn removed(sheet: &Sheet) -> (Vec<f64>, Unfolded) {
    let y = solved(&sheet.problem());
    let out = unfold(&sheet.problem(), &y, &Progress::new()).unwrap();
    assert_eq!(out.folds.len(), sheet.problem().folded(&sheet.reduction.expand(&out.y)).len());
    (y, out)
}

#[test]
fn a_dragged_vertex_leaves_no_fold() {
    let (_, out) = removed(&dragged(24));
    eprintln!("{} {} {} {}", out.folds_before, out.folds.len(), out.energy_before, out.energy);
    assert!(out.folds_before > 0 && out.folds.is_empty());
    assert!(out.energy > out.energy_before && out.energy < 3.0 * out.energy_before);
}

#[test]
fn nothing_to_do_changes_no_bit() {
    let sheet = pinned(6, &[(at(6, 3, 3), DVec2::new(3.2, 3.1))]);
    let (y, out) = removed(&sheet);
    assert_eq!((out.y, out.folds_before), (y, 0));
}

#[test]
fn swapped_vertices_are_reported_or_resolved() {
    let n = 10;
    let pins = [(at(n, 5, 5), DVec2::new(6.0, 5.0)), (at(n, 6, 5), DVec2::new(5.0, 5.0))];
    let (_, out) = removed(&pinned(n, &pins));
    eprintln!("{} {:?} {} {}", out.folds_before, out.folds, out.energy_before, out.energy);
    assert!(out.folds.len() <= out.folds_before);
}

#[test]
fn measure() {
    for (drag, label) in [(2.0, "2"), (3.0, "3"), (4.0, "4")] {
        let n = 100;
        let mut pins = boundary(n);
        for j in 0..5 {
            for i in 0..6 {
                let v = at(n, 10 + 16 * i, 12 + 19 * j);
                let angle = f64::from(7 * i + 5 * j * j);
                pins.push((v, point(n, v) + drag * DVec2::from_angle(angle)));
            }
        }
        let sheet = pinned(n, &pins);
        let t0 = std::time::Instant::now();
        let y = solved(&sheet.problem());
        let t1 = t0.elapsed();
        let out = unfold(&sheet.problem(), &y, &Progress::new()).unwrap();
        eprintln!(
            "drag {label}: solve {t1:?} unfold {:?} folds {} -> {} energy {} -> {}",
            t0.elapsed() - t1,
            out.folds_before,
            out.folds.len(),
            out.energy_before,
            out.energy
        );
    }
}
