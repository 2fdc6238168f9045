//! The third step of the search: the cheapest loop per start direction.
//!
//! An A* search with the distance to `v` as potential is quick where the way back ends in a direction that turns
//! into the start. Where it does not, the potential promises too much almost everywhere. Then neighbouring start
//! directions share a *sector field*: the distances from only those directions that turn into one of them, within
//! the corridor. It is a potential that knows about the corner at `v`, and rules most directions out at once.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::graph::{ElasticaGraph, NO_STATE, State};
use super::mask::DirectionMask;
use super::search::{Field, LoopSearch, Meter, Route, Stop};

/// Widest range of start directions that share a sector field, in radians; 0.25 to 0.8 cost nearly the same. The
/// field knows the way back to within this and twice the largest turn.
const SECTOR: f64 = 0.5;

/// States an A* search may settle before a sector field is worth its cost: at least so many, ...
const QUICK_LEAST: u64 = 500;
/// ... and this part of the states settled for the ball and the corridor.
const QUICK_PART: u64 = 16;

/// Memory for one sector.
#[derive(Debug, Default)]
pub(super) struct Fan {
    sector: Field,
    star: Field,
}

impl LoopSearch<'_> {
    /// Looks for loops cheaper than `cost` in the given directions, each with a lower bound, in order; lowers `cost`
    /// to the cheapest found.
    pub(super) fn improve(
        &mut self,
        directions: &[(f32, State)],
        cost: &mut f32,
        routes: &mut Vec<Route>,
    ) -> Result<(), Stop> {
        let sectors = Sectors { graph: self.graph, mask: self.mask, root: &self.work.root };
        self.work.fans.resize_with(1.max(self.work.fans.len()), Mutex::default);
        let fan = self.work.fans[0].get_mut().unwrap_or_else(PoisonError::into_inner);
        let quick = QUICK_LEAST.max(self.meter.settled / QUICK_PART);
        let mut tried = Vec::new();
        for &(bound, a) in directions {
            if bound >= *cost {
                break;
            }
            if tried.contains(&a) {
                continue;
            }
            let meter = &mut self.meter;
            let mut short = Meter { budget: meter.budget.min(meter.settled + quick), ..*meter };
            let attempt = sectors.star(&mut fan.star, None, a, *cost, &mut short);
            meter.settled = short.settled;
            match attempt {
                Ok(route) => {
                    tried.push(a);
                    *cost = route.as_ref().map_or(*cost, |r| r.cost);
                    routes.extend(route);
                }
                Err(Stop::Spent) if meter.settled < meter.budget => {
                    let angle = |s: State| self.graph.out_angle(s);
                    let near = |s: State| unturned(angle(s) - angle(a)) <= 0.5 * SECTOR && !tried.contains(&s);
                    let group: Vec<State> = directions.iter().map(|d| d.1).filter(|&s| near(s)).collect();
                    for route in sectors.solve(fan, &group, *cost, true, meter)? {
                        *cost = cost.min(route.cost);
                        routes.push(route);
                    }
                    tried.extend(group);
                }
                Err(stop) => return Err(stop),
            }
        }
        Ok(())
    }

    /// The cheapest loop in each of the given directions, if it costs less than `limit`. Sectors are searched at
    /// once, each with an equal share of the budget, so that the result does not depend on the number of threads.
    pub(super) fn alternatives(
        &mut self,
        mut starts: Vec<State>,
        limit: f32,
        routes: &mut Vec<Route>,
    ) -> Result<(), Stop> {
        starts.sort_unstable();
        let angle = |s: State| self.graph.out_angle(s);
        let mut groups: Vec<&[State]> = Vec::new();
        let mut rest = &starts[..];
        while let Some(&first) = rest.first() {
            let count = rest.iter().take_while(|&&s| angle(s) - angle(first) <= SECTOR).count();
            let (group, after) = rest.split_at(count);
            groups.push(group);
            rest = after;
        }
        let threads = rayon::current_num_threads();
        self.work.fans.resize_with(threads + 1, Mutex::default);
        let sectors = Sectors { graph: self.graph, mask: self.mask, root: &self.work.root };
        let (fans, progress) = (&self.work.fans, self.meter.progress);
        let left = self.meter.budget - self.meter.settled;
        let results: Vec<(u64, Result<Vec<Route>, Stop>)> = groups
            .par_iter()
            .map(|group| {
                let thread = rayon::current_thread_index().map_or(threads, |t| t.min(threads));
                let mut fan = fans[thread].lock().unwrap_or_else(PoisonError::into_inner);
                let share = left * group.len() as u64 / starts.len() as u64;
                let mut meter = Meter { progress, budget: share, settled: 0 };
                let found = sectors.solve(&mut fan, group, limit, false, &mut meter);
                (meter.settled, found)
            })
            .collect();
        let mut outcome = Ok(());
        for (settled, result) in results {
            self.meter.settled += settled;
            match result {
                Ok(found) => routes.extend(found),
                Err(Stop::Cancelled) => return Err(Stop::Cancelled),
                Err(Stop::Spent) => outcome = Err(Stop::Spent),
            }
        }
        outcome
    }
}

