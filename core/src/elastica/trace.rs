//! From a route in the graph to a curve on the mesh.
//!
//! A route passes through vertices, a curve must not: it is pushed off to its left, around each vertex through the
//! fan between the way in and the way out. A geodesic along a mesh edge runs in the triangle left of it. Where the
//! boundary is in the way, the right side is taken. Turning back at once over the edge just crossed is removed, so
//! that what remains crosses each edge for a reason.

use super::geodesics::edge_between;
use super::graph::{ElasticaGraph, State};
use super::search::Route;
use super::unfold::Unfolding;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::surface::{Crossing, SurfaceCurve};

/// How far from a vertex, relative to the edge, a curve passes it.
const PASSING: f64 = 0.15;

/// Least distance of a crossing from the ends of its edge, relative to the edge.
const CLEARANCE: f64 = 0.05;

/// Relative error allowed of the stored single-precision angle and length when a geodesic is traced again.
const TRACE_SLACK: f64 = 1e-4;

/// One geodesic on the mesh: the corner it starts in, the edges it crosses, the corner it ends in.
struct Segment {
    start: HalfedgeId,
    crossings: Vec<Crossing>,
    end: HalfedgeId,
}

impl ElasticaGraph {
    /// The curve of a route; `None` if it shrinks to nothing or a geodesic cannot be traced again.
    pub(super) fn curve(&self, route: &Route) -> Option<SurfaceCurve> {
        let mesh = &*self.mesh;
        let mut work = Unfolding::default();
        let segments: Vec<Segment> = route.states.iter().map(|&e| self.segment(e, &mut work)).collect::<Option<_>>()?;
        let mut crossings = Vec::new();
        if !route.closed {
            crossings = towards_boundary(mesh, segments.first()?.start)?;
            reverse(mesh, &mut crossings);
        }
        for (i, segment) in segments.iter().enumerate() {
            crossings.extend(&segment.crossings);
            match segments.get(i + 1).or(if route.closed { segments.first() } else { None }) {
                Some(next) => crossings.extend(around(mesh, segment.end, next.start)?),
                None => crossings.extend(towards_boundary(mesh, segment.end)?),
            }
        }
        let curve = SurfaceCurve { crossings: without_spurs(mesh, &crossings, route.closed), closed: route.closed };
        (curve.check(mesh).is_ok() && !(curve.closed && circles_one_vertex(mesh, &curve))).then_some(curve)
    }

    fn segment(&self, e: State, work: &mut Unfolding) -> Option<Segment> {
        let mesh = &*self.mesh;
        let (v, w) = (self.origin(e), VertexId(self.target[e as usize]));
        if let Some(h) = edge_between(mesh, v, w) {
            let (start, end) = if mesh.origin(h) == v { (h, mesh.next(h)) } else { (mesh.next(h), h) };
            return Some(Segment { start, crossings: Vec::new(), end });
        }
        // Traced from the same end whichever way it is used, as it was found.
        if v > w {
            let mut segment = self.segment(self.reverse[e as usize], work)?;
            std::mem::swap(&mut segment.start, &mut segment.end);
            reverse(mesh, &mut segment.crossings);
            return Some(segment);
        }
        let known = (self.out_angle(e), f64::from(self.nodes[e as usize].length));
        let g = work.towards(mesh, &self.corners, v, w, known, TRACE_SLACK)?;
        let crossings = work
            .crossings(&g)
            .iter()
            .map(|c| Crossing { halfedge: c.halfedge, t: c.t.clamp(CLEARANCE, 1.0 - CLEARANCE) })
            .collect();
        Some(Segment { start: g.start, crossings, end: g.end })
    }
}

/// Turns a list of crossings round. The first of an open curve has no other side and keeps it.
fn reverse(mesh: &TriMesh, crossings: &mut [Crossing]) {
    crossings.reverse();
    for c in crossings {
        if let Some(twin) = mesh.twin(c.halfedge) {
            *c = Crossing { halfedge: twin, t: 1.0 - c.t };
        }
    }
}

/// The next corner clockwise around the origin of `corner`, and the crossing into it.
fn clockwise(mesh: &TriMesh, corner: HalfedgeId) -> (Crossing, Option<HalfedgeId>) {
    (Crossing { halfedge: corner, t: PASSING }, mesh.twin(corner).map(|t| mesh.next(t)))
}

/// The next corner counter-clockwise around the origin of `corner`, and the crossing into it.
fn counter_clockwise(mesh: &TriMesh, corner: HalfedgeId) -> (Crossing, Option<HalfedgeId>) {
    let spoke = mesh.prev(corner);
    (Crossing { halfedge: spoke, t: 1.0 - PASSING }, mesh.twin(spoke))
}

/// The crossings from one corner of a vertex to another, past the vertex on its left if there is surface.
fn around(mesh: &TriMesh, from: HalfedgeId, to: HalfedgeId) -> Option<Vec<Crossing>> {
    [clockwise, counter_clockwise].into_iter().find_map(|turn| {
        let mut list = Vec::new();
        let mut corner = from;
        while corner != to {
            let (crossing, next) = turn(mesh, corner);
            list.push(crossing);
            corner = next.filter(|&n| n != from)?;
        }
        Some(list)
    })
}

/// The crossings from a corner of a boundary vertex over the boundary, the shorter way.
fn towards_boundary(mesh: &TriMesh, from: HalfedgeId) -> Option<Vec<Crossing>> {
    [clockwise, counter_clockwise]
        .into_iter()
        .filter_map(|turn| {
            let mut list = Vec::new();
            let mut corner = Some(from);
            while let Some(at) = corner {
                let (crossing, next) = turn(mesh, at);
                list.push(crossing);
                if next == Some(from) {
                    return None;
                }
                corner = next;
            }
            Some(list)
        })
        .min_by_key(Vec::len)
}

/// Removes each crossing that is undone by the next.
fn without_spurs(mesh: &TriMesh, crossings: &[Crossing], closed: bool) -> Vec<Crossing> {
    let undone = |a: &Crossing, b: &Crossing| mesh.twin(a.halfedge) == Some(b.halfedge);
    let mut kept: Vec<Crossing> = Vec::with_capacity(crossings.len());
    for c in crossings {
        if kept.last().is_some_and(|last| undone(last, c)) {
            kept.pop();
        } else {
            kept.push(*c);
        }
    }
    let mut ends = 0;
    while closed && kept.len() >= 2 * ends + 2 && undone(&kept[kept.len() - 1 - ends], &kept[ends]) {
        ends += 1;
    }
    kept[ends..kept.len() - ends].to_vec()
}

/// Whether all edges crossed meet in one vertex, so that the curve is the boundary of a point.
fn circles_one_vertex(mesh: &TriMesh, curve: &SurfaceCurve) -> bool {
    let ends = |c: &Crossing| [mesh.origin(c.halfedge), mesh.target(c.halfedge)];
    let Some(first) = curve.crossings.first() else { return true };
    ends(first).iter().any(|v| curve.crossings.iter().all(|c| ends(c).contains(v)))
}
