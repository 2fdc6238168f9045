//! Curves carried from the proxy to the original.
//!
//! The images of the original's vertices lie on one side or the other of the curve. In a triangle of the original the
//! sides of the corners differ along two edges or none; so the edges between the sides form a strip, which is
//! followed from triangle to triangle once around. Sides are taken from the part of the curve near by, counted along
//! it, so that a curve may meet itself. The strip accompanies the curve at less than an edge, and its progress along
//! the curve is watched: it makes just one turn, and is therefore in the same homotopy class.

use glam::DVec3;
use thiserror::Error;

use super::map::Proxy;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::{Crossing, CurveError, SurfaceCurve, SurfacePoint, nearest_in_triangle};

/// How far along the curve sides are taken from, in mean edges of the proxy that it crosses.
const REACH: f64 = 2.5;
/// Distance in edge parameters kept from vertices; that of the other makers of curves.
const VERTEX_DISTANCE: f64 = 1e-3;
/// Places along the curve from which it is tried.
const STARTS: usize = 12;
/// Triangles around a start in which an edge between the sides is looked for.
const AROUND: usize = 200;
/// Crossings after the start within which the walk may join its own way.
const JOIN: usize = 200;
/// The carried curve is as long as the curve up to this factor.
const LENGTH_FACTOR: f64 = 1.6;

/// Why a curve cannot be carried to the original.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CarryError {
    /// The curve is not one on the proxy.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The original has no strip of triangles along the curve that closes, or that ends where the curve does.
    #[error("the curve has no counterpart on the original")]
    Lost,
    /// The curve found is of quite another length: the original is too rough there.
    #[error("on the original the curve would be {ratio:.1} times as long")]
    Length {
        /// Its length there by its length on the proxy.
        ratio: f64,
    },
}

/// One segment of the curve on the proxy.
struct Segment {
    from: DVec3,
    to: DVec3,
    /// Unit vector to the left in the triangle.
    left: DVec3,
    face: FaceId,
}

/// The curve on the proxy, to be accompanied.
struct Guide {
    segments: Vec<Segment>,
    closed: bool,
    reach: f64,
}

/// Where a point lies along the guide: the distance to its left, and the place in segments.
#[derive(Clone, Copy)]
struct Side {
    distance: f64,
    at: f64,
}

impl Guide {
    fn new(mesh: &TriMesh, curve: &SurfaceCurve) -> Self {
        let points = curve.points(mesh);
        let n = points.len();
        let count = if curve.closed { n } else { n - 1 };
        let segment = |k: usize| {
            let (from, to) = (points[k], points[(k + 1) % n]);
            let face = mesh.face(curve.crossings[(k + 1) % n].halfedge);
            let left = mesh.face_normal(face).cross(to - from).normalize_or_zero();
            Segment { from, to, left, face }
        };
        let edges: f64 = curve.crossings.iter().map(|c| mesh.vector(c.halfedge).length()).sum();
        Self { segments: (0..count).map(segment).collect(), closed: curve.closed, reach: REACH * edges / n as f64 }
    }

    /// The segment after or before another.
    fn step(&self, k: usize, forward: bool) -> Option<usize> {
        let n = self.segments.len();
        match (forward, k) {
            (true, k) if k + 1 < n => Some(k + 1),
            (false, k) if k > 0 => Some(k - 1),
            (true, _) => self.closed.then_some(0),
            (false, _) => self.closed.then_some(n - 1),
        }
    }

    /// Where `p` lies, seen from near the place `at`.
    fn side(&self, p: DVec3, at: f64) -> Side {
        let n = self.segments.len();
        let home = (at.max(0.0) as usize).min(n - 1);
        let mut best = (f64::INFINITY, home, 0.0);
        self.measure(p, home, &mut best);
        for forward in [false, true] {
            let (mut k, mut passed) = (home, 0.0);
            while let Some(next) = self.step(k, forward).filter(|&next| passed < self.reach && next != home) {
                k = next;
                self.measure(p, k, &mut best);
                let s = &self.segments[k];
                passed += s.from.distance(s.to);
            }
        }
        let (distance, k, t) = best;
        let s = &self.segments[k];
        // At a joint the curve turns; both its segments tell left from right.
        let mut left = s.left;
        if t == 0.0 || t == 1.0 {
            left += self.step(k, t == 1.0).map_or(DVec3::ZERO, |other| self.segments[other].left);
        }
        let offset = p - s.from.lerp(s.to, t);
        Side { distance: distance.sqrt().copysign(offset.dot(left)), at: k as f64 + t }
    }

