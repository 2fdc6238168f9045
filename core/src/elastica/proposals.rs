//! Loops proposed at a point: the cheapest, and alternatives in order of cost.

use glam::DVec3;

use super::curve_neighbourhood::Vicinity;
use super::graph::{ElasticaGraph, State};
use super::homology::HomologyClasses;
use super::mask::DirectionMask;
use super::search::{Ball, LoopSearch, Meter, ROUNDING, Route, SearchWorkspace, Stop};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};
use crate::surface::SurfaceCurve;

/// Two routes are one if one keeps within the separation of the other and their lengths differ by less than this
/// factor: then neither leaves out what the other goes round.
const SAME_LENGTH: f64 = 1.3;

/// Cosine of 45°: loops of one class that pass the vertex in directions further apart are different strips, those nearer
/// are one shifted to the side. Strips with less between them are equivalent (Campen, section 8.2.2).
const OTHER_DIRECTION: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Where the cheapest route shrinks to a point as a curve, the next ones up to this multiple of its cost are tried.
const FALLBACK_FACTOR: f64 = 2.0;

/// States settled from when there is a loop until it is shown, unless it is the cheapest before: about one
/// millisecond, in which most loops found first give way to better ones.
const PATIENCE: u64 = 4000;

/// What is known of a loop that is handed out early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// It is the cheapest so far; usually it is the cheapest of all, or costs a few percent more.
    Found,
    /// It is the cheapest of all.
    Proved,
}

/// What loops are wanted.
#[derive(Debug, Clone, Copy)]
pub struct ProposalQuery<'a> {
    /// The vertex they pass.
    pub vertex: VertexId,
    /// The direction they pass it in: then only the cheapest loop along the geodesic nearest to this direction is
    /// returned. Without, all directions compete.
    pub direction: Option<DVec3>,
    /// Directions that are closed.
    pub mask: &'a DirectionMask,
    /// Alternatives may cost up to this multiple of the cheapest loop; 1 asks for the cheapest only, which is faster.
    pub factor: f64,
    /// Most loops returned.
    pub max: usize,
    /// Alternatives keep this distance somewhere from every cheaper loop (in mesh units, measured along edges).
    pub separation: f64,
    /// Of the loops of one class that pass the vertex in about the same direction only the cheapest is wanted.
    pub classes: Option<&'a HomologyClasses>,
    /// A loop found nearby under the same mask: the search starts from what it becomes where it passes the vertex.
    pub nearby: Option<&'a FoundLoop>,
    /// Most search states to settle before the best so far is returned unproved. A state takes about a
    /// quarter of a microsecond.
    pub budget: u64,
}

impl<'a> ProposalQuery<'a> {
    /// The cheapest loop through a vertex, proved within about a second on ordinary meshes.
    pub fn cheapest(vertex: VertexId, mask: &'a DirectionMask) -> Self {
        Self {
            vertex,
            direction: None,
            mask,
            factor: 1.0,
            max: 1,
            separation: 0.05,
            classes: None,
            nearby: None,
            budget: 4_000_000,
        }
    }

    /// The cheapest loop and up to 15 alternatives that cost at most half as much again.
    pub fn alternatives(vertex: VertexId, mask: &'a DirectionMask) -> Self {
        Self { factor: 1.5, max: 16, budget: 20_000_000, ..Self::cheapest(vertex, mask) }
    }
}

/// A loop, or on open surfaces a curve from boundary to boundary, with its cost.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundLoop {
    /// The curve on the mesh of the graph.
    pub curve: SurfaceCurve,
    /// Total cost, the sum of the following three; a length for a surface of diagonal 1.
    pub cost: f64,
    /// Length.
    pub length: f64,
    /// Weighted alignment cost.
    pub alignment: f64,
    /// Weighted squared geodesic curvature.
    pub bending: f64,
    /// The vertices passed, joined by straight geodesics. A loop starts at the vertex asked for and does not repeat
    /// it; an open curve starts and ends on the boundary.
    pub path: Vec<VertexId>,
}

/// Loops through a vertex, cheapest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposals {
    /// The loops.
    pub loops: Vec<FoundLoop>,
    /// Whether the first is proved to be the cheapest and no alternative is missing; false if the budget was spent.
    pub proved: bool,
    /// Search states settled.
    pub settled: u64,
}

/// A loop that is proposed, and what others are compared with.
struct Kept {
    found: FoundLoop,
    /// The vertices within the separation of it; sorted.
    near: Vec<VertexId>,
    class: Option<u64>,
    heading: DVec3,
}

