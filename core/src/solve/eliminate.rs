//! Elimination of linear equalities with small coefficients.
//!
//! Constraints `Σ cᵢ xᵢ = b` are used up one at a time, those with the fewest terms first: what is already known
//! is substituted, one variable is solved for, and what remains are free variables `y` and the exact affine
//! expression `x = C y + d` of every variable. A constraint that has become `0 = 0` is redundant and dropped, one
//! that has become `0 = b` is an error. Chains of equalities behave like a union-find: the variable on which fewer
//! others depend is expressed by the other, and expressions are shortened whenever they are followed.
//! (Dynamic reordering: Bommes, Quadrilateral Surface Mesh Generation, section 5.2.)

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use thiserror::Error;

/// Coefficients below this have cancelled: those given are of the order of 1.
const ZERO: f64 = 1e-9;
/// A pivot is at least this fraction of the largest coefficient, so that expressions cannot grow much.
const PIVOT: f64 = 0.4;
/// A constraint without variables holds if its constant is below this.
const CONFLICT: f64 = 1e-6;

/// Why constraints could not be eliminated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EliminationError {
    /// A constraint contradicts the others.
    #[error("linear constraint {constraint} contradicts the others (by {rest:e})")]
    Conflict {
        /// Its position in the list.
        constraint: usize,
        /// What remains of its constant.
        rest: f64,
    },
    /// A constraint names a variable that does not exist, or a coefficient is not finite.
    #[error("linear constraint {constraint} is malformed")]
    Malformed {
        /// Its position in the list.
        constraint: usize,
    },
}

/// The equality `Σ cᵢ xᵢ = rhs`.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraint {
    /// Variables and their coefficients.
    pub terms: Vec<(u32, f64)>,
    /// The right-hand side.
    pub rhs: f64,
}

/// Every variable as an affine expression of the free ones.
#[derive(Debug, Clone)]
pub struct Reduction {
    n_free: usize,
    start: Vec<u32>,
    terms: Vec<(u32, f64)>,
    constant: Vec<f64>,
}

impl Reduction {
    /// Number of free variables.
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// Variable `x` as terms in the free variables and a constant.
    pub fn expression(&self, x: usize) -> (&[(u32, f64)], f64) {
        (&self.terms[self.start[x] as usize..self.start[x + 1] as usize], self.constant[x])
    }

    /// Number of variables.
    pub fn n_variables(&self) -> usize {
        self.constant.len()
    }

    /// The same variables in terms of the free ones of `next`, whose variables are the free ones here.
    pub fn then(&self, next: &Self) -> Self {
        let n = self.constant.len();
        let mut out = Self {
            n_free: next.n_free,
            start: vec![0],
            terms: Vec::with_capacity(2 * n),
            constant: Vec::with_capacity(n),
        };
        for x in 0..n {
            let (terms, mut constant) = self.expression(x);
            let mut all = Vec::with_capacity(terms.len());
            for &(z, a) in terms {
                let (inner, d) = next.expression(z as usize);
                all.extend(inner.iter().map(|&(y, b)| (y, a * b)));
                constant += a * d;
            }
            out.terms.extend(collect(all));
            out.start.push(out.terms.len() as u32);
            out.constant.push(constant);
        }
        out
    }

    /// The values of all variables where the free ones are `y`.
    pub fn expand(&self, y: &[f64]) -> Vec<f64> {
        (0..self.constant.len())
            .map(|x| {
                let (terms, constant) = self.expression(x);
                terms.iter().fold(constant, |sum, &(f, c)| sum + c * y[f as usize])
            })
            .collect()
    }
}

/// An affine expression: variables ascending, none twice.
#[derive(Debug, Clone, Default)]
struct Affine {
    terms: Vec<(u32, f64)>,
    constant: f64,
}

