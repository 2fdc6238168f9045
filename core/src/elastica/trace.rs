//! From a route in the graph to a curve on the mesh.
//!
//! A route passes through vertices; a curve must not. So the curve passes each vertex on its left, through the fan of
//! triangles between the arriving and the leaving geodesic. A geodesic along a mesh edge runs in the triangle left of it.
//! Where the boundary is in the way, the curve passes on the right. Consecutive crossings of an edge and back are removed,
//! so that the edges crossed depend on the homotopy class only.

use super::geodesics::edge_between;
use super::graph::{ElasticaGraph, State};
use super::route::Route;
use super::unfold::Unfolding;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};

/// Distance at which a curve passes a vertex, as a fraction of the edge crossed. Chosen by hand.
const PASSING: f64 = 0.15;

/// Least distance of a crossing from the ends of its edge, as a fraction of the edge. Chosen by hand.
const CLEARANCE: f64 = 0.05;

/// Tolerance when a geodesic is traced again from its stored angle (radians) and length (relative): above the error of
/// single precision.
const TRACE_SLACK: f64 = 1e-4;

/// A geodesic on the mesh.
struct TracedGeodesic {
    /// The corner it starts in, as outgoing half-edge of its origin.
    start: HalfedgeId,
    crossings: Vec<Crossing>,
    /// The corner it ends in, as outgoing half-edge of its target.
    end: HalfedgeId,
}

impl ElasticaGraph {
    /// The curve of a route; `None` if it is contractible to a point or a geodesic cannot be traced again.
    pub(super) fn curve(&self, route: &Route) -> Option<SurfaceCurve> {
        let mesh = &*self.mesh;
        let mut work = Unfolding::default();
        let traced: Vec<TracedGeodesic> =
            route.states.iter().map(|&e| self.trace(e, &mut work)).collect::<Option<_>>()?;
        let mut crossings = Vec::new();
        if !route.closed {
            crossings = to_boundary(mesh, traced.first()?.start)?;
            reverse(mesh, &mut crossings);
        }
        for (i, geodesic) in traced.iter().enumerate() {
            crossings.extend(&geodesic.crossings);
            match traced.get(i + 1).or(if route.closed { traced.first() } else { None }) {
                Some(next) => crossings.extend(around_vertex(mesh, geodesic.end, next.start)?),
                None => crossings.extend(to_boundary(mesh, geodesic.end)?),
            }
        }
        let curve =
            SurfaceCurve { crossings: without_backtracking(mesh, &crossings, route.closed), closed: route.closed };
        (curve.check(mesh).is_ok() && !(curve.closed && circles_one_vertex(mesh, &curve))).then_some(curve)
    }

    /// Traces the geodesic of a state.
    fn trace(&self, e: State, work: &mut Unfolding) -> Option<TracedGeodesic> {
        let mesh = &*self.mesh;
        let (v, w) = (self.origin(e), self.target(e));
        if let Some(h) = edge_between(mesh, v, w) {
            let (start, end) = if mesh.origin(h) == v { (h, mesh.next(h)) } else { (mesh.next(h), h) };
            return Some(TracedGeodesic { start, crossings: Vec::new(), end });
        }
        // Both directions are traced from the end of smaller index, from which the geodesic was found.
        if v > w {
            let mut geodesic = self.trace(self.reversed(e), work)?;
            std::mem::swap(&mut geodesic.start, &mut geodesic.end);
            reverse(mesh, &mut geodesic.crossings);
            return Some(geodesic);
        }
        let known = (self.out_angle(e), f64::from(self.geodesics[e as usize].length));
        let g = work.towards(mesh, &self.corners, v, w, known, TRACE_SLACK)?;
        let crossings = work
            .crossings(&g)
            .iter()
            .map(|c| Crossing { halfedge: c.halfedge, t: c.t.clamp(CLEARANCE, 1.0 - CLEARANCE) })
            .collect();
        Some(TracedGeodesic { start: g.start, crossings, end: g.end })
    }
}

/// Reverses a list of crossings. A crossing of a boundary edge keeps its half-edge, which has no twin.
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

