//! Parts of a surface around folds, and what may move in them.
//!
//! A domain is a set of triangles grown from folded ones. Its inner variables are the free ones that occur in no
//! other triangle, so that moving them leaves all the rest of the map in place. Translations of seams and the
//! coordinates of related points occur far apart: they move with the whole surface only.

use super::OrientationProblem;

/// Triangles and the free variables that occur in them alone, both ascending.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Domain {
    pub triangles: Vec<u32>,
    pub inner: Vec<u32>,
}

/// Which triangles meet at each vertex, and in how many each free variable occurs.
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
            for y in variables(problem, t) {
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

    /// The distance of each triangle from `seeds` in rings, 0 for the seeds; `u32::MAX` beyond `rings`.
    pub fn distance(&self, problem: &OrientationProblem, seeds: &[u32], rings: u32) -> Vec<u32> {
        let mut distance = vec![u32::MAX; problem.triangles.len()];
        for &t in seeds {
            distance[t as usize] = 0;
        }
        let mut front = seeds.to_vec();
        for ring in 1..=rings {
            let mut next = Vec::new();
            for &t in &front {
                for &s in problem.triangles[t as usize].vertices.iter().flat_map(|&v| self.around(v)) {
                    if distance[s as usize] == u32::MAX {
                        distance[s as usize] = ring;
                        next.push(s);
                    }
                }
            }
            front = next;
        }
        distance
    }

    /// The surroundings of `seeds` up to some rings, those that touch as one domain.
    pub fn domains(&self, problem: &OrientationProblem, seeds: &[u32], rings: u32) -> Vec<Domain> {
        let distance = self.distance(problem, seeds, rings);
        let mut seen = vec![false; problem.triangles.len()];
        let mut count = vec![0; self.occurrences.len()];
        let mut out = Vec::new();
        for &seed in seeds {
            if seen[seed as usize] {
                continue;
            }
            seen[seed as usize] = true;
            let mut triangles = vec![seed];
            let mut next = 0;
            while next < triangles.len() {
                for &s in problem.triangles[triangles[next] as usize].vertices.iter().flat_map(|&v| self.around(v)) {
                    if distance[s as usize] != u32::MAX && !seen[s as usize] {
                        seen[s as usize] = true;
                        triangles.push(s);
                    }
                }
                next += 1;
            }
            triangles.sort_unstable();
            let inner = self.inner(problem, &triangles, &mut count);
            out.push(Domain { triangles, inner });
        }
        out
    }

    /// All triangles and all free variables that occur.
    pub fn whole(&self, problem: &OrientationProblem) -> Domain {
        let inner = (0..self.occurrences.len() as u32).filter(|&y| self.occurrences[y as usize] > 0).collect();
        Domain { triangles: (0..problem.triangles.len() as u32).collect(), inner }
    }

    /// The variables that occur in `triangles` only; `count` is all zero before and after.
    fn inner(&self, problem: &OrientationProblem, triangles: &[u32], count: &mut [u32]) -> Vec<u32> {
        let mut touched = Vec::new();
        for &t in triangles {
            for y in variables(problem, t) {
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

/// The free variables that occur in a triangle, each once.
fn variables(problem: &OrientationProblem, t: u32) -> Vec<u32> {
    let corners = problem.triangles[t as usize].corners.iter().flatten();
    let mut out: Vec<u32> =
        corners.flat_map(|&(x, _)| problem.reduction.expression(x as usize).0.iter().map(|term| term.0)).collect();
    out.sort_unstable();
    out.dedup();
    out
}
