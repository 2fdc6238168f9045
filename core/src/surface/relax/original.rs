//! The curve as it was: the tube around it, and the moves of a strip inside the tube.

use std::collections::HashMap;

use glam::DVec3;

use crate::mesh::{TriMesh, VertexId};

use super::energy::Energy;
use super::strip::{Side, TriangleStrip};
use super::{CurveCost, RelaxOptions, Relaxed, pushed_vertices};

/// Crossings on each side of a vertex that slide when it is tried: about the extent of a bend.
const REACH: usize = 10;
/// Sliding steps of a trial.
const TRIAL_STEPS: usize = 12;
/// Sliding steps after which a trial is given up if it costs `HOPELESS` times as much as no trial.
const FIRST_TRIAL_STEPS: usize = 6;
/// See `FIRST_TRIAL_STEPS`; a curve just passed costs more at first than it will.
const HOPELESS: f64 = 2.0;
/// A trial is not repeated unless the cost around has changed by this fraction.
const SAME_TRIAL: f64 = 1e-2;
/// Gain, as a fraction of the cost around, that makes a trial worth keeping; far above rounding.
const MIN_TRIAL_GAIN: f64 = 1e-5;
/// Weight of the squared distance from a point that the curve is to pass, relative to that of bending. A curve that
/// is displaced at one point gives way over a length `λ` of some half a diagonal and resists as `192 / λ³`, which is
/// some thousand; this is far more, so the point is passed nearly. It is far less than what a kink at a single edge
/// costs.
const PULL: f64 = 2e4;
/// How far along the original curve, in segments, the nearest one is looked for around the one known.
const WINDOW: usize = 8;

/// The best strip met so far.
pub(super) struct Best {
    pub strip: Option<TriangleStrip>,
    pub cost: CurveCost,
    /// Cost and fidelity.
    merit: f64,
}

impl Default for Best {
    fn default() -> Self {
        Self { strip: None, cost: CurveCost::default(), merit: f64::INFINITY }
    }
}

/// The curve as it was, for measuring how far it has moved.
pub(super) struct Original {
    points: Vec<DVec3>,
    closed: bool,
    /// Points to pass, each with the crossing nearest to it.
    waypoints: Vec<(DVec3, usize)>,
    /// Radius of the tube.
    radius: f64,
}

impl Original {
    /// Remembers a strip.
    pub fn new(mesh: &TriMesh, strip: &TriangleStrip, options: &RelaxOptions<'_>) -> Self {
        let edges: f64 = strip.nodes.iter().map(|n| mesh.vector(n.halfedge).length()).sum();
        let points: Vec<DVec3> = (0..strip.len()).map(|i| strip.point(mesh, i)).collect();
        let nearest = |p: DVec3| {
            let distance = |i: &usize| points[*i].distance_squared(p);
            (0..points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
        };
        let waypoints = options.waypoints.iter().map(|at| at.position(mesh)).map(|p| (p, nearest(p))).collect();
        Self { points, closed: strip.closed, waypoints, radius: options.tube * edges / strip.len() as f64 }
    }

    /// Slides the crossings of a strip; remembers it if it is the best. Gives how hard they push in the end.
    pub fn slide(
        &self,
        mesh: &TriMesh,
        options: &RelaxOptions<'_>,
        strip: &mut TriangleStrip,
        steps: usize,
        best: &mut Best,
    ) -> Vec<f64> {
        let (energy, t) = self.descend(mesh, options, strip, steps);
        let cost = energy.cost(&t);
        let merit = cost.total + energy.fidelity(&t);
        if merit < best.merit {
            *best = Best { strip: Some(strip.clone()), cost, merit };
        }
        energy.pushes(&t)
    }

    fn descend<'a>(
        &self,
        mesh: &'a TriMesh,
        options: &'a RelaxOptions<'a>,
        strip: &mut TriangleStrip,
        steps: usize,
    ) -> (Energy<'a>, Vec<f64>) {
        let energy = self.energy(mesh, options, strip);
        let mut t: Vec<f64> = strip.nodes.iter().map(|n| n.t).collect();
        energy.descend(&mut t, steps);
        strip.nodes.iter_mut().zip(&t).for_each(|(n, &t)| n.t = t);
        (energy, t)
    }