/// Eliminates `constraints` among as many variables as `keep` has entries. Where there is a choice, the variable
/// with the smaller `keep` goes.
///
/// # Errors
///
/// See [`EliminationError`].
pub fn eliminate(keep: &[u32], constraints: &[Constraint]) -> Result<Reduction, EliminationError> {
    let mut work = Work { known: vec![None; keep.len()], weight: keep.iter().map(|&k| u64::from(k)).collect() };
    let mut queue = BinaryHeap::with_capacity(constraints.len());
    for (i, c) in constraints.iter().enumerate() {
        if !c.rhs.is_finite() || c.terms.iter().any(|&(v, a)| v as usize >= keep.len() || !a.is_finite()) {
            return Err(EliminationError::Malformed { constraint: i });
        }
        queue.push(Reverse((c.terms.len(), i)));
    }
    while let Some(Reverse((count, i))) = queue.pop() {
        let rest = work.substitute(&Affine { terms: constraints[i].terms.clone(), constant: -constraints[i].rhs });
        if rest.terms.is_empty() {
            if rest.constant.abs() > CONFLICT {
                return Err(EliminationError::Conflict { constraint: i, rest: rest.constant });
            }
        } else if rest.terms.len() > count {
            queue.push(Reverse((rest.terms.len(), i)));
        } else {
            work.solve_for_one(&rest);
        }
    }
    Ok(work.finish())
}

struct Work {
    known: Vec<Option<Affine>>,
    /// How many variables depend on this one, counted generously.
    weight: Vec<u64>,
}

impl Work {
    /// Replaces all known variables until only free ones remain.
    fn substitute(&mut self, from: &Affine) -> Affine {
        let mut terms = Vec::with_capacity(from.terms.len() + 2);
        let mut constant = from.constant;
        for &(v, a) in &from.terms {
            if self.known[v as usize].is_none() {
                terms.push((v, a));
                continue;
            }
            self.shorten(v);
            if let Some(known) = &self.known[v as usize] {
                terms.extend(known.terms.iter().map(|&(w, b)| (w, a * b)));
                constant += a * known.constant;
            }
        }
        Affine { terms: collect(terms), constant }
    }

    /// Makes the expression of a known variable one of free variables only.
    fn shorten(&mut self, v: u32) {
        // Depth first with an own stack: a chain of expressions may be long.
        let mut stack = vec![v];
        while let Some(&v) = stack.last() {
            let Some(known) = &self.known[v as usize] else {
                stack.pop();
                continue;
            };
            let before = stack.len();
            for &(w, _) in &known.terms {
                if let Some(inner) = &self.known[w as usize]
                    && inner.terms.iter().any(|&(x, _)| self.known[x as usize].is_some())
                {
                    stack.push(w);
                }
            }
            if stack.len() > before {
                continue;
            }
            if known.terms.iter().any(|&(w, _)| self.known[w as usize].is_some()) {
                let mut terms = Vec::with_capacity(known.terms.len() + 2);
                let mut constant = known.constant;
                for &(w, a) in &known.terms {
                    match &self.known[w as usize] {
                        None => terms.push((w, a)),
                        Some(inner) => {
                            terms.extend(inner.terms.iter().map(|&(x, b)| (x, a * b)));
                            constant += a * inner.constant;
                        }
                    }
                }
                self.known[v as usize] = Some(Affine { terms: collect(terms), constant });
            }
            stack.pop();
        }
    }

    fn solve_for_one(&mut self, rest: &Affine) {
        let largest = rest.terms.iter().map(|t| t.1.abs()).fold(0.0, f64::max);
        let fit = rest.terms.iter().filter(|t| t.1.abs() >= PIVOT * largest);
        let Some(&(pivot, a)) = fit.min_by_key(|t| (self.weight[t.0 as usize], t.0)) else { return };
        let terms: Vec<_> = rest.terms.iter().filter(|t| t.0 != pivot).map(|&(v, c)| (v, -c / a)).collect();
        for &(v, _) in &terms {
            self.weight[v as usize] += self.weight[pivot as usize];
        }
        self.known[pivot as usize] = Some(Affine { terms, constant: -rest.constant / a });
    }

