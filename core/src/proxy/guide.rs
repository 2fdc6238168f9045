//! The polyline on the proxy that a transferred curve follows, and signed distances from it.

use glam::DVec3;

use super::map::Proxy;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::{SurfaceCurve, SurfacePoint};

/// Extent of the part of the guide from which distances are taken, to each side of a point of it, in mean edges of the
/// proxy that it crosses.
const REACH: f64 = 2.5;

/// Least distance between points of an image on the proxy, in mean edges; nearer ones are merged. Segments then have
/// similar lengths in both directions of transfer.
const SPACING: f64 = 0.5;

/// One segment of a guide.
pub(super) struct Segment {
    pub from: DVec3,
    pub to: DVec3,
    /// A face of the proxy at `from`.
    pub face: FaceId,
    /// Unit vector to the left.
    left: DVec3,
}

impl Segment {
    fn new(from: DVec3, to: DVec3, face: FaceId, normal: DVec3) -> Self {
        Self { from, to, face, left: normal.cross(to - from).normalize_or_zero() }
    }

    fn length(&self) -> f64 {
        self.from.distance(self.to)
    }
}

/// A polyline on the proxy. Its parameter is the index of a segment plus the fraction of the segment.
pub(super) struct Guide {
    pub segments: Vec<Segment>,
    pub closed: bool,
    /// Extent of the part from which distances are taken, in units of the mesh.
    pub reach: f64,
}

/// Where a point lies relative to the guide.
#[derive(Clone, Copy)]
pub(super) struct SignedDistance {
    /// Distance, positive to the left.
    pub distance: f64,
    /// Parameter of the nearest point.
    pub at: f64,
}

impl Guide {
    /// The guide along a curve on the proxy.
    pub fn of_curve(mesh: &TriMesh, curve: &SurfaceCurve) -> Self {
        let points = curve.points(mesh);
        let n = points.len();
        let count = if curve.closed { n } else { n - 1 };
        let segment = |k: usize| {
            let face = mesh.face(curve.crossings[(k + 1) % n].halfedge);
            Segment::new(points[k], points[(k + 1) % n], face, mesh.face_normal(face))
        };
        let edges: f64 = curve.crossings.iter().map(|c| mesh.vector(c.halfedge).length()).sum();
        Self { segments: (0..count).map(segment).collect(), closed: curve.closed, reach: REACH * edges / n as f64 }
    }

    /// The guide along a polyline on the proxy: its points, each with the face of the segment to the next one.
    pub fn of_polyline(mesh: &TriMesh, line: &[(DVec3, FaceId)], closed: bool) -> Self {
        let n = line.len();
        let segment = |k: usize| {
            let ((from, face), (to, _)) = (line[k], line[(k + 1) % n]);
            Segment::new(from, to, face, mesh.face_normal(face))
        };
        let segments = (0..if closed { n } else { n - 1 }).map(segment).collect();
        Self { segments, closed, reach: REACH * mean_edge(mesh, line) }
    }

    /// The guide along the image on the proxy of a polyline on the original.
    pub fn of_image(proxy: &Proxy, original: &TriMesh, line: impl Iterator<Item = SurfacePoint>, closed: bool) -> Self {
        let mesh = proxy.mesh();
        let image = |point: SurfacePoint| {
            let at = proxy.to_proxy(original, point);
            (at.position(mesh), at.face)
        };
        let all: Vec<(DVec3, FaceId)> = line.map(image).collect();
        let edge = mean_edge(mesh, &all);
        let points = spaced(&all, SPACING * edge, closed);
        let n = points.len();
        let segment = |k: usize| {
            let ((from, face), (to, other)) = (points[k], points[(k + 1) % n]);
            Segment::new(from, to, face, mesh.face_normal(face) + mesh.face_normal(other))
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

    /// Signed distance of `p` from the part of the guide within reach of the parameter `at`. Parts of the guide
    /// elsewhere do not count, so the guide may cross itself.
    pub fn signed_distance(&self, p: DVec3, at: f64) -> SignedDistance {
        let n = self.segments.len();
        let home = (at.max(0.0) as usize).min(n - 1);
        let mut best = (f64::INFINITY, home, 0.0);
        self.compare(p, home, &mut best);
        for forward in [false, true] {
            let (mut k, mut passed) = (home, 0.0);
            while let Some(next) = self.step(k, forward).filter(|&next| passed < self.reach && next != home) {
                k = next;
                self.compare(p, k, &mut best);
                passed += self.segments[k].length();
            }
        }
        let (distance, k, t) = best;
        let s = &self.segments[k];
        // At a vertex of the polyline the mean of both segments' left vectors decides.
        let mut left = s.left;
        if t == 0.0 || t == 1.0 {
            left += self.step(k, t == 1.0).map_or(DVec3::ZERO, |other| self.segments[other].left);
        }
        let offset = p - s.from.lerp(s.to, t);
        SignedDistance { distance: distance.sqrt().copysign(offset.dot(left)), at: k as f64 + t }
    }

    /// Updates `best`, the least squared distance with its segment and parameter, by segment `k`.
    fn compare(&self, p: DVec3, k: usize, best: &mut (f64, usize, f64)) {
        let s = &self.segments[k];
        let along = s.to - s.from;
        let t = ((p - s.from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance = s.from.lerp(s.to, t).distance_squared(p);
        if distance < best.0 {
            *best = (distance, k, t);
        }
    }

    /// The difference `b - a` of two parameters; on a closed guide the one of least absolute value.
    pub fn difference(&self, a: f64, b: f64) -> f64 {
        let n = self.segments.len() as f64;
        let difference = b - a;
        if self.closed { difference - n * (difference / n).round() } else { difference }
    }

    /// Whether the points at two parameters are less than three segments or half the reach apart.
    pub fn is_near(&self, a: f64, b: f64) -> bool {
        let position = |at: f64| {
            let k = (at.max(0.0) as usize).min(self.segments.len() - 1);
            self.segments[k].from.lerp(self.segments[k].to, at - k as f64)
        };
        self.difference(a, b).abs() < 3.0 || position(a).distance(position(b)) < 0.5 * self.reach
    }

    /// Length, in units of the mesh.
    pub fn length(&self) -> f64 {
        self.segments.iter().map(Segment::length).sum()
    }
}

/// The points of a line that are at least `distance` from the one before. The ends of an open line are kept.
fn spaced(all: &[(DVec3, FaceId)], distance: f64, closed: bool) -> Vec<(DVec3, FaceId)> {
    let mut points: Vec<(DVec3, FaceId)> = Vec::new();
    for &p in all {
        if points.last().is_none_or(|last| last.0.distance(p.0) >= distance) {
            points.push(p);
        }
    }
    let (first, end) = (all[0], all[all.len() - 1]);
    let near = |p: DVec3, q: DVec3| p.distance(q) < distance;
    if closed {
        while points.len() > 3 && points.last().is_some_and(|last| near(last.0, first.0)) {
            points.pop();
        }
    } else {
        // The end on the boundary replaces a point just before it.
        if points.len() > 1 && points.last().is_some_and(|last| near(last.0, end.0)) {
            points.pop();
        }
        points.push(end);
    }
    points
}

/// The mean length of an edge of the faces along a line.
fn mean_edge(mesh: &TriMesh, line: &[(DVec3, FaceId)]) -> f64 {
    let edge = |f: FaceId| mesh.vector(mesh.face_halfedges(f)[0]).length();
    line.iter().map(|p| edge(p.1)).sum::<f64>() / line.len().max(1) as f64
}
