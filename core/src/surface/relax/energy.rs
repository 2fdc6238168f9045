//! The elastica energy of a curve in its strip, from intrinsic measures only, and its minimisation.
//!
//! The edges of two consecutive crossings share an end, the pivot. Let `a`, `b` be the distances of the crossings from
//! the pivot and `θ` the angle of the triangle there. The segment has length `l`, `l² = a² + b² − 2ab cos θ`. It makes
//! the angle `φ = ±atan2(b cos θ − a, b sin θ)` with the normal of the edge it leaves and `φ ± θ` with that of the edge
//! it reaches (+ for a pivot to the right). The difference `γ` of the two angles at a crossing is the geodesic turning
//! there, the turning after both triangles are unfolded. The energy is `Σ l (1 + α q) + β Σ γ² / l̄` with `l̄` the mean
//! length of both segments: (8.1) of Campen's thesis. An open end counts as if the curve were mirrored at the boundary,
//! so that it meets the boundary orthogonally. A fidelity term keeps the curve near the original.
//!
//! The method is Gauss–Newton with bounds (projected Newton). The turning residuals `γ / √l̄` are differentiated
//! exactly; of the second derivative of the length only the non-negative part is kept. A crossing is coupled to the two
//! on each side, so each step is one banded solve.

use glam::DVec3;

use super::banded::Banded;
use super::options::{Alignment, CurveCost, RelaxOptions};
use super::triangle_strip::TriangleStrip;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::vertex_fan::Side;

/// Step of the finite differences of the alignment by direction, in radians: large against rounding, small against the
/// 45 degrees over which an alignment varies.
const ALIGNMENT_STEP: f64 = 1e-3;
/// Least angle of a triangle, in radians. Smaller angles count as this one, so that needles do not cause a division by
/// zero.
const MIN_ANGLE: f64 = 1e-7;
/// Least length of a segment, for meshes of model size 1. Shorter segments count as this long; the square is
/// still a normal number.
const MIN_LENGTH: f64 = 1e-100;
/// Least decrease of a step, as a fraction of what the gradient predicts (Armijo condition).
const ARMIJO: f64 = 1e-4;
/// Step sizes tried, each half the one before; after that the damping is raised instead.
const STEP_SIZES: usize = 6;
/// Descent stops when a step decreases the energy by less than this fraction.
const MIN_GAIN: f64 = 1e-5;
/// Levenberg–Marquardt damping of the diagonal: the least; the least after a step without decrease; the one at which
/// descent stops; and the factors after steps without and with decrease.
const LEAST_DAMPING: f64 = 1e-6;
const LEAST_RAISED_DAMPING: f64 = 1e-3;
const MOST_DAMPING: f64 = 1e4;
const DAMPING_INCREASE: f64 = 30.0;
const DAMPING_DECREASE: f64 = 0.1;

/// The segment between two crossings.
struct Segment {
    face: FaceId,
    /// Angle `θ` of the triangle at the pivot, with its sine and cosine.
    angle: f64,
    sin: f64,
    cos: f64,
    /// Side of the pivot.
    pivot: Side,
}

/// Length and direction of a segment, with derivatives by the parameters of its two crossings.
#[derive(Clone, Copy)]
struct SegmentMeasure {
    length: f64,
    /// Angle `φ` to the normal of the edge that the segment leaves, positive to the left.
    phi: f64,
    d_length: [f64; 2],
    d_phi: [f64; 2],
}

/// The energy as a function of the parameters of the crossings; the crossed edges do not change.
pub(super) struct Energy<'a> {
    mesh: &'a TriMesh,
    options: &'a RelaxOptions<'a>,
    closed: bool,
    /// Length of each crossed edge.
    edge: Vec<f64>,
    /// Right end of each crossed edge, and the vector from there to its left end.
    right: Vec<DVec3>,
    along: Vec<DVec3>,
    segments: Vec<Segment>,
    /// Fidelity term of each crossing: coefficients of a quadratic polynomial of its parameter, constant first.
    fidelity: Vec<[f64; 3]>,
    /// Least and greatest parameter of each crossing; equal where it is fixed.
    bounds: Vec<(f64, f64)>,
}

