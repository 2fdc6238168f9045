//! Loops proposed at a vertex: the cheapest, and alternatives in order of cost.

use glam::DVec3;

use super::budget::{SearchBudget, Stop};
use super::curve_neighbourhood::CurveNeighbourhood;
use super::graph::{ElasticaGraph, State};
use super::homology::HomologyClasses;
use super::mask::DirectionMask;
use super::open_curves::BoundarySearch;
use super::route::{ROUNDING, Route};
use super::search::{Ball, LoopSearch};
use super::workspace::SearchWorkspace;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};
use crate::surface::SurfaceCurve;

/// Largest ratio of the lengths of two loops that count as copies. A loop is a copy of a cheaper one if it stays within the
/// separation of it and their lengths differ by less than this factor; then neither skips a part of the other. Chosen by
/// hand.
const SAME_LENGTH: f64 = 1.3;

/// Cosine of 45°. Homologous loops that pass the vertex at a smaller angle to each other are equivalent, and the cheapest is
/// kept; at a larger angle they are different strips (Campen, section 8.2.2).
const SAME_DIRECTION: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// If all routes up to the factor of the query are contractible, and therefore no loops, the search is repeated up to this
/// multiple of the cost of the cheapest route. Chosen by hand.
const FALLBACK_FACTOR: f64 = 2.0;

/// Number of states settled after the first loop is found and before it is shown: about one millisecond, in which most
/// first loops are replaced by better ones.
const SHOW_AFTER: u64 = 4000;

/// What is known about a loop that is shown while the search continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// It is the cheapest found so far. Usually it is the cheapest of all, or costs a few percent more.
    Found,
    /// It is the cheapest of all.
    Proved,
}

/// Which loops of a search are returned.
#[derive(Debug, Clone, Copy)]
pub struct Selection<'a> {
    /// Alternatives may cost up to this multiple of the cheapest loop. 1: only the cheapest, which is faster.
    pub factor: f64,
    /// Largest number of loops returned.
    pub max: usize,
    /// Each alternative has a vertex farther than this from every cheaper loop of similar length (in mesh units, measured
    /// along edges).
    pub separation: f64,
    /// If given, of homologous loops that pass the vertex in about the same direction only the cheapest is returned.
    pub classes: Option<&'a HomologyClasses>,
}

impl Selection<'_> {
    /// The cheapest loop. The separation of 0.05, on a surface of model size 1, only matters for alternatives.
    pub fn cheapest() -> Self {
        Self { factor: 1.0, max: 1, separation: 0.05, classes: None }
    }

    /// The cheapest loop and up to 15 alternatives of at most 1.5 times its cost.
    pub fn alternatives() -> Self {
        Self { factor: 1.5, max: 16, ..Self::cheapest() }
    }
}

/// A query for loops through a vertex.
#[derive(Debug, Clone, Copy)]
pub struct ProposalQuery<'a> {
    /// The vertex that the loops pass.
    pub vertex: VertexId,
    /// The direction in which they pass it: only the cheapest loop along the geodesic nearest to this direction is
    /// returned. `None`: all directions compete.
    pub direction: Option<DVec3>,
    /// Directions that are closed.
    pub mask: &'a DirectionMask,
    /// Which loops are returned.
    pub selection: Selection<'a>,
    /// A loop found at a vertex nearby, under the same mask: the search starts from its detour through the vertex.
    pub nearby: Option<&'a FoundLoop>,
    /// Largest number of search states to settle; then the best loop found so far is returned without proof. A state takes
    /// about a quarter of a microsecond.
    pub budget: u64,
}

impl<'a> ProposalQuery<'a> {
    /// The cheapest loop through a vertex, in any direction. The budget, about a second, suffices for a proof on ordinary
    /// meshes.
    pub fn cheapest(vertex: VertexId, mask: &'a DirectionMask) -> Self {
        Self { vertex, direction: None, mask, selection: Selection::cheapest(), nearby: None, budget: 4_000_000 }
    }

    /// The cheapest loop and up to 15 alternatives of at most 1.5 times its cost.
    pub fn alternatives(vertex: VertexId, mask: &'a DirectionMask) -> Self {
        Self { selection: Selection::alternatives(), budget: 20_000_000, ..Self::cheapest(vertex, mask) }
    }
}