    fn finish(mut self) -> Reduction {
        let n = self.known.len();
        let mut index = vec![0u32; n];
        let mut n_free = 0;
        for (v, known) in self.known.iter().enumerate() {
            if known.is_none() {
                index[v] = n_free;
                n_free += 1;
            }
        }
        let mut out = Reduction { n_free: n_free as usize, start: vec![0], terms: Vec::new(), constant: vec![0.0; n] };
        for v in 0..n {
            self.shorten(v as u32);
            match &self.known[v] {
                None => out.terms.push((index[v], 1.0)),
                Some(known) => {
                    out.terms.extend(known.terms.iter().map(|&(w, a)| (index[w as usize], a)));
                    out.constant[v] = known.constant;
                }
            }
            out.start.push(out.terms.len() as u32);
        }
        out
    }
}

/// Sorts terms, sums those of one variable and drops what cancels.
fn collect(mut terms: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    terms.sort_by_key(|t| t.0);
    let mut out: Vec<(u32, f64)> = Vec::with_capacity(terms.len());
    for (v, a) in terms {
        match out.last_mut() {
            Some(last) if last.0 == v => last.1 += a,
            _ => out.push((v, a)),
        }
    }
    out.retain(|t| t.1.abs() > ZERO);
    out
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn constraint(terms: &[(u32, f64)], rhs: f64) -> Constraint {
        Constraint { terms: terms.to_vec(), rhs }
    }

    #[test]
    fn a_long_chain_becomes_one_variable() {
        let n = 20_000;
        let chain: Vec<_> = (1..n).map(|i| constraint(&[(i, 1.0), (i - 1, 1.0)], 0.0)).collect();
        let r = eliminate(&vec![1; n as usize], &chain).unwrap();
        assert_eq!(r.n_free(), 1);
        let x = r.expand(&[1.0]);
        assert!(x.windows(2).all(|w| w[0] == -w[1]));
    }

    #[test]
    fn redundant_constraints_are_dropped_and_conflicts_named() {
        let mut list = vec![constraint(&[(0, 1.0), (1, -1.0)], 1.0), constraint(&[(1, 1.0), (2, -1.0)], 1.0)];
        list.push(constraint(&[(0, 1.0), (2, -1.0)], 2.0));
        let r = eliminate(&[1; 3], &list).unwrap();
        assert_eq!(r.n_free(), 1);
        list[2].rhs = 3.0;
        assert!(matches!(eliminate(&[1; 3], &list), Err(EliminationError::Conflict { constraint: 2, .. })));
        assert_eq!(
            eliminate(&[1], &[constraint(&[(1, 1.0)], 0.0)]).err(),
            Some(EliminationError::Malformed { constraint: 0 })
        );
    }

    proptest! {
        #[test]
        fn every_expansion_satisfies_all_constraints(
            seeds in prop::collection::vec((0u32..12, 0u32..12, 0u32..12, -2i32..=2, 1i32..=2), 0..12),
        ) {
            let list: Vec<_> = seeds
                .iter()
                .map(|&(a, b, c, p, q)| constraint(&[(a, 1.0), (b, f64::from(p)), (c, f64::from(q))], 0.0))
                .collect();
            let r = eliminate(&[1; 12], &list).unwrap();
            let y: Vec<f64> = (0..r.n_free()).map(|i| 1.0 + i as f64 * 0.37).collect();
            let x = r.expand(&y);
            let size = x.iter().fold(1.0f64, |m, v| m.max(v.abs()));
            for c in &list {
                let sum: f64 = c.terms.iter().map(|&(v, a)| a * x[v as usize]).sum();
                prop_assert!(sum.abs() < 1e-6 * size);
            }
        }
    }
}
