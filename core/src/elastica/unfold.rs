//! Straight geodesics from a vertex to the vertices around it.
//!
//! The triangles around a vertex are unfolded into the plane one across the other, each together with the window
//! of directions in which it is seen; a vertex inside its window is the end of a straight geodesic. Vertices
//! hidden behind a saddle have none and are left out.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// Parent of a window that starts at the source.
const ROOT: u32 = u32::MAX;

/// Most windows unfolded from one vertex. A regular 4-ring takes about 300, a 5-ring 450; only meshes with hubs of
/// hundreds of slivers come near, and there the nearest windows, which come first, are enough.
const MAX_WINDOWS: usize = 4000;

/// Relative slack of the test whether a vertex lies inside its window: a geodesic may graze a vertex.
const GRAZING: f64 = 1e-10;

/// The angles around each vertex.
#[derive(Debug)]
pub(crate) struct Corners {
    /// Per half-edge: the angle of its spoke at its origin, counter-clockwise from the first spoke of the fan.
    start: Vec<f64>,
    /// Per vertex: full angle of its fan.
    total: Vec<f64>,
    /// Per vertex: what turns an angle on the surface into one of the tangent plane.
    scale: Vec<f64>,
}

impl Corners {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
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
            // A full turn is 2π at every inner vertex; a boundary fan keeps its angle, so that a straight boundary
            // is straight, unless it overlaps itself.
            if sum > 0.0 && (!mesh.is_boundary_vertex(v) || sum > std::f64::consts::TAU) {
                scale[v.index()] = std::f64::consts::TAU / sum;
            }
        }
        Self { start, total, scale }
    }

    /// The inverse of [`Self::tangent`].
    pub(crate) fn local(&self, mesh: &TriMesh, h: HalfedgeId, tangent: f64) -> f64 {
        tangent / self.scale[mesh.origin(h).index()] - self.start[h.index()]
    }

    /// Tangent angle of the direction `local` radians counter-clockwise of spoke `h`.
    pub(crate) fn tangent(&self, mesh: &TriMesh, h: HalfedgeId, local: f64) -> f64 {
        (self.start[h.index()] + local) * self.scale[mesh.origin(h).index()]
    }

    /// The corner at `v` that holds a tangent angle, and the angle from its first spoke on the surface.
    pub(crate) fn locate(&self, mesh: &TriMesh, v: VertexId, angle: f64) -> (HalfedgeId, f64) {
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
pub(crate) fn direction_in_face(mesh: &TriMesh, h: HalfedgeId, local: f64) -> DVec3 {
    let x = mesh.vector(h).normalize_or_zero();
    let side = -mesh.vector(mesh.prev(h));
    let y = side.reject_from_normalized(x).normalize_or_zero();
    (x * local.cos() + y * local.sin()).normalize_or_zero()
}

/// A straight geodesic from the source of an unfolding.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Geodesic {
    pub(crate) target: VertexId,
    pub(crate) length: f64,
    /// The corner it starts in, as outgoing half-edge of the source.
    pub(crate) start: HalfedgeId,
    /// The corner it ends in, as outgoing half-edge of the target.
    pub(crate) end: HalfedgeId,
    /// The end in the plane of the start corner.
    position: DVec2,
    /// The direction of `end` in that plane.
    side: DVec2,
    window: u32,
}

impl Geodesic {
    /// Angle from `start`.
    pub(crate) fn start_angle(&self) -> f64 {
        self.position.y.atan2(self.position.x).max(0.0)
    }

    /// Angle from `end` to the direction back to the source.
    pub(crate) fn end_angle(&self) -> f64 {
        self.side.perp_dot(-self.position).atan2(self.side.dot(-self.position)).max(0.0)
    }

    /// Whether it is a mesh edge.
    pub(crate) fn is_edge(&self) -> bool {
        self.window == ROOT
    }
}

