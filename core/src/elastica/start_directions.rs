//! Step 3 of the loop search: the cheapest loop per start direction.
//!
//! See [`super::search`] for the steps, and [`super::sectors`] for the search in one direction.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::budget::{SearchBudget, Stop};
use super::graph::State;
use super::route::Route;
use super::search::LoopSearch;
use super::sectors::Sectors;

/// Widest range of start directions that share a sector field, in radians. The field includes the turn at the vertex only
/// up to this and twice the largest turn. Measured: widths from 0.25 to 0.8 take nearly the same time.
const SECTOR_WIDTH: f64 = 0.5;

/// Number of states that an A* search may settle before a sector field is computed instead: the number settled in the ball
/// and the corridor divided by `DIRECT_DIVISOR`, but at least `DIRECT_LEAST`. Chosen by hand.
const DIRECT_LEAST: u64 = 500;
/// See [`DIRECT_LEAST`].
const DIRECT_DIVISOR: u64 = 16;

impl LoopSearch<'_> {
    /// Searches loops of cost below `cost` in the given start directions, each with a lower bound, in order. Lowers `cost`
    /// to the cheapest loop found.
    pub(super) fn improve(
        &mut self,
        directions: &[(f32, State)],
        cost: &mut f32,
        routes: &mut Vec<Route>,
    ) -> Result<(), Stop> {
        let sectors = Sectors { graph: self.graph, mask: self.mask, root: &self.work.root };
        self.work.sectors.resize_with(1.max(self.work.sectors.len()), Mutex::default);
        let memory = self.work.sectors[0].get_mut().unwrap_or_else(PoisonError::into_inner);
        let direct = DIRECT_LEAST.max(self.budget.settled / DIRECT_DIVISOR);
        let mut tried = Vec::new();
        for &(bound, a) in directions {
            if bound >= *cost {
                break;
            }
            if tried.contains(&a) {
                continue;
            }
            let budget = &mut self.budget;
            let mut short = SearchBudget { limit: budget.limit.min(budget.settled + direct), ..*budget };
            let attempt = sectors.loop_from(&mut memory.star, None, a, *cost, &mut short);
            budget.settled = short.settled;
            match attempt {
                Ok(route) => {
                    tried.push(a);
                    *cost = route.as_ref().map_or(*cost, |r| r.cost);
                    routes.extend(route);
                }
                // The direct search takes too long: a sector field, for the directions nearby too.
                Err(Stop::Spent) if budget.settled < budget.limit => {
                    let angle = |s: State| self.graph.out_angle(s);
                    let near =
                        |s: State| angle_between(angle(s), angle(a)) <= 0.5 * SECTOR_WIDTH && !tried.contains(&s);
                    let group: Vec<State> = directions.iter().map(|d| d.1).filter(|&s| near(s)).collect();
                    for route in sectors.loops_in_sector(memory, &group, *cost, true, budget)? {
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

    /// The cheapest loop in each of the given start directions, if it costs less than `limit`. Sectors are searched in
    /// parallel. Each has a share of the budget fixed beforehand, so that the result does not depend on the number of
    /// threads.
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
            let count = rest.iter().take_while(|&&s| angle(s) - angle(first) <= SECTOR_WIDTH).count();
            let (group, after) = rest.split_at(count);
            groups.push(group);
            rest = after;
        }
        let threads = rayon::current_num_threads();
        self.work.sectors.resize_with(threads + 1, Mutex::default);
        let sectors = Sectors { graph: self.graph, mask: self.mask, root: &self.work.root };
        let (memories, progress) = (&self.work.sectors, self.budget.progress);
        let left = self.budget.limit - self.budget.settled;
        let results: Vec<(u64, Result<Vec<Route>, Stop>)> = groups
            .par_iter()
            .map(|group| {
                // The last memory is for a thread outside the pool.
                let thread = rayon::current_thread_index().map_or(threads, |t| t.min(threads));
                let mut memory = memories[thread].lock().unwrap_or_else(PoisonError::into_inner);
                let share = left * group.len() as u64 / starts.len() as u64;
                let mut budget = SearchBudget { progress, limit: share, settled: 0 };
                let found = sectors.loops_in_sector(&mut memory, group, limit, false, &mut budget);
                (budget.settled, found)
            })
            .collect();
        let mut outcome = Ok(());
        for (settled, result) in results {
            self.budget.settled += settled;
            match result {
                Ok(found) => routes.extend(found),
                Err(Stop::Cancelled) => return Err(Stop::Cancelled),
                Err(Stop::Spent) => outcome = Err(Stop::Spent),
            }
        }
        outcome
    }
}

/// The angle between two directions, from 0 to π.
fn angle_between(a: f64, b: f64) -> f64 {
    let turns = (a - b) / std::f64::consts::TAU;
    (turns - turns.round()).abs() * std::f64::consts::TAU
}
