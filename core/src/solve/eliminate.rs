//! Elimination of linear equality constraints with coefficients of the order of 1.
//!
//! Constraints `Σ cᵢ xᵢ = b` are eliminated one at a time, those with the fewest terms first (dynamic reordering: Bommes,
//! Quadrilateral Surface Mesh Generation, section 5.2): eliminated variables are substituted and one variable is solved for.
//! The result is every variable as an affine expression of free variables, `x = C y + d`. A constraint that has become
//! `0 = 0` is redundant, one that has become `0 = b` a conflict. Chains of equalities are handled as in union-find: of two
//! variables, the one that fewer others depend on is eliminated, and expressions are compressed when they are followed.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use thiserror::Error;

/// Coefficients of smaller magnitude count as cancelled; given ones are of the order of 1.
const ZERO: f64 = 1e-9;
/// Least magnitude of a pivot relative to the largest coefficient of the constraint; bounds the growth of expressions. At 1 only
/// the largest coefficients could be pivots, at 0 growth is unbounded.
const MIN_PIVOT: f64 = 0.4;
/// Largest constant of a constraint without variables that counts as satisfied.
const CONFLICT: f64 = 1e-6;

/// Why constraints could not be eliminated.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EliminationError {
    /// A constraint contradicts the others.
    #[error("linear constraint {constraint} contradicts the others (residual {rest:e})")]
    Conflict {
        /// Its position in the list.
        constraint: usize,
        /// What remains of its constant.
        rest: f64,
    },
    /// A constraint has an unknown variable or a number that is not finite.
    #[error("linear constraint {constraint} has an unknown variable or a number that is not finite")]
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

/// Every variable as an affine expression of the free ones, in compressed rows.
#[derive(Debug, Clone)]
pub struct Reduction {
    n_free: usize,
    /// Start of each variable's terms in `terms`, and the end of the last.
    start: Vec<u32>,
    terms: Vec<(u32, f64)>,
    constant: Vec<f64>,
}

impl Reduction {
    /// Number of free variables.
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// Variable `x`: terms in the free variables, and the constant.
    pub fn expression(&self, x: usize) -> (&[(u32, f64)], f64) {
        (&self.terms[self.start[x] as usize..self.start[x + 1] as usize], self.constant[x])
    }

    /// Number of variables.
    pub fn n_variables(&self) -> usize {
        self.constant.len()
    }

    /// The composition: the same variables in terms of the free ones of `next`, whose variables are the free ones here.
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

    /// The values of all variables for values `y` of the free ones.
    pub fn expand(&self, y: &[f64]) -> Vec<f64> {
        (0..self.constant.len())
            .map(|x| {
                let (terms, constant) = self.expression(x);
                terms.iter().fold(constant, |sum, &(f, c)| sum + c * y[f as usize])
            })
            .collect()
    }
}

/// An affine expression; variables ascending, none twice.
#[derive(Debug, Clone, Default)]
struct Affine {
    terms: Vec<(u32, f64)>,
    constant: f64,
}

/// Eliminates `constraints` on as many variables as `keep` has entries. Of the possible pivots the variable with the smallest
/// `keep` is eliminated first.
///
/// # Errors
///
/// See [`EliminationError`].
pub fn eliminate(keep: &[u32], constraints: &[Constraint]) -> Result<Reduction, EliminationError> {
    let mut elimination =
        Elimination { known: vec![None; keep.len()], weight: keep.iter().map(|&k| u64::from(k)).collect() };
    let mut queue = BinaryHeap::with_capacity(constraints.len());
    for (i, c) in constraints.iter().enumerate() {
        if !c.rhs.is_finite() || c.terms.iter().any(|&(v, a)| v as usize >= keep.len() || !a.is_finite()) {
            return Err(EliminationError::Malformed { constraint: i });
        }
        queue.push(Reverse((c.terms.len(), i)));
    }
    while let Some(Reverse((count, i))) = queue.pop() {
        let rest =
            elimination.substitute(&Affine { terms: constraints[i].terms.clone(), constant: -constraints[i].rhs });
        if rest.terms.is_empty() {
            if rest.constant.abs() > CONFLICT {
                return Err(EliminationError::Conflict { constraint: i, rest: rest.constant });
            }
        } else if rest.terms.len() > count {
            // Substitution has made it longer: shorter constraints come first.
            queue.push(Reverse((rest.terms.len(), i)));
        } else {
            elimination.solve_for_one(&rest);
        }
    }
    Ok(elimination.finish())
}

/// The state between constraints.
struct Elimination {
    /// The expressions of eliminated variables; their own variables may be eliminated since.
    known: Vec<Option<Affine>>,
    /// `keep`, plus an upper bound of that of all variables that depend on this one.
    weight: Vec<u64>,
}

impl Elimination {
    /// Substitutes all eliminated variables, so that only free ones remain.
    fn substitute(&mut self, from: &Affine) -> Affine {
        let mut terms = Vec::with_capacity(from.terms.len() + 2);
        let mut constant = from.constant;
        for &(v, a) in &from.terms {
            if self.known[v as usize].is_none() {
                terms.push((v, a));
                continue;
            }
            self.compress(v);
            if let Some(known) = &self.known[v as usize] {
                terms.extend(known.terms.iter().map(|&(w, b)| (w, a * b)));
                constant += a * known.constant;
            }
        }
        Affine { terms: collect(terms), constant }
    }

