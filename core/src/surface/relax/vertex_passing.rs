//! Passing a curve over the vertices that block it.

use std::collections::HashMap;

use super::triangle_strip::TriangleStrip;
use super::tube::Tube;
use crate::mesh::VertexId;
use crate::surface::vertex_fan::Side;

/// How often one vertex may be passed: there and back. More would be an oscillation.
const PASSES: u8 = 2;
/// Least part of a vertex' fan that a run must sweep to be passed. Where it sweeps less, the run on the other side
/// would be longer.
const LEAST_SWEEP: f64 = 0.5;
/// Crossings on each side of a vertex that move in a trial: about the extent of a bend.
const TRIAL_REACH: usize = 10;
/// Steps of minimisation in a trial.
const TRIAL_STEPS: usize = 12;
/// Steps of minimisation after which a trial is abandoned if its cost is [`ABANDON_RATIO`] times that of the curve before.
const FIRST_TRIAL_STEPS: usize = 6;
/// See [`FIRST_TRIAL_STEPS`]. The factor is above 1, since a curve that has just passed a vertex costs more at first.
const ABANDON_RATIO: f64 = 2.0;
/// A failed trial is repeated only after the cost around the vertex has changed by this fraction.
const RETRY_CHANGE: f64 = 1e-2;
/// Least decrease of the cost around the vertex, as a fraction, for a trial to succeed; far above rounding.
const MIN_TRIAL_GAIN: f64 = 1e-5;

/// Passes over vertices at which the forces point beyond the end of an edge.
#[derive(Default)]
pub(super) struct VertexPassing {
    /// Passes over each vertex so far.
    passes: HashMap<VertexId, u8>,
    /// Cost around a vertex at its last failed trial.
    failed: HashMap<VertexId, f64>,
}

impl VertexPassing {
    /// Passes over the vertices that block crossings; returns their number. `forces` are those of
    /// [`Energy::bound_forces`](super::energy::Energy::bound_forces).
    pub fn pass(&mut self, tube: &Tube<'_>, strip: &mut TriangleStrip, forces: &[f64]) -> usize {
        let (mesh, options) = (tube.mesh, tube.options);
        let mut count = 0;
        for (v, side) in blocking_vertices(tube, strip, forces) {
            // Earlier passes may have moved the curve away from the vertex.
            let Some(i) = (0..strip.len()).find(|&i| strip.end(mesh, i, side) == v) else { continue };
            if self.passes.get(&v).is_some_and(|&n| n >= PASSES) {
                continue;
            }
            let Some(run) = strip.run(mesh, i, side).filter(|_| tube.contains_end(strip, i, side)) else { continue };
            let (swept, total) = strip.swept_angle(mesh, run, side);
            if swept < LEAST_SWEEP * total {
                continue;
            }
            if strip.pass_vertex(mesh, run, side, options.t_min) {
                *self.passes.entry(v).or_default() += 1;
                count += 1;
            }
        }
        count
    }

    /// Tries each vertex that blocks a crossing: passes over it and minimises around it; keeps the result if the cost
    /// has decreased. Returns the number of vertices passed.
    pub fn try_each(&mut self, tube: &Tube<'_>, strip: &mut TriangleStrip, forces: &[f64]) -> usize {
        let (mesh, options) = (tube.mesh, tube.options);
        let mut count = 0;
        for (v, side) in blocking_vertices(tube, strip, forces) {
            let Some(i) = (0..strip.len()).find(|&i| strip.end(mesh, i, side) == v) else { continue };
            let Some(run) = strip.run(mesh, i, side).filter(|_| tube.contains_end(strip, i, side)) else { continue };
            let Some((mut now, first)) = strip.window(mesh, run, TRIAL_REACH) else { continue };
            let length = now.len();
            let mut run_in_window = run;
            run_in_window.first = (run.first + strip.len() - first) % strip.len();
            let mut other = now.clone();
            if !other.pass_vertex(mesh, run_in_window, side, options.t_min) {
                continue;
            }
            let cost = |strip: &mut TriangleStrip, steps: usize| {
                let (energy, t) = tube.minimise(strip, steps);
                energy.value(&t)
            };
            // The whole strip has just been minimised, so the window needs no steps.
            let here = cost(&mut now, 0);
            if self.failed.get(&v).is_some_and(|then| (then - here).abs() < RETRY_CHANGE * here) {
                continue;
            }
            let mut there = cost(&mut other, FIRST_TRIAL_STEPS);
            if there < here * ABANDON_RATIO {
                there = cost(&mut other, TRIAL_STEPS);
            }
            if there < here * (1.0 - MIN_TRIAL_GAIN) {
                strip.replace_window(other, first, length);
                self.failed.remove(&v);
                count += 1;
            } else {
                self.failed.insert(v, here);
            }
        }
        count
    }
}

/// The vertices that block crossings, with the side of the curve they are on, in order of decreasing force.
fn blocking_vertices(tube: &Tube<'_>, strip: &TriangleStrip, forces: &[f64]) -> Vec<(VertexId, Side)> {
    let mut blocking: Vec<(f64, VertexId, Side)> = Vec::new();
    for (i, &force) in forces.iter().enumerate() {
        let t = strip.crossings[i].t;
        let distance = if force > 0.0 { 1.0 - t } else { t };
        // A crossing at another bound is blocked by the tube, not by the vertex.
        if force != 0.0 && distance <= tube.options.t_min * (1.0 + 1e-9) {
            let side = if force > 0.0 { Side::Left } else { Side::Right };
            blocking.push((force.abs(), strip.end(tube.mesh, i, side), side));
        }
    }
    if tube.options.tie > 0.0 {
        let unit = tube.options.tie * blocking.iter().map(|b| b.0).fold(0.0, f64::max);
        blocking.iter_mut().for_each(|b| b.0 = (b.0 / unit).round());
    }
    blocking.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    blocking.into_iter().map(|p| (p.1, p.2)).collect()
}
