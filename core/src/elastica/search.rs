//! The exact search for the cheapest loops through a vertex.
//!
//! 1. *Ball*: Dijkstra from all states leaving `v` at once, each label remembering its origin. Where the way out
//!    of one origin meets the reversed way out of another, both together are a loop, with a corner at `v`. If the
//!    corner is a turn that is allowed, the loop is real and an upper bound. A loop of cost `C` splits into two
//!    parts below `C/2`, so the ball needs half the bound as radius. It stops there and can grow on later, when
//!    dearer loops are wanted too.
//! 2. *Corridor*: beyond that radius only states are continued from which the way back is known and the whole
//!    stays below the bound. Now `D(rev e)` is the exact cheapest way from `e` back to `v`, in any direction, for
//!    each state that can lie on a loop below the bound.
//! 3. *Stars* ([`super::stars`]): for each start direction that can still matter an A* search with that potential
//!    finds the cheapest loop in that direction, up to the bound.
//!
//! Reversal symmetry of the prices carries 1 and 2: one field from `v` serves both ways.

use std::sync::Mutex;

use super::bucket_queue::Queue;
use super::curve_neighbourhood::Vicinity;
use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::open_curves::ExitMemory;
use super::start_directions::Fan;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// Sums of the same prices in another order differ in their last bits; bounds give way by this much.
pub(super) const ROUNDING: f32 = 1.0 + 1e-5;

/// States settled between two looks at the wish to stop: some tenths of a millisecond.
const CHECK_EVERY: u64 = 1024;

/// How a state was reached.
#[derive(Debug, Clone, Copy, Default)]
struct Trail {
    parent: State,
    /// Index among the states leaving the source; with several legs, the leg of the parent.
    origin: u16,
}

/// Tentative distances of one search, with its queue.
///
/// A label is a distance as bits, which order like non-negative numbers, below the number of its search. These count
/// down, by two: labels of earlier searches are larger than any that replaces them, and final ones, which have the
/// number below, smaller. So one comparison tells whether a label is to be replaced.
#[derive(Debug, Default)]
pub(super) struct Field {
    labels: Vec<u64>,
    trails: Vec<Trail>,
    /// Of tentative labels.
    number: u32,
    queue: Queue,
}

impl Field {
    /// Forgets everything, without touching it.
    pub(super) fn restart(&mut self, n_states: usize) {
        self.queue.clear();
        if self.labels.len() != n_states || self.number <= 2 {
            self.labels.clear();
            self.labels.resize(n_states, u64::MAX);
            self.trails.clear();
            self.trails.resize(n_states, Trail::default());
            self.number = u32::MAX - 1;
        }
        self.number -= 2;
    }

    /// Tentative or final distance, infinite where none is known.
    #[inline]
    pub(super) fn dist(&self, e: State) -> f32 {
        let label = self.labels[e as usize];
        if (label >> 32) as u32 <= self.number { f32::from_bits(label as u32) } else { f32::INFINITY }
    }

    /// Final distance, infinite where none is known.
    #[inline]
    pub(super) fn settled(&self, e: State) -> f32 {
        let label = self.labels[e as usize];
        if (label >> 32) as u32 == self.number - 1 { f32::from_bits(label as u32) } else { f32::INFINITY }
    }

    /// Whether the distance is final.
    #[inline]
    pub(super) fn is_settled(&self, e: State) -> bool {
        (self.labels[e as usize] >> 32) as u32 == self.number - 1
    }

    #[inline]
    fn label(&self, dist: f32) -> u64 {
        u64::from(self.number) << 32 | u64::from(dist.to_bits())
    }

    /// Whether a distance would replace the one of `e`: that of a settled state stands, as another order of summing
    /// the same prices must not open it again.
    #[inline]
    pub(super) fn improves(&self, e: State, dist: f32) -> bool {
        self.label(dist) < self.labels[e as usize]
    }

    #[inline]
    pub(super) fn set(&mut self, e: State, dist: f32, parent: State, origin: u16) {
        self.labels[e as usize] = self.label(dist);
        self.trails[e as usize] = Trail { parent, origin };
    }

    #[inline]
    pub(super) fn push(&mut self, key: f32, e: State) {
        self.queue.push(key, e);
    }

    /// The next state that is not settled, with its key; it is settled now.
    #[inline]
    pub(super) fn settle(&mut self, graph: &ElasticaGraph) -> Option<(f32, State)> {
        loop {
            self.fetch(graph);
            let (key, e) = self.queue.pop()?;
            if !self.is_settled(e) {
                self.labels[e as usize] -= 1 << 32;
                return Some((key, e));
            }
        }
    }