    /// Substitutes eliminated variables in the expression of one, so that only free ones remain in it.
    fn compress(&mut self, v: u32) {
        // Depth first on an explicit stack: chains of expressions may be long.
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

    /// Solves a constraint (left-hand side of `= 0`) for its pivot.
    fn solve_for_one(&mut self, rest: &Affine) {
        let largest = rest.terms.iter().map(|t| t.1.abs()).fold(0.0, f64::max);
        let possible = rest.terms.iter().filter(|t| t.1.abs() >= MIN_PIVOT * largest);
        let Some(&(pivot, a)) = possible.min_by_key(|t| (self.weight[t.0 as usize], t.0)) else { return };
        let terms: Vec<_> = rest.terms.iter().filter(|t| t.0 != pivot).map(|&(v, c)| (v, -c / a)).collect();
        for &(v, _) in &terms {
            self.weight[v as usize] += self.weight[pivot as usize];
        }
        self.known[pivot as usize] = Some(Affine { terms, constant: -rest.constant / a });
    }

    /// Numbers the free variables in order.
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
            self.compress(v as u32);
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

/// Sorts terms by variable, sums those of the same variable, and drops those that cancel.
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
    fn a_long_chain_has_one_free_variable() {
        let n = 20_000;
        let chain: Vec<_> = (1..n).map(|i| constraint(&[(i, 1.0), (i - 1, 1.0)], 0.0)).collect();
        let r = eliminate(&vec![1; n as usize], &chain).unwrap();
        assert_eq!(r.n_free(), 1);
        let x = r.expand(&[1.0]);
        assert!(x.windows(2).all(|w| w[0] == -w[1]));
    }

    #[test]
    fn redundant_constraints_are_dropped_and_conflicts_are_errors() {
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

    /// The rank of the left-hand sides, by Gaussian elimination with full rows.
    fn rank(n: usize, list: &[Constraint]) -> usize {
        let row = |c: &Constraint| {
            let mut row = vec![0.0; n];
            c.terms.iter().for_each(|&(v, a)| row[v as usize] += a);
            row
        };
        let mut rows: Vec<Vec<f64>> = list.iter().map(row).collect();
        let mut rank = 0;
        for column in 0..n {
            let Some(best) =
                (rank..rows.len()).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))
            else {
                break;
            };
            if rows[best][column].abs() < 1e-6 {
                continue;
            }
            rows.swap(rank, best);
            let pivot = rows[rank].clone();
            for row in &mut rows[rank + 1..] {
                let factor = row[column] / pivot[column];
                row.iter_mut().zip(&pivot).for_each(|(r, p)| *r -= factor * p);
            }
            rank += 1;
        }
        rank
    }

    const N: usize = 12;

    /// Up to twelve constraints of up to three terms that the solution returned with them satisfies.
    fn consistent() -> impl Strategy<Value = (Vec<f64>, Vec<Constraint>)> {
        let solution = prop::collection::vec(-3i32..=3, N);
        let terms = (0u32..12, 0u32..12, 0u32..12, -2i32..=2, 1i32..=2);
        (solution, prop::collection::vec(terms, 0..12)).prop_map(|(solution, terms)| {
            let x: Vec<f64> = solution.into_iter().map(f64::from).collect();
            let list = terms
                .into_iter()
                .map(|(a, b, c, p, q)| {
                    let terms = [(a, 1.0), (b, f64::from(p)), (c, f64::from(q))];
                    constraint(&terms, terms.iter().map(|&(v, a)| a * x[v as usize]).sum())
                })
                .collect();
            (x, list)
        })
    }

    fn violation(list: &[Constraint], x: &[f64]) -> f64 {
        let size = x.iter().fold(1.0f64, |m, v| m.max(v.abs()));
        let left = |c: &Constraint| c.terms.iter().map(|&(v, a)| a * x[v as usize]).sum::<f64>();
        list.iter().map(|c| (left(c) - c.rhs).abs() / size).fold(0.0, f64::max)
    }

    /// The values of the free variables in `x`.
    fn free_values(r: &Reduction, x: &[f64]) -> Vec<f64> {
        let mut y = vec![f64::NAN; r.n_free()];
        for (v, &x) in x.iter().enumerate() {
            if let (&[(free, 1.0)], 0.0) = r.expression(v) {
                // Another variable may equal a free one.
                y[free as usize] = x;
            }
        }
        y
    }

    proptest! {
        #[test]
        fn expansions_are_all_solutions((x, list) in consistent()) {
            let r = eliminate(&[1; N], &list).unwrap();
            prop_assert_eq!(r.n_free(), N - rank(N, &list));
            let y: Vec<f64> = (0..r.n_free()).map(|i| 1.0 + i as f64 * 0.37).collect();
            prop_assert!(violation(&list, &r.expand(&y)) < 1e-6);
            let again = r.expand(&free_values(&r, &x));
            prop_assert!(again.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-6), "{again:?}");
        }

        #[test]
        fn composed_reductions_satisfy_both_lists((x, list) in consistent(), split in 0usize..12) {
            let (first, second) = list.split_at(split.min(list.len()));
            let r = eliminate(&[1; N], first).unwrap();
            // The second list in terms of the free variables of the first.
            let substituted: Vec<Constraint> = second
                .iter()
                .map(|c| {
                    let mut terms = Vec::new();
                    let mut rhs = c.rhs;
                    for &(v, a) in &c.terms {
                        let (inner, constant) = r.expression(v as usize);
                        terms.extend(inner.iter().map(|&(y, b)| (y, a * b)));
                        rhs -= a * constant;
                    }
                    Constraint { terms, rhs }
                })
                .collect();
            let both = r.then(&eliminate(&vec![1; r.n_free()], &substituted).unwrap());
            prop_assert_eq!(both.n_free(), N - rank(N, &list));
            let y: Vec<f64> = (0..both.n_free()).map(|i| 1.0 + i as f64 * 0.37).collect();
            prop_assert!(violation(&list, &both.expand(&y)) < 1e-6);
            let again = both.expand(&free_values(&both, &x));
            prop_assert!(again.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-6), "{again:?}");
        }
    }
}
