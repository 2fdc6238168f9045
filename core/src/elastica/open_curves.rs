//! Curves from boundary to boundary through a vertex.
//!
//! As in Campen, chapter 8, all boundaries are one node of the graph. The cheapest ways to it from all states are
//! found once for a graph, with no direction closed. Closed directions only make ways dearer, so these costs stay lower
//! bounds whatever strips are placed, and nothing is computed anew when one is: the exact way from a state is found by
//! an A* search along them, which hardly leaves the way where no strip is in it. Searches from one vertex share what
//! they learn. From a state that was settled at distance `d` while the way out turned out to cost `c`, it costs
//! `c − d` at least (Koenig and Likhachev, Adaptive A*).

use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::search::{Field, LoopSearch, Meter, Route, Stop};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// A raised bound from where no way leads to the boundary; infinite ones are none.
const NO_WAY: f32 = f32::MAX;

/// By which part of the limit a way that was not found below it costs more at least: rounding must not have it looked
/// for again.
const BEYOND: f32 = 1e-6;

/// Memory for ways to the boundary.
#[derive(Debug, Default)]
pub(super) struct ExitMemory {
    field: Field,
    settled: Vec<State>,
    /// Lower bounds of ways that the searches from one vertex have raised.
    raised: Field,
}

impl ElasticaGraph {
    /// Makes what all searches on an open surface need. The first search does it too; on a large mesh it takes about a
    /// second, once for a graph, which may be spent beforehand. Does nothing on a closed surface.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn prepare_boundary_costs(&self, progress: &Progress) -> Result<(), Cancelled> {
        self.ways_out(progress).map(|_| ())
    }

    /// Per state the least cost from its middle to the boundary, with no direction closed; `None` on a closed surface.
    pub(super) fn ways_out(&self, progress: &Progress) -> Result<Option<&[f32]>, Cancelled> {
        if !self.has_boundary {
            return Ok(None);
        }
        if let Some(known) = self.ways_out.get() {
            return Ok(Some(known));
        }
        // Reversed, a way from the boundary is a way to it.
        let mut field = Field::default();
        field.restart(self.n_states());
        for v in self.mesh.vertices().filter(|&v| self.mesh.is_boundary_vertex(v)) {
            for e in self.leaving(v) {
                let cost = self.half_parts(e).iter().sum();
                field.set(e, cost, NO_STATE, 0);
                field.push(cost, e);
            }
        }
        let mut settled = 0u32;
        while let Some((d, e)) = field.settle(self) {
            settled += 1;
            if settled.is_multiple_of(4096) {
                progress.check()?;
            }
            self.expand(e, |f, step| {
                if field.improves(f, d + step) {
                    field.set(f, d + step, e, 0);
                    field.push(d + step, f);
                }
            });
        }
        let ways = self.reverse.iter().map(|&back| field.dist(back)).collect();
        Ok(Some(self.ways_out.get_or_init(|| ways)))
    }
}

/// The cheapest ways to the boundary with some directions closed.
pub(super) struct Exits<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    least: &'a [f32],
    memory: &'a mut ExitMemory,
}

/// A way to the boundary: its cost from the middle of its first state, and its states.
pub(super) type Exit = (f32, Vec<State>);

impl<'a> Exits<'a> {
    /// For searches from one vertex. `None` on a closed surface.
    pub(super) fn new(
        graph: &'a ElasticaGraph,
        mask: &'a DirectionMask,
        memory: &'a mut ExitMemory,
        progress: &Progress,
    ) -> Result<Option<Self>, Cancelled> {
        let Some(least) = graph.ways_out(progress)? else { return Ok(None) };
        memory.raised.restart(graph.n_states());
        Ok(Some(Self { graph, mask, least, memory }))
    }

    /// What the way from `e` costs at least.
    fn bound(&self, e: State) -> f32 {
        bound(self.least, &self.memory.raised, e)
    }

    /// The cheapest way from `a`, if it costs less than `limit`.
    pub(super) fn way(&mut self, a: State, limit: f32, meter: &mut Meter) -> Result<Option<Exit>, Stop> {
        let (graph, mask, least) = (self.graph, self.mask, self.least);
        let ExitMemory { field, settled, raised } = &mut *self.memory;
        field.restart(graph.n_states());
        settled.clear();
        let (mut cost, mut end) = (limit, None);
        let start = bound(least, raised, a);
        if start < limit {
            field.set(a, 0.0, NO_STATE, 0);
            field.push(start, a);
        }
        while let Some((_, e)) = field.settle(graph).filter(|&(key, _)| key < cost) {
            meter.tick()?;
            settled.push(e);
            let d = field.dist(e);
            if graph.mesh.is_boundary_vertex(VertexId(graph.target[e as usize])) {
                let total = d + graph.half_parts(e).iter().sum::<f32>();
                if total < cost {
                    (cost, end) = (total, Some(e));
                }
            }
            graph.expand(e, |f, step| {
                let reached = d + step;
                if !field.improves(f, reached) {
                    return;
                }
                let key = reached + bound(least, raised, f);
                if key < cost && mask.is_open(f) {
                    field.set(f, reached, e, 0);
                    field.push(key, f);
                }
            });
        }
        for &e in settled.iter() {
            let known = (cost - field.dist(e)).min(NO_WAY);
            if known > bound(least, raised, e) {
                raised.set(e, known, NO_STATE, 0);
            }
        }
        Ok(end.map(|e| (cost, field.chain(e))))
    }

