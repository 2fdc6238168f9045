//! Steps between states, the edges of `g′`: which states may follow a state, and at what cost.
//!
//! The cost of a step is equation (8.2) of the thesis, for geodesics `e`, `f` that meet at the turning angle γ:
//!
//! `w(e, f) = |e′| (1 + α ½ (q(e) + q(f))) + β γ² / m`, with `m = min(|e|, |f|)` and
//! `|e′| = γ m / (2 tan ½γ) + ½ ||e| − |f||`.

use std::f32::consts::PI;

use rayon::prelude::*;

use super::graph::{DirectedGeodesic, ElasticaGraph, State, Successors};
use super::options::ElasticaError;

/// Positions before the computed one at which the search for the first allowed turn begins. Rounding moves that position
/// by one at most.
const SEARCH_MARGIN: usize = 2;

/// Number of states whose step costs one parallel task computes; chosen by hand.
const CHUNK: usize = 4096;

impl ElasticaGraph {
    /// Finds the successors of each state and the cost of each step.
    ///
    /// The costs take as much memory as everything else. They are stored because the costs of the steps from one state are
    /// then contiguous, and a search is bound by memory latency.
    pub(super) fn find_steps(&mut self) -> Result<(), ElasticaError> {
        let graph = &*self;
        self.successors = (0..graph.n_states()).into_par_iter().map(|e| graph.find_successors(e as State)).collect();
        let mut count = 0u32;
        for range in &mut self.successors {
            range.costs = count;
            count = count.checked_add(u32::from(range.count)).ok_or(ElasticaError::TooLarge)?;
        }
        self.step_costs = self.all_step_costs(count as usize);
        Ok(())
    }

    /// The costs of all `count` steps. They are written in place: collecting them from chunks would take twice the memory.
    fn all_step_costs(&self, count: usize) -> Vec<f32> {
        let mut costs = vec![0.0; count];
        let mut chunks = Vec::new();
        let mut rest = &mut costs[..];
        for first in (0..self.n_states()).step_by(CHUNK) {
            let states = first..(first + CHUNK).min(self.n_states());
            let steps = self.successors[states.clone()].iter().map(|range| usize::from(range.count)).sum();
            let (chunk, after) = rest.split_at_mut(steps);
            chunks.push((states, chunk));
            rest = after;
        }
        chunks.into_par_iter().for_each(|(states, chunk)| {
            let steps = states.flat_map(|e| self.successors(e as State).map(move |f| (e as State, f)));
            chunk.iter_mut().zip(steps).for_each(|(cost, (e, f))| *cost = self.step_cost(e, f));
        });
        costs
    }

    /// The range of states that leave the target of `e` within the largest turning angle; the index of its costs is not
    /// set.
    fn find_successors(&self, e: State) -> Successors {
        let states = self.outgoing(self.target(e));
        let n = (states.end - states.start) as usize;
        let max_turn = self.options.max_turn as f32;
        let allowed = |i: usize| self.turn(e, states.start + (i % n) as u32) <= max_turn;
        // The range begins near the angle that the largest turn to the right leads to.
        let lowest = (self.geodesics[e as usize].back_angle + PI - max_turn).rem_euclid(2.0 * PI);
        let around = &self.geodesics[states.start as usize..states.end as usize];
        let about = around.partition_point(|g| g.out_angle < lowest) + n.saturating_sub(SEARCH_MARGIN);
        let begins = |&i: &usize| allowed(i) && !allowed(i + n - 1);
        let (offset, count) = match (about..about + n).find(begins) {
            Some(i) => (i % n, (1..n).find(|&k| !allowed(i + k)).unwrap_or(n)),
            // Either every turn is allowed or none.
            None => (0, if n > 0 && allowed(0) { n } else { 0 }),
        };
        let wrapped = (offset + count).saturating_sub(n);
        let start = states.start + offset as u32;
        Successors { start, offset: offset as u16, count: count as u16, wrapped: wrapped as u16, costs: 0 }
    }

    /// Turning angle from `e` into `f`, which leaves the target of `e`; the same number from `rev f` into `rev e`.
    #[inline]
    fn turn(&self, e: State, f: State) -> f32 {
        turn(&self.geodesics[e as usize], &self.geodesics[f as usize])
    }

    /// Number of steps between states.
    pub fn n_steps(&self) -> usize {
        self.successors.iter().map(|range| range.count as usize).sum()
    }

    /// The states that may follow `e`.
    #[inline]
    pub(super) fn successors(&self, e: State) -> impl Iterator<Item = State> + use<> {
        let Successors { start, offset, count, wrapped, .. } = self.successors[e as usize];
        let first = start - u32::from(offset);
        (start..start + u32::from(count - wrapped)).chain(first..first + u32::from(wrapped))
    }

    /// Calls `visit` with each state that may follow `e` and the cost of the step into it.
    #[inline]
    pub(super) fn expand(&self, e: State, mut visit: impl FnMut(State, f32)) {
        let range = &self.successors[e as usize];
        let first = range.start - u32::from(range.offset);
        let costs = &self.step_costs[range.costs as usize..][..usize::from(range.count)];
        let (straight, wrapped) = costs.split_at(usize::from(range.count - range.wrapped));
        for (start, costs) in [(range.start, straight), (first, wrapped)] {
            for (f, &step) in (start..).zip(costs) {
                visit(f, step);
            }
        }
    }

