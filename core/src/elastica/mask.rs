//! Directions closed to the search, because a strip already runs there.

use std::ops::Range;

use glam::DVec3;

use super::graph::{ElasticaGraph, State};
use crate::mesh::FaceId;

/// The states of an [`ElasticaGraph`] that are closed; a geodesic is closed both ways or not at all.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DirectionMask {
    /// One bit per state; empty while nothing is closed.
    bits: Vec<u64>,
}

impl DirectionMask {
    /// Nothing closed.
    pub fn none() -> Self {
        Self::default()
    }

    /// Whether nothing is closed.
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty()
    }

    #[inline]
    pub(super) fn is_open(&self, e: State) -> bool {
        self.bits.is_empty() || self.bits[e as usize / 64] >> (e % 64) & 1 == 0
    }

    fn close(&mut self, graph: &ElasticaGraph, e: State) {
        if self.bits.is_empty() {
            self.bits = vec![0; graph.n_states().div_ceil(64)];
        }
        for s in [e, graph.reverse[e as usize]] {
            self.bits[s as usize / 64] |= 1 << (s % 64);
        }
    }

    /// Number of closed geodesics.
    pub fn n_closed(&self) -> usize {
        self.bits.iter().map(|b| b.count_ones() as usize).sum::<usize>() / 2
    }
}

impl ElasticaGraph {
    /// Closes the geodesics that start, end or have their middle in `face` and run within `max_angle` radians of
    /// `direction` (either way) there. Along a strip 45° closes what is
    /// equivalent to it and leaves what crosses it.
    pub fn disable_near(&self, mask: &mut DirectionMask, face: FaceId, direction: DVec3, max_angle: f64) {
        let mesh = &self.mesh;
        for h in mesh.face_halfedges(face) {
            let wanted = angle_from(mesh.vector(h), direction, mesh.face_normal(face));
            let (low, high) = (self.corners.tangent(mesh, h, 0.0), self.corners.tangent(mesh, h, mesh.corner_angle(h)));
            let states = self.leaving(mesh.origin(h));
            let begin = self.first_from(&states, low);
            for e in (begin..states.end).take_while(|&e| self.out_angle(e) <= high) {
                if unoriented(self.corners.local(mesh, h, self.out_angle(e)) - wanted) <= max_angle {
                    mask.close(self, e);
                }
            }
        }
        let [side, ..] = mesh.face_halfedges(face);
        let wanted = angle_from(mesh.vector(side), direction, mesh.face_normal(face));
        let range = self.middle_first[face.index()] as usize..self.middle_first[face.index() + 1] as usize;
        for &(e, angle) in &self.middle[range] {
            if unoriented(f64::from(angle) - wanted) <= max_angle {
                mask.close(self, e);
            }
        }
    }
}

impl ElasticaGraph {
    /// The first of the `states` around a vertex at a tangent angle of at least `angle`.
    fn first_from(&self, states: &Range<State>, angle: f64) -> State {
        let (mut low, mut high) = (states.start, states.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.out_angle(middle) < angle { low = middle + 1 } else { high = middle }
        }
        low
    }
}

/// Angle from `from` to the projection of `direction` into the plane with normal `n`, counter-clockwise.
fn angle_from(from: DVec3, direction: DVec3, n: DVec3) -> f64 {
    from.cross(direction).dot(n).atan2(from.dot(direction) - from.dot(n) * direction.dot(n))
}

/// Angle between two undirected lines, up to a right angle.
fn unoriented(difference: f64) -> f64 {
    let half_turns = difference / std::f64::consts::PI;
    (half_turns - half_turns.round()).abs() * std::f64::consts::PI
}
