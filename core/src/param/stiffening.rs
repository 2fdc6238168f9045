//! Stiffening: larger weights at and around flipped triangles, so that the next least-squares solve flips fewer
//! (Bommes, Zimmer and Kobbelt, Mixed-Integer Quadrangulation, section 5; Campen, section 6.5.3).
//!
//! Repeated with new solves it removes most flips at the cost of a larger residual. It gives no guarantee: where no
//! locally injective map satisfies the constraints, some triangle stays flipped.

use crate::mesh::{BreadthFirst, FaceId, TriMesh};

/// How weights grow in one round of stiffening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffening {
    /// Relative growth of the weight of a flipped triangle; positive.
    pub growth: f64,
    /// Factor of the growth from one ring of triangles to the next, between 0 and 1.
    pub fading: f64,
    /// Number of rings around flipped triangles whose weight grows. Without them a flip moves to a neighbour.
    pub rings: u32,
    /// Upper bound of the weights; infinite: none.
    pub limit: f64,
}

impl Stiffening {
    /// Raises the weights by the distance of each triangle from the nearest flipped one, in rings.
    pub(super) fn raise(&self, distance: &[u32], weight: &mut [f64]) {
        for (w, &d) in weight.iter_mut().zip(distance) {
            let share = if d <= self.rings { (0..d).fold(1.0, |share, _| self.fading * share) } else { 0.0 };
            *w = (*w * (1.0 + self.growth * share)).min(self.limit);
        }
    }

    /// Raises the weights of the triangles at and around `flipped`; rings are of triangles that share an edge.
    pub fn raise_around(&self, mesh: &TriMesh, flipped: &[bool], weight: &mut [f64]) {
        let seeds: Vec<u32> = (0..).zip(flipped).filter(|(_, flipped)| **flipped).map(|(f, _)| f).collect();
        let around = |f: u32| mesh.adjacent_faces(FaceId(f)).map(|(_, g)| g.0);
        self.raise(&ring_distances(mesh.n_faces(), &seeds, self.rings, around), weight);
    }
}

/// The distance of each of `n` triangles from `seeds` in rings: 0 for the seeds, `u32::MAX` beyond `rings`.
pub(super) fn ring_distances<I: Iterator<Item = u32>>(
    n: usize,
    seeds: &[u32],
    rings: u32,
    neighbours: impl Fn(u32) -> I,
) -> Vec<u32> {
    let mut search = BreadthFirst::new(n);
    for &t in seeds {
        search.start(t);
    }
    while let Some(t) = search.visit() {
        if search.depth(t).is_none_or(|d| d >= rings) {
            break;
        }
        for s in neighbours(t) {
            search.reach(s, ());
        }
    }
    (0..n as u32).map(|t| search.depth(t).unwrap_or(u32::MAX)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    #[test]
    fn growth_fades_with_the_distance_and_is_bounded() {
        let mesh = square(8);
        let mut flipped = vec![false; mesh.n_faces()];
        flipped[60] = true;
        let stiffening = Stiffening { growth: 1.5, fading: 0.7, rings: 2, limit: 3.0 };
        let mut weight = vec![1.0; mesh.n_faces()];
        stiffening.raise_around(&mesh, &flipped, &mut weight);
        assert_eq!(weight[60], 2.5);
        let count = |w: f64| weight.iter().filter(|&&x| (x - w).abs() < 1e-12).count();
        assert_eq!((count(1.0 + 1.5 * 0.7), count(1.0 + 1.5 * 0.49)), (3, 6));
        assert_eq!(count(1.0), mesh.n_faces() - 10);
        stiffening.raise_around(&mesh, &flipped, &mut weight);
        assert_eq!(weight[60], 3.0);
    }
}
