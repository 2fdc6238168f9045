//! Steps between states: what may follow a state, and at which price.

use std::f32::consts::PI;

use rayon::prelude::*;

use super::graph::{ElasticaError, ElasticaGraph, Node, State};
use crate::mesh::VertexId;

/// How many places before the one computed the first allowed turn is looked for: rounding moves it by one at most.
const NEARLY: usize = 2;

/// States whose steps are priced at once.
const PART: usize = 4096;

/// The states that may follow a state: a range around its end, which may be wrapped.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Window {
    /// The first of them.
    start: State,
    /// Its position among the states of the vertex.
    offset: u16,
    count: u16,
    /// How many of them are the first states of the vertex.
    wrapped: u16,
    /// Where the prices of the steps to them begin.
    prices: u32,
}

impl ElasticaGraph {
    /// Finds what follows each state, and the price of each step. The prices take as much memory as all else, but those
    /// from one state lie in one place, and a search waits for memory more than for anything else.
    pub(super) fn find_steps(&mut self) -> Result<(), ElasticaError> {
        let graph = &*self;
        self.window = (0..graph.n_states()).into_par_iter().map(|e| graph.find_window(e as State)).collect();
        let mut count = 0u32;
        for window in &mut self.window {
            window.prices = count;
            count = count.checked_add(u32::from(window.count)).ok_or(ElasticaError::TooLarge)?;
        }
        self.prices = self.step_prices(count as usize);
        Ok(())
    }

    /// The prices of all steps, of which there are so many, written where they stay: collected from parts they would take
    /// twice the memory.
    fn step_prices(&self, count: usize) -> Vec<f32> {
        let mut prices = vec![0.0; count];
        let mut parts = Vec::new();
        let mut rest = &mut prices[..];
        for first in (0..self.n_states()).step_by(PART) {
            let states = first..(first + PART).min(self.n_states());
            let steps = self.window[states.clone()].iter().map(|w| usize::from(w.count)).sum();
            let (part, after) = rest.split_at_mut(steps);
            parts.push((states, part));
            rest = after;
        }
        parts.into_par_iter().for_each(|(states, part)| {
            let steps = states.flat_map(|e| self.successors(e as State).map(move |f| (e as State, f)));
            part.iter_mut().zip(steps).for_each(|(price, (e, f))| *price = self.step(e, f));
        });
        prices
    }

    fn find_window(&self, e: State) -> Window {
        let states = self.leaving(VertexId(self.target[e as usize]));
        let n = (states.end - states.start) as usize;
        let max_turn = self.options.max_turn as f32;
        let allowed = |i: usize| self.turn(e, states.start + (i % n) as u32) <= max_turn;
        // They begin about where the largest turn leads to.
        let lowest = (self.nodes[e as usize].back + PI - max_turn).rem_euclid(2.0 * PI);
        let around = &self.nodes[states.start as usize..states.end as usize];
        let about = around.partition_point(|node| node.out < lowest) + n.saturating_sub(NEARLY);
        let begins = |&i: &usize| allowed(i) && !allowed(i + n - 1);
        let (offset, count) = match (about..about + n).find(begins) {
            Some(i) => (i % n, (1..n).find(|&k| !allowed(i + k)).unwrap_or(n)),
            None => (0, if n > 0 && allowed(0) { n } else { 0 }),
        };
        let wrapped = (offset + count).saturating_sub(n);
        let start = states.start + offset as u32;
        Window { start, offset: offset as u16, count: count as u16, wrapped: wrapped as u16, prices: 0 }
    }

    /// Turning angle from `e` into `f`, which leaves the end of `e`. The same number from `rev f` into `rev e`.
    #[inline]
    fn turn(&self, e: State, f: State) -> f32 {
        turn(&self.nodes[e as usize], &self.nodes[f as usize])
    }

    /// Number of steps between states.
    pub fn n_steps(&self) -> usize {
        self.window.iter().map(|w| w.count as usize).sum()
    }

    /// The states that may follow `e`.
    #[inline]
    pub(super) fn successors(&self, e: State) -> impl Iterator<Item = State> + use<> {
        let Window { start, offset, count, wrapped, .. } = self.window[e as usize];
        let first = start - u32::from(offset);
        (start..start + u32::from(count - wrapped)).chain(first..first + u32::from(wrapped))
    }

    /// Shows every state that may follow `e`, and the price of that step, to `visit`.
    #[inline]
    pub(super) fn expand(&self, e: State, mut visit: impl FnMut(State, f32)) {
        let window = &self.window[e as usize];
        let first = window.start - u32::from(window.offset);
        let prices = &self.prices[window.prices as usize..][..usize::from(window.count)];
        let (straight, wrapped) = prices.split_at(usize::from(window.count - window.wrapped));
        for (start, prices) in [(window.start, straight), (first, wrapped)] {
            for (f, &step) in (start..).zip(prices) {
                visit(f, step);
            }
        }
    }

    /// The first state that may follow `e`, and bits of prices at both ends of those that [`Self::expand`] reads.
    #[inline]
    pub(super) fn ahead(&self, e: State) -> (State, u32) {
        let window = &self.window[e as usize];
        let prices = &self.prices[window.prices as usize..][..usize::from(window.count)];
        match prices {
            [] => (e, 0),
            [first, ..] => (window.start, first.to_bits() ^ prices[prices.len() - 1].to_bits()),
        }
    }

    /// Whether `f` may follow `e`.
    #[inline]
    pub(super) fn follows(&self, e: State, f: State) -> bool {
        self.leaving(VertexId(self.target[e as usize])).contains(&f) && self.turn(e, f) <= self.options.max_turn as f32
    }

    /// Parts of the price of the step from `e` into `f`: length, alignment and bending, weighted.
    #[inline]
    pub(super) fn step_parts(&self, e: State, f: State) -> [f32; 3] {
        let (alpha, beta) = (self.options.alpha as f32, self.options.beta as f32);
        price(&self.nodes[e as usize], &self.nodes[f as usize], alpha, beta)
    }

    /// Price of the step from `e` into `f`.
    #[inline]
    pub(super) fn step(&self, e: State, f: State) -> f32 {
        let [length, alignment, bending] = self.step_parts(e, f);
        length + alignment + bending
    }
}

#[inline]
fn turn(from: &Node, to: &Node) -> f32 {
    ((to.out - from.back).abs() - PI).abs()
}

/// Parts of the price of a step: length, alignment and bending, weighted.
#[inline]
fn price(a: &Node, b: &Node, alpha: f32, beta: f32) -> [f32; 3] {
    let turn = turn(a, b);
    // Not `min`, whose care for what is not a number costs.
    let least = if a.length < b.length { a.length } else { b.length };
    // ½γ / tan ½γ by its series; the next term is below 1e-6 at 30°.
    let x = 0.25 * turn * turn;
    let arc = 1.0 - x * (1.0 / 3.0 + x * (1.0 / 45.0 + x * (2.0 / 945.0)));
    let length = arc * least + 0.5 * (a.length - b.length).abs();
    let alignment = alpha * 0.5 * (a.alignment + b.alignment) * length;
    [length, alignment, beta * turn * turn / least]
}