impl ElasticaGraph {
    /// The loops that `query` asks for. The result depends on nothing but the graph and the query.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn proposals(
        &self,
        query: &ProposalQuery,
        work: &mut SearchWorkspace,
        progress: &Progress,
    ) -> Result<Proposals, Cancelled> {
        self.proposals_with(query, work, progress, |_, _| {})
    }

    /// Like [`Self::proposals`], and hands loops to `watch` as soon as they are there: the first one found, perhaps
    /// a better one, and the cheapest when it is proved to be that, before alternatives are looked for. The same loop
    /// comes twice if what was found is then proved.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn proposals_with(
        &self,
        query: &ProposalQuery,
        work: &mut SearchWorkspace,
        progress: &Progress,
        watch: impl FnMut(Certainty, &FoundLoop),
    ) -> Result<Proposals, Cancelled> {
        self.prepare_boundary_costs(progress)?;
        let mut search = LoopSearch {
            graph: self,
            mask: query.mask,
            work,
            meter: Meter { progress, budget: query.budget, settled: 0 },
            vertex: query.vertex,
            factor: query.factor.max(1.0) as f32,
        };
        let seed = query.nearby.filter(|l| l.curve.closed && query.direction.is_none());
        let seed = seed.and_then(|l| self.seed(query.mask, query.vertex, &l.path));
        let mut routes = Vec::new();
        let outcome = match query.direction {
            Some(direction) => search.along(direction, &mut routes),
            None => search.all(seed, &mut routes, watch),
        };
        let proved = match outcome {
            Ok(()) => true,
            Err(Stop::Spent) => false,
            Err(Stop::Cancelled) => return Err(Cancelled),
        };
        let settled = search.meter.settled;
        let any = !routes.is_empty();
        let loops = self.distinct(routes, query, &mut work.vicinity);
        if loops.is_empty() && any && query.direction.is_none() && query.factor < FALLBACK_FACTOR {
            return self.proposals(&ProposalQuery { factor: FALLBACK_FACTOR, ..*query }, work, progress);
        }
        Ok(Proposals { loops, proved, settled })
    }

    /// The cheapest of `routes` that are curves and not copies of one another.
    fn distinct(&self, mut routes: Vec<Route>, query: &ProposalQuery, vicinity: &mut Vicinity) -> Vec<FoundLoop> {
        routes.sort_by(|a, b| a.cost.total_cmp(&b.cost).then_with(|| a.states.cmp(&b.states)));
        let Some(limit) = routes.first().map(|r| r.cost * query.factor.max(1.0) as f32 * ROUNDING) else {
            return Vec::new();
        };
        let mut kept: Vec<Kept> = Vec::new();
        for route in routes.iter().take_while(|r| r.cost <= limit) {
            if kept.len() >= query.max {
                break;
            }
            if kept.iter().any(|k| self.keeps_to(route, k)) {
                continue;
            }
            let Some(found) = self.found(route) else { continue };
            let class = query.classes.and_then(|c| c.of(&self.mesh, &found.curve));
            let heading = self.heading(route);
            let shifted = |k: &Kept| k.class == class && k.heading.dot(heading).abs() > OTHER_DIRECTION;
            if class.is_some() && kept.iter().any(shifted) {
                continue;
            }
            let near = vicinity.of(&self.mesh, &found.curve, query.separation);
            kept.push(Kept { found, near, class, heading });
        }
        kept.into_iter().map(|k| k.found).collect()
    }

    /// Whether a route is a loop kept, but for details.
    fn keeps_to(&self, route: &Route, kept: &Kept) -> bool {
        let ratio = self.parts(route)[0] / kept.found.length;
        (1.0 / SAME_LENGTH..SAME_LENGTH).contains(&ratio)
            && kept.found.curve.closed == route.closed
            && route.states.iter().all(|&e| kept.near.binary_search(&self.origin(e)).is_ok())
    }

    /// The direction in which a loop passes the vertex it starts at.
    fn heading(&self, route: &Route) -> DVec3 {
        let (Some(&first), Some(&last)) = (route.states.first(), route.states.last()) else { return DVec3::ZERO };
        (self.departure(first) - self.departure(self.reverse[last as usize])).normalize_or_zero()
    }

    /// Length, alignment and bending of a route.
    fn parts(&self, route: &Route) -> [f64; 3] {
        let s = &route.states;
        let mut sum = [0.0; 3];
        let mut add = |parts: [f32; 3]| sum.iter_mut().zip(parts).for_each(|(s, p)| *s += f64::from(p));
        for pair in s.windows(2) {
            add(self.step_parts(pair[0], pair[1]));
        }
        if let (Some(&start), Some(&end)) = (s.first(), s.last()) {
            if route.closed {
                add(self.step_parts(end, start));
            } else {
                add(self.half_parts(start));
                add(self.half_parts(end));
            }
        }
        sum
    }

    pub(super) fn found(&self, route: &Route) -> Option<FoundLoop> {
        let curve = self.curve(route)?;
        let [length, alignment, bending] = self.parts(route);
        let mut path: Vec<VertexId> = route.states.iter().map(|&e| self.origin(e)).collect();
        if let Some(&last) = route.states.last().filter(|_| !route.closed) {
            path.push(VertexId(self.target[last as usize]));
        }
        Some(FoundLoop { curve, cost: length + alignment + bending, length, alignment, bending, path })
    }
}