/// An angle modulo a full turn, without sign.
fn unturned(angle: f64) -> f64 {
    let turns = angle / std::f64::consts::TAU;
    (turns - turns.round()).abs() * std::f64::consts::TAU
}

/// What the searches of all sectors share.
struct Sectors<'a> {
    graph: &'a ElasticaGraph,
    mask: &'a DirectionMask,
    /// Final distances from `v` in the corridor.
    root: &'a Field,
}

impl Sectors<'_> {
    /// The cheapest loop below `limit` in each direction of `group`; or only those that are cheaper than the ones
    /// before.
    fn solve(
        &self,
        fan: &mut Fan,
        group: &[State],
        limit: f32,
        only_better: bool,
        meter: &mut Meter,
    ) -> Result<Vec<Route>, Stop> {
        self.sector(&mut fan.sector, group, limit, meter)?;
        let graph = self.graph;
        let bound = |a: State| {
            let ways = graph.successors(a).filter(|&f| self.mask.is_open(f));
            ways.map(|f| graph.step(a, f) + fan.sector.settled(graph.reverse[f as usize])).fold(f32::INFINITY, f32::min)
        };
        let mut order: Vec<(f32, State)> = group.iter().map(|&a| (bound(a), a)).collect();
        order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let (mut routes, mut limit) = (Vec::new(), limit);
        for (bound, a) in order {
            if bound >= limit {
                break;
            }
            if let Some(route) = self.star(&mut fan.star, Some(&fan.sector), a, limit, meter)? {
                if only_better {
                    limit = route.cost;
                }
                routes.push(route);
            }
        }
        Ok(routes)
    }

    /// Distances from the directions that turn into one of `group`, with the price of that turn, as far as they
    /// can be part of a loop below `limit`.
    fn sector(&self, field: &mut Field, group: &[State], limit: f32, meter: &mut Meter) -> Result<(), Stop> {
        let graph = self.graph;
        field.restart(graph.n_states());
        let Some(&first) = group.first() else { return Ok(()) };
        for b in graph.leaving(graph.origin(first)).filter(|&b| self.mask.is_open(b)) {
            let last = graph.reverse[b as usize];
            let turns = group.iter().filter(|&&a| graph.follows(last, a)).map(|&a| graph.step(last, a));
            let closing = turns.fold(f32::INFINITY, f32::min);
            if closing + self.root.settled(last) < limit {
                field.set(b, closing, NO_STATE, 0);
                field.push(closing, b);
            }
        }
        while let Some((d, e)) = field.settle(graph) {
            meter.tick()?;
            graph.expand(e, |f, step| {
                let reached = d + step;
                if field.improves(f, reached)
                    && reached + self.root.settled(graph.reverse[f as usize]) < limit
                    && self.mask.is_open(f)
                {
                    field.set(f, reached, e, 0);
                    field.push(reached, f);
                }
            });
        }
        Ok(())
    }

    /// The cheapest loop that starts with state `a`, if there is one cheaper than `limit`. The potential is the
    /// distance from a sector that contains all ways into `a`, or from all directions.
    fn star(
        &self,
        star: &mut Field,
        sector: Option<&Field>,
        a: State,
        limit: f32,
        meter: &mut Meter,
    ) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let potential = sector.unwrap_or(self.root);
        star.restart(graph.n_states());
        let (mut cost, mut last) = (limit, NO_STATE);
        let (mut from, mut d, mut parent) = (a, 0.0, NO_STATE);
        loop {
            graph.expand(from, |f, step| {
                let reached = d + step;
                if !star.improves(f, reached) {
                    return;
                }
                let key = reached + potential.settled(graph.reverse[f as usize]);
                if key >= cost || !self.mask.is_open(f) {
                    return;
                }
                star.set(f, reached, parent, 0);
                star.push(key, f);
                if graph.follows(f, a) {
                    let closed = reached + graph.step(f, a);
                    if closed < cost {
                        (cost, last) = (closed, f);
                    }
                }
            });
            let Some((_, e)) = star.settle(graph).filter(|&(key, _)| key < cost) else { break };
            meter.tick()?;
            (from, d, parent) = (e, star.dist(e), e);
        }
        if last == NO_STATE {
            return Ok(None);
        }
        let mut states = vec![a];
        states.extend(star.chain(last));
        Ok(Some(Route { cost, states, closed: true }))
    }
}
