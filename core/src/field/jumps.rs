//! Period jumps: which direction of a triangle's cross continues which of its neighbour's.
//!
//! Each edge first takes the jump that leaves the smallest rotation. Along a curve that is aligned with the field
//! this is not always right: where the curve bends at a vertex by more than an eighth of a turn, the smallest
//! rotations around the vertex would carry it over to another branch. There the jump that is cheapest to change
//! is changed; that moves a singularity from the curve to a vertex beside it.

use std::f64::consts::{FRAC_PI_2, PI};

use super::curves::{EdgePath, Step};
use super::metric::Metric;
use crate::mesh::{EdgeId, HalfedgeId, TriMesh};

/// How often the fans are gone through: a change in one may upset another it shares an edge with.
const ROUNDS: usize = 4;

/// An angle brought into `(-π, π]`.
pub(super) fn wrap(angle: f64) -> f64 {
    let a = angle - (angle / (2.0 * PI)).round() * 2.0 * PI;
    if a <= -PI { a + 2.0 * PI } else { a }
}

/// A branch or jump brought into 0 to 3.
fn quarter(k: i32) -> i32 {
    k.rem_euclid(4)
}

/// A jump brought into -1 to 2.
fn small(k: i32) -> i8 {
    ((k + 1).rem_euclid(4) - 1) as i8
}

/// How much the field turns from the triangle of `h` to that of its twin, in `(-π, π]`.
fn turn(metric: &Metric, mesh: &TriMesh, angle: &[f64], h: HalfedgeId, twin: HalfedgeId) -> f64 {
    wrap(angle[mesh.face(twin).index()] - angle[mesh.face(h).index()] - metric.transport(h, twin))
}

/// What the turn across `h` is beyond the jump, in `(-π, π]`; zero on the boundary.
pub(super) fn rest(metric: &Metric, mesh: &TriMesh, angle: &[f64], jump: &[i8], h: HalfedgeId) -> f64 {
    mesh.twin(h).map_or(0.0, |t| wrap(turn(metric, mesh, angle, h, t) - f64::from(across(mesh, jump, h)) * FRAC_PI_2))
}

/// The jump across `h`, from its triangle to that of its twin.
#[inline]
pub(super) fn across(mesh: &TriMesh, jump: &[i8], h: HalfedgeId) -> i32 {
    let e = mesh.edge(h);
    let p = i32::from(jump[e.index()]);
    if mesh.halfedge(e) == h { p } else { -p }
}

fn set_across(mesh: &TriMesh, jump: &mut [i8], h: HalfedgeId, value: i32) {
    let e = mesh.edge(h);
    jump[e.index()] = small(if mesh.halfedge(e) == h { value } else { -value });
}

/// The branch of the cross in the triangle of `h` that is nearest to `h`.
pub(super) fn branch_along(metric: &Metric, angle: &[f64], h: HalfedgeId) -> i32 {
    quarter(((metric.direction(h) - angle[h.index() / 3]) / FRAC_PI_2).round() as i32)
}

/// The jumps of smallest rotation.
pub(super) fn principal(mesh: &TriMesh, metric: &Metric, angle: &[f64]) -> Vec<i8> {
    mesh.edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            mesh.twin(h).map_or(0, |t| small((turn(metric, mesh, angle, h, t) / FRAC_PI_2).round() as i32))
        })
        .collect()
}

/// Changes jumps so that the edges of every path continue each other on one branch, on both of its sides.
pub(super) fn keep_on_branch(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &mut [i8], paths: &[EdgePath]) {
    let mut on_path = vec![false; mesh.n_edges()];
    let mut busy = vec![false; mesh.n_vertices()];
    for step in paths.iter().flat_map(|p| &p.steps) {
        on_path[step.edge.index()] = true;
        busy[step.from(mesh).index()] = true;
        busy[step.to(mesh).index()] = true;
        if let (Some(l), Some(r)) = (step.left(mesh), step.right(mesh)) {
            let value = branch_along(metric, angle, l) - (branch_along(metric, angle, r) + 2);
            set_across(mesh, jump, l, value);
        }
    }
    for _ in 0..ROUNDS {
        let mut changed = false;
        for path in paths {
            for (a, b) in pairs(path) {
                for (a, b) in [(a, b), (b.reversed(), a.reversed())] {
                    changed |= mend(mesh, metric, angle, jump, (a, b), &on_path, &busy);
                }
            }
        }
        if !changed {
            break;
        }
    }
}

/// Consecutive steps of a path.
fn pairs(path: &EdgePath) -> impl Iterator<Item = (Step, Step)> + '_ {
    let n = path.steps.len();
    (usize::from(!path.closed)..n).map(move |i| (path.steps[(i + n - 1) % n], path.steps[i]))
}

/// Mends the fan left of two consecutive steps; says whether anything was changed.
fn mend(
    mesh: &TriMesh,
    metric: &Metric,
    angle: &[f64],
    jump: &mut [i8],
    (a, b): (Step, Step),
    on_path: &[bool],
    busy: &[bool],
) -> bool {
    let Some(fan) = left_fan(mesh, a, b) else { return false };
    let (Some(ha), Some(hb)) = (a.left(mesh), b.left(mesh)) else { return false };
    if fan.is_empty() {
        return false;
    }
    let sum: i32 = fan.iter().map(|&h| across(mesh, jump, h)).sum();
    let mut lack = small(branch_along(metric, angle, hb) - sum - branch_along(metric, angle, ha));
    let changed = lack != 0;
    while lack != 0 {
        let sign = i32::from(lack.signum());
        // Not another path, rather not an edge to another path's vertex, then the largest turn of the right sign.
        let cost = |h: HalfedgeId| {
            let e: EdgeId = mesh.edge(h);
            let far = mesh.origin(h);
            let kind = if on_path[e.index()] { 2 } else { i32::from(busy[far.index()]) };
            (kind, -f64::from(sign) * rest(metric, mesh, angle, jump, h))
        };
        let best = fan.iter().copied().min_by(|&x, &y| {
            let (x, y) = (cost(x), cost(y));
            x.0.cmp(&y.0).then(x.1.total_cmp(&y.1))
        });
        let Some(best) = best else { return false };
        let value = across(mesh, jump, best) + sign;
        set_across(mesh, jump, best, value);
        lack -= sign as i8;
    }
    changed
}

/// The half-edges crossed counter-clockwise around the vertex between two steps, from the triangle left of the
/// second to the triangle left of the first; `None` if the boundary is in between.
fn left_fan(mesh: &TriMesh, a: Step, b: Step) -> Option<Vec<HalfedgeId>> {
    let end = a.left(mesh)?;
    let mut h = b.left(mesh)?;
    let mut fan = Vec::new();
    loop {
        let spoke = mesh.prev(h);
        if spoke == end {
            return Some(fan);
        }
        fan.push(spoke);
        h = mesh.twin(spoke)?;
    }
}