    fn measure(&self, p: DVec3, k: usize, best: &mut (f64, usize, f64)) {
        let s = &self.segments[k];
        let along = s.to - s.from;
        let t = ((p - s.from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance = s.from.lerp(s.to, t).distance_squared(p);
        if distance < best.0 {
            *best = (distance, k, t);
        }
    }

    /// The way from place `a` to place `b`, the short way around.
    fn way(&self, a: f64, b: f64) -> f64 {
        let n = self.segments.len() as f64;
        let way = b - a;
        if self.closed { way - n * (way / n).round() } else { way }
    }

    fn length(&self) -> f64 {
        self.segments.iter().map(|s| s.from.distance(s.to)).sum()
    }
}

impl Proxy {
    /// The curve on the original that goes as `curve` goes on the proxy: of the same homotopy class, closed or from
    /// boundary to boundary. It runs as the proxy's edges let it; [`relax`](crate::surface::relax) makes it fair.
    ///
    /// # Errors
    ///
    /// A curve that is not one on the proxy, or an original too rough along it.
    pub fn curve_to_original(&self, original: &TriMesh, curve: &SurfaceCurve) -> Result<SurfaceCurve, CarryError> {
        curve.check(self.mesh())?;
        let guide = Guide::new(self.mesh(), curve);
        let walker = Walker { original, places: self.places(), guide: &guide };
        let n = guide.segments.len();
        let mut error = CarryError::Lost;
        for i in 0..if curve.closed { STARTS.min(n) } else { 1 } {
            let k = i * n / STARTS.min(n);
            let Some(start) = self.start(original, &walker, k) else { continue };
            match walker.walk(start) {
                Ok(carried) if carried.check(original).is_ok() => return Ok(carried),
                Ok(_) => {}
                Err(e) => error = e,
            }
        }
        Err(error)
    }

    /// The half-edge through which the walk along segment `k` first leaves a triangle; for an open curve the one on
    /// the boundary through which it enters.
    fn start(&self, original: &TriMesh, walker: &Walker<'_>, k: usize) -> Option<(HalfedgeId, f64)> {
        let s = &walker.guide.segments[k];
        let t = if walker.guide.closed { 0.5 } else { 0.0 };
        let corners = self.mesh().face_vertices(s.face).map(|v| self.mesh().position(v));
        let on_proxy = SurfacePoint { face: s.face, weights: nearest_in_triangle(s.from.lerp(s.to, t), &corners) };
        let mut near = vec![self.to_original(original, on_proxy).face];
        let mut next = 0;
        while next < near.len().min(AROUND) {
            let sides = original.face_halfedges(near[next]);
            for h in sides {
                let ends = [original.origin(h), original.target(h)].map(|v| walker.side(v, k as f64 + t));
                let crosses = if walker.guide.closed {
                    ends[0].distance < 0.0 && ends[1].distance >= 0.0
                } else {
                    original.twin(h).is_none() && ends[0].distance >= 0.0 && ends[1].distance < 0.0
                };
                // Beyond the ends of the part looked at, sides mean nothing.
                let way = ends.map(|e| walker.guide.way(k as f64 + t, e.at).abs());
                if crosses && ends.iter().all(|e| e.distance.abs() < walker.guide.reach) && way[0].min(way[1]) < 3.0 {
                    return Some((h, k as f64 + t));
                }
            }
            for f in sides.into_iter().filter_map(|h| original.twin(h)).map(|g| original.face(g)) {
                if !near.contains(&f) {
                    near.push(f);
                }
            }
            next += 1;
        }
        None
    }
}

/// Follows a guide over the original as it is laid onto the proxy.
struct Walker<'a> {
    original: &'a TriMesh,
    places: &'a [DVec3],
    guide: &'a Guide,
}

impl Walker<'_> {
    fn side(&self, v: VertexId, at: f64) -> Side {
        self.guide.side(self.places[v.index()], at)
    }

    /// Walks from a half-edge, near a place on the guide, until the curve is closed or at the boundary.
    fn walk(&self, (mut first, at): (HalfedgeId, f64)) -> Result<SurfaceCurve, CarryError> {
        let (mesh, guide) = (self.original, self.guide);
        let n = guide.segments.len() as f64;
        let mut ends = [mesh.origin(first), mesh.target(first)].map(|v| (v, self.side(v, at).distance));
        let (mut h, mut at, mut gone, mut length) = (first, at, 0.0, 0.0);
        let mut crossings = Vec::new();
        // How far the walk had come at each of the first crossings.
        let mut come = Vec::new();
        let mut last: Option<DVec3> = None;
        loop {
            let (p, q) = (self.places[ends[0].0.index()], self.places[ends[1].0.index()]);
            let t = (ends[0].1 / (ends[0].1 - ends[1].1)).clamp(VERTEX_DISTANCE, 1.0 - VERTEX_DISTANCE);
            let t = if t.is_nan() { 0.5 } else { t };
            let place = p.lerp(q, t);
            let now = guide.side(place, at).at;
            gone += guide.way(at, now);
            at = now;
            length += last.map_or(0.0, |l| l.distance(place));
            last = Some(place);
            crossings.push(Crossing { halfedge: h, t });
            if come.len() < JOIN {
                come.push(gone);
            }
            let entered = if !guide.closed && crossings.len() == 1 { Some(h) } else { mesh.twin(h) };
            let Some(g) = entered else { break };
            // Between the sides: `g` has left at its origin, right at its target.
            let (left, right) = if g == h { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
            let v = mesh.opposite(g);
            let d = self.side(v, at).distance;
            (h, ends) = if d >= 0.0 { (mesh.next(g), [right, (v, d)]) } else { (mesh.prev(g), [(v, d), left]) };
            if guide.closed && h == first || crossings.len() > mesh.n_edges() || gone.abs() > 1.5 * n + 3.0 {
                break;
            }
            // Where the original is rough, the walk may meet its own way a little after the start only.
            if guide.closed && gone > n - 0.5 {
                let met = crossings.iter().zip(&come).position(|(c, &at)| c.halfedge == h && gone - at > 0.5 * n);
                if let Some(i) = met {
                    gone -= come[i];
                    crossings.drain(..i);
                    first = h;
                    break;
                }
            }
        }
        let whole = if guide.closed { h == first } else { mesh.twin(h).is_none() };
        // A whole turn or way ends where it began up to the size of an edge; there is no half one.
        if !whole || gone < 0.5 * n || gone > 1.5 * n {
            return Err(CarryError::Lost);
        }
        let ratio = length / guide.length().max(f64::MIN_POSITIVE);
        if !(1.0 / LENGTH_FACTOR..LENGTH_FACTOR).contains(&ratio) {
            return Err(CarryError::Length { ratio });
        }
        Ok(SurfaceCurve { crossings, closed: guide.closed })
    }
}