    /// Reads what settling the states of the nearest bucket will read, so that it need not be waited for one state after
    /// the other: a search jumps about in tables that no fast memory holds.
    #[inline]
    fn fetch(&mut self, graph: &ElasticaGraph) {
        let Some(states) = self.queue.opened() else { return };
        let (labels, trails) = (&self.labels, &self.trails);
        let read = |e: State| {
            let (next, price) = graph.ahead(e);
            let [e, back, next] = [e, graph.reverse[e as usize], next].map(|s| s as usize);
            let label = labels[e] ^ labels[back] ^ labels[next];
            label as u32 ^ price ^ trails[e].parent ^ trails[next].parent
        };
        std::hint::black_box(states.map(read).fold(0, |all, read| all ^ read));
    }

    /// Smallest key in the queue, infinite if it is empty.
    #[inline]
    pub(super) fn top(&mut self) -> f32 {
        self.queue.top()
    }

    /// The state before `e`, and the tag it was set with.
    pub(super) fn parent(&self, e: State) -> (State, u16) {
        let trail = &self.trails[e as usize];
        (trail.parent, trail.origin)
    }

    /// The states from the source to `e`.
    pub(super) fn chain(&self, e: State) -> Vec<State> {
        let mut list: Vec<State> =
            std::iter::successors(Some(e), |&s| Some(self.parent(s).0).filter(|&p| p != NO_STATE)).collect();
        list.reverse();
        list
    }
}

/// Memory of searches, to be kept between them. It serves one graph at a time and is never cleared.
#[derive(Debug, Default)]
pub struct SearchWorkspace {
    pub(super) root: Field,
    /// The states settled in the ball, and those in the corridor beyond it.
    ball: Vec<State>,
    corridor: Vec<State>,
    /// The queue of the ball while the one of the field serves the corridor.
    rim: Queue,
    /// The second front of a search from both ends.
    pub(super) far: Field,
    /// Per thread, for start directions that are searched at once.
    pub(super) fans: Vec<Mutex<Fan>>,
    pub(super) vicinity: Vicinity,
    /// Per leg of a loop through anchors.
    pub(super) out: Vec<Field>,
    pub(super) home: Vec<Field>,
    pub(super) ahead: Vec<Field>,
    pub(super) exits: ExitMemory,
}

impl SearchWorkspace {
    /// An empty workspace; it grows with the first search.
    pub fn new() -> Self {
        Self::default()
    }
}

/// Why a search ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    Cancelled,
    /// The allowed number of states was settled.
    Spent,
}

impl From<Cancelled> for Stop {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// A cycle of states, or an open sequence from boundary to boundary, with its price.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Route {
    pub(super) cost: f32,
    pub(super) states: Vec<State>,
    pub(super) closed: bool,
}

/// Counts work and asks now and then whether to go on.
#[derive(Debug)]
pub(super) struct Meter<'a> {
    pub(super) progress: &'a Progress,
    pub(super) budget: u64,
    pub(super) settled: u64,
}

impl Meter<'_> {
    #[inline]
    pub(super) fn tick(&mut self) -> Result<(), Stop> {
        if self.settled >= self.budget {
            return Err(Stop::Spent);
        }
        if self.settled.is_multiple_of(CHECK_EVERY) {
            self.progress.check()?;
        }
        self.settled += 1;
        Ok(())
    }
}

/// One search for loops through one vertex.
pub(super) struct LoopSearch<'a> {
    pub(super) graph: &'a ElasticaGraph,
    pub(super) mask: &'a DirectionMask,
    pub(super) work: &'a mut SearchWorkspace,
    pub(super) meter: Meter<'a>,
    pub(super) vertex: VertexId,
    /// Costs up to this multiple of the cheapest are wanted.
    pub(super) factor: f32,
}

/// Whether the ball has its radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ball {
    Complete,
    /// A loop is there and could be shown, but the ball is to grow on.
    Growing,
}