impl<'a> Energy<'a> {
    /// The energy of a strip. `fidelity` and `bounds` have one entry per crossing.
    pub fn new(
        mesh: &'a TriMesh,
        options: &'a RelaxOptions<'a>,
        strip: &TriangleStrip,
        fidelity: Vec<[f64; 3]>,
        bounds: Vec<(f64, f64)>,
    ) -> Self {
        let ends = |side| (0..strip.len()).map(move |i| mesh.position(strip.end(mesh, i, side)));
        let right: Vec<DVec3> = ends(Side::Right).collect();
        let along: Vec<DVec3> = ends(Side::Left).zip(&right).map(|(l, r)| l - *r).collect();
        let segment = |i: usize| {
            let (entered, leaving) = (strip.entered(mesh, i), strip.crossings[strip.after(i)].halfedge);
            let (pivot, corner) =
                if leaving == mesh.next(entered) { (Side::Right, leaving) } else { (Side::Left, entered) };
            let angle = mesh.corner_angle(corner).clamp(MIN_ANGLE, std::f64::consts::PI - MIN_ANGLE);
            Segment { face: mesh.face(entered), angle, sin: angle.sin(), cos: angle.cos(), pivot }
        };
        Self {
            mesh,
            options,
            closed: strip.closed,
            edge: along.iter().map(|e| e.length()).collect(),
            right,
            along,
            segments: (0..strip.n_segments()).map(segment).collect(),
            fidelity,
            bounds,
        }
    }

    fn len(&self) -> usize {
        self.edge.len()
    }

    fn after(&self, i: usize) -> usize {
        if i + 1 == self.len() { 0 } else { i + 1 }
    }

    fn measure(&self, t: &[f64], j: usize) -> SegmentMeasure {
        let (k, s) = (self.after(j), &self.segments[j]);
        let sign = if s.pivot == Side::Right { 1.0 } else { -1.0 };
        let from_pivot = |i: usize| self.edge[i] * if s.pivot == Side::Right { t[i] } else { 1.0 - t[i] };
        let (a, b) = (from_pivot(j), from_pivot(k));
        let (u, w) = (b * s.sin, b * s.cos - a);
        let length = (u * u + w * w).sqrt().max(MIN_LENGTH);
        let (da, db) = (sign * self.edge[j], sign * self.edge[k]);
        let inverse = 1.0 / length;
        SegmentMeasure {
            length,
            phi: sign * w.atan2(u),
            d_length: [(a - b * s.cos) * inverse * da, (b - a * s.cos) * inverse * db],
            d_phi: [-sign * u * inverse * inverse * da, sign * a * s.sin * inverse * inverse * db],
        }
    }

    /// Angle of segment `j` to the normal of the edge it reaches.
    fn arrival_angle(&self, m: &SegmentMeasure, j: usize) -> f64 {
        let s = &self.segments[j];
        m.phi + if s.pivot == Side::Right { s.angle } else { -s.angle }
    }

    fn point(&self, t: &[f64], i: usize) -> DVec3 {
        self.right[i] + self.along[i] * t[i]
    }

    /// The alignment `q` of segment `j`, rotated to the left by each of the angles `turns`.
    fn alignment<const N: usize>(&self, q: &Alignment<'_>, t: &[f64], j: usize, turns: [f64; N]) -> [f64; N] {
        let tangent = (self.point(t, self.after(j)) - self.point(t, j)).normalize_or_zero();
        if tangent == DVec3::ZERO {
            return [0.0; N];
        }
        let face = self.segments[j].face;
        let left = self.mesh.face_normal(face).cross(tangent);
        turns.map(|a| q(face, tangent * a.cos() + left * a.sin()))
    }

    fn measures(&self, t: &[f64]) -> Vec<SegmentMeasure> {
        (0..self.segments.len()).map(|j| self.measure(t, j)).collect()
    }

    /// The residual `γ / √l̄` at crossing `i`, whose square is the bending there.
    fn residual(&self, measures: &[SegmentMeasure], i: usize) -> Residual {
        let last = self.len() - 1;
        let before = if i == 0 { last } else { i - 1 };
        if !self.closed && (i == 0 || i == last) {
            // The curve mirrored at the boundary turns by 2 φ over length l; half of its bending counts.
            let j = if i == 0 { 0 } else { before };
            let (m, at) = (&measures[j], [j, j + 1]);
            let phi = if i == 0 { m.phi } else { self.arrival_angle(m, j) };
            let scale = (2.0 / m.length).sqrt();
            let r = scale * phi;
            let d = |k: usize| (at[k], scale * m.d_phi[k] - 0.5 * r / m.length * m.d_length[k]);
            return Residual { value: r, gradient: [d(0), d(1), (at[1], 0.0)] };
        }
        let (p, s) = (&measures[before], &measures[i]);
        let gamma = s.phi - self.arrival_angle(p, before);
        let mean = 0.5 * (p.length + s.length);
        let scale = mean.sqrt().recip();
        let r = gamma * scale;
        let d = |gamma: f64, length: f64| scale * gamma - 0.25 * r / mean * length;
        Residual {
            value: r,
            gradient: [
                (before, d(-p.d_phi[0], p.d_length[0])),
                (i, d(s.d_phi[0] - p.d_phi[1], s.d_length[0] + p.d_length[1])),
                (self.after(i), d(s.d_phi[1], s.d_length[1])),
            ],
        }
    }