    /// The first state that may follow `e`, and bits of the first and the last step cost that [`Self::expand`] reads: for
    /// prefetching.
    #[inline]
    pub(super) fn touch_steps(&self, e: State) -> (State, u32) {
        let range = &self.successors[e as usize];
        let costs = &self.step_costs[range.costs as usize..][..usize::from(range.count)];
        match costs {
            [] => (e, 0),
            [first, ..] => (range.start, first.to_bits() ^ costs[costs.len() - 1].to_bits()),
        }
    }

    /// Whether `f` may follow `e`.
    #[inline]
    pub(super) fn follows(&self, e: State, f: State) -> bool {
        self.outgoing(self.target(e)).contains(&f) && self.turn(e, f) <= self.options.max_turn as f32
    }

    /// The weighted terms of the cost of the step from `e` into `f`: length, alignment and bending.
    #[inline]
    pub(super) fn step_terms(&self, e: State, f: State) -> [f32; 3] {
        let (alpha, beta) = (self.options.alpha as f32, self.options.beta as f32);
        step_terms(&self.geodesics[e as usize], &self.geodesics[f as usize], alpha, beta)
    }

    /// Cost of the step from `e` into `f`.
    #[inline]
    pub(super) fn step_cost(&self, e: State, f: State) -> f32 {
        let [length, alignment, bending] = self.step_terms(e, f);
        length + alignment + bending
    }

    /// The weighted terms of the cost of half a state, from its midpoint to its end, where an open curve ends on the
    /// boundary: length, alignment and bending, which is zero.
    #[inline]
    pub(super) fn half_terms(&self, e: State) -> [f32; 3] {
        let g = &self.geodesics[e as usize];
        let length = 0.5 * g.length;
        [length, self.options.alpha as f32 * g.alignment * length, 0.0]
    }

    /// The sum of [`Self::half_terms`].
    #[inline]
    pub(super) fn half_cost(&self, e: State) -> f32 {
        self.half_terms(e).iter().sum()
    }
}

/// Turning angle between two geodesics that meet, from 0 to π.
#[inline]
fn turn(from: &DirectedGeodesic, to: &DirectedGeodesic) -> f32 {
    ((to.out_angle - from.back_angle).abs() - PI).abs()
}

/// The terms of (8.2), weighted: length, alignment and bending.
#[inline]
fn step_terms(a: &DirectedGeodesic, b: &DirectedGeodesic, alpha: f32, beta: f32) -> [f32; 3] {
    let turn = turn(a, b);
    // `f32::min` is slower, as it handles NaN.
    let least = if a.length < b.length { a.length } else { b.length };
    // Series of ½γ / tan ½γ; the next term is below 1e-6 at 30°.
    let x = 0.25 * turn * turn;
    let arc = 1.0 - x * (1.0 / 3.0 + x * (1.0 / 45.0 + x * (2.0 / 945.0)));
    let length = arc * least + 0.5 * (a.length - b.length).abs();
    let alignment = alpha * 0.5 * (a.alignment + b.alignment) * length;
    [length, alignment, beta * turn * turn / least]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geodesic(out_angle: f32, back_angle: f32, length: f32, alignment: f32) -> DirectedGeodesic {
        DirectedGeodesic { out_angle, back_angle, length, alignment }
    }

    #[test]
    fn a_straight_step_costs_the_mean_length_and_alignment() {
        let (a, b) = (geodesic(0.0, PI, 0.25, 2.0), geodesic(0.0, PI, 0.5, 4.0));
        let [length, alignment, bending] = step_terms(&a, &b, 1.0, 0.25);
        assert_eq!((length, alignment, bending), (0.375, 3.0 * 0.375, 0.0));
    }

    #[test]
    fn a_turn_costs_as_in_equation_8_2() {
        let (beta, m) = (0.25, 0.1f64);
        for degrees in [1.0f64, 10.0, 30.0] {
            let turn = degrees.to_radians();
            let (a, b) = (geodesic(0.0, PI, m as f32, 0.0), geodesic(turn as f32, 0.0, 0.3, 0.0));
            let [length, _, bending] = step_terms(&a, &b, 1.0, beta as f32);
            let expected = turn * m / (2.0 * (0.5 * turn).tan()) + 0.5 * (0.3 - m);
            assert!((f64::from(length) - expected).abs() < 1e-6, "{degrees}°: {length}, expected {expected}");
            assert!((f64::from(bending) - beta * turn * turn / m).abs() < 1e-5, "{degrees}°: {bending}");
        }
    }

    #[test]
    fn turns_are_measured_across_the_angle_zero() {
        let from = |back_angle| geodesic(0.0, back_angle, 1.0, 0.0);
        let to = |out_angle| geodesic(out_angle, 0.0, 1.0, 0.0);
        // Straight on from 0.1 before half a turn is 0.1 before a full turn.
        assert!((turn(&from(PI - 0.1), &to(0.05)) - 0.15).abs() < 1e-6);
        assert!((turn(&from(PI + 0.1), &to(2.0 * PI - 0.05)) - 0.15).abs() < 1e-6);
        // Straight back is half a turn.
        assert_eq!(turn(&from(1.0), &to(1.0)), PI);
    }
}
