//! The star of a vertex (its triangles), flattened to the plane.
//!
//! The star is flattened by a polar map, as in MAPS (Lee, Sweldens, Schröder, Cowsar, Dobkin 1998): spokes keep their
//! lengths and angles are scaled so that they sum to 2π. On a feature or the boundary they are scaled to π on each
//! side, so that the crease becomes straight. Every change of the mesh re-triangulates such a flat polygon.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::connectivity::{Connectivity, NONE, prev};

/// A flattened star with its vertex at the origin. The buffers are reused from star to star.
#[derive(Default)]
pub(super) struct FlatStar {
    /// The outgoing half-edges counter-clockwise, one per triangle.
    pub spokes: Vec<u32>,
    /// The neighbours: targets of the spokes, and at the boundary the end of the last edge.
    pub ring: Vec<u32>,
    /// The ring in the plane.
    pub flat: Vec<DVec2>,
    /// Whether the vertex is an inner one.
    pub closed: bool,
    /// Index in the ring of the second neighbour on the crease; the first has index 0. `None` off creases.
    pub crease: Option<usize>,
}

impl FlatStar {
    /// Collects the triangles of `v`; on a `crease` the first spoke is on it.
    pub fn gather(&mut self, mesh: &Connectivity, v: u32, crease: bool) {
        self.spokes.clear();
        self.ring.clear();
        mesh.for_spokes(v, |h| self.spokes.push(h));
        let first = self.spokes[0];
        self.closed = mesh.twin(first) != NONE;
        self.crease = None;
        if crease && self.closed {
            let mut ends = (0..self.spokes.len()).filter(|&i| mesh.is_feature(self.spokes[i]));
            if let (Some(i), Some(j)) = (ends.next(), ends.next()) {
                self.spokes.rotate_left(i);
                self.crease = Some(j - i);
            }
        }
        self.ring.extend(self.spokes.iter().map(|&h| mesh.target(h)));
        if !self.closed {
            let last = self.spokes[self.spokes.len() - 1];
            self.ring.push(mesh.origin(prev(last)));
            self.crease = Some(self.spokes.len());
        }
    }

    /// Index in the ring after `i`.
    #[inline]
    pub fn after(&self, i: usize) -> usize {
        if i + 1 == self.ring.len() { 0 } else { i + 1 }
    }

    /// Flattens the star.
    pub fn flatten(&mut self, positions: &[DVec3], v: u32) {
        let centre = positions[v as usize];
        let n = self.spokes.len();
        let arm = |i: usize| positions[self.ring[i] as usize] - centre;
        // First the angle of each ring vertex, stored in `flat[i].x`, then its position.
        self.flat.clear();
        let mut sums = [0.0, 0.0];
        let split = self.crease.unwrap_or(n);
        for i in 0..n {
            let part = usize::from(i >= split);
            let (a, b) = (arm(i), arm(self.after(i)));
            self.flat.push(DVec2::new(sums[part], 0.0));
            sums[part] += a.cross(b).length().atan2(a.dot(b));
        }
        let whole = if self.crease.is_some() { PI } else { TAU };
        for i in 0..self.ring.len() {
            let angle = if i >= split {
                whole + if i < n { self.flat[i].x * PI / sums[1] } else { 0.0 }
            } else {
                self.flat[i].x * whole / sums[0]
            };
            let position = if i == split { -DVec2::X } else { DVec2::from_angle(angle) } * arm(i).length();
            if i < n { self.flat[i] = position } else { self.flat.push(position) }
        }
    }
}

/// Barycentric coordinates of `p` in a flat triangle; some are negative outside.
#[inline]
pub(super) fn flat_weights(p: DVec2, [a, b, c]: [DVec2; 3]) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    [(b - p).perp_dot(c - p) / area, (c - p).perp_dot(a - p) / area, (a - p).perp_dot(b - p) / area]
}

/// A triangle of a flat polygon: the face, and its corners in face order.
pub(super) type FlatFace = (u32, [DVec2; 3]);

/// The triangle of a half-edge in the plane, given its corners from the half-edge's origin on.
#[inline]
pub(super) fn in_face_order(spoke: u32, corners: [DVec2; 3]) -> FlatFace {
    let mut ordered = [DVec2::ZERO; 3];
    for (i, c) in corners.into_iter().enumerate() {
        ordered[(spoke as usize + i) % 3] = c;
    }
    (spoke / 3, ordered)
}
