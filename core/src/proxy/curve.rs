//! Curves carried from the proxy to the original and back.
//!
//! The images of the original's vertices lie on one side or the other of the curve. In a triangle of the original the
//! sides of the corners differ along two edges or none; so the edges between the sides form a strip, which is
//! followed from triangle to triangle once around. Sides are taken from the part of the curve near by, counted along
//! it, so that a curve may meet itself. The strip accompanies the curve at less than an edge, and its progress along
//! the curve is watched: it makes just one turn, and is therefore in the same homotopy class. The way back is the same
//! walk over the proxy, along the images of the curve's points.

use glam::DVec3;
use thiserror::Error;

use super::map::Proxy;
use super::string::{dense, strung};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::{Crossing, CurveError, SurfaceCurve, SurfacePoint, nearest_in_triangle};

/// How far along the curve sides are taken from, in mean edges of the proxy that it crosses.
const REACH: f64 = 2.5;
/// Distance in edge parameters kept from vertices; that of the other makers of curves.
pub(super) const VERTEX_DISTANCE: f64 = 1e-3;
/// Places along the curve from which it is tried.
const STARTS: usize = 12;
/// Triangles around a start in which an edge between the sides is looked for.
const AROUND: usize = 200;
/// Crossings after the start within which the walk may join its own way.
const JOIN: usize = 200;
/// The carried curve is as long as the curve up to this factor.
const LENGTH_FACTOR: f64 = 1.6;

/// Points of a curve of the original less than this apart, in mean edges of the proxy, are one point of its image:
/// places along the guide are then of like length whichever way a curve is carried.
const APART: f64 = 0.5;