    /// The cheapest curves from boundary to boundary that leave `v` by each of `starts`, if they cost less than `limit`;
    /// or only those that are cheaper than the ones before. They come to `v` along a state that turns into the start,
    /// or begin at `v` if that is on the boundary.
    pub(super) fn through(
        &mut self,
        v: VertexId,
        starts: impl Iterator<Item = State>,
        mut limit: f32,
        only_better: bool,
        meter: &mut Meter,
    ) -> Result<Vec<Route>, Stop> {
        let out = self.graph.leaving(v);
        let first = out.start;
        let mut ways = Ways { low: out.map(|a| self.bound(a)).collect(), exact: Vec::new(), first };
        ways.exact.resize(ways.low.len(), None);
        let mut order: Vec<(f32, State)> =
            starts.map(|a| (self.entrance(&ways, v, a).map_or(f32::INFINITY, |e| e.0), a)).collect();
        order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut routes = Vec::new();
        for (bound, a) in order {
            if bound >= limit {
                break;
            }
            if let Some(route) = self.leaving_by(&mut ways, v, a, limit, meter)? {
                if only_better {
                    limit = route.cost;
                }
                routes.push(route);
            }
        }
        Ok(routes)
    }

    /// Of the ways to come to `v` and leave it by `a` the one that promises to cost least: that cost, the price of the
    /// turn, and the reverse of the state by which it comes, if it does not begin at `v`.
    fn entrance(&self, ways: &Ways, v: VertexId, a: State) -> Option<(f32, f32, Option<State>)> {
        let graph = self.graph;
        let reverse = |s: State| graph.reverse[s as usize];
        let turns = graph.leaving(v).filter(|&b| graph.follows(reverse(b), a) && self.mask.is_open(b)).map(|b| {
            let turn = graph.step(reverse(b), a);
            (ways.low(a) + ways.low(b) + turn, turn, Some(b))
        });
        let begins = graph.mesh.is_boundary_vertex(v).then(|| {
            let half = graph.half_parts(a).iter().sum::<f32>();
            (ways.low(a) + half, half, None)
        });
        turns.chain(begins).filter(|way| way.0.is_finite()).min_by(|x, y| x.0.total_cmp(&y.0))
    }

    /// The cheapest curve that leaves `v` by `a`, if it costs less than `limit`.
    fn leaving_by(
        &mut self,
        ways: &mut Ways,
        v: VertexId,
        a: State,
        limit: f32,
        meter: &mut Meter,
    ) -> Result<Option<Route>, Stop> {
        // Each time round a bound becomes exact or is raised beyond what is wanted of it.
        while let Some((cost, turn, back)) = self.entrance(ways, v, a).filter(|e| e.0 < limit) {
            let both = [Some(a), back];
            let Some(unknown) = both.into_iter().flatten().find(|&s| ways.exact[ways.place(s)].is_none()) else {
                let exact = |s: State| ways.exact[ways.place(s)].iter().flatten().copied();
                let mut states: Vec<State> = back.map_or_else(Vec::new, |b| exact(b).collect());
                states.reverse();
                states.iter_mut().for_each(|s| *s = self.graph.reverse[*s as usize]);
                states.extend(exact(a));
                return Ok(Some(Route { cost, states, closed: false }));
            };
            let others: f32 = both.into_iter().flatten().filter(|&s| s != unknown).map(|s| ways.low(s)).sum();
            let wanted = limit - others - turn;
            let place = ways.place(unknown);
            match self.way(unknown, wanted, meter)? {
                Some((cost, states)) => {
                    ways.low[place] = cost;
                    ways.exact[place] = Some(states);
                }
                None => ways.low[place] = wanted + limit * BEYOND,
            }
        }
        Ok(None)
    }
}

/// What is known of the ways to the boundary from the states around a vertex.
struct Ways {
    first: State,
    /// Their costs, or what they cost at least.
    low: Vec<f32>,
    /// Those that were found.
    exact: Vec<Option<Vec<State>>>,
}

impl Ways {
    fn place(&self, a: State) -> usize {
        (a - self.first) as usize
    }

    fn low(&self, a: State) -> f32 {
        self.low[self.place(a)]
    }
}

/// What a way from a state costs at least.
fn bound(least: &[f32], raised: &Field, e: State) -> f32 {
    match raised.dist(e) {
        f32::INFINITY => least[e as usize],
        NO_WAY => f32::INFINITY,
        raised => raised,
    }
}

impl LoopSearch<'_> {
    /// The cheapest curves from boundary to boundary; see [`Exits::through`]. None on a closed surface.
    pub(super) fn open_curves(&mut self, starts: &[State], limit: f32, only_better: bool) -> Result<Vec<Route>, Stop> {
        let open = starts.iter().copied().filter(|&a| self.mask.is_open(a));
        match Exits::new(self.graph, self.mask, &mut self.work.exits, self.meter.progress)? {
            Some(mut exits) => exits.through(self.vertex, open, limit, only_better, &mut self.meter),
            None => Ok(Vec::new()),
        }
    }
}
