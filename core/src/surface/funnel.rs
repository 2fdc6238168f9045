//! A strip of triangles unfolded to the plane, and the shortest path in it.
//!
//! The funnel algorithm of Lee and Preparata (1984): seen from the last bend of the path, the ends of the crossed edges
//! narrow a funnel from both sides; where one side would cross the other, the path bends at the vertex that bounds the
//! other side.

use glam::DVec2;

use super::curve::Crossing;
use super::vertex_fan::Side;
use crate::mesh::{HalfedgeId, TriMesh};

/// Distance at which a path passes the vertices at which it bends, as a fraction of the crossed edge.
const VERTEX_DISTANCE: f64 = 1e-3;

/// A vertex at which the shortest path bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bend {
    /// Side of the path on which the vertex is.
    pub side: Side,
    /// First and last of the consecutive crossings of edges at the vertex.
    pub first: usize,
    pub last: usize,
    /// The vertex in the plane.
    pub point: DVec2,
}

/// A strip unfolded to the plane.
pub(super) struct UnfoldedStrip {
    pub start: DVec2,
    pub end: DVec2,
    /// Right and left end of each crossed edge.
    right: Vec<DVec2>,
    left: Vec<DVec2>,
    /// For the right and the left end of each crossed edge the first and last of the consecutive crossings with this
    /// end.
    runs: [Vec<(usize, usize)>; 2],
}

impl UnfoldedStrip {
    /// Unfolds the strip of these crossed half-edges; there is at least one.
    pub fn new(mesh: &TriMesh, strip: &[HalfedgeId]) -> Self {
        // The third corner of the triangle of `h`, left of `h`, which goes from `a` to `b` in the plane.
        let apex = |h: HalfedgeId, a: DVec2, b: DVec2| {
            let (along, to) = (mesh.vector(h), -mesh.vector(mesh.prev(h)));
            let length = along.length().max(f64::MIN_POSITIVE);
            let (x, y) = (along.dot(to) / length, along.cross(to).length() / length);
            let e = (b - a).normalize_or_zero();
            a + e * x + e.perp() * y
        };
        let h = strip[0];
        let (mut r, mut l) = (DVec2::ZERO, DVec2::new(mesh.vector(h).length(), 0.0));
        let start = apex(h, r, l);
        let (mut right, mut left) = (vec![r], vec![l]);
        for w in strip.windows(2) {
            let Some(entered) = mesh.twin(w[0]) else { break };
            let p = apex(entered, l, r);
            if w[1] == mesh.next(entered) {
                l = p
            } else {
                r = p
            }
            right.push(r);
            left.push(l);
        }
        let end = strip.last().and_then(|&h| mesh.twin(h)).map_or(r, |entered| apex(entered, l, r));
        let runs = [Side::Right, Side::Left].map(|side| {
            let end = |h| if side == Side::Left { mesh.target(h) } else { mesh.origin(h) };
            let mut runs = vec![(0, 0); strip.len()];
            for group in strip.chunk_by(|&a, &b| end(a) == end(b)).scan(0, |at, g| {
                *at += g.len();
                Some((*at - g.len(), *at - 1))
            }) {
                runs[group.0..=group.1].fill(group);
            }
            runs
        });
        Self { start, end, right, left, runs }
    }

    fn bend_at(&self, i: usize, side: Side) -> Bend {
        let (first, last) = self.runs[usize::from(side == Side::Left)][i];
        Bend { side, first, last, point: if side == Side::Left { self.left[i] } else { self.right[i] } }
    }

    /// The bends of the shortest path, in order.
    pub fn shortest_path(&self) -> Vec<Bend> {
        let mut bends: Vec<Bend> = Vec::new();
        loop {
            let from = bends.last().map_or(0, |c| c.last + 1);
            let apex = bends.last().map_or(self.start, |c| c.point);
            let Some(bend) = self.next_bend(apex, from) else { return bends };
            bends.push(bend);
        }
    }

    /// The first bend of the shortest path from `apex`, where `from` is the first crossing after it; `None` if the
    /// straight segment from `apex` to the end is inside the strip.
    fn next_bend(&self, apex: DVec2, from: usize) -> Option<Bend> {
        let n = self.right.len();
        // The funnel: the tightest right and left ends seen from the apex.
        let (mut right, mut left): (Option<Bend>, Option<Bend>) = (None, None);
        for i in from..=n {
            let ends = [Side::Right, Side::Left].map(|side| match i < n {
                true => self.bend_at(i, side),
                false => Bend { side, first: n, last: n, point: self.end },
            });
            for new in ends {
                let (own, other, sign) =
                    if new.side == Side::Right { (&mut right, left, 1.0) } else { (&mut left, right, -1.0) };
                // Positive where `b` is further inside the funnel than `a`, coming from the side of the new end.
                let inward = |a: DVec2, b: DVec2| (a - apex).perp_dot(b - apex) * sign;
                if own.is_some_and(|own| inward(own.point, new.point) < 0.0) {
                    continue;
                }
                if let Some(bend) = other.filter(|o| inward(o.point, new.point) > 0.0) {
                    return Some(bend);
                }
                *own = Some(new);
            }
        }
        None
    }

    /// The crossings of the shortest path, at a distance of [`VERTEX_DISTANCE`] from the vertices.
    pub fn crossings(&self, strip: &[HalfedgeId], bends: &[Bend]) -> Vec<Crossing> {
        let mut crossings = Vec::with_capacity(strip.len());
        let (mut from, mut next) = (self.start, 0);
        for (i, &halfedge) in strip.iter().enumerate() {
            while next < bends.len() && bends[next].last < i {
                from = bends[next].point;
                next += 1;
            }
            let (r, l) = (self.right[i], self.left[i]);
            let t = match bends.get(next) {
                Some(c) if c.first <= i => f64::from(c.side == Side::Left),
                other => {
                    let to = other.map_or(self.end, |c| c.point);
                    let (a, b) = ((to - from).perp_dot(r - from), (to - from).perp_dot(l - from));
                    if b > a { -a / (b - a) } else { 0.5 }
                }
            };
            crossings.push(Crossing { halfedge, t: t.clamp(VERTEX_DISTANCE, 1.0 - VERTEX_DISTANCE) });
        }
        crossings
    }

    /// The angle at a bend, on the strip's side, between the parts of the path before and after it, in radians.
    pub fn swept(&self, c: &Bend, from: DVec2, to: DVec2) -> f64 {
        let opposite = |i: usize| if c.side == Side::Left { self.right[i] } else { self.left[i] };
        let rays = std::iter::once(from).chain((c.first..=c.last).map(opposite)).chain([to]);
        let mut last: Option<DVec2> = None;
        let mut sum = 0.0;
        for ray in rays.map(|p| p - c.point) {
            sum += last.map_or(0.0, |l| l.perp_dot(ray).abs().atan2(l.dot(ray)));
            last = Some(ray);
        }
        sum
    }
}