/// One mesh edge crossed by a geodesic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeCrossing {
    /// Seen from the triangle left.
    pub(crate) halfedge: HalfedgeId,
    /// From the origin (0) to the target (1) of the half-edge.
    pub(crate) t: f64,
    /// Distance from the source.
    pub(crate) distance: f64,
    /// Angle from the half-edge to the direction of travel, in (−π, 0).
    pub(crate) angle: f64,
}

#[derive(Debug, Clone, Copy)]
struct Window {
    /// Crossed half-edge, seen from the nearer triangle.
    halfedge: HalfedgeId,
    start: HalfedgeId,
    a: DVec2,
    b: DVec2,
    low: DVec2,
    high: DVec2,
    parent: u32,
}

/// Reusable memory for unfolding.
#[derive(Debug, Default)]
pub(crate) struct Unfolding {
    windows: Vec<Window>,
}

impl Unfolding {
    /// Visits straight geodesics from `v` over the vertices for which `inside` holds, nearer triangles first.
    /// A vertex can be met more than once; mesh edges come first.
    pub(crate) fn all(
        &mut self,
        mesh: &TriMesh,
        v: VertexId,
        inside: impl Fn(VertexId) -> bool,
        mut visit: impl FnMut(Geodesic),
    ) {
        self.windows.clear();
        for h in mesh.outgoing(v) {
            visit(along_spoke(mesh, h));
            if mesh.twin(mesh.prev(h)).is_none() {
                visit(along_last_spoke(mesh, h));
            }
            self.push_corner(mesh, h, None);
        }
        self.expand(mesh, inside, |g| {
            visit(g);
            ControlFlow::Continue(())
        });
    }

    /// The geodesic from `v` to `target` of a known length that starts within `slack` of a tangent angle.
    pub(crate) fn towards(
        &mut self,
        mesh: &TriMesh,
        corners: &Corners,
        v: VertexId,
        target: VertexId,
        (angle, length): (f64, f64),
        slack: f64,
    ) -> Option<Geodesic> {
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

    fn expand(
        &mut self,
        mesh: &TriMesh,
        inside: impl Fn(VertexId) -> bool,
        mut visit: impl FnMut(Geodesic) -> ControlFlow<()>,
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
                let geodesic = Geodesic {
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

    /// The mesh edges a geodesic of the last unfolding crosses, in order.
    pub(crate) fn crossings(&self, g: &Geodesic) -> Vec<EdgeCrossing> {
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

/// Sine of the angle from `a` to `b`; zero if one of them is.
fn sine(a: DVec2, b: DVec2) -> f64 {
    let length = a.length() * b.length();
    if length > 0.0 { a.perp_dot(b) / length } else { 0.0 }
}

/// Where the third corner of the triangle behind a window lies in the plane; `None` if the edge has no length.
fn unfold_apex(mesh: &TriMesh, w: &Window, apex: VertexId) -> Option<DVec2> {
    let origin = mesh.position(mesh.origin(w.halfedge));
    let u = mesh.vector(w.halfedge).try_normalize()?;
    let side = mesh.position(apex) - origin;
    let x = (w.b - w.a).try_normalize()?;
    let outwards = DVec2::new(x.y, -x.x);
    Some(w.a + x * side.dot(u) + outwards * side.cross(u).length())
}

fn along_spoke(mesh: &TriMesh, h: HalfedgeId) -> Geodesic {
    let length = mesh.vector(h).length();
    let position = DVec2::new(length, 0.0);
    let (end, side) = match mesh.twin(h) {
        Some(t) => (t, -position),
        None => (mesh.next(h), DVec2::from_angle(PI - mesh.corner_angle(mesh.next(h)))),
    };
    Geodesic { target: mesh.target(h), length, start: h, end, position, side, window: ROOT }
}

/// The geodesic along the boundary edge that ends the fan, in the corner of spoke `h`.
fn along_last_spoke(mesh: &TriMesh, h: HalfedgeId) -> Geodesic {
    let end = mesh.prev(h);
    let length = mesh.vector(end).length();
    let position = DVec2::from_angle(mesh.corner_angle(h)) * length;
    Geodesic { target: mesh.origin(end), length, start: h, end, position, side: -position, window: ROOT }
}
