//! Smoothing of a curve on the surface towards an elastica, within its homotopy class.
//!
//! A curve found on a coarse graph turns in steps. Here its crossings slide along their edges until length plus
//! bending (the cost (8.1) of Campen's thesis) is least near where the curve was: a weak fidelity term pulls it
//! back, and it never leaves a tube around the original, since length alone would slide loops off the limbs
//! they embrace. Undulations much shorter than `2π (β R²)^¼` (`R` the tube's radius) are smoothed out, the
//! place of the curve is kept. A crossing that pushes against a vertex passes over it: the run of spokes crossed
//! on one side gives way to the spokes on the other side. So the homotopy class stays, but not the way past
//! single vertices. Sliding and passing alternate; in the end each vertex the curve still leans on is tried, by
//! relaxing the stretch around it on either side. The best curve met is the result.

mod banded;
mod energy;
mod original;
mod strip;

use std::collections::HashMap;

use glam::DVec3;
use thiserror::Error;

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

use super::{CurveError, SurfaceCurve, SurfacePoint};
use energy::Energy;
use original::{Best, Original};
use strip::TriangleStrip;
pub(super) use strip::{Side, spokes_across};

/// Penalty of a direction: triangle and unit tangent in it → `q` of (8.1), not negative.
pub type Alignment<'a> = dyn Fn(FaceId, DVec3) -> f64 + Sync + 'a;

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
    /// Crossings stay in `[t_min, 1 − t_min]` of their edges; between 0 and 0.5.
    pub t_min: f64,
    /// Points that the curve passes, up to a fraction of an edge; it passes smoothly, whatever vertices are near.
    pub waypoints: Vec<SurfacePoint>,
    /// Number of times at most that the curve slides and then passes vertices.
    pub rounds: usize,
    /// Number of times that the vertices still pushed against are then tried one by one. 0 takes about half the
    /// time and leaves a less fair curve.
    pub trials: usize,
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
            waypoints: Vec::new(),
            rounds: 8,
            trials: 10,
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
    /// A distance from the vertices that leaves nothing of an edge, or none.
    #[error("crossings cannot keep {t_min} of an edge from its ends")]
    VertexDistance {
        /// The option of this name.
        t_min: f64,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Sliding steps before vertices are passed; few, since passing changes the problem.
const STEPS: usize = 8;
/// Sliding steps once no vertex is passed any more.
const LAST_STEPS: usize = 30;
/// How often one vertex may be passed: there and back; more would be an oscillation.
const PASSES: u8 = 2;

/// The cost (8.1) of a curve as [`relax`] measures it.
///
/// # Errors
///
/// A curve that is not one on `mesh`.
pub fn curve_cost(mesh: &TriMesh, curve: &SurfaceCurve, options: &RelaxOptions<'_>) -> Result<CurveCost, CurveError> {
    curve.check(mesh)?;
    Ok(strip_cost(mesh, options, &TriangleStrip::new(curve)))
}

fn strip_cost(mesh: &TriMesh, options: &RelaxOptions<'_>, strip: &TriangleStrip) -> CurveCost {
    let n = strip.len();
    let t: Vec<f64> = strip.nodes.iter().map(|n| n.t).collect();
    Energy::new(mesh, options, strip, vec![[0.0; 3]; n], vec![(0.0, 1.0); n]).cost(&t)
}

/// Smooths `curve` (see the head of this module). The result passes [`SurfaceCurve::check`], has the homotopy
/// class of the curve (ends of an open one sliding on their boundary loops) and never costs more.
///
/// # Errors
///
/// A curve that is not one on `mesh`, a senseless `t_min`, or [`Cancelled`].
pub fn relax(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    options: &RelaxOptions<'_>,
    progress: &Progress,
) -> Result<Relaxed, RelaxError> {
    curve.check(mesh)?;
    if !(options.t_min > 0.0 && options.t_min < 0.5) {
        return Err(RelaxError::VertexDistance { t_min: options.t_min });
    }
    let mut strip = TriangleStrip::new(curve);
    let before = strip_cost(mesh, options, &strip);
    let original = Original::new(mesh, &strip, options);
    for node in &mut strip.nodes {
        node.t = node.t.clamp(options.t_min, 1.0 - options.t_min);
    }

    let mut best = Best::default();
    let mut passed = 0;
    let mut passes: HashMap<VertexId, u8> = HashMap::new();
    for _ in 0..options.rounds {
        progress.check()?;
        let pushes = original.slide(mesh, options, &mut strip, STEPS, &mut best);
        let now = pass_vertices(mesh, options, &original, &mut strip, &pushes, &mut passes);
        passed += now;
        if now == 0 {
            break;
        }
    }
    let mut strip = best.strip.clone().unwrap_or(strip);
    let mut failed: HashMap<VertexId, f64> = HashMap::new();
    for _ in 0..options.trials {
        progress.check()?;
        let pushes = original.slide(mesh, options, &mut strip, LAST_STEPS, &mut best);
        let now = original.try_vertices(mesh, options, &mut strip, &pushes, &mut failed);
        passed += now;
        if now == 0 {
            break;
        }
    }
    original.slide(mesh, options, &mut strip, LAST_STEPS, &mut best);
    let after = best.cost;
    let result = best.strip.filter(|s| after.total < before.total && s.curve().check(mesh).is_ok());
    Ok(match result {
        Some(strip) => original.finish(mesh, strip, before, after, passed),
        None => {
            Relaxed { curve: curve.clone(), before, after: before, max_displacement: 0.0, passed: 0, improved: false }
        }
    })
}

/// The vertices that crossings push against, and the side they are on, the hardest pushed first.
fn pushed_vertices(
    mesh: &TriMesh,
    options: &RelaxOptions<'_>,
    strip: &TriangleStrip,
    pushes: &[f64],
) -> Vec<(VertexId, Side)> {
    let mut pushed: Vec<(f64, VertexId, Side)> = Vec::new();
    for (i, &push) in pushes.iter().enumerate() {
        let t = strip.nodes[i].t;
        let near = if push > 0.0 { 1.0 - t } else { t };
        // Else it is blocked by the tube, not by the vertex.
        if push != 0.0 && near <= options.t_min * (1.0 + 1e-9) {
            let side = if push > 0.0 { Side::Left } else { Side::Right };
            pushed.push((push.abs(), strip.end(mesh, i, side), side));
        }
    }
    pushed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    pushed.into_iter().map(|p| (p.1, p.2)).collect()
}

/// Passes over the vertices that crossings push against; gives their number.
fn pass_vertices(
    mesh: &TriMesh,
    options: &RelaxOptions<'_>,
    original: &Original,
    strip: &mut TriangleStrip,
    pushes: &[f64],
    passes: &mut HashMap<VertexId, u8>,
) -> usize {
    let mut count = 0;
    for (v, side) in pushed_vertices(mesh, options, strip, pushes) {
        let Some(i) = (0..strip.len()).find(|&i| strip.end(mesh, i, side) == v) else { continue };
        if passes.get(&v).is_some_and(|&n| n >= PASSES) {
            continue;
        }
        let Some(run) = strip.run(mesh, i, side).filter(|_| original.embraces(mesh, strip, i, side)) else { continue };
        let (swept, total) = strip.sweep(mesh, run, side);
        // A run that sweeps less than half of the fan would give way to a longer one.
        if swept < 0.5 * total {
            continue;
        }
        if strip.pass(mesh, run, side, options.t_min) {
            *passes.entry(v).or_default() += 1;
            count += 1;
        }
    }
    count
}

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