    /// The cost (8.1) of the curve, without the fidelity term.
    pub fn cost(&self, t: &[f64]) -> CurveCost {
        let measures = self.measures(t);
        let mut cost = CurveCost { length: measures.iter().map(|m| m.length).sum(), ..CurveCost::default() };
        cost.bending = (0..self.len()).map(|i| self.residual(&measures, i).value.powi(2)).sum();
        if let Some(q) = self.options.alignment {
            let part = |(j, m): (usize, &SegmentMeasure)| self.alignment(q, t, j, [0.0])[0] * m.length;
            cost.alignment = measures.iter().enumerate().map(part).sum();
        }
        cost.total = cost.length + self.options.alpha * cost.alignment + self.options.beta * cost.bending;
        cost
    }

    /// The fidelity term.
    pub fn fidelity(&self, t: &[f64]) -> f64 {
        self.fidelity.iter().zip(t).map(|([a, b, c], t)| a + t * (b + t * c)).sum()
    }

    /// Length and angles of segment `j` to the normals of the edges it leaves and reaches.
    fn length_and_angles(&self, t: &[f64], j: usize) -> (f64, f64, f64) {
        let (k, s) = (self.after(j), &self.segments[j]);
        let (sign, a, b) = match s.pivot {
            Side::Right => (1.0, self.edge[j] * t[j], self.edge[k] * t[k]),
            Side::Left => (-1.0, self.edge[j] * (1.0 - t[j]), self.edge[k] * (1.0 - t[k])),
        };
        let (u, w) = (b * s.sin, b * s.cos - a);
        let phi = sign * w.atan2(u);
        ((u * u + w * w).sqrt().max(MIN_LENGTH), phi, phi + sign * s.angle)
    }

    /// What is minimised: the sum of [`Self::cost`] and [`Self::fidelity`]. Line searches need no derivatives, so this
    /// computes none.
    pub fn value(&self, t: &[f64]) -> f64 {
        let n = self.segments.len();
        let (mut length, mut bending, mut alignment) = (0.0, 0.0, 0.0);
        let mut before = self.closed.then(|| self.length_and_angles(t, n - 1));
        for j in 0..n {
            let here = self.length_and_angles(t, j);
            bending += match before {
                Some(p) => 2.0 * (here.1 - p.2).powi(2) / (p.0 + here.0),
                None => 2.0 * here.1 * here.1 / here.0,
            };
            length += here.0;
            if let Some(q) = self.options.alignment {
                alignment += self.alignment(q, t, j, [0.0])[0] * here.0;
            }
            before = Some(here);
        }
        if let Some(p) = before.filter(|_| !self.closed) {
            bending += 2.0 * p.2 * p.2 / p.0;
        }
        length + self.options.alpha * alignment + self.options.beta * bending + self.fidelity(t)
    }

    /// The gradient at `t`; fills the Gauss–Newton Hessian.
    fn derivatives(&self, t: &[f64], hessian: &mut Banded) -> Vec<f64> {
        let mut gradient = vec![0.0; self.len()];
        hessian.clear();
        let measures = self.measures(t);
        for (j, m) in measures.iter().enumerate() {
            let k = self.after(j);
            // The second derivative of the length is `l dφ dφᵀ`, up to a part that may be negative.
            let (mut by_length, mut by_phi, mut curvature) = (1.0, 0.0, m.length);
            if let Some(q) = self.options.alignment {
                let h = ALIGNMENT_STEP;
                let [low, here, high] = self.alignment(q, t, j, [-h, 0.0, h]);
                by_length += self.options.alpha * here;
                by_phi = self.options.alpha * m.length * (high - low) / (2.0 * h);
                curvature = m.length
                    * (by_length + self.options.alpha * ((high - 2.0 * here + low) / (h * h)).max(0.0)).max(0.0);
            }
            gradient[j] += by_length * m.d_length[0] + by_phi * m.d_phi[0];
            gradient[k] += by_length * m.d_length[1] + by_phi * m.d_phi[1];
            hessian.add_outer(&[(j, m.d_phi[0]), (k, m.d_phi[1])], curvature);
        }
        for i in 0..self.len() {
            let r = self.residual(&measures, i);
            for (k, d) in r.gradient {
                gradient[k] += 2.0 * self.options.beta * r.value * d;
            }
            hessian.add_outer(&r.gradient, 2.0 * self.options.beta);
            let [_, b, c] = self.fidelity[i];
            gradient[i] += b + 2.0 * c * t[i];
            hessian.add_outer(&[(i, 1.0)], 2.0 * c);
        }
        gradient
    }

