//! Closed curves strung from triangle to triangle through points given: the way to carry a curve where nothing can
//! accompany it.
//!
//! Where a curve turns back within a triangle of the proxy both its legs have the same triangles to one side and the other.
//! Then the triangles that its points lie in still follow each other, or nearly; between two that are not neighbours the
//! way is the shortest. Where it comes back at once, it is cut short. As all that happens near by, the curve is of the same
//! homotopy class.

use std::collections::{HashMap, VecDeque};

use glam::DVec3;

use super::curve::VERTEX_DISTANCE;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve, SurfacePoint, nearest_in_triangle};

/// Triangles among which the way from one to the next point's is looked for.
const AROUND: usize = 200;
/// Points per segment of a line of the proxy that is strung through triangles of the original, which are smaller.
const DENSE: usize = 16;

/// A half-edge crossed on the way from one point to the next, and the middle between these.
type Step = (HalfedgeId, DVec3);

/// The closed curve through points so near to each other that nothing lies between; `None` where they are not, or where
/// nothing is left of it.
pub(super) fn strung(mesh: &TriMesh, points: &[SurfacePoint]) -> Option<SurfaceCurve> {
    let mut steps: VecDeque<Step> = VecDeque::new();
    for (k, p) in points.iter().enumerate() {
        let q = &points[(k + 1) % points.len()];
        let middle = 0.5 * (p.position(mesh) + q.position(mesh));
        for h in way(mesh, p.face, q.face)? {
            match steps.back() {
                Some(last) if mesh.twin(h) == Some(last.0) => drop(steps.pop_back()),
                _ => steps.push_back((h, middle)),
            }
        }
    }
    while steps.len() > 1 && mesh.twin(steps[0].0) == Some(steps[steps.len() - 1].0) {
        steps.pop_front();
        steps.pop_back();
    }
    let crossing = |&(halfedge, near): &Step| {
        let (from, along) = (mesh.position(mesh.origin(halfedge)), mesh.vector(halfedge));
        let t = (near - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        Crossing { halfedge, t: t.clamp(VERTEX_DISTANCE, 1.0 - VERTEX_DISTANCE) }
    };
    let curve = SurfaceCurve { crossings: steps.iter().map(crossing).collect(), closed: true };
    curve.check(mesh).is_ok().then_some(curve)
}

/// The points of a closed line, and between them more.
pub(super) fn dense(mesh: &TriMesh, line: &[(DVec3, FaceId)]) -> impl Iterator<Item = SurfacePoint> {
    let point = move |k: usize| {
        let ((from, face), to) = (line[k / DENSE], line[(k / DENSE + 1) % line.len()].0);
        let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
        let at = from.lerp(to, (k % DENSE) as f64 / DENSE as f64);
        SurfacePoint { face, weights: nearest_in_triangle(at, &corners) }
    };
    (0..DENSE * line.len()).map(point)
}

/// The half-edges crossed on the shortest way from one triangle to another near by.
fn way(mesh: &TriMesh, from: FaceId, to: FaceId) -> Option<Vec<HalfedgeId>> {
    let mut through: HashMap<FaceId, Option<HalfedgeId>> = HashMap::from([(from, None)]);
    let mut queue = VecDeque::from([from]);
    while let Some(f) = queue.pop_front() {
        if f == to {
            let before = |h: &HalfedgeId| through[&mesh.face(*h)];
            let mut way: Vec<HalfedgeId> = std::iter::successors(through[&to], before).collect();
            way.reverse();
            return Some(way);
        }
        if through.len() > AROUND {
            continue;
        }
        for h in mesh.face_halfedges(f) {
            let Some(g) = mesh.twin(h).map(|t| mesh.face(t)) else { continue };
            through.entry(g).or_insert_with(|| {
                queue.push_back(g);
                Some(h)
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, torus};

    const N: u32 = 12;

    /// The points of a row of a torus, and those from one of them straight away and back again.
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
    fn a_curve_comes_back_and_what_turns_back_is_cut_short() {
        let mesh = torus(N, N);
        let halfedges = |curve: &SurfaceCurve| curve.crossings.iter().map(|c| c.halfedge).collect::<Vec<_>>();
        let straight = strung(&mesh, &points(&mesh, false)).unwrap();
        let wanted = halfedges(&row(N, 3, true, 0.4));
        let mut got = halfedges(&straight);
        let first = got.iter().position(|h| *h == wanted[0]).unwrap();
        got.rotate_left(first);
        assert_eq!(got, wanted);
        assert_eq!(halfedges(&strung(&mesh, &points(&mesh, true)).unwrap()), halfedges(&straight));
    }

    #[test]
    fn of_a_curve_that_only_turns_back_nothing_is_left() {
        let mesh = torus(N, N);
        let mut points = points(&mesh, false);
        points.truncate(6);
        assert_eq!(strung(&mesh, &points), None);
        assert_eq!(strung(&mesh, &points[..1]), None);
        assert_eq!(strung(&mesh, &[]), None);
    }
}
