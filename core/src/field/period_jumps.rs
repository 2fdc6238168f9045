//! Period jumps: which direction of a triangle's cross continues which of its neighbour's.
//!
//! Each edge first takes the jump that leaves the smallest rotation. Along a curve that is aligned with the field
//! this is not always right: where the curve bends at a vertex by more than an eighth of a turn, the smallest
//! rotations around the vertex would carry it over to another branch. There the jump that is cheapest to change
//! is changed; that moves a singularity from the curve to a vertex beside it.

use std::f64::consts::{FRAC_PI_2, PI};

use super::edge_paths::{EdgePath, Step, left_fan};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::Metric;

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

/// The branch of the cross in the triangle of `h` that is nearest to the direction `lean` counter-clockwise of `h`.
pub(super) fn branch_along(metric: &Metric, angle: &[f64], h: HalfedgeId, lean: f64) -> i32 {
    quarter(((metric.direction(h) + lean - angle[h.index() / 3]) / FRAC_PI_2).round() as i32)
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
    let (on_path, busy) = (vec![false; mesh.n_edges()], vec![false; mesh.n_vertices()]);
    let mut mender = Mender { mesh, metric, angle, jump, on_path, busy };
    for (step, &lean) in paths.iter().flat_map(|p| p.steps.iter().zip(&p.lean)) {
        mender.take(*step, lean);
    }
    for _ in 0..ROUNDS {
        let mut changed = false;
        for path in paths {
            for (a, b) in path.pairs() {
                let (a, b) = ((path.steps[a], path.lean[a]), (path.steps[b], path.lean[b]));
                changed |= mender.mend(a, b);
                changed |= mender.mend((b.0.reversed(), b.1), (a.0.reversed(), a.1));
            }
        }
        if !changed {
            break;
        }
    }
}

/// Jumps being changed along paths.
struct Mender<'a> {
    mesh: &'a TriMesh,
    metric: &'a Metric,
    angle: &'a [f64],
    jump: &'a mut [i8],
    /// The edges of paths.
    on_path: Vec<bool>,
    /// The vertices of paths.
    busy: Vec<bool>,
}

impl Mender<'_> {
    /// Marks an edge of a path and matches the branches on its two sides.
    fn take(&mut self, step: Step, lean: f64) {
        self.on_path[step.edge.index()] = true;
        self.busy[step.from(self.mesh).index()] = true;
        self.busy[step.to(self.mesh).index()] = true;
        if let (Some(l), Some(r)) = (step.left(self.mesh), step.right(self.mesh)) {
            let branch = |h| branch_along(self.metric, self.angle, h, lean);
            let value = branch(l) - (branch(r) + 2);
            set_across(self.mesh, self.jump, l, value);
        }
    }

    /// Changes jumps left of two consecutive steps until the second continues the first; says whether that was
    /// needed.
    fn mend(&mut self, (a, lean_a): (Step, f64), (b, lean_b): (Step, f64)) -> bool {
        let mesh = self.mesh;
        let (Some(fan), Some(ha), Some(hb)) = (left_fan(mesh, a, b), a.left(mesh), b.left(mesh)) else { return false };
        let want =
            branch_along(self.metric, self.angle, hb, lean_b) - branch_along(self.metric, self.angle, ha, lean_a);
        let sum: i32 = fan.iter().map(|&h| across(mesh, self.jump, h)).sum();
        let mut lack = small(want - sum);
        let needed = lack != 0;
        while lack != 0 {
            let sign = lack.signum();
            let Some(h) = self.cheapest(&fan, f64::from(sign)) else { return false };
            let value = across(mesh, self.jump, h) + i32::from(sign);
            set_across(mesh, self.jump, h, value);
            lack -= sign;
        }
        needed
    }

    /// Where a change of the jump by `sign` costs least: not on a path, rather not towards one, and then where it
    /// leaves the smallest rotation.
    fn cheapest(&self, fan: &[HalfedgeId], sign: f64) -> Option<HalfedgeId> {
        let cost = |h: HalfedgeId| {
            let far = self.busy[self.mesh.origin(h).index()];
            let kind = if self.on_path[self.mesh.edge(h).index()] { 2 } else { u8::from(far) };
            (kind, -sign * rest(self.metric, self.mesh, self.angle, self.jump, h))
        };
        fan.iter().copied().min_by(|&x, &y| {
            let (x, y) = (cost(x), cost(y));
            x.0.cmp(&y.0).then(x.1.total_cmp(&y.1))
        })
    }
}
