//! Closed curves along shortest dual paths between given triangles: the transfer of curves that cannot be traced.
//!
//! Where a curve turns back within a triangle of the proxy, triangles lie to the left of one part of the curve and to the
//! right of another, and tracing by sides fails. The triangles at the curve's points are still neighbours or nearly so. Here
//! consecutive ones are joined by the shortest path in the dual graph; a path that returns at once through the same
//! edge is shortened. All this is local, so the curve stays in its homotopy class.

use std::collections::VecDeque;

use glam::DVec3;

use super::curve_walk::VERTEX_DISTANCE;
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve, SurfacePoint, nearest_in_triangle};

/// Triangles in which the path from one point's triangle to the next one's is searched.
const SEARCH_FACES: usize = 200;
/// Points per segment of a polyline on the proxy: triangles of the original are smaller than the segments.
const SUBDIVISION: usize = 16;

/// A half-edge crossed between two consecutive points, and their midpoint.
type Step = (HalfedgeId, DVec3);

/// The closed curve through the triangles of points. `None` where the triangles of two consecutive points are too far
/// apart, or where the curve contracts to nothing.
pub(super) fn face_path_curve(mesh: &TriMesh, points: &[SurfacePoint]) -> Option<SurfaceCurve> {
    let mut steps: VecDeque<Step> = VecDeque::new();
    for (k, p) in points.iter().enumerate() {
        let q = &points[(k + 1) % points.len()];
        let midpoint = 0.5 * (p.position(mesh) + q.position(mesh));
        for h in dual_path(mesh, p.face, q.face)? {
            match steps.back() {
                Some(last) if mesh.twin(h) == Some(last.0) => drop(steps.pop_back()),
                _ => steps.push_back((h, midpoint)),
            }
        }
    }
    while steps.len() > 1 && mesh.twin(steps[0].0) == Some(steps[steps.len() - 1].0) {
        steps.pop_front();
        steps.pop_back();
    }
    let crossing = |&(halfedge, midpoint): &Step| {
        let (from, along) = (mesh.position(mesh.origin(halfedge)), mesh.vector(halfedge));
        let t = (midpoint - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        Crossing { halfedge, t: t.clamp(VERTEX_DISTANCE, 1.0 - VERTEX_DISTANCE) }
    };
    let curve = SurfaceCurve { crossings: steps.iter().map(crossing).collect(), closed: true };
    curve.check(mesh).is_ok().then_some(curve)
}

/// The points of a closed polyline with each segment divided into [`SUBDIVISION`] parts.
pub(super) fn subdivided(mesh: &TriMesh, line: &[(DVec3, FaceId)]) -> impl Iterator<Item = SurfacePoint> {
    let point = move |k: usize| {
        let ((from, face), to) = (line[k / SUBDIVISION], line[(k / SUBDIVISION + 1) % line.len()].0);
        let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
        let at = from.lerp(to, (k % SUBDIVISION) as f64 / SUBDIVISION as f64);
        SurfacePoint { face, weights: nearest_in_triangle(at, &corners) }
    };
    (0..SUBDIVISION * line.len()).map(point)
}

/// The half-edges crossed by the shortest dual path from one triangle to another near it.
fn dual_path(mesh: &TriMesh, from: FaceId, to: FaceId) -> Option<Vec<HalfedgeId>> {
    let mut search: BreadthFirst<FaceId, HalfedgeId> = BreadthFirst::sparse();
    search.start(from);
    while let Some(f) = search.visit() {
        if f == to {
            return search.path_to(to, |&h| mesh.face(h));
        }
        if search.reached().len() > SEARCH_FACES {
            continue;
        }
        for (h, g) in mesh.adjacent_faces(f) {
            search.reach(g, h);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, torus};

    const N: u32 = 12;

    /// The points of a row of a torus; if `there_and_back`, with a detour that returns the same way.
    fn points(mesh: &TriMesh, there_and_back: bool) -> Vec<SurfacePoint> {
        let curve = row(N, 3, true, 0.4);
        let mut points: Vec<SurfacePoint> = (0..curve.crossings.len()).map(|i| curve.surface_point(mesh, i)).collect();
        if there_and_back {
            let mut faces = vec![points[5].face];
            for side in [0, 1, 2, 0, 1] {
                let h = mesh.face_halfedges(faces[faces.len() - 1])[side];
                faces.extend(mesh.twin(h).map(|t| mesh.face(t)));
            }
            let there: Vec<FaceId> = faces.iter().chain(faces.iter().rev()).copied().collect();
            let centre = |face| SurfacePoint { face, weights: [1.0 / 3.0; 3] };
            points.splice(6..6, there.into_iter().map(centre));
        }
        points
    }

    #[test]
    fn a_curve_is_restored_and_its_detours_are_removed() {
        let mesh = torus(N, N);
        let halfedges = |curve: &SurfaceCurve| curve.crossings.iter().map(|c| c.halfedge).collect::<Vec<_>>();
        let straight = face_path_curve(&mesh, &points(&mesh, false)).unwrap();
        let wanted = halfedges(&row(N, 3, true, 0.4));
        let mut got = halfedges(&straight);
        let first = got.iter().position(|h| *h == wanted[0]).unwrap();
        got.rotate_left(first);
        assert_eq!(got, wanted);
        assert_eq!(halfedges(&face_path_curve(&mesh, &points(&mesh, true)).unwrap()), halfedges(&straight));
    }

    #[test]
    fn a_curve_that_contracts_to_nothing_is_refused() {
        let mesh = torus(N, N);
        let mut points = points(&mesh, false);
        points.truncate(6);
        assert_eq!(face_path_curve(&mesh, &points), None);
        assert_eq!(face_path_curve(&mesh, &points[..1]), None);
        assert_eq!(face_path_curve(&mesh, &[]), None);
    }
}
