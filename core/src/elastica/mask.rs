//! Directions that are closed to the search, because a strip already runs there (Campen, section 8.2.2).

use std::ops::Range;

use glam::DVec3;

use super::graph::{ElasticaGraph, State};
use crate::mesh::{FaceId, VertexId};

/// The closed states of an [`ElasticaGraph`]. A geodesic is closed in both directions or in none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DirectionMask {
    /// One bit per state; empty while no direction is closed.
    bits: Vec<u64>,
}

impl DirectionMask {
    /// No direction closed.
    pub fn all_open() -> Self {
        Self::default()
    }

    /// Whether no direction is closed.
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty()
    }

    #[inline]
    pub(super) fn is_open(&self, e: State) -> bool {
        self.bits.is_empty() || self.bits[e as usize / 64] >> (e % 64) & 1 == 0
    }

    /// Closes the geodesic of a state.
    fn close(&mut self, graph: &ElasticaGraph, e: State) {
        if self.bits.is_empty() {
            self.bits = vec![0; graph.n_states().div_ceil(64)];
        }
        for s in [e, graph.reversed(e)] {
            self.bits[s as usize / 64] |= 1 << (s % 64);
        }
    }

    /// Number of closed geodesics.
    pub fn n_closed(&self) -> usize {
        self.bits.iter().map(|b| b.count_ones() as usize).sum::<usize>() / 2
    }
}

impl ElasticaGraph {
    /// Closes the geodesics that have an end or their midpoint in `face` and there differ from the line along `direction`
    /// by at most `max_angle` radians. Along a strip, 45° closes the loops equivalent to it and leaves those that cross it.
    pub fn close_near(&self, mask: &mut DirectionMask, face: FaceId, direction: DVec3, max_angle: f64) {
        let mesh = &self.mesh;
        for h in mesh.face_halfedges(face) {
            let line = angle_from(mesh.vector(h), direction, mesh.face_normal(face));
            let (low, high) = (self.corners.tangent(mesh, h, 0.0), self.corners.tangent(mesh, h, mesh.corner_angle(h)));
            let states = self.outgoing(mesh.origin(h));
            let begin = self.first_at_or_after(&states, low);
            for e in (begin..states.end).take_while(|&e| self.out_angle(e) <= high) {
                if line_angle(self.corners.local(mesh, h, self.out_angle(e)) - line) <= max_angle {
                    mask.close(self, e);
                }
            }
        }
        let [side, ..] = mesh.face_halfedges(face);
        let line = angle_from(mesh.vector(side), direction, mesh.face_normal(face));
        let range = self.first_midpoint[face.index()] as usize..self.first_midpoint[face.index() + 1] as usize;
        for &(e, angle) in &self.midpoints[range] {
            if line_angle(f64::from(angle) - line) <= max_angle {
                mask.close(self, e);
            }
        }
    }

    /// The open state leaving `v` whose direction is nearest to `direction`.
    pub(super) fn nearest_open(&self, mask: &DirectionMask, v: VertexId, direction: DVec3) -> Option<State> {
        let cosine = |a: &State| self.departure(*a).dot(direction);
        let open = self.outgoing(v).filter(|&a| mask.is_open(a));
        open.max_by(|a, b| cosine(a).total_cmp(&cosine(b)).then(b.cmp(a)))
    }

    /// The first of the `states` around a vertex with a tangent angle of at least `angle`.
    fn first_at_or_after(&self, states: &Range<State>, angle: f64) -> State {
        let (mut low, mut high) = (states.start, states.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.out_angle(middle) < angle { low = middle + 1 } else { high = middle }
        }
        low
    }
}

/// Angle from `from` to the projection of `direction` onto the plane with normal `n`, counter-clockwise.
fn angle_from(from: DVec3, direction: DVec3, n: DVec3) -> f64 {
    from.cross(direction).dot(n).atan2(from.dot(direction) - from.dot(n) * direction.dot(n))
}

/// The angle between two undirected lines whose directions differ by an angle; at most a right angle.
fn line_angle(difference: f64) -> f64 {
    let half_turns = difference / std::f64::consts::PI;
    (half_turns - half_turns.round()).abs() * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn the_angle_of_lines_ignores_their_orientation() {
        for (difference, expected) in [(0.0, 0.0), (PI, 0.0), (-0.3, 0.3), (PI - 0.3, 0.3), (-3.5 * PI, FRAC_PI_2)] {
            assert!((line_angle(difference) - expected).abs() < 1e-12, "{difference}");
        }
    }

    #[test]
    fn angles_are_measured_in_the_plane_of_the_normal() {
        let up = DVec3::new(0.0, 0.5, 4.0);
        assert!((angle_from(DVec3::X, up, DVec3::Z) - FRAC_PI_2).abs() < 1e-12);
        assert!((angle_from(DVec3::X, up, -DVec3::Z) + FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn a_new_mask_closes_nothing() {
        let mask = DirectionMask::all_open();
        assert!(mask.is_empty() && mask.is_open(17) && mask.n_closed() == 0);
    }
}