    /// Passes over those of the pushed vertices where sliding the crossings around then shows a gain; gives
    /// their number. `failed` tells the cost around a vertex at its last trial in vain.
    pub fn try_vertices(
        &self,
        mesh: &TriMesh,
        options: &RelaxOptions<'_>,
        strip: &mut TriangleStrip,
        pushes: &[f64],
        failed: &mut HashMap<VertexId, f64>,
    ) -> usize {
        let mut count = 0;
        for (v, side) in pushed_vertices(mesh, options, strip, pushes) {
            let Some(i) = (0..strip.len()).find(|&i| strip.end(mesh, i, side) == v) else { continue };
            let Some(run) = strip.run(mesh, i, side).filter(|_| self.embraces(mesh, strip, i, side)) else { continue };
            let Some((mut now, first)) = strip.window(mesh, run, REACH) else { continue };
            let length = now.len();
            let inner = (run.0 + strip.len() - first) % strip.len();
            let mut other = now.clone();
            if !other.pass(mesh, (inner, run.1), side, options.t_min) {
                continue;
            }
            let merit = |strip: &mut TriangleStrip, steps: usize| {
                let (energy, t) = self.descend(mesh, options, strip, steps);
                energy.value(&t)
            };
            // The window has just slid as a part of the whole.
            let here = merit(&mut now, 0);
            if failed.get(&v).is_some_and(|then| (then - here).abs() < SAME_TRIAL * here) {
                continue;
            }
            let mut there = merit(&mut other, FIRST_TRIAL_STEPS);
            if there < here * HOPELESS {
                there = merit(&mut other, TRIAL_STEPS);
            }
            if there < here * (1.0 - MIN_TRIAL_GAIN) {
                strip.put_back(other, first, length);
                failed.remove(&v);
                count += 1;
            } else {
                failed.insert(v, here);
            }
        }
        count
    }

    fn n_segments(&self) -> usize {
        if self.closed { self.points.len() } else { self.points.len() - 1 }
    }

