//! Straight geodesics from a vertex to the vertices around it.
//!
//! The triangles around the source vertex are unfolded into the plane, each across an edge of the one before. A window is
//! an edge with the range of directions in which the source sees it. The vertex behind a window is the target of a
//! straight geodesic if its direction lies inside that range. A vertex behind a saddle vertex may have no straight
//! geodesic; it is left out.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// Parent of a window on an edge opposite the source.
const ROOT: u32 = u32::MAX;

/// Largest number of windows unfolded from one vertex. A regular 4-ring has about 300, a 5-ring 450. Only vertices with
/// hundreds of sliver triangles reach the limit; then the windows nearest to the source, which come first, are used.
const MAX_WINDOWS: usize = 4000;

/// Tolerance of the sine in the test whether a vertex lies inside its window: a geodesic may touch a vertex. Chosen by
/// hand, above rounding.
const GRAZING: f64 = 1e-10;

/// The angles around each vertex.
///
/// The tangent angle of a direction at an inner vertex is its angle on the surface, scaled so that a full turn is 2π.
#[derive(Debug)]
pub(super) struct Corners {
    /// Per half-edge: its angle on the surface around its origin, counter-clockwise from the first outgoing half-edge.
    start: Vec<f64>,
    /// Per vertex: the sum of its corner angles.
    total: Vec<f64>,
    /// Per vertex: tangent angle per angle on the surface.
    scale: Vec<f64>,
}

impl Corners {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let mut start = vec![0.0; mesh.n_halfedges()];
        let mut total = vec![0.0; mesh.n_vertices()];
        let mut scale = vec![1.0; mesh.n_vertices()];
        for v in mesh.vertices() {
            let mut sum = 0.0;
            for h in mesh.outgoing(v) {
                start[h.index()] = sum;
                sum += mesh.corner_angle(h);
            }
            total[v.index()] = sum;
            // At the boundary angles are not scaled, so that a straight boundary stays straight; unless their sum exceeds
            // a full turn, where directions would coincide.
            if sum > 0.0 && (!mesh.is_boundary_vertex(v) || sum > std::f64::consts::TAU) {
                scale[v.index()] = std::f64::consts::TAU / sum;
            }
        }
        Self { start, total, scale }
    }

    /// The angle from `h` on the surface of the direction at a tangent angle: the inverse of [`Self::tangent`].
    pub(super) fn local(&self, mesh: &TriMesh, h: HalfedgeId, tangent: f64) -> f64 {
        tangent / self.scale[mesh.origin(h).index()] - self.start[h.index()]
    }

    /// Tangent angle of the direction `local` radians counter-clockwise of `h`.
    pub(super) fn tangent(&self, mesh: &TriMesh, h: HalfedgeId, local: f64) -> f64 {
        (self.start[h.index()] + local) * self.scale[mesh.origin(h).index()]
    }

    /// The corner at `v` that contains a tangent angle, as outgoing half-edge, and the angle from that half-edge on the
    /// surface.
    pub(super) fn locate(&self, mesh: &TriMesh, v: VertexId, angle: f64) -> (HalfedgeId, f64) {
        let raw = angle / self.scale[v.index()];
        let mut found = mesh.vertex_halfedge(v);
        for h in mesh.outgoing(v) {
            if self.start[h.index()] <= raw {
                found = h;
            }
        }
        (found, raw - self.start[found.index()])
    }
}

/// The unit vector in the triangle of `h` that points `local` radians counter-clockwise of `h`.
pub(super) fn direction_in_face(mesh: &TriMesh, h: HalfedgeId, local: f64) -> DVec3 {
    let x = mesh.vector(h).normalize_or_zero();
    let side = -mesh.vector(mesh.prev(h));
    let y = side.reject_from_normalized(x).normalize_or_zero();
    (x * local.cos() + y * local.sin()).normalize_or_zero()
}

/// A straight geodesic from the source of an unfolding.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnfoldedGeodesic {
    pub(super) target: VertexId,
    pub(super) length: f64,
    /// The corner it starts in, as outgoing half-edge of the source.
    pub(super) start: HalfedgeId,
    /// The corner it ends in, as outgoing half-edge of the target.
    pub(super) end: HalfedgeId,
    /// Position of the target in the unfolded plane: the source is the origin, `start` the x axis.
    position: DVec2,
    /// The vector of `end` in that plane.
    side: DVec2,
    /// The window behind which the target lies; [`ROOT`] for a mesh edge.
    window: u32,
}