/// Why a curve cannot be carried to the other mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CurveTransferError {
    /// The curve is not one on the mesh it is carried from.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// The other mesh has no strip of triangles along the curve that closes, or that ends where the curve does.
    #[error("the curve has no counterpart between mesh and proxy")]
    Lost,
    /// The curve found is of quite another length: the original is too rough there.
    #[error("carried between mesh and proxy the curve would be {ratio:.1} times as long")]
    Length {
        /// Its length there by its length here.
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

    /// A line on the proxy: its points, each with the face in which it goes on to the next.
    fn along(mesh: &TriMesh, line: &[(DVec3, FaceId)], closed: bool) -> Self {
        let n = line.len();
        let segment = |k: usize| {
            let ((from, face), (to, _)) = (line[k], line[(k + 1) % n]);
            Segment { from, to, left: mesh.face_normal(face).cross(to - from).normalize_or_zero(), face }
        };
        let segments = (0..if closed { n } else { n - 1 }).map(segment).collect();
        Self { segments, closed, reach: REACH * mean_edge(mesh, line) }
    }

    /// The image on the proxy of a line over the original.
    fn image(proxy: &Proxy, original: &TriMesh, line: impl Iterator<Item = SurfacePoint>, closed: bool) -> Self {
        let mesh = proxy.mesh();
        let image = |point: SurfacePoint| {
            let at = proxy.to_proxy(original, point);
            (at.position(mesh), at.face)
        };
        let all: Vec<(DVec3, FaceId)> = line.map(image).collect();
        let edge = mean_edge(mesh, &all);
        let mut points: Vec<(DVec3, FaceId)> = Vec::new();
        for &p in &all {
            if points.last().is_none_or(|last| last.0.distance(p.0) >= APART * edge) {
                points.push(p);
            }
        }
        let (&first, &end) = (&all[0], &all[all.len() - 1]);
        let near = |p: DVec3, q: DVec3| p.distance(q) < APART * edge;
        if closed {
            while points.len() > 3 && points.last().is_some_and(|last| near(last.0, first.0)) {
                points.pop();
            }
        } else {
            // The end on the boundary counts, not what comes just before it.
            if points.len() > 1 && points.last().is_some_and(|last| near(last.0, end.0)) {
                points.pop();
            }
            points.push(end);
        }
        let n = points.len();
        let segment = |k: usize| {
            let ((from, face), (to, other)) = (points[k], points[(k + 1) % n]);
            let up = mesh.face_normal(face) + mesh.face_normal(other);
            Segment { from, to, left: up.cross(to - from).normalize_or_zero(), face }
        };
        let count = if closed { n } else { n - 1 };
        Self { segments: (0..count).map(segment).collect(), closed, reach: REACH * edge }
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

    /// Whether two places are much less than the reach apart.
    fn is_near(&self, a: f64, b: f64) -> bool {
        let place = |at: f64| {
            let k = (at.max(0.0) as usize).min(self.segments.len() - 1);
            self.segments[k].from.lerp(self.segments[k].to, at - k as f64)
        };
        self.way(a, b).abs() < 3.0 || place(a).distance(place(b)) < 0.5 * self.reach
    }

    fn length(&self) -> f64 {
        self.segments.iter().map(|s| s.from.distance(s.to)).sum()
    }
}

/// The mean length of an edge of the faces along a line.
fn mean_edge(mesh: &TriMesh, line: &[(DVec3, FaceId)]) -> f64 {
    let edge = |f: FaceId| mesh.vector(mesh.face_halfedges(f)[0]).length();
    line.iter().map(|p| edge(p.1)).sum::<f64>() / line.len().max(1) as f64
}

impl Proxy {
    /// The curve on the original that goes as `curve` goes on the proxy: of the same homotopy class, closed or from
    /// boundary to boundary. It runs as the proxy's edges let it; [`relax`](crate::surface::relax) makes it fair.
    ///
    /// # Errors
    ///
    /// A curve that is not one on the proxy, or an original too rough along it.
    pub fn curve_to_original(
        &self,
        original: &TriMesh,
        curve: &SurfaceCurve,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        curve.check(self.mesh())?;
        let guide = Guide::new(self.mesh(), curve);
        self.along_on_original(original, &guide)
    }

    /// As [`Self::curve_to_original`] for a line over the proxy: its points, each with the face in which it goes on to
    /// the next, from boundary to boundary unless it is closed.
    ///
    /// # Errors
    ///
    /// An original too rough along it.
    pub fn polyline_to_original(
        &self,
        original: &TriMesh,
        line: &[(DVec3, FaceId)],
        closed: bool,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        if line.len() < 2 {
            return Err(CurveTransferError::Lost);
        }
        let guide = Guide::along(self.mesh(), line, closed);
        self.along_on_original(original, &guide).or_else(|lost| {
            let images: Vec<SurfacePoint> = dense(self.mesh(), line).map(|p| self.to_original(original, p)).collect();
            if closed { strung(original, &images).ok_or(lost) } else { Err(lost) }
        })
    }

    /// The curve on the proxy that goes as `curve` goes on the original, as [`Self::curve_to_original`] the other way.
    ///
    /// # Errors
    ///
    /// A curve that is not one on the original, or one smaller than the triangles of the proxy.
    pub fn curve_to_proxy(&self, original: &TriMesh, curve: &SurfaceCurve) -> Result<SurfaceCurve, CurveTransferError> {
        curve.check(original)?;
        let points = (0..curve.crossings.len()).map(|i| curve.surface_point(original, i));
        let guide = Guide::image(self, original, points, curve.closed);
        self.along(&guide)
    }

    /// As [`Self::curve_to_proxy`] for a line over the original, as in [`Self::polyline_to_original`].
    ///
    /// # Errors
    ///
    /// A line smaller than the triangles of the proxy.
    pub fn polyline_to_proxy(
        &self,
        original: &TriMesh,
        line: &[(DVec3, FaceId)],
        closed: bool,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        if line.len() < 2 {
            return Err(CurveTransferError::Lost);
        }
        let point = |&(p, face): &(DVec3, FaceId)| {
            let corners = original.face_vertices(face).map(|v| original.position(v));
            SurfacePoint { face, weights: nearest_in_triangle(p, &corners) }
        };
        let guide = Guide::image(self, original, line.iter().map(point), closed);
        self.along(&guide).or_else(|lost| {
            let images: Vec<SurfacePoint> = line.iter().map(|p| self.to_proxy(original, point(p))).collect();
            if closed { strung(self.mesh(), &images).ok_or(lost) } else { Err(lost) }
        })
    }

    fn along_on_original(&self, original: &TriMesh, guide: &Guide) -> Result<SurfaceCurve, CurveTransferError> {
        let walker = Walker { mesh: original, places: self.places(), guide };
        walker.follow(self, |point| self.to_original(original, point).face)
    }

    fn along(&self, guide: &Guide) -> Result<SurfaceCurve, CurveTransferError> {
        let walker = Walker { mesh: self.mesh(), places: self.mesh().positions(), guide };
        walker.follow(self, |point| point.face)
    }
}

/// Follows a guide over a mesh as it is laid onto the proxy.
struct Walker<'a> {
    mesh: &'a TriMesh,
    /// Where its vertices lie on the proxy.
    places: &'a [DVec3],
    guide: &'a Guide,
}

