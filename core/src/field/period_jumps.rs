//! Period jumps of a cross field with known angles.
//!
//! Each edge first takes the jump of smallest rotation. Along a curve the field is aligned with, this is not always right:
//! if the edges of the curve bend at a vertex by more than an eighth of a turn, the smallest rotations around the vertex
//! continue one edge by another direction of the cross than the next edge has. There jumps on one side of the curve are
//! changed where the remaining rotation stays smallest; this moves a singularity from the curve to a vertex beside it.

use std::f64::consts::{FRAC_PI_2, PI};

use super::edge_paths::{EdgePath, Step, left_fan};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::Metric;

/// Most passes over all paths: a change of one fan may invalidate another that shares an edge with it. Chosen by hand.
const MAX_PASSES: usize = 4;

/// An angle modulo a full turn, in `(-π, π]`.
pub(super) fn wrap(angle: f64) -> f64 {
    let a = angle - (angle / (2.0 * PI)).round() * 2.0 * PI;
    if a <= -PI { a + 2.0 * PI } else { a }
}

/// A direction of a cross modulo four, 0 to 3.
fn modulo_four(k: i32) -> i32 {
    k.rem_euclid(4)
}

/// A jump modulo four, -1 to 2.
fn reduced(k: i32) -> i8 {
    ((k + 1).rem_euclid(4) - 1) as i8
}

/// The rotation of direction 0 from the triangle of `h` to that of its twin, in `(-π, π]`.
fn rotation(metric: &Metric, mesh: &TriMesh, angle: &[f64], h: HalfedgeId, twin: HalfedgeId) -> f64 {
    wrap(angle[mesh.face(twin).index()] - angle[mesh.face(h).index()] - metric.transport(h, twin))
}

/// The residual rotation across `h`: what remains without the jump, in `(-π, π]`; zero on the boundary.
pub(super) fn residual_rotation(metric: &Metric, mesh: &TriMesh, angle: &[f64], jump: &[i8], h: HalfedgeId) -> f64 {
    mesh.twin(h)
        .map_or(0.0, |t| wrap(rotation(metric, mesh, angle, h, t) - f64::from(across(mesh, jump, h)) * FRAC_PI_2))
}

/// The jump across `h`, from its triangle to that of its twin; not reduced.
#[inline]
pub(super) fn across(mesh: &TriMesh, jump: &[i8], h: HalfedgeId) -> i32 {
    let e = mesh.edge(h);
    let p = i32::from(jump[e.index()]);
    if mesh.halfedge(e) == h { p } else { -p }
}

fn set_across(mesh: &TriMesh, jump: &mut [i8], h: HalfedgeId, value: i32) {
    let e = mesh.edge(h);
    jump[e.index()] = reduced(if mesh.halfedge(e) == h { value } else { -value });
}

/// The direction of the cross in the triangle of `h` that is nearest to `h` turned by `tangent_offset`.
pub(super) fn branch_along(metric: &Metric, angle: &[f64], h: HalfedgeId, tangent_offset: f64) -> i32 {
    modulo_four(((metric.direction(h) + tangent_offset - angle[h.index() / 3]) / FRAC_PI_2).round() as i32)
}

/// For each edge the jump of smallest residual rotation.
pub(super) fn smallest_rotation(mesh: &TriMesh, metric: &Metric, angle: &[f64]) -> Vec<i8> {
    mesh.edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            mesh.twin(h).map_or(0, |t| reduced((rotation(metric, mesh, angle, h, t) / FRAC_PI_2).round() as i32))
        })
        .collect()
}

/// Changes jumps so that along every path, on both of its sides, each edge continues the direction of the edge before.
pub(super) fn follow_one_branch(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &mut [i8], paths: &[EdgePath]) {
    let (path_edge, path_vertex) = (vec![false; mesh.n_edges()], vec![false; mesh.n_vertices()]);
    let mut correction = Correction { mesh, metric, angle, jump, path_edge, path_vertex };
    for (step, &tangent_offset) in paths.iter().flat_map(|p| p.steps.iter().zip(&p.tangent_offset)) {
        correction.match_sides(*step, tangent_offset);
    }
    for _ in 0..MAX_PASSES {
        let mut changed = false;
        for path in paths {
            for (a, b) in path.pairs() {
                let [a, b] = [a, b].map(|i| (path.steps[i], path.tangent_offset[i]));
                changed |= correction.continue_left(a, b);
                changed |= correction.continue_left((b.0.reversed(), b.1), (a.0.reversed(), a.1));
            }
        }
        if !changed {
            break;
        }
    }
}

/// Jumps being changed along paths.
struct Correction<'a> {
    mesh: &'a TriMesh,
    metric: &'a Metric,
    angle: &'a [f64],
    jump: &'a mut [i8],
    /// Whether an edge is on a path.
    path_edge: Vec<bool>,
    /// Whether a vertex is on a path.
    path_vertex: Vec<bool>,
}

impl Correction<'_> {
    /// Marks an edge of a path, and sets its jump so that both sides follow it by the same direction.
    fn match_sides(&mut self, step: Step, tangent_offset: f64) {
        self.path_edge[step.edge.index()] = true;
        self.path_vertex[step.from(self.mesh).index()] = true;
        self.path_vertex[step.to(self.mesh).index()] = true;
        if let (Some(l), Some(r)) = (step.left(self.mesh), step.right(self.mesh)) {
            let branch = |h| branch_along(self.metric, self.angle, h, tangent_offset);
            let value = branch(l) - (branch(r) + 2);
            set_across(self.mesh, self.jump, l, value);
        }
    }

    /// Changes jumps in the fan left of two consecutive steps (each with its tangent offset) until the second continues
    /// the direction of the first; returns whether a change was needed.
    fn continue_left(&mut self, (a, offset_a): (Step, f64), (b, offset_b): (Step, f64)) -> bool {
        let mesh = self.mesh;
        let (Some(fan), Some(ha), Some(hb)) = (left_fan(mesh, a, b), a.left(mesh), b.left(mesh)) else { return false };
        let wanted =
            branch_along(self.metric, self.angle, hb, offset_b) - branch_along(self.metric, self.angle, ha, offset_a);
        let sum: i32 = fan.iter().map(|&h| across(mesh, self.jump, h)).sum();
        let mut missing = reduced(wanted - sum);
        let needed = missing != 0;
        while missing != 0 {
            let sign = missing.signum();
            let Some(h) = self.cheapest(&fan, f64::from(sign)) else { return false };
            let value = across(mesh, self.jump, h) + i32::from(sign);
            set_across(mesh, self.jump, h, value);
            missing -= sign;
        }
        needed
    }

    /// The half-edge of a fan whose jump is best changed by `sign`: of an edge that is on no path, preferably whose other end
    /// is on no path either, and among these where the residual rotation becomes smallest.
    fn cheapest(&self, fan: &[HalfedgeId], sign: f64) -> Option<HalfedgeId> {
        let cost = |h: HalfedgeId| {
            let to_path = self.path_vertex[self.mesh.origin(h).index()];
            let kind = if self.path_edge[self.mesh.edge(h).index()] { 2 } else { u8::from(to_path) };
            (kind, -sign * residual_rotation(self.metric, self.mesh, self.angle, self.jump, h))
        };
        fan.iter().copied().min_by(|&x, &y| {
            let (x, y) = (cost(x), cost(y));
            x.0.cmp(&y.0).then(x.1.total_cmp(&y.1))
        })
    }
}
