//! Straightest geodesics from a vertex (Polthier and Schmies, Straightest Geodesics on Polyhedral Surfaces).
//!
//! The geodesic is a straight segment in each triangle and continues straight into the next one, unfolded. Directions
//! at the vertex are those of the geodesic polar map (Welch and Witkin): the angles between its edges are scaled by one
//! factor so that they sum to 2π (π at the boundary).

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::metric::Metric;
use super::point::SurfacePoint;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Least distance of a crossing from the ends of its edge, as a fraction of the edge. A geodesic that would run into a
/// vertex passes beside it.
const CORNER_CLEARANCE: f64 = 1e-6;

/// The geodesic polar map of the triangles around a vertex.
#[derive(Debug, Clone)]
pub struct PolarMap {
    /// The outgoing half-edges, counter-clockwise, each with its polar angle in radians; the first is at 0.
    pub spokes: Vec<(HalfedgeId, f64)>,
    /// Ratio of polar angles to angles on the surface.
    pub scale: f64,
    /// The polar angle at which the last triangle ends: 2π, or π at the boundary.
    pub total: f64,
}

impl PolarMap {
    /// The polar map of `v`.
    pub fn new(mesh: &TriMesh, metric: &Metric, v: VertexId) -> Self {
        let total = if mesh.is_boundary_vertex(v) { PI } else { TAU };
        let sum: f64 = mesh.outgoing(v).map(|h| metric.corner_angle(h)).sum();
        let scale = total / sum.max(f64::MIN_POSITIVE);
        let mut at = 0.0;
        let spokes = mesh
            .outgoing(v)
            .map(|h| {
                let angle = at;
                at += scale * metric.corner_angle(h);
                (h, angle)
            })
            .collect();
        Self { spokes, scale, total }
    }

    /// The outgoing half-edge whose triangle contains polar direction `angle`, and the angle on the surface from this
    /// half-edge, in radians.
    pub fn wedge(&self, angle: f64) -> (HalfedgeId, f64) {
        let angle = if self.total < TAU { angle.clamp(0.0, self.total) } else { angle.rem_euclid(TAU) };
        let at = self.spokes.partition_point(|s| s.1 <= angle).max(1) - 1;
        let (h, from) = self.spokes[at];
        (h, (angle - from) / self.scale)
    }
}

/// A traced geodesic.
#[derive(Debug, Clone)]
pub struct GeodesicTrace {
    /// The end point.
    pub end: SurfacePoint,
    /// The half-edges crossed, each in the triangle that the geodesic leaves.
    pub crossed: Vec<HalfedgeId>,
    /// The first triangle.
    pub first: FaceId,
    /// Whether the boundary ended it before it had the requested length.
    pub hit_boundary: bool,
}

/// Traces a geodesic from `v` in polar direction `angle` (radians) over `length` (units of the mesh), or up to the
/// boundary.
pub fn trace_geodesic(mesh: &TriMesh, metric: &Metric, v: VertexId, angle: f64, length: f64) -> GeodesicTrace {
    let (start, turn) = PolarMap::new(mesh, metric, v).wedge(angle);
    let first = mesh.face(start);
    let mut face = first;
    let mut at = metric.layout(face)[start.index() % 3];
    let mut heading = metric.direction(start) + turn;
    let mut remaining = length;
    let mut crossed = Vec::new();
    // The side through which the triangle was entered. In the first triangle only the side opposite to `v` is an exit.
    let mut entry: Option<usize> = None;
    loop {
        let corners = metric.layout(face);
        let direction = DVec2::from_angle(heading);
        let exit = (0..3)
            .filter(|&i| Some(i) != entry)
            .filter(|&i| entry.is_some() || i == (start.index() + 1) % 3)
            .filter_map(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let away = direction.perp_dot(b - a);
                // The geodesic leaves where it crosses a side from left to right: `away > 0`.
                let t = (a - at).perp_dot(direction) / away;
                let s = (a - at).perp_dot(b - a) / away;
                (away > 0.0 && s.is_finite() && t.is_finite()).then_some((
                    i,
                    s.max(0.0),
                    t.clamp(CORNER_CLEARANCE, 1.0 - CORNER_CLEARANCE),
                ))
            })
            .min_by(|p, q| p.1.total_cmp(&q.1));
        let Some((side, s, t)) = exit else {
            return GeodesicTrace { end: surface_point(metric, face, at), crossed, first, hit_boundary: true };
        };
        // The second condition is a safeguard against an endless loop by rounding.
        if s >= remaining || crossed.len() > mesh.n_faces() {
            return GeodesicTrace {
                end: surface_point(metric, face, at + remaining * direction),
                crossed,
                first,
                hit_boundary: false,
            };
        }
        let h = mesh.face_halfedges(face)[side];
        let Some(twin) = mesh.twin(h) else {
            let end = corners[side].lerp(corners[(side + 1) % 3], t);
            return GeodesicTrace { end: surface_point(metric, face, end), crossed, first, hit_boundary: true };
        };
        remaining -= s;
        heading += metric.transport(h, twin);
        crossed.push(h);
        face = mesh.face(twin);
        entry = Some(twin.index() % 3);
        let next = metric.layout(face);
        at = next[(twin.index() + 1) % 3].lerp(next[twin.index() % 3], t);
    }
}