impl Walker<'_> {
    /// The curve along the guide; `face_at` finds the face at a point of the proxy.
    fn follow(
        &self,
        proxy: &Proxy,
        face_at: impl Fn(SurfacePoint) -> FaceId,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        let (mesh, guide) = (self.mesh, self.guide);
        let n = guide.segments.len();
        let t = if guide.closed { 0.5 } else { 0.0 };
        let mut error = CurveTransferError::Lost;
        for i in 0..if guide.closed { STARTS.min(n) } else { 1 } {
            let k = i * n / STARTS.min(n);
            let s = &guide.segments[k];
            let corners = proxy.mesh().face_vertices(s.face).map(|v| proxy.mesh().position(v));
            let on_proxy = SurfacePoint { face: s.face, weights: nearest_in_triangle(s.from.lerp(s.to, t), &corners) };
            let Some(start) = self.start(face_at(on_proxy), k as f64 + t) else { continue };
            match self.walk(start) {
                Ok(carried) if carried.check(mesh).is_ok() => return Ok(carried),
                Ok(_) => {}
                Err(e) => error = e,
            }
        }
        Err(error)
    }

    /// The half-edge near a face through which the walk from a place of the guide first leaves a triangle; for an open
    /// guide the one on the boundary through which it enters.
    fn start(&self, face: FaceId, at: f64) -> Option<(HalfedgeId, f64)> {
        let (mesh, guide) = (self.mesh, self.guide);
        let mut near = vec![face];
        let mut next = 0;
        while next < near.len().min(AROUND) {
            let sides = mesh.face_halfedges(near[next]);
            for h in sides {
                let ends = [mesh.origin(h), mesh.target(h)].map(|v| self.side(v, at));
                let crosses = if guide.closed {
                    ends[0].distance < 0.0 && ends[1].distance >= 0.0
                } else {
                    mesh.twin(h).is_none() && ends[0].distance >= 0.0 && ends[1].distance < 0.0
                };
                // Beyond the ends of the part looked at, sides mean nothing.
                let near = |e: &Side| e.distance.abs() < guide.reach;
                if crosses && ends.iter().all(near) && ends.iter().any(|e| guide.is_near(at, e.at)) {
                    return Some((h, at));
                }
            }
            for f in sides.into_iter().filter_map(|h| mesh.twin(h)).map(|g| mesh.face(g)) {
                if !near.contains(&f) {
                    near.push(f);
                }
            }
            next += 1;
        }
        None
    }

    fn side(&self, v: VertexId, at: f64) -> Side {
        self.guide.side(self.places[v.index()], at)
    }

    /// Walks from a half-edge, near a place on the guide, until the curve is closed or at the boundary.
    fn walk(&self, (mut first, at): (HalfedgeId, f64)) -> Result<SurfaceCurve, CurveTransferError> {
        let (mesh, guide) = (self.mesh, self.guide);
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
            return Err(CurveTransferError::Lost);
        }
        let ratio = length / guide.length().max(f64::MIN_POSITIVE);
        if !(1.0 / LENGTH_FACTOR..LENGTH_FACTOR).contains(&ratio) {
            return Err(CurveTransferError::Length { ratio });
        }
        Ok(SurfaceCurve { crossings, closed: guide.closed })
    }
}