    /// The point nearest to `p` on the segments near `reference`, the vector of its segment, and its segment.
    fn nearest(&self, p: DVec3, reference: usize) -> (DVec3, DVec3, usize) {
        let (n, reach) = (self.n_segments(), WINDOW.min(self.n_segments() / 2));
        let mut best = (f64::INFINITY, self.points[0], DVec3::ZERO, 0);
        for k in 0..=2 * reach {
            let j = if self.closed {
                (reference + n + k - reach) % n
            } else {
                match (reference + k).checked_sub(reach) {
                    Some(j) if j < n => j,
                    _ => continue,
                }
            };
            let a = self.points[j];
            let along = self.points[(j + 1) % self.points.len()] - a;
            let s = (along.dot(p - a) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let q = a + along * s;
            if q.distance_squared(p) < best.0 {
                best = (q.distance_squared(p), q, along, j);
            }
        }
        (best.1, best.2, best.3)
    }

    /// Whether the vertex on one side of crossing `i` lies in the tube.
    pub fn embraces(&self, mesh: &TriMesh, strip: &TriangleStrip, i: usize, side: Side) -> bool {
        let p = mesh.position(strip.end(mesh, i, side));
        self.nearest(p, strip.nodes[i].reference).0.distance(p) <= self.radius
    }

    /// The energy of a strip, with the pull back to here; renews the references of its crossings.
    fn energy<'a>(&self, mesh: &'a TriMesh, options: &'a RelaxOptions<'a>, strip: &mut TriangleStrip) -> Energy<'a> {
        let points: Vec<DVec3> = (0..strip.len()).map(|i| strip.point(mesh, i)).collect();
        let lengths: Vec<f64> = (0..strip.n_segments()).map(|j| points[j].distance(points[strip.after(j)])).collect();
        let (mut fidelity, mut bounds) = (Vec::with_capacity(strip.len()), Vec::with_capacity(strip.len()));
        for i in 0..strip.len() {
            let (foot, along, reference) = self.nearest(points[i], strip.nodes[i].reference);
            let here = lengths.get(i).copied().unwrap_or(0.0);
            let back = if strip.closed || i > 0 { lengths[strip.before(i)] } else { 0.0 };
            let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(strip.end(mesh, i, s)));
            // Squared distances are polynomials of the parameter. Only what is across the original is pulled back.
            let tangent = along.normalize_or_zero();
            let away = square(right - foot, left - right);
            let node = &mut strip.nodes[i];
            node.reference = reference;
            let weight = options.fidelity * 0.5 * (here + back) / (self.radius * self.radius);
            fidelity.push(square(across(right - foot, tangent), across(left - right, tangent)).map(|x| weight * x));
            bounds.push(if node.held { (node.t, node.t) } else { self.bounds(away, node.t, options.t_min) });
        }
        for &(p, reference) in &self.waypoints {
            self.pull(mesh, options, strip, (p, reference), &mut fidelity);
        }
        Energy::new(mesh, options, strip, fidelity, bounds)
    }

    /// Adds to the fidelity of the crossing nearest to a point that the curve is to pass, if it is in the strip, its
    /// squared distance from there across the curve.
    fn pull(
        &self,
        mesh: &TriMesh,
        options: &RelaxOptions<'_>,
        strip: &TriangleStrip,
        (p, reference): (DVec3, usize),
        fidelity: &mut [[f64; 3]],
    ) {
        let around = |i: &usize| {
            let apart = strip.nodes[*i].reference.abs_diff(reference);
            apart.min(self.points.len() - apart) <= WINDOW
        };
        let distance = |i: &usize| strip.point(mesh, *i).distance_squared(p);
        let Some(i) = (0..strip.len()).filter(around).min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return;
        };
        let j = strip.nodes[i].reference;
        let tangent = (self.points[(j + 1) % self.points.len()] - self.points[j]).normalize_or_zero();
        let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(strip.end(mesh, i, s)));
        let square = square(across(right - p, tangent), across(left - right, tangent));
        let weight = PULL * options.beta;
        fidelity[i].iter_mut().zip(square).for_each(|(f, s)| *f += weight * s);
    }

    /// The parameters inside the tube, of those allowed anyway; `t` itself is always among them.
    fn bounds(&self, [c, b, a]: [f64; 3], t: f64, t_min: f64) -> (f64, f64) {
        let (mut low, mut high) = (t_min, 1.0 - t_min);
        if a > 0.0 {
            let root = (b * b - 4.0 * a * (c - self.radius * self.radius)).max(0.0).sqrt();
            low = low.max((-b - root) / (2.0 * a));
            high = high.min((-b + root) / (2.0 * a));
        }
        (low.min(t), high.max(t))
    }

    /// The strip as a result.
    pub fn finish(
        &self,
        mesh: &TriMesh,
        mut strip: TriangleStrip,
        before: CurveCost,
        after: CurveCost,
        passed: usize,
    ) -> Relaxed {
        if strip.closed {
            let start = (0..strip.len()).min_by_key(|&i| strip.nodes[i].reference).unwrap_or(0);
            strip.nodes.rotate_left(start);
        }
        let distance = |i: usize| {
            let p = strip.point(mesh, i);
            self.nearest(p, strip.nodes[i].reference).0.distance(p)
        };
        Relaxed {
            max_displacement: (0..strip.len()).map(distance).fold(0.0, f64::max),
            curve: strip.curve(),
            before,
            after,
            passed,
            improved: true,
        }
    }
}

/// The part of `v` across a unit vector.
fn across(v: DVec3, tangent: DVec3) -> DVec3 {
    v - tangent * v.dot(tangent)
}

/// The coefficients of `|c + t d|²`.
fn square(c: DVec3, d: DVec3) -> [f64; 3] {
    [c.length_squared(), 2.0 * c.dot(d), d.length_squared()]
}