/// The crossings from one corner of a vertex to another: clockwise, that is past the vertex on its left, unless the boundary
/// is in the way.
fn around_vertex(mesh: &TriMesh, from: HalfedgeId, to: HalfedgeId) -> Option<Vec<Crossing>> {
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

/// The crossings from a corner of a boundary vertex to the boundary, in the direction with fewer of them.
fn to_boundary(mesh: &TriMesh, from: HalfedgeId) -> Option<Vec<Crossing>> {
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

/// Removes pairs of consecutive crossings of an edge and back.
fn without_backtracking(mesh: &TriMesh, crossings: &[Crossing], closed: bool) -> Vec<Crossing> {
    let goes_back = |a: &Crossing, b: &Crossing| mesh.twin(a.halfedge) == Some(b.halfedge);
    let mut kept: Vec<Crossing> = Vec::with_capacity(crossings.len());
    for c in crossings {
        if kept.last().is_some_and(|last| goes_back(last, c)) {
            kept.pop();
        } else {
            kept.push(*c);
        }
    }
    let mut ends = 0;
    while closed && kept.len() >= 2 * ends + 2 && goes_back(&kept[kept.len() - 1 - ends], &kept[ends]) {
        ends += 1;
    }
    kept[ends..kept.len() - ends].to_vec()
}

/// Whether all edges crossed have a vertex in common, so that the curve is contractible to it.
fn circles_one_vertex(mesh: &TriMesh, curve: &SurfaceCurve) -> bool {
    let ends = |c: &Crossing| [mesh.origin(c.halfedge), mesh.target(c.halfedge)];
    let Some(first) = curve.crossings.first() else { return true };
    ends(first).iter().any(|v| curve.crossings.iter().all(|c| ends(c).contains(v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::VertexId;
    use crate::testing::{row, square, torus};

    fn back_over(mesh: &TriMesh, c: Crossing) -> Crossing {
        Crossing { halfedge: mesh.twin(c.halfedge).unwrap(), t: 1.0 - c.t }
    }

    #[test]
    fn crossings_of_an_edge_and_back_are_removed() {
        let mesh = torus(8, 6);
        let curve = row(8, 2, true, 0.4).crossings;
        // Out and back over two edges, inside the list.
        let mut detour = curve.clone();
        let (h, g) = (curve[3], back_over(&mesh, curve[3]));
        let inner = Crossing { halfedge: mesh.next(g.halfedge), t: 0.5 };
        detour.splice(4..4, [inner, back_over(&mesh, inner)]);
        assert_eq!(without_backtracking(&mesh, &detour, true), curve);
        // The same across the ends of the list, which only a closed curve has.
        let mut ends = curve.clone();
        ends.insert(0, back_over(&mesh, h));
        ends.push(h);
        assert_eq!(without_backtracking(&mesh, &ends, true), curve);
        assert_eq!(without_backtracking(&mesh, &ends, false), ends);
    }

    #[test]
    fn a_curve_around_a_vertex_is_contractible_to_it() {
        let mesh = torus(8, 6);
        let crossings = mesh.outgoing(VertexId(9)).map(|h| Crossing { halfedge: h, t: 0.2 }).collect();
        assert!(circles_one_vertex(&mesh, &SurfaceCurve { crossings, closed: true }));
        assert!(!circles_one_vertex(&mesh, &row(8, 2, true, 0.4)));
    }

    #[test]
    fn a_vertex_is_passed_on_the_left_unless_the_boundary_is_there() {
        let mesh = square(4);
        // Clockwise around an inner vertex.
        let spokes: Vec<HalfedgeId> = mesh.outgoing(VertexId(12)).collect();
        let passed = around_vertex(&mesh, spokes[2], spokes[1]).unwrap();
        assert_eq!(passed, [Crossing { halfedge: spokes[2], t: PASSING }]);
        // At a boundary vertex the last corner is reached from the first one counter-clockwise only.
        let spokes: Vec<HalfedgeId> = mesh.outgoing(VertexId(2)).collect();
        let passed = around_vertex(&mesh, spokes[0], spokes[1]).unwrap();
        assert_eq!(passed, [Crossing { halfedge: mesh.prev(spokes[0]), t: 1.0 - PASSING }]);
        assert_eq!(around_vertex(&mesh, spokes[0], spokes[0]), Some(Vec::new()));
    }
}