/// A point given in a triangle's planar layout, clamped to the triangle.
fn surface_point(metric: &Metric, face: FaceId, at: DVec2) -> SurfacePoint {
    let [a, b, c] = *metric.layout(face);
    let area = (b - a).perp_dot(c - a);
    let weights = [(c - b).perp_dot(at - b), (a - c).perp_dot(at - c), (b - a).perp_dot(at - a)];
    let weights = weights.map(|w| (w / area).max(0.0));
    let sum: f64 = weights.iter().sum();
    SurfacePoint { face, weights: weights.map(|w| w / sum) }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::testing::{grid, square};

    #[test]
    fn on_the_plane_a_geodesic_is_a_straight_line() {
        let mesh = square(12);
        let metric = Metric::new(&mesh);
        let v = VertexId(13 * 6 + 6);
        let polar = PolarMap::new(&mesh, &metric, v);
        assert!((polar.scale - 1.0).abs() < 1e-3);
        let first = mesh.vector(polar.spokes[0].0).truncate().to_angle();
        for k in 0..50 {
            let angle = TAU * (f64::from(k) + 0.3) / 50.0;
            let trace = trace_geodesic(&mesh, &metric, v, angle, 0.4);
            let want = mesh.position(v) + 0.4 * DVec3::new((angle + first).cos(), (angle + first).sin(), 0.0);
            // `Metric` lengthens edges by a ten-thousandth of the mean.
            assert!(trace.end.position(&mesh).distance(want) < 1e-3, "{k}");
            assert!(!trace.hit_boundary);
            let last = trace.crossed.last().map_or(trace.first, |&h| mesh.face(mesh.twin(h).unwrap()));
            assert_eq!(last, trace.end.face);
        }
    }

    #[test]
    fn a_geodesic_stops_at_the_boundary() {
        let mesh = square(8);
        let metric = Metric::new(&mesh);
        let trace = trace_geodesic(&mesh, &metric, VertexId(9 * 4 + 4), 1.0, 10.0);
        let end = trace.end.position(&mesh);
        assert!(trace.hit_boundary);
        assert!([end.x, end.y, 1.0 - end.x, 1.0 - end.y].iter().any(|d| d.abs() < 1e-6), "{end}");
    }

    #[test]
    fn around_a_cylinder_a_geodesic_returns_to_its_height() {
        let mesh = grid(24, 8, [true, false], |u, v| DVec3::new((TAU * u).cos(), (TAU * u).sin(), 2.0 * v));
        let metric = Metric::new(&mesh);
        let v = VertexId(24 * 4);
        let around = 24.0 * mesh.edge_length(mesh.edge(mesh.vertex_halfedge(v)));
        let along = mesh
            .outgoing(v)
            .find(|&h| mesh.vector(h).z.abs() < 1e-9)
            .and_then(|h| PolarMap::new(&mesh, &metric, v).spokes.iter().find(|s| s.0 == h).map(|s| s.1));
        let trace = trace_geodesic(&mesh, &metric, v, along.unwrap() + 1e-9, around * 0.999);
        assert!((trace.end.position(&mesh).z - 1.0).abs() < 1e-2);
    }
}