impl UnfoldedGeodesic {
    /// Angle from `start` to the geodesic, in radians.
    pub(super) fn start_angle(&self) -> f64 {
        self.position.y.atan2(self.position.x).max(0.0)
    }

    /// Angle from `end` to the direction back to the source, in radians.
    pub(super) fn end_angle(&self) -> f64 {
        self.side.perp_dot(-self.position).atan2(self.side.dot(-self.position)).max(0.0)
    }

    /// Whether it is a mesh edge.
    pub(super) fn is_edge(&self) -> bool {
        self.window == ROOT
    }
}

/// A mesh edge crossed by a geodesic.
#[derive(Debug, Clone, Copy)]
pub(super) struct EdgeCrossing {
    /// The half-edge in the triangle that the geodesic leaves.
    pub(super) halfedge: HalfedgeId,
    /// Position from the origin (0) to the target (1) of the half-edge.
    pub(super) t: f64,
    /// Distance from the source along the geodesic.
    pub(super) distance: f64,
    /// Angle from the half-edge to the direction of the geodesic, in (−π, 0).
    pub(super) angle: f64,
}

/// An unfolded edge, with the directions in which the source sees it.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// The half-edge in the triangle nearer to the source.
    halfedge: HalfedgeId,
    /// The corner at the source that the directions lie in.
    start: HalfedgeId,
    /// Position of the origin of `halfedge`.
    a: DVec2,
    /// Position of the target of `halfedge`.
    b: DVec2,
    /// The clockwise-most direction.
    low: DVec2,
    /// The counter-clockwise-most direction.
    high: DVec2,
    parent: u32,
}

/// The windows of an unfolding; the memory is reused from source to source.
#[derive(Debug, Default)]
pub(super) struct Unfolding {
    windows: Vec<Window>,
}

impl Unfolding {
    /// Calls `visit` with the straight geodesics from `v` to vertices for which `inside` holds, in breadth-first order of
    /// the triangles unfolded; mesh edges come first. Only apexes for which `inside` holds are unfolded. A vertex can be
    /// visited more than once.
    pub(super) fn all(
        &mut self,
        mesh: &TriMesh,
        v: VertexId,
        inside: impl Fn(VertexId) -> bool,
        mut visit: impl FnMut(UnfoldedGeodesic),
    ) {
        self.windows.clear();
        for h in mesh.outgoing(v) {
            visit(along_edge(mesh, h));
            if mesh.twin(mesh.prev(h)).is_none() {
                visit(along_last_boundary_edge(mesh, h));
            }
            self.push_corner(mesh, h, None);
        }
        self.expand(mesh, inside, |g| {
            visit(g);
            ControlFlow::Continue(())
        });
    }

