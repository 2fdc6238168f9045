//! Disjoint sets (union-find).

/// Disjoint sets of the numbers 0 to `n − 1`.
#[derive(Debug)]
pub(crate) struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// Sets of one number each.
    pub(crate) fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    /// The representative of the set of `a`: its smallest number.
    pub(crate) fn root(&mut self, mut a: u32) -> u32 {
        while self.parent[a as usize] != a {
            self.parent[a as usize] = self.parent[self.parent[a as usize] as usize];
            a = self.parent[a as usize];
        }
        a
    }

    /// Joins the sets of `a` and `b`; says whether they were different.
    pub(crate) fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_number_represents_a_set() {
        let mut sets = UnionFind::new(6);
        assert!(sets.join(4, 2) && sets.join(5, 4));
        assert!(!sets.join(2, 5));
        assert_eq!([0, 1, 2, 3, 4, 5].map(|a| sets.root(a)), [0, 1, 2, 3, 2, 2]);
    }

    #[test]
    fn as_many_joins_as_numbers_less_one_leave_one_set() {
        let mut sets = UnionFind::new(50);
        let joins = (0..200u32).filter(|k| sets.join(7 * k % 50, 11 * k % 50)).count();
        let mut roots: Vec<u32> = (0..50).map(|a| sets.root(a)).collect();
        roots.sort_unstable();
        roots.dedup();
        assert_eq!(roots.len(), 50 - joins);
    }
}
