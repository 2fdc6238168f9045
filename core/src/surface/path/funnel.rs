//! A strip of triangles laid out in the plane, and the shortest path in it.
//!
//! The funnel algorithm of Lee and Preparata (1984): seen from the last corner of the path, the ends of the
//! crossed edges narrow a funnel from both sides; where one side would cross the other, the path bends at the
//! other's tightest end.

use glam::DVec2;

use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::Crossing;
use crate::surface::relax::Side;

/// Distance in edge parameters at which a path passes the vertices that it bends around.
const VERTEX_DISTANCE: f64 = 1e-3;

/// A vertex at which the taut path bends: its side, and the crossings of its run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner {
    pub side: Side,
    pub first: usize,
    pub last: usize,
    pub point: DVec2,
}

/// A strip laid out in the plane.
pub(super) struct Unfolded {
    pub start: DVec2,
    pub end: DVec2,
    right: Vec<DVec2>,
    left: Vec<DVec2>,
    /// First and last crossing of the run of each right and left end.
    runs: [Vec<(usize, usize)>; 2],
}

impl Unfolded {
    /// Lays out the strip of these crossings, which are not none.
    pub fn new(mesh: &TriMesh, strip: &[HalfedgeId]) -> Self {
        // The third corner of the triangle of `h`, on the left of `h` laid from `a` to `b`.
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

    fn corner(&self, i: usize, side: Side) -> Corner {
        let (first, last) = self.runs[usize::from(side == Side::Left)][i];
        Corner { side, first, last, point: if side == Side::Left { self.left[i] } else { self.right[i] } }
    }

    /// Pulls the path taut: the corners at which it bends, in order.
    pub fn pull(&self) -> Vec<Corner> {
        let mut corners: Vec<Corner> = Vec::new();
        loop {
            let from = corners.last().map_or(0, |c| c.last + 1);
            let apex = corners.last().map_or(self.start, |c| c.point);
            let Some(bend) = self.next_bend(apex, from) else { return corners };
            corners.push(bend);
        }
    }

    /// The first corner of the shortest path after `apex`, whose run ends before crossing `from`; `None` if the
    /// end is seen from there.
    fn next_bend(&self, apex: DVec2, from: usize) -> Option<Corner> {
        let n = self.right.len();
        // The funnel: the tightest right and left ends seen from the apex.
        let (mut right, mut left): (Option<Corner>, Option<Corner>) = (None, None);
        for i in from..=n {
            let ends = [Side::Right, Side::Left].map(|side| match i < n {
                true => self.corner(i, side),
                false => Corner { side, first: n, last: n, point: self.end },
            });
            for new in ends {
                let (own, other, sign) =
                    if new.side == Side::Right { (&mut right, left, 1.0) } else { (&mut left, right, -1.0) };
                // Positive where `b` is seen further inside the funnel than `a`, coming from the new end's side.
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

    /// The crossings of the taut path, kept off the vertices.
    pub fn crossings(&self, strip: &[HalfedgeId], corners: &[Corner]) -> Vec<Crossing> {
        let mut crossings = Vec::with_capacity(strip.len());
        let (mut from, mut next) = (self.start, 0);
        for (i, &halfedge) in strip.iter().enumerate() {
            while next < corners.len() && corners[next].last < i {
                from = corners[next].point;
                next += 1;
            }
            let (r, l) = (self.right[i], self.left[i]);
            let t = match corners.get(next) {
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

    /// The angle of the strip at a corner between the path's parts before and after it, in radians.
    pub fn swept(&self, c: &Corner, from: DVec2, to: DVec2) -> f64 {
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