    /// Finds a geodesic from `v` to `target` again, whose tangent `angle` at `v` and `length` are known: the angle on the
    /// surface within `slack` radians, the length within the fraction `slack`.
    pub(super) fn towards(
        &mut self,
        mesh: &TriMesh,
        corners: &Corners,
        v: VertexId,
        target: VertexId,
        (angle, length): (f64, f64),
        slack: f64,
    ) -> Option<UnfoldedGeodesic> {
        self.windows.clear();
        let raw = angle / corners.scale[v.index()];
        let full = corners.total[v.index()];
        let whole_turn = if mesh.is_boundary_vertex(v) { 0.0 } else { full };
        for h in mesh.outgoing(v) {
            let width = mesh.corner_angle(h);
            let local = raw - corners.start[h.index()];
            for at in [local, local - whole_turn, local + whole_turn] {
                if at + slack > 0.0 && at - slack < width {
                    self.push_corner(mesh, h, Some(((at - slack).max(0.0), (at + slack).min(width))));
                    break;
                }
            }
        }
        let mut found = None;
        self.expand(
            mesh,
            |_| true,
            |g| {
                if g.target == target && (g.length - length).abs() <= slack * length {
                    found = Some(g);
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            },
        );
        found
    }

    /// Adds the window of the edge opposite the source in the corner of `h`, for the directions `between` two angles from
    /// `h`, or all.
    fn push_corner(&mut self, mesh: &TriMesh, h: HalfedgeId, between: Option<(f64, f64)>) {
        let angle = mesh.corner_angle(h);
        let a = DVec2::new(mesh.vector(h).length(), 0.0);
        let b = DVec2::from_angle(angle) * mesh.vector(mesh.prev(h)).length();
        let (low, high) = match between {
            Some((low, high)) => (DVec2::from_angle(low), DVec2::from_angle(high)),
            None => (a, b),
        };
        self.windows.push(Window { halfedge: mesh.next(h), start: h, a, b, low, high, parent: ROOT });
    }

    /// Unfolds the triangles behind the windows, breadth first, until `visit` breaks.
    fn expand(
        &mut self,
        mesh: &TriMesh,
        inside: impl Fn(VertexId) -> bool,
        mut visit: impl FnMut(UnfoldedGeodesic) -> ControlFlow<()>,
    ) {
        let mut next = 0;
        while next < self.windows.len().min(MAX_WINDOWS) {
            let w = self.windows[next];
            let index = next as u32;
            next += 1;
            let Some(twin) = mesh.twin(w.halfedge) else { continue };
            let apex = mesh.opposite(twin);
            let Some(c) = (if inside(apex) { unfold_apex(mesh, &w, apex) } else { None }) else { continue };
            let (from_low, to_high) = (sine(w.low, c), sine(c, w.high));
            if from_low >= -GRAZING && to_high >= -GRAZING {
                let end = mesh.prev(twin);
                let geodesic = UnfoldedGeodesic {
                    target: apex,
                    length: c.length(),
                    start: w.start,
                    end,
                    position: c,
                    side: w.b - c,
                    window: index,
                };
                if visit(geodesic).is_break() {
                    return;
                }
            }
            if from_low > GRAZING {
                let high = if to_high > GRAZING { c } else { w.high };
                self.windows.push(Window { halfedge: mesh.next(twin), b: c, high, parent: index, ..w });
            }
            if to_high > GRAZING {
                let low = if from_low > GRAZING { c } else { w.low };
                self.windows.push(Window { halfedge: mesh.prev(twin), a: c, low, parent: index, ..w });
            }
        }
    }

    /// The mesh edges that a geodesic of the last unfolding crosses, in order.
    pub(super) fn crossings(&self, g: &UnfoldedGeodesic) -> Vec<EdgeCrossing> {
        let mut list = Vec::new();
        let mut at = g.window;
        while at != ROOT {
            let w = &self.windows[at as usize];
            let direction = g.position;
            let (below, above) = (w.a.perp_dot(direction).max(0.0), direction.perp_dot(w.b).max(0.0));
            let t = if below + above > 0.0 { below / (below + above) } else { 0.5 };
            let along = w.b - w.a;
            list.push(EdgeCrossing {
                halfedge: w.halfedge,
                t,
                distance: w.a.lerp(w.b, t).length(),
                angle: along.perp_dot(direction).atan2(along.dot(direction)),
            });
            at = w.parent;
        }
        list.reverse();
        list
    }
}

/// Sine of the angle from `a` to `b`; zero if one of them is zero.
fn sine(a: DVec2, b: DVec2) -> f64 {
    let length = a.length() * b.length();
    if length > 0.0 { a.perp_dot(b) / length } else { 0.0 }
}

/// Position of the third vertex of the triangle behind a window in the unfolded plane; `None` if the edge has length zero.
fn unfold_apex(mesh: &TriMesh, w: &Window, apex: VertexId) -> Option<DVec2> {
    let origin = mesh.position(mesh.origin(w.halfedge));
    let u = mesh.vector(w.halfedge).try_normalize()?;
    let side = mesh.position(apex) - origin;
    let x = (w.b - w.a).try_normalize()?;
    let outwards = DVec2::new(x.y, -x.x);
    Some(w.a + x * side.dot(u) + outwards * side.cross(u).length())
}

/// The geodesic along the edge of `h`.
fn along_edge(mesh: &TriMesh, h: HalfedgeId) -> UnfoldedGeodesic {
    let length = mesh.vector(h).length();
    let position = DVec2::new(length, 0.0);
    let (end, side) = match mesh.twin(h) {
        Some(t) => (t, -position),
        None => (mesh.next(h), DVec2::from_angle(PI - mesh.corner_angle(mesh.next(h)))),
    };
    UnfoldedGeodesic { target: mesh.target(h), length, start: h, end, position, side, window: ROOT }
}

/// The geodesic along the boundary edge that arrives at the origin of `h`, in the corner of `h`.
fn along_last_boundary_edge(mesh: &TriMesh, h: HalfedgeId) -> UnfoldedGeodesic {
    let end = mesh.prev(h);
    let length = mesh.vector(end).length();
    let position = DVec2::from_angle(mesh.corner_angle(h)) * length;
    UnfoldedGeodesic { target: mesh.origin(end), length, start: h, end, position, side: -position, window: ROOT }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::testing::{square, torus};

    #[test]
    fn geodesics_on_a_plane_are_straight_lines() {
        let mesh = square(6);
        let source = VertexId(3 * 7 + 3);
        let mut unfolding = Unfolding::default();
        let mut seen = vec![false; mesh.n_vertices()];
        unfolding.all(
            &mesh,
            source,
            |_| true,
            |g| {
                let distance = mesh.position(g.target).distance(mesh.position(source));
                assert!((g.length - distance).abs() < 1e-12, "to {:?}: {} instead of {distance}", g.target, g.length);
                seen[g.target.index()] = true;
            },
        );
        assert_eq!(seen.iter().filter(|&&s| !s).count(), 1, "only the source has none");
    }

    #[test]
    fn a_full_turn_of_tangent_angles_is_two_pi_inside_and_the_surface_angle_at_the_boundary() {
        for (mesh, v, full) in [(torus(8, 6), VertexId(5), TAU), (square(4), VertexId(2), PI)] {
            let corners = Corners::new(&mesh);
            let last = mesh.outgoing(v).last().unwrap();
            assert!((corners.tangent(&mesh, last, mesh.corner_angle(last)) - full).abs() < 1e-12);
            for h in mesh.outgoing(v) {
                let tangent = corners.tangent(&mesh, h, 0.1);
                assert!((corners.local(&mesh, h, tangent) - 0.1).abs() < 1e-12);
                assert_eq!(corners.locate(&mesh, v, tangent).0, h);
            }
        }
    }

    #[test]
    fn a_geodesic_is_found_again_by_its_angle_and_length() {
        let mesh = torus(16, 12);
        let (corners, v) = (Corners::new(&mesh), VertexId(12));
        let mut all = Vec::new();
        let mut unfolding = Unfolding::default();
        unfolding.all(&mesh, v, |w| mesh.position(w).distance(mesh.position(v)) < 0.25, |g| all.push(g));
        for g in all.iter().filter(|g| !g.is_edge()) {
            let angle = corners.tangent(&mesh, g.start, g.start_angle());
            let again = unfolding.towards(&mesh, &corners, v, g.target, (angle, g.length), 1e-6).unwrap();
            assert_eq!((again.start, again.end, again.target), (g.start, g.end, g.target));
        }
        assert!(all.iter().any(|g| !g.is_edge()));
        let known = (0.0, 100.0);
        assert!(unfolding.towards(&mesh, &corners, v, VertexId(13), known, 1e-6).is_none());
    }

    #[test]
    fn crossings_of_a_geodesic_lie_on_it() {
        let mesh = square(6);
        let mut unfolding = Unfolding::default();
        let mut found = Vec::new();
        unfolding.all(&mesh, VertexId(0), |_| true, |g| found.push(g));
        let g = found.iter().find(|g| g.target == VertexId(2 * 7 + 5)).unwrap();
        let [a, b] = [VertexId(0), g.target].map(|v| mesh.position(v));
        let crossings = unfolding.crossings(g);
        assert!(!crossings.is_empty());
        for c in crossings {
            let x = mesh.position(mesh.origin(c.halfedge)).lerp(mesh.position(mesh.target(c.halfedge)), c.t);
            assert!(
                (x.distance(a) - c.distance).abs() < 1e-12 && (x.distance(a) + x.distance(b) - g.length).abs() < 1e-12
            );
        }
    }
}