impl LoopSearch<'_> {
    /// Begins step 1.
    pub(super) fn start(&mut self) {
        let out = self.graph.leaving(self.vertex);
        let first = out.start;
        let SearchWorkspace { root, ball, corridor, .. } = &mut *self.work;
        root.restart(self.graph.n_states());
        ball.clear();
        corridor.clear();
        for a in out.filter(|&a| self.mask.is_open(a)) {
            root.set(a, 0.0, NO_STATE, (a - first) as u16);
            root.push(0.0, a);
        }
    }

    /// Step 1: lets the ball grow as far as loops of up to `factor` times the cost of `best` need it, and improves
    /// `best`. With `pause` it comes back early, so many states after there is a loop at all.
    pub(super) fn ball(&mut self, best: &mut Option<Route>, factor: f32, pause: Option<u64>) -> Result<Ball, Stop> {
        let graph = self.graph;
        let first = graph.leaving(self.vertex).start;
        let mut cost = best.as_ref().map_or(f32::INFINITY, |r| r.cost);
        let slack = self.slack();
        let mut meet = None;
        let mut patience = if best.is_some() { pause } else { None };
        let SearchWorkspace { root, ball, .. } = &mut *self.work;
        let mut outcome = Ok(Ball::Complete);
        while root.top() < 0.5 * cost * factor {
            if patience == Some(0) {
                outcome = Ok(Ball::Growing);
                break;
            }
            let Some((d, e)) = root.settle(graph) else { break };
            if let Err(stop) = self.meter.tick() {
                outcome = Err(stop);
                break;
            }
            patience = patience.map(|p| p - 1);
            ball.push(e);
            let (before, origin) = root.parent(e);
            // A loop is seen when the second of two states on it that are each other's reverse is settled.
            let back = graph.reverse[e as usize];
            let total = d + root.dist(back);
            if total < cost {
                let (after, other) = root.parent(back);
                let (start, last) = (first + u32::from(origin), graph.reverse[(first + u32::from(other)) as usize]);
                if graph.follows(last, start) && total + graph.step(last, start) < cost {
                    patience = patience.or(pause);
                    (cost, meet) = (total + graph.step(last, start), Some((before, e, after)));
                }
            }
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !root.improves(f, reached) || !self.mask.is_open(f) {
                    return;
                }
                root.set(f, reached, e, origin);
                // What is too far stays labelled: the corridor may go on from there.
                if reached < 0.5 * cost * slack {
                    root.push(reached, f);
                }
            });
        }
        if let Some((before, e, after)) = meet {
            // The label of the reverse of `e` may have changed since; those of settled states have not.
            let chain = |s: State| if s == NO_STATE { Vec::new() } else { root.chain(s) };
            let mut states = chain(before);
            states.push(e);
            states.extend(chain(after).iter().rev().map(|&s| graph.reverse[s as usize]));
            *best = Some(Route { cost, states, closed: true });
        }
        outcome
    }

    /// Step 2, for loops cheaper than `limit`, half of which is the radius of the ball.
    pub(super) fn corridor(&mut self, limit: f32) -> Result<(), Stop> {
        let graph = self.graph;
        let SearchWorkspace { root, ball, corridor, rim, .. } = &mut *self.work;
        std::mem::swap(&mut root.queue, rim);
        root.queue.clear();
        for &back in ball.iter() {
            let x = graph.reverse[back as usize];
            if !root.is_settled(x) && root.dist(x) + root.dist(back) < limit {
                root.push(root.dist(x), x);
            }
        }
        while let Some((d, e)) = root.settle(graph) {
            self.meter.tick()?;
            corridor.push(e);
            let origin = root.parent(e).1;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if root.improves(f, reached)
                    && reached + root.settled(graph.reverse[f as usize]) < limit
                    && self.mask.is_open(f)
                {
                    root.set(f, reached, e, origin);
                    root.push(reached, f);
                }
            });
        }
        std::mem::swap(&mut root.queue, rim);
        Ok(())
    }

    /// Back to step 1 after step 2. The distances in the corridor are exact, but the ball has not grown from there.
    pub(super) fn resume(&mut self) {
        let SearchWorkspace { root, corridor, .. } = &mut *self.work;
        for e in corridor.drain(..) {
            let (dist, (parent, origin)) = (root.dist(e), root.parent(e));
            root.set(e, dist, parent, origin);
            root.push(dist, e);
        }
    }

    /// The start directions that can lie on a loop cheaper than `limit`, each with a lower bound, cheapest first.
    pub(super) fn directions(&self, limit: f32) -> Vec<(f32, State)> {
        let graph = self.graph;
        let root = &self.work.root;
        let out = graph.leaving(self.vertex);
        let home = |a: State| root.settled(graph.reverse[a as usize]);
        let mut list: Vec<(f32, State)> = out
            .clone()
            .filter(|&a| self.mask.is_open(a))
            .map(|a| {
                // The loop comes back along some `rev b` that turns into `a`; it is also a loop through `b`.
                let closing = out
                    .clone()
                    .filter(|&b| graph.follows(graph.reverse[b as usize], a))
                    .map(|b| home(a).max(home(b)) + graph.step(graph.reverse[b as usize], a))
                    .fold(f32::INFINITY, f32::min);
                (closing, a)
            })
            .filter(|&(bound, _)| bound < limit)
            .collect();
        list.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        list
    }
}
