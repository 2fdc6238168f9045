//! Domains of local optimisation around flipped triangles.
//!
//! A domain is a set of triangles grown from flipped ones. Its inner variables are the free variables that occur in no
//! other triangle; changing them leaves the rest of the map in place. Translations of seams and variables shared by a
//! coordinate constraint occur in distant triangles: they are inner variables of the whole surface only.

use super::problem::OrientationProblem;
use crate::mesh::BreadthFirst;
use crate::param::stiffening::ring_distances;

/// Triangles and their inner variables, both ascending.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Domain {
    pub triangles: Vec<u32>,
    pub inner: Vec<u32>,
}

/// The triangles at each vertex, and the number of triangles in which each free variable occurs.
#[derive(Debug)]
pub(super) struct Neighbours {
    start: Vec<u32>,
    around: Vec<u32>,
    occurrences: Vec<u32>,
}

impl Neighbours {
    pub fn new(problem: &OrientationProblem) -> Self {
        let n_vertices = problem.triangles.iter().flat_map(|t| t.vertices).max().map_or(0, |v| v as usize + 1);
        let mut start = vec![0u32; n_vertices + 1];
        for v in problem.triangles.iter().flat_map(|t| t.vertices) {
            start[v as usize + 1] += 1;
        }
        for v in 0..n_vertices {
            start[v + 1] += start[v];
        }
        let mut fill = start.clone();
        let mut around = vec![0; 3 * problem.triangles.len()];
        for (t, triangle) in (0..).zip(problem.triangles) {
            for v in triangle.vertices {
                around[fill[v as usize] as usize] = t;
                fill[v as usize] += 1;
            }
        }
        let mut occurrences = vec![0; problem.reduction.n_free()];
        for t in 0..problem.triangles.len() as u32 {
            for y in problem.variables(t) {
                occurrences[y as usize] += 1;
            }
        }
        Self { start, around, occurrences }
    }

    pub fn n_vertices(&self) -> usize {
        self.start.len() - 1
    }

    /// The triangles at a vertex, ascending.
    pub fn around(&self, v: u32) -> &[u32] {
        &self.around[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }

    /// The distance of each triangle from `seeds` in rings of triangles that share a vertex: 0 for the seeds,
    /// `u32::MAX` beyond `rings`.
    pub fn distance(&self, problem: &OrientationProblem, seeds: &[u32], rings: u32) -> Vec<u32> {
        let around =
            |t: u32| problem.triangles[t as usize].vertices.into_iter().flat_map(|v| self.around(v).iter().copied());
        ring_distances(problem.triangles.len(), seeds, rings, around)
    }

    /// The neighbourhoods of `seeds` up to a number of rings; neighbourhoods that touch are one domain.
    pub fn domains(&self, problem: &OrientationProblem, seeds: &[u32], rings: u32) -> Vec<Domain> {
        let distance = self.distance(problem, seeds, rings);
        let mut search = BreadthFirst::new(problem.triangles.len());
        let mut count = vec![0; self.occurrences.len()];
        let mut out = Vec::new();
        for &seed in seeds {
            let first = search.reached().len();
            if !search.start(seed) {
                continue;
            }
            while let Some(t) = search.visit() {
                for &s in problem.triangles[t as usize].vertices.iter().flat_map(|&v| self.around(v)) {
                    if distance[s as usize] != u32::MAX {
                        search.reach(s, ());
                    }
                }
            }
            let mut triangles = search.reached()[first..].to_vec();
            triangles.sort_unstable();
            let inner = self.inner(problem, &triangles, &mut count);
            out.push(Domain { triangles, inner });
        }
        out
    }

    /// `triangles`, ascending, as one domain.
    pub fn joined(&self, problem: &OrientationProblem, triangles: Vec<u32>) -> Domain {
        let inner = self.inner(problem, &triangles, &mut vec![0; self.occurrences.len()]);
        Domain { triangles, inner }
    }

    /// The variables that occur in `triangles` only. `count` must be zero; it is zero again on return.
    fn inner(&self, problem: &OrientationProblem, triangles: &[u32], count: &mut [u32]) -> Vec<u32> {
        let mut touched = Vec::new();
        for &t in triangles {
            for y in problem.variables(t) {
                if count[y as usize] == 0 {
                    touched.push(y);
                }
                count[y as usize] += 1;
            }
        }
        touched.sort_unstable();
        let inner = touched.iter().copied().filter(|&y| count[y as usize] == self.occurrences[y as usize]).collect();
        for y in touched {
            count[y as usize] = 0;
        }
        inner
    }
}
