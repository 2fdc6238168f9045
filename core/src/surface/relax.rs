//! Smoothing of a curve on the surface towards an elastica, within its homotopy class.
//!
//! A curve found on a coarse graph turns in steps. Here its crossings slide along their edges until length plus
//! bending (the cost (8.1) of Campen's thesis) is least near where the curve was: a weak fidelity term pulls it
//! back, and it never leaves a tube around the original, since length alone would slide loops off the limbs
//! they embrace. Undulations much shorter than `2π (β R²)^¼` (`R` the tube's radius) are smoothed out, the
//! place of the curve is kept. A crossing that pushes against a vertex passes over it: the run of spokes crossed
//! on one side gives way to the spokes on the other side. So the homotopy class stays, but not the way past
//! single vertices. Sliding and passing alternate; the best curve met is the result.

mod banded;
mod energy;
mod strip;

use std::collections::HashMap;

use glam::DVec3;
use thiserror::Error;

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

use super::{CurveError, SurfaceCurve, SurfacePoint};
use energy::Energy;
use strip::Strip;
pub(super) use strip::{Side, spokes_across};

/// Penalty of a direction: triangle and unit tangent in it → `q` of (8.1), not negative.
pub type Alignment<'a> = dyn Fn(FaceId, DVec3) -> f64 + Sync + 'a;

/// A place at which the curve is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// The crossing at this position in the list.
    Crossing(usize),
    /// The crossing nearest to a point.
    Point(SurfacePoint),
}

/// What [`relax`] minimises and how far it may go.
#[derive(Clone)]
pub struct RelaxOptions<'a> {
    /// Weight of the alignment; 1 in the thesis.
    pub alpha: f64,
    /// Weight of the bending; 0.25 in the thesis, for models of bounding-box diagonal 1.
    pub beta: f64,
    /// The alignment, if wanted.
    pub alignment: Option<&'a Alignment<'a>>,
    /// Weight of the squared distance to the original curve in units of the tube's radius.
    pub fidelity: f64,
    /// Radius of the tube around the original curve, in mean lengths of the edges that the curve crosses.
    pub tube: f64,
    /// Crossings stay in `[t_min, 1 − t_min]` of their edges.
    pub t_min: f64,
    /// Where the curve is held; exactly, up to `t_min` of an edge.
    pub anchors: Vec<Anchor>,
    /// Number of times that the curve slides and then passes vertices.
    pub rounds: usize,
}

impl Default for RelaxOptions<'_> {
    fn default() -> Self {
        Self {
            alpha: 1.0,
            beta: 0.25,
            alignment: None,
            fidelity: 1.0,
            tube: 2.5,
            t_min: 0.03,
            anchors: Vec::new(),
            rounds: 16,
        }
    }
}

/// The parts of the cost (8.1) of a curve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CurveCost {
    /// Length on the mesh.
    pub length: f64,
    /// Integral of the alignment along the curve.
    pub alignment: f64,
    /// Integral of the squared geodesic curvature.
    pub bending: f64,
    /// `length + α alignment + β bending`.
    pub total: f64,
}

/// A relaxed curve.
#[derive(Debug, Clone)]
pub struct Relaxed {
    /// The curve; a closed one starts near where the original started.
    pub curve: SurfaceCurve,
    /// Where the anchors are now: positions in its list of crossings, in the order of the options.
    pub anchors: Vec<usize>,
    /// Cost of the original curve.
    pub before: CurveCost,
    /// Cost of the curve.
    pub after: CurveCost,
    /// Largest distance of a crossing from the original curve.
    pub max_displacement: f64,
    /// Number of vertices passed over, as often as they were.
    pub passed: usize,
    /// Whether the curve differs from the original.
    pub improved: bool,
}