impl LoopSearch<'_> {
    /// The cheapest loop along the state nearest to `direction`.
    fn along(&mut self, direction: DVec3, routes: &mut Vec<Route>) -> Result<(), Stop> {
        let Some(a) = self.graph.nearest(self.mask, self.vertex, direction) else { return Ok(()) };
        let open = self.open_curves(&[a], f32::INFINITY, true)?;
        let limit = open.first().map_or(f32::INFINITY, |r| r.cost);
        routes.extend(open);
        routes.extend(self.both_ways(a, limit)?);
        Ok(())
    }

    /// The cheapest route, and those of the other start directions up to the factor. The search starts from `seed`, if
    /// there is one.
    pub(super) fn all(
        &mut self,
        seed: Option<Route>,
        routes: &mut Vec<Route>,
        mut watch: impl FnMut(Certainty, &FoundLoop),
    ) -> Result<(), Stop> {
        let out: Vec<State> = self.graph.leaving(self.vertex).collect();
        routes.extend(self.open_curves(&out, f32::INFINITY, true)?);
        let best = self.cheapest(seed, routes, &mut watch)?;
        if self.factor > 1.0
            && let Some(cost) = best.as_ref().map(|r| r.cost)
        {
            routes.extend(self.open_curves(&out, cost * self.slack(), false)?);
            self.dearer(best, routes)?;
        }
        Ok(())
    }

    /// The cheapest route, proved; those that it improved on are among `routes`.
    fn cheapest(
        &mut self,
        seed: Option<Route>,
        routes: &mut Vec<Route>,
        mut watch: impl FnMut(Certainty, &FoundLoop),
    ) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let mut show = |certainty, route: &Option<Route>| {
            if let Some(l) = route.as_ref().and_then(|r| graph.found(r)) {
                watch(certainty, &l);
            }
        };
        let mut best = routes.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).cloned();
        self.start();
        let mut shown = None;
        // It is shown at once, but proposed only if nothing is cheaper: an alternative it need not be.
        let seed = seed.filter(|s| best.as_ref().is_none_or(|b| s.cost < b.cost));
        if seed.is_some() {
            best = seed;
            shown = best.as_ref().map(|r| r.cost);
            show(Certainty::Found, &best);
        }
        let seed = shown;
        let mut patience = Some(PATIENCE);
        loop {
            let grown = self.ball(&mut best, 1.0, patience.take());
            let cost = best.as_ref().map(|r| r.cost);
            if cost != shown {
                shown = cost;
                show(Certainty::Found, &best);
                routes.extend(best.clone());
            }
            if grown? == Ball::Complete {
                break;
            }
        }
        let mut cost = best.as_ref().map_or(f32::INFINITY, |r| r.cost);
        self.corridor(cost)?;
        let directions = self.directions(cost);
        let known = routes.len();
        self.improve(&directions, &mut cost, routes)?;
        let better = routes[known..].iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).cloned();
        best = better.or(best);
        if seed.is_some() && best.as_ref().map(|r| r.cost) == seed {
            routes.extend(best.clone());
        }
        show(Certainty::Proved, &best);
        Ok(best)
    }

    /// The cheapest route of each start direction, up to the factor times the cost of `best`.
    fn dearer(&mut self, mut best: Option<Route>, routes: &mut Vec<Route>) -> Result<(), Stop> {
        let Some(cost) = best.as_ref().map(|r| r.cost) else { return Ok(()) };
        let limit = cost * self.slack();
        self.resume();
        self.ball(&mut best, self.slack(), None)?;
        self.corridor(limit)?;
        let starts = self.directions(limit).into_iter().map(|d| d.1).collect();
        self.alternatives(starts, limit, routes)
    }

    /// The factor, with room for rounding where costs up to it are wanted.
    pub(super) fn slack(&self) -> f32 {
        if self.factor > 1.0 { self.factor * ROUNDING } else { 1.0 }
    }
}