/// A loop, or on open surfaces a curve from boundary to boundary, with its elastica cost.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundLoop {
    /// The curve on the mesh of the graph.
    pub curve: SurfaceCurve,
    /// Elastica cost, the sum of the following three terms; a length, on a surface of model size 1.
    pub cost: f64,
    /// Length of the geodesics, with rounded corners as in (8.2); on a surface of model size 1.
    pub length: f64,
    /// Weighted alignment cost.
    pub alignment: f64,
    /// Weighted squared geodesic curvature.
    pub bending: f64,
    /// The vertices passed, joined by straight geodesics. A loop starts at the vertex of the query and does not repeat
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
    /// Number of search states settled.
    pub settled: u64,
}

/// A loop to be returned, with what the next ones are compared with.
struct KeptLoop {
    found: FoundLoop,
    /// The vertices within the separation of it; sorted.
    near: Vec<VertexId>,
    class: Option<u64>,
    /// Unit vector in which it passes the vertex.
    heading: DVec3,
}

impl ElasticaGraph {
    /// The loops of a query. The result depends on nothing but the graph and the query.
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

    /// Like [`Self::proposals`], and calls `watch` with loops as soon as they are known: the first one found, each better
    /// one, and the cheapest when it is proved, before alternatives are searched. A loop found and then proved is passed
    /// twice.
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
            budget: SearchBudget { progress, limit: query.budget, settled: 0 },
            vertex: query.vertex,
            factor: query.selection.factor.max(1.0) as f32,
        };
        let nearby = query.nearby.filter(|l| l.curve.closed && query.direction.is_none());
        let initial = nearby.and_then(|l| self.initial_loop(query.mask, query.vertex, &l.path));
        let mut routes = Vec::new();
        let outcome = match query.direction {
            Some(direction) => search.in_direction(direction, &mut routes),
            None => search.in_all_directions(initial, &mut routes, watch),
        };
        let proved = match outcome {
            Ok(()) => true,
            Err(Stop::Spent) => false,
            Err(Stop::Cancelled) => return Err(Cancelled),
        };
        let settled = search.budget.settled;
        let any = !routes.is_empty();
        let loops = self.distinct(routes, &query.selection, &mut work.neighbourhood);
        if loops.is_empty() && any && query.direction.is_none() && query.selection.factor < FALLBACK_FACTOR {
            let selection = Selection { factor: FALLBACK_FACTOR, ..query.selection };
            return self.proposals(&ProposalQuery { selection, ..*query }, work, progress);
        }
        Ok(Proposals { loops, proved, settled })
    }

    /// The cheapest of `routes` that are not contractible and not copies of one another.
    pub(super) fn distinct(
        &self,
        mut routes: Vec<Route>,
        selection: &Selection,
        neighbourhood: &mut CurveNeighbourhood,
    ) -> Vec<FoundLoop> {
        routes.sort_by(|a, b| a.cost.total_cmp(&b.cost).then_with(|| a.states.cmp(&b.states)));
        let Some(limit) = routes.first().map(|r| r.cost * selection.factor.max(1.0) as f32 * ROUNDING) else {
            return Vec::new();
        };
        let mut kept: Vec<KeptLoop> = Vec::new();
        for route in routes.iter().take_while(|r| r.cost <= limit) {
            if kept.len() >= selection.max {
                break;
            }
            if kept.iter().any(|k| self.is_copy(route, k)) {
                continue;
            }
            let Some(found) = self.found_loop(route) else { continue };
            let class = selection.classes.and_then(|c| c.of(&self.mesh, &found.curve));
            let heading = self.heading(route);
            let equivalent = |k: &KeptLoop| k.class == class && k.heading.dot(heading).abs() > SAME_DIRECTION;
            if class.is_some() && kept.iter().any(equivalent) {
                continue;
            }
            let near = neighbourhood.of(&self.mesh, &found.curve, selection.separation);
            kept.push(KeptLoop { found, near, class, heading });
        }
        kept.into_iter().map(|k| k.found).collect()
    }

    /// Whether a route is a copy of a loop that is kept; see [`SAME_LENGTH`].
    fn is_copy(&self, route: &Route, kept: &KeptLoop) -> bool {
        let ratio = self.route_terms(route)[0] / kept.found.length;
        (1.0 / SAME_LENGTH..SAME_LENGTH).contains(&ratio)
            && kept.found.curve.closed == route.closed
            && route.states.iter().all(|&e| kept.near.binary_search(&self.origin(e)).is_ok())
    }

    /// Unit vector in which a loop passes the vertex it starts at.
    fn heading(&self, route: &Route) -> DVec3 {
        let (Some(&first), Some(&last)) = (route.states.first(), route.states.last()) else { return DVec3::ZERO };
        (self.departure(first) - self.departure(self.reversed(last))).normalize_or_zero()
    }

    /// The loop of a route; `None` if it is contractible to a point or cannot be traced.
    pub(super) fn found_loop(&self, route: &Route) -> Option<FoundLoop> {
        let curve = self.curve(route)?;
        let [length, alignment, bending] = self.route_terms(route);
        let path = self.route_vertices(route);
        Some(FoundLoop { curve, cost: length + alignment + bending, length, alignment, bending, path })
    }
}