/// Why a curve cannot be relaxed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RelaxError {
    /// The curve is not one on this mesh.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// An anchor names a crossing that the curve does not have.
    #[error("anchor {anchor} names a crossing that the curve does not have")]
    UnknownAnchor {
        /// Position in the list of anchors.
        anchor: usize,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Sliding steps before vertices are passed; few, since passing changes the problem.
const STEPS: usize = 6;
/// Sliding steps once no vertex is passed any more.
const LAST_STEPS: usize = 30;
/// How often one vertex may be passed: there and back; more would be an oscillation.
const PASSES: u8 = 2;
/// A curve passes over a vertex only where its run sweeps at least half of the fan less this angle (radians):
/// a run that sweeps less would give way to a far longer one.
const SWEEP_SLACK: f64 = 0.5;
/// How far along the original curve, in segments, the nearest one is looked for around the one known.
const WINDOW: usize = 8;

/// The cost (8.1) of a curve as [`relax`] measures it.
///
/// # Errors
///
/// A curve that is not one on `mesh`.
pub fn curve_cost(mesh: &TriMesh, curve: &SurfaceCurve, options: &RelaxOptions<'_>) -> Result<CurveCost, CurveError> {
    curve.check(mesh)?;
    Ok(strip_cost(mesh, options, &Strip::new(curve)))
}

fn strip_cost(mesh: &TriMesh, options: &RelaxOptions<'_>, strip: &Strip) -> CurveCost {
    let n = strip.len();
    let t: Vec<f64> = strip.nodes.iter().map(|n| n.t).collect();
    Energy::new(mesh, options, strip, vec![[0.0; 3]; n], vec![(0.0, 1.0); n]).cost(&t)
}

/// Smooths `curve` (see the head of this module). The result passes [`SurfaceCurve::check`], has the homotopy
/// class of the curve (ends of an open one sliding on their boundary loops) and never costs more.
///
/// # Errors
///
/// A curve that is not one on `mesh`, an anchor beyond its crossings, or [`Cancelled`].
pub fn relax(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    options: &RelaxOptions<'_>,
    progress: &Progress,
) -> Result<Relaxed, RelaxError> {
    curve.check(mesh)?;
    let held = anchor_crossings(mesh, curve, &options.anchors)?;
    let mut strip = Strip::new(curve);
    for &i in &held {
        strip.nodes[i].held = Some(i);
    }
    let before = strip_cost(mesh, options, &strip);
    let original = Original::new(mesh, &strip, options);
    for node in &mut strip.nodes {
        node.t = node.t.clamp(options.t_min, 1.0 - options.t_min);
    }

    let mut best: Option<(Strip, CurveCost, f64)> = None;
    let mut passes: HashMap<VertexId, u8> = HashMap::new();
    let mut passed = 0;
    let mut last = false;
    for round in 0..options.rounds {
        progress.check()?;
        last |= round + 1 == options.rounds;
        let energy = original.energy(mesh, options, &mut strip);
        let mut t: Vec<f64> = strip.nodes.iter().map(|n| n.t).collect();
        energy.descend(&mut t, if last { LAST_STEPS } else { STEPS });
        strip.nodes.iter_mut().zip(&t).for_each(|(n, &t)| n.t = t);
        let cost = energy.cost(&t);
        let merit = cost.total + energy.fidelity(&t);
        if merit.is_finite() && best.as_ref().is_none_or(|b| merit < b.2) {
            best = Some((strip.clone(), cost, merit));
        }
        if last {
            break;
        }
        let pushes = energy.pushes(&t);
        let now = pass_vertices(mesh, options, &mut strip, &pushes, &mut passes);
        passed += now;
        last = now == 0;
    }
    let result = best.filter(|b| b.1.total < before.total && b.0.curve().check(mesh).is_ok());
    Ok(match result {
        Some((strip, after, _)) => original.finish(mesh, strip, &held, before, after, passed),
        None => Relaxed {
            curve: curve.clone(),
            anchors: held,
            before,
            after: before,
            max_displacement: 0.0,
            passed: 0,
            improved: false,
        },
    })
}

fn anchor_crossings(mesh: &TriMesh, curve: &SurfaceCurve, anchors: &[Anchor]) -> Result<Vec<usize>, RelaxError> {
    let points = curve.points(mesh);
    let nearest = |p: DVec3| {
        let distance = |i: &usize| points[*i].distance_squared(p);
        (0..points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    let crossing = |(anchor, a): (usize, &Anchor)| match *a {
        Anchor::Crossing(i) if i < points.len() => Ok(i),
        Anchor::Crossing(_) => Err(RelaxError::UnknownAnchor { anchor }),
        Anchor::Point(p) => Ok(nearest(p.position(mesh))),
    };
    anchors.iter().enumerate().map(crossing).collect()
}

/// Passes over the vertices that crossings push against, the hardest pushed first; gives their number.
fn pass_vertices(
    mesh: &TriMesh,
    options: &RelaxOptions<'_>,
    strip: &mut Strip,
    pushes: &[f64],
    passes: &mut HashMap<VertexId, u8>,
) -> usize {
    let mut wanted: Vec<(f64, VertexId, Side)> = Vec::new();
    for (i, &push) in pushes.iter().enumerate() {
        let t = strip.nodes[i].t;
        let near = if push > 0.0 { 1.0 - t } else { t };
        // Blocked by the tube, not by the vertex.
        if push == 0.0 || near > options.t_min * (1.0 + 1e-9) {
            continue;
        }
        let side = if push > 0.0 { Side::Left } else { Side::Right };
        wanted.push((push.abs(), strip.end(mesh, i, side), side));
    }
    wanted.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut count = 0;
    for (_, v, side) in wanted {
        let Some(i) = (0..strip.len()).find(|&i| strip.end(mesh, i, side) == v) else { continue };
        if passes.get(&v).is_some_and(|&n| n >= PASSES) {
            continue;
        }
        let Some(run) = strip.run(mesh, i, side) else { continue };
        let (swept, total) = strip.sweep(mesh, run, side);
        if swept < 0.5 * total - SWEEP_SLACK {
            continue;
        }
        if strip.pass(mesh, run, side, options.t_min) {
            *passes.entry(v).or_default() += 1;
            count += 1;
        }
    }
    count
}

/// The curve as it was, for measuring how far it has moved.
struct Original {
    points: Vec<DVec3>,
    closed: bool,
    /// Radius of the tube.
    radius: f64,
}

impl Original {
    fn new(mesh: &TriMesh, strip: &Strip, options: &RelaxOptions<'_>) -> Self {
        let edges: f64 = strip.nodes.iter().map(|n| mesh.vector(n.halfedge).length()).sum();
        Self {
            points: (0..strip.len()).map(|i| strip.point(mesh, i)).collect(),
            closed: strip.closed,
            radius: options.tube * edges / strip.len() as f64,
        }
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

    /// The energy of a strip, with the pull back to here; renews the references of its crossings.
    fn energy<'a>(&self, mesh: &'a TriMesh, options: &'a RelaxOptions<'a>, strip: &mut Strip) -> Energy<'a> {
        let points: Vec<DVec3> = (0..strip.len()).map(|i| strip.point(mesh, i)).collect();
        let lengths: Vec<f64> = (0..strip.n_segments()).map(|j| points[j].distance(points[strip.after(j)])).collect();
        let (mut fidelity, mut bounds) = (Vec::with_capacity(strip.len()), Vec::with_capacity(strip.len()));
        for i in 0..strip.len() {
            let (foot, along, reference) = self.nearest(points[i], strip.nodes[i].reference);
            let here = lengths.get(i).copied().unwrap_or(0.0);
            let back = if strip.closed || i > 0 { lengths[strip.before(i)] } else { 0.0 };
            let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(strip.end(mesh, i, s)));
            // Distance across the original: squared, a polynomial of the parameter.
            let tangent = along.normalize_or_zero();
            let across = |v: DVec3| v - tangent * v.dot(tangent);
            let (c, d) = (across(right - foot), across(left - right));
            let square = [c.length_squared(), 2.0 * c.dot(d), d.length_squared()];
            let node = &mut strip.nodes[i];
            node.reference = reference;
            let weight = options.fidelity * 0.5 * (here + back) / (self.radius * self.radius);
            fidelity.push(square.map(|x| weight * x));
            bounds.push(if node.held.is_some() {
                (node.t, node.t)
            } else {
                self.bounds(square, node.t, options.t_min)
            });
        }
        Energy::new(mesh, options, strip, fidelity, bounds)
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

    fn finish(
        &self,
        mesh: &TriMesh,
        mut strip: Strip,
        held: &[usize],
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
            anchors: held.iter().filter_map(|&a| strip.nodes.iter().position(|n| n.held == Some(a))).collect(),
            curve: strip.curve(),
            before,
            after,
            passed,
            improved: true,
        }
    }
}

#[cfg(test)]
pub(super) mod testing;
#[cfg(test)]
mod tests;