    /// Whether crossing `i` is fixed, or at a bound beyond which the energy decreases.
    fn is_blocked(&self, t: &[f64], gradient: &[f64], i: usize) -> bool {
        let (low, high) = self.bounds[i];
        low >= high || (t[i] <= low && gradient[i] > 0.0) || (t[i] >= high && gradient[i] < 0.0)
    }

    /// Minimises the energy from `t` in at most `steps` steps.
    pub fn minimise(&self, t: &mut [f64], steps: usize) {
        let mut hessian = Banded::new(self.len(), self.closed);
        let mut value = self.value(t);
        let mut damping = LEAST_DAMPING;
        for _ in 0..steps {
            let gradient = self.derivatives(t, &mut hessian);
            let free: Vec<bool> = (0..self.len()).map(|i| !self.is_blocked(t, &gradient, i)).collect();
            let downhill: Vec<f64> = gradient.iter().map(|g| -g).collect();
            let step = hessian.solve(&downhill, &free, damping);
            let better = step.and_then(|step| self.line_search(t, value, &gradient, &step));
            let Some((next, next_value)) = better else {
                // The quadratic model is poor here: a larger damping turns the step towards the negative gradient.
                damping = (damping * DAMPING_INCREASE).max(LEAST_RAISED_DAMPING);
                if damping > MOST_DAMPING {
                    break;
                }
                continue;
            };
            damping = (damping * DAMPING_DECREASE).max(LEAST_DAMPING);
            t.copy_from_slice(&next);
            let gain = value - next_value;
            value = next_value;
            if gain < MIN_GAIN * value {
                break;
            }
        }
    }

    /// Backtracking along `step`, projected to the bounds: the first point that satisfies the Armijo condition.
    fn line_search(&self, t: &[f64], value: f64, gradient: &[f64], step: &[f64]) -> Option<(Vec<f64>, f64)> {
        let mut scale = 1.0;
        for _ in 0..STEP_SIZES {
            let next: Vec<f64> =
                (0..t.len()).map(|i| (t[i] + scale * step[i]).clamp(self.bounds[i].0, self.bounds[i].1)).collect();
            let predicted: f64 = (0..t.len()).map(|i| gradient[i] * (next[i] - t[i])).sum();
            let next_value = self.value(&next);
            if predicted < 0.0 && next_value < value + ARMIJO * predicted {
                return Some((next, next_value));
            }
            scale *= 0.5;
        }
        None
    }

    /// For each crossing at a bound the negative gradient, which points beyond the bound (negative: to the right); 0
    /// for free and fixed crossings.
    pub fn bound_forces(&self, t: &[f64]) -> Vec<f64> {
        let gradient = self.derivatives(t, &mut Banded::new(self.len(), self.closed));
        let force = |i: usize| {
            if self.bounds[i].0 < self.bounds[i].1 && self.is_blocked(t, &gradient, i) { -gradient[i] } else { 0.0 }
        };
        (0..self.len()).map(force).collect()
    }
}

/// A residual and its derivatives by the parameters of up to three crossings.
struct Residual {
    value: f64,
    gradient: [(usize, f64); 3],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::testing::{cylinder, ring, upright};

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        let mesh = cylinder(14, 9, 0.2);
        for closed in [true, false] {
            let q = |_: FaceId, d: DVec3| (d.z * d.z - 0.2 * d.x * d.y).powi(2);
            let options = RelaxOptions { alignment: Some(&q), ..RelaxOptions::default() };
            let curve = if closed { ring(&mesh, 14, 4, 0.3) } else { upright(&mesh, 14, 9, 5) };
            assert_eq!(curve.check(&mesh), Ok(()));
            let strip = TriangleStrip::new(&curve);
            let n = strip.len();
            let fidelity = (0..n).map(|i| [0.1, 0.2 * i as f64 / n as f64, 0.5]).collect();
            let energy = Energy::new(&mesh, &options, &strip, fidelity, vec![(0.03, 0.97); n]);
            let t: Vec<f64> = strip.crossings.iter().map(|n| n.t).collect();
            let sum = energy.cost(&t).total + energy.fidelity(&t);
            assert!((energy.value(&t) - sum).abs() < 1e-12 * sum);
            assert!((energy.cost(&t).length - curve.length(&mesh)).abs() < 1e-12);
            let gradient = energy.derivatives(&t, &mut Banded::new(n, closed));
            for i in 0..n {
                let at = |d: f64| {
                    let mut t = t.clone();
                    t[i] += d;
                    energy.value(&t)
                };
                let numeric = (at(1e-6) - at(-1e-6)) / 2e-6;
                let scale = gradient.iter().fold(1.0f64, |m, g| m.max(g.abs()));
                assert!((numeric - gradient[i]).abs() < 1e-4 * scale, "{closed} {i}: {numeric} {}", gradient[i]);
            }
        }
    }
}