impl LoopSearch<'_> {
    /// The cheapest loop or open curve along the state nearest to `direction`.
    fn in_direction(&mut self, direction: DVec3, routes: &mut Vec<Route>) -> Result<(), Stop> {
        let Some(a) = self.graph.nearest_open(self.mask, self.vertex, direction) else { return Ok(()) };
        let open = self.open_curves(&[a], f32::INFINITY, true)?;
        let limit = open.first().map_or(f32::INFINITY, |r| r.cost);
        routes.extend(open);
        routes.extend(self.bidirectional(a, limit)?);
        Ok(())
    }

    /// The cheapest route, and the cheapest route of each other start direction up to the factor. The search starts from
    /// the loop `initial`, if there is one.
    pub(super) fn in_all_directions(
        &mut self,
        initial: Option<Route>,
        routes: &mut Vec<Route>,
        mut watch: impl FnMut(Certainty, &FoundLoop),
    ) -> Result<(), Stop> {
        let out: Vec<State> = self.graph.outgoing(self.vertex).collect();
        routes.extend(self.open_curves(&out, f32::INFINITY, true)?);
        let best = self.cheapest(initial, routes, &mut watch)?;
        if self.factor > 1.0
            && let Some(cost) = best.as_ref().map(|r| r.cost)
        {
            routes.extend(self.open_curves(&out, cost * self.limit_factor(), false)?);
            self.more_expensive(best, routes)?;
        }
        Ok(())
    }

    /// The cheapest route, proved. The routes that it improved on are among `routes`.
    fn cheapest(
        &mut self,
        initial: Option<Route>,
        routes: &mut Vec<Route>,
        mut watch: impl FnMut(Certainty, &FoundLoop),
    ) -> Result<Option<Route>, Stop> {
        let graph = self.graph;
        let mut show = |certainty, route: &Option<Route>| {
            if let Some(l) = route.as_ref().and_then(|r| graph.found_loop(r)) {
                watch(certainty, &l);
            }
        };
        let mut best = routes.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).cloned();
        self.start();
        let mut shown = None;
        // The initial loop is shown at once. It is proposed only if nothing is cheaper, as it need not be the cheapest of
        // its start direction.
        let initial = initial.filter(|s| best.as_ref().is_none_or(|b| s.cost < b.cost));
        if initial.is_some() {
            best = initial;
            shown = best.as_ref().map(|r| r.cost);
            show(Certainty::Found, &best);
        }
        let initial_cost = shown;
        let mut pause = Some(SHOW_AFTER);
        loop {
            let grown = self.grow_ball(&mut best, 1.0, pause.take());
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
        self.search_corridor(cost)?;
        let directions = self.start_directions(cost);
        let known = routes.len();
        self.improve(&directions, &mut cost, routes)?;
        let better = routes[known..].iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).cloned();
        best = better.or(best);
        if initial_cost.is_some() && best.as_ref().map(|r| r.cost) == initial_cost {
            routes.extend(best.clone());
        }
        show(Certainty::Proved, &best);
        Ok(best)
    }

    /// The cheapest route of each start direction, up to the factor times the cost of `best`.
    fn more_expensive(&mut self, mut best: Option<Route>, routes: &mut Vec<Route>) -> Result<(), Stop> {
        let Some(cost) = best.as_ref().map(|r| r.cost) else { return Ok(()) };
        let limit = cost * self.limit_factor();
        self.resume_ball();
        self.grow_ball(&mut best, self.limit_factor(), None)?;
        self.search_corridor(limit)?;
        let starts = self.start_directions(limit).into_iter().map(|d| d.1).collect();
        self.alternatives(starts, limit, routes)
    }

    /// The cheapest curves from boundary to boundary; see [`BoundarySearch::curves_through`]. None on a closed surface.
    fn open_curves(&mut self, starts: &[State], limit: f32, only_better: bool) -> Result<Vec<Route>, Stop> {
        let open = starts.iter().copied().filter(|&a| self.mask.is_open(a));
        match BoundarySearch::new(self.graph, self.mask, &mut self.work.boundary, self.budget.progress)? {
            Some(mut search) => search.curves_through(self.vertex, open, limit, only_better, &mut self.budget),
            None => Ok(Vec::new()),
        }
    }
}
