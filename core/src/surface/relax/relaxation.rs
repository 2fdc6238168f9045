//! Relaxation: sliding and passing over vertices in turn. The method is described in the [parent module](super).

use super::energy::Energy;
use super::options::{CurveCost, RelaxError, RelaxOptions, Relaxed};
use super::triangle_strip::TriangleStrip;
use super::tube::Tube;
use super::vertex_passing::VertexPassing;
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::curve::{CurveError, SurfaceCurve};

/// Steps of minimisation between passes over vertices; few, since a pass changes the problem.
const STEPS: usize = 8;
/// Steps of minimisation between trials, and at the end.
const LAST_STEPS: usize = 30;

/// The cost (8.1) of a curve as [`relax`] measures it.
///
/// # Errors
///
/// [`CurveError`] if the curve does not lie on `mesh`.
pub fn curve_cost(mesh: &TriMesh, curve: &SurfaceCurve, options: &RelaxOptions<'_>) -> Result<CurveCost, CurveError> {
    curve.check(mesh)?;
    Ok(strip_cost(mesh, options, &TriangleStrip::new(curve)))
}

fn strip_cost(mesh: &TriMesh, options: &RelaxOptions<'_>, strip: &TriangleStrip) -> CurveCost {
    let n = strip.len();
    let t: Vec<f64> = strip.crossings.iter().map(|n| n.t).collect();
    Energy::new(mesh, options, strip, vec![[0.0; 3]; n], vec![(0.0, 1.0); n]).cost(&t)
}

/// Smooths `curve` towards an elastica, as described in the [module documentation](super).
///
/// The result passes [`SurfaceCurve::check`], is homotopic to `curve` (the ends of an open curve may slide on their
/// boundary loops) and has no higher cost.
///
/// # Errors
///
/// See [`RelaxError`].
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
    let tube = Tube::new(mesh, options, &strip);
    for crossing in &mut strip.crossings {
        crossing.t = crossing.t.clamp(options.t_min, 1.0 - options.t_min);
    }

    let mut best = Best::default();
    let mut passing = VertexPassing::default();
    let mut passed = 0;
    for _ in 0..options.rounds {
        progress.check()?;
        let forces = best.slide(&tube, &mut strip, STEPS);
        let count = passing.pass(&tube, &mut strip, &forces);
        passed += count;
        if count == 0 {
            break;
        }
    }
    let mut strip = best.strip.clone().unwrap_or(strip);
    for _ in 0..options.trials {
        progress.check()?;
        let forces = best.slide(&tube, &mut strip, LAST_STEPS);
        let count = passing.try_each(&tube, &mut strip, &forces);
        passed += count;
        if count == 0 {
            break;
        }
    }
    best.slide(&tube, &mut strip, LAST_STEPS);
    let after = best.cost;
    let result = best.strip.filter(|s| after.total < before.total && s.curve().check(mesh).is_ok());
    Ok(match result {
        Some(strip) => relaxed(&tube, strip, before, after, passed),
        None => {
            Relaxed { curve: curve.clone(), before, after: before, max_displacement: 0.0, passed: 0, improved: false }
        }
    })
}

/// The best strip so far.
struct Best {
    strip: Option<TriangleStrip>,
    cost: CurveCost,
    /// Cost and fidelity term, by which strips are compared.
    value: f64,
}

impl Default for Best {
    fn default() -> Self {
        Self { strip: None, cost: CurveCost::default(), value: f64::INFINITY }
    }
}

impl Best {
    /// Slides the crossings of `strip` along their edges and keeps the strip if it is the best. Returns the forces on
    /// crossings at their bounds.
    fn slide(&mut self, tube: &Tube<'_>, strip: &mut TriangleStrip, steps: usize) -> Vec<f64> {
        let (energy, t) = tube.minimise(strip, steps);
        let cost = energy.cost(&t);
        let value = cost.total + energy.fidelity(&t);
        if value < self.value {
            *self = Self { strip: Some(strip.clone()), cost, value };
        }
        energy.bound_forces(&t)
    }
}

fn relaxed(tube: &Tube<'_>, mut strip: TriangleStrip, before: CurveCost, after: CurveCost, passed: usize) -> Relaxed {
    if strip.closed {
        let start = (0..strip.len()).min_by_key(|&i| strip.crossings[i].reference).unwrap_or(0);
        strip.crossings.rotate_left(start);
    }
    let max_displacement = (0..strip.len()).map(|i| tube.displacement(&strip, i)).fold(0.0, f64::max);
    Relaxed { max_displacement, curve: strip.curve(), before, after, passed, improved: true }
}
