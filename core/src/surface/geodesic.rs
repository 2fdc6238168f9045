//! Geodesics between two vertices inside a part of the surface.
//!
//! Dijkstra over the midpoints of edges finds a strip of triangles from start to end. The shortest path in this strip,
//! unfolded to the plane, is found by the funnel algorithm ([`funnel`](super::funnel)); it bends only at vertices of
//! the strip's boundary. Where the fan of such a vertex on the other side of the path is allowed and narrower than π,
//! the strip is replaced by that fan, which shortens the path (like the edge flips of Sharp and Crane 2020). This is
//! repeated until no such vertex is left. The result is a geodesic, locally shortest; a shorter one may exist
//! elsewhere.

use std::f64::consts::PI;

use super::funnel::{Bend, UnfoldedStrip};
use super::vertex_fan::{Side, spokes_across};
use super::vertex_path::{VertexPath, joined_by_edge};
use crate::mesh::{Dijkstra, FaceId, HalfedgeId, TriMesh, VertexId};

/// A fan is used only if it is narrower than π by this (radians); far above rounding, so that the loop ends.
const MIN_BEND: f64 = 1e-7;

/// A geodesic from `start` to `end` through triangles that are `allowed`; `None` if there is none, or if both are
/// one vertex.
///
/// It passes the vertices at which it bends (on the boundary of the allowed part, or with an angle sum of more than 2π)
/// at a distance of a thousandth of an edge.
pub fn geodesic_in(
    mesh: &TriMesh,
    start: VertexId,
    end: VertexId,
    allowed: impl Fn(FaceId) -> bool,
) -> Option<VertexPath> {
    if start == end {
        return None;
    }
    if joined_by_edge(mesh, start, end, &allowed) {
        return Some(VertexPath { start, end, crossings: Vec::new() });
    }
    let mut strip = midpoint_strip(mesh, start, end, &allowed)?;
    // Each pass shortens the path, so the loop ends. The bound, far above the passes needed, is a safeguard against rounding.
    let mut passes = 20 * strip.len() + 100;
    loop {
        trim(mesh, start, end, &mut strip);
        if strip.is_empty() {
            // One triangle holds both ends.
            return Some(VertexPath { start, end, crossings: Vec::new() });
        }
        let unfolded = UnfoldedStrip::new(mesh, &strip);
        let bends = unfolded.shortest_path();
        if passes == 0 || !reroute(mesh, &mut strip, &unfolded, &bends, &allowed) {
            return Some(VertexPath { start, end, crossings: unfolded.crossings(&strip, &bends) });
        }
        passes -= 1;
    }
}

/// The half-edges crossed by the shortest path over midpoints of edges.
fn midpoint_strip(
    mesh: &TriMesh,
    start: VertexId,
    end: VertexId,
    allowed: &impl Fn(FaceId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let midpoint = |h| 0.5 * (mesh.position(mesh.origin(h)) + mesh.position(mesh.target(h)));
    let mut search: Dijkstra<HalfedgeId, HalfedgeId> = Dijkstra::new(mesh.n_halfedges());
    for out in mesh.outgoing(start).filter(|&h| allowed(mesh.face(h))) {
        let h = mesh.next(out);
        search.start(h, midpoint(h).distance(mesh.position(start)));
    }
    let mut best: Option<(f64, HalfedgeId)> = None;
    while let Some((h, d)) = search.settle() {
        if best.is_some_and(|b| b.0 <= d) {
            break;
        }
        let Some(entered) = mesh.twin(h).filter(|&g| allowed(mesh.face(g))) else { continue };
        if mesh.opposite(entered) == end {
            let total = d + midpoint(h).distance(mesh.position(end));
            if best.is_none_or(|b| total < b.0) {
                best = Some((total, h));
            }
        }
        for next in [mesh.next(entered), mesh.prev(entered)] {
            search.reach(next, d + midpoint(h).distance(midpoint(next)), h);
        }
    }
    let last = best?.1;
    let mut strip = search.path_to(last, |&h| h)?;
    strip.push(last);
    Some(strip)
}

/// Removes pairs of crossings of one edge in both directions, then the crossings up to the last edge at the start and
/// from the first edge at the end.
fn trim(mesh: &TriMesh, start: VertexId, end: VertexId, strip: &mut Vec<HalfedgeId>) {
    let mut kept: Vec<HalfedgeId> = Vec::with_capacity(strip.len());
    for &h in strip.iter() {
        if kept.last().is_some_and(|&k| mesh.twin(k) == Some(h)) {
            kept.pop();
        } else {
            kept.push(h);
        }
    }
    *strip = kept;
    let touches = |h: HalfedgeId, v| mesh.origin(h) == v || mesh.target(h) == v;
    if let Some(i) = strip.iter().rposition(|&h| touches(h, start)) {
        strip.drain(..=i);
    }
    if let Some(i) = strip.iter().position(|&h| touches(h, end)) {
        strip.truncate(i);
    }
}

/// Replaces the part of the strip at the first bend that allows it by the fan on the other side of the bend; `false` if
/// no bend does.
fn reroute(
    mesh: &TriMesh,
    strip: &mut Vec<HalfedgeId>,
    unfolded: &UnfoldedStrip,
    bends: &[Bend],
    allowed: &impl Fn(FaceId) -> bool,
) -> bool {
    for (k, c) in bends.iter().enumerate() {
        let h = strip[c.first];
        let v = if c.side == Side::Left { mesh.target(h) } else { mesh.origin(h) };
        if mesh.is_boundary_vertex(v) {
            continue;
        }
        let from = if k == 0 { unfolded.start } else { bends[k - 1].point };
        let to = bends.get(k + 1).map_or(unfolded.end, |c| c.point);
        let total: f64 = mesh.outgoing(v).map(|h| mesh.corner_angle(h)).sum();
        if total - unfolded.swept(c, from, to) > PI - MIN_BEND {
            continue;
        }
        let Some(entered) = mesh.twin(strip[c.last]) else { continue };
        let Some(mut spokes) = spokes_across(mesh, h, mesh.face(entered), c.side) else { continue };
        // A path that starts or ends on a spoke does not cross it.
        if c.first == 0 && !spokes.is_empty() {
            spokes.remove(0);
        }
        if c.last + 1 == strip.len() {
            spokes.pop();
        }
        let open = |&h: &HalfedgeId| allowed(mesh.face(h)) && mesh.twin(h).is_some_and(|g| allowed(mesh.face(g)));
        if spokes.is_empty() && (c.first == 0 || c.last + 1 == strip.len()) || !spokes.iter().all(open) {
            continue;
        }
        strip.splice(c.first..=c.last, spokes);
        return true;
    }
    false
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::curve::{Crossing, CurveError};
    use super::super::testing::{Random, cylinder, real_mesh};
    use super::*;

    /// A flat square of `n` by `n` cells with random diagonals; inner vertices are displaced by up to `jitter` cells.
    fn plane(n: usize, jitter: f64) -> TriMesh {
        let mut random = Random(9);
        let mut positions = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let mut at = |k: usize| {
                    let displacement = 2.0 * jitter * (random.unit() - 0.5);
                    (k as f64 + if k == 0 || k == n { 0.0 } else { displacement }) / n as f64
                };
                positions.push(DVec3::new(at(i), at(j), 0.0));
            }
        }
        let mut faces = Vec::new();
        for j in 0..n {
            for i in 0..n {
                let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let diagonal = random.unit() < 0.5;
                faces.extend(if diagonal { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
            }
        }
        TriMesh::from_faces(positions, &faces).unwrap()
    }

    #[test]
    fn in_the_plane_geodesics_are_straight() {
        let mesh = plane(24, 0.3);
        let mut random = Random(1);
        for _ in 0..300 {
            let [a, b] = [0; 2].map(|_| VertexId::new(random.below(mesh.n_vertices())));
            let Some(path) = geodesic_in(&mesh, a, b, |_| true) else {
                assert_eq!(a, b);
                continue;
            };
            assert_eq!(path.check(&mesh), Ok(()));
            let straight = mesh.position(a).distance(mesh.position(b));
            // Vertices on the straight line are passed at a thousandth of an edge.
            assert!(
                (path.length(&mesh) / straight - 1.0).abs() < 1e-4,
                "{a:?} {b:?} {}",
                path.length(&mesh) / straight
            );
        }
    }

    #[test]
    fn a_geodesic_goes_around_a_forbidden_region() {
        let mesh = plane(20, 0.0);
        // A forbidden band at half the width that leaves the uppermost tenth open.
        let centre = |f: FaceId| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
        let allowed = |f: FaceId| {
            let c = centre(f);
            !(c.x > 0.45 && c.x < 0.55 && c.y < 0.9)
        };
        let path = geodesic_in(&mesh, VertexId(0), VertexId(20), allowed).unwrap();
        assert_eq!(path.check(&mesh), Ok(()));
        assert!(path.faces(&mesh).into_iter().all(allowed));
        let shortest = 2.0 * (0.45f64 * 0.45 + 0.81).sqrt() + 0.1;
        assert!((path.length(&mesh) / shortest - 1.0).abs() < 1e-3, "{} {shortest}", path.length(&mesh));
        let closed = |f: FaceId| (centre(f).x - 0.5).abs() > 0.05;
        assert_eq!(geodesic_in(&mesh, VertexId(0), VertexId(20), closed), None);
    }

    #[test]
    fn adjacent_vertices_are_joined_by_their_edge() {
        let mesh = plane(4, 0.0);
        let path = geodesic_in(&mesh, VertexId(6), VertexId(7), |_| true).unwrap();
        assert!(path.crossings.is_empty() && path.check(&mesh).is_ok());
        assert_eq!(geodesic_in(&mesh, VertexId(6), VertexId(6), |_| true), None);
        let wrong = VertexPath { start: VertexId(0), end: VertexId(24), crossings: Vec::new() };
        assert_eq!(wrong.check(&mesh), Err(CurveError::TooShort { count: 0 }));
    }

    #[test]
    fn on_a_cylinder_a_geodesic_has_the_length_of_the_unrolled_line() {
        let mesh = cylinder(60, 30, 0.2);
        for (a, b) in [(0, 60 * 20 + 20), (60 * 3 + 5, 60 * 28 + 30), (60 * 30 + 59, 14)] {
            let [p, q] = [a, b].map(|i| mesh.positions()[i]);
            let mut turn = (p.y.atan2(p.x) - q.y.atan2(q.x)).abs();
            turn = turn.min(2.0 * PI - turn);
            let smooth = (0.25 * turn).hypot(p.z - q.z);
            let path = geodesic_in(&mesh, VertexId::new(a), VertexId::new(b), |_| true).unwrap();
            assert_eq!(path.check(&mesh), Ok(()));
            assert!((path.length(&mesh) / smooth - 1.0).abs() < 5e-3, "{} {smooth}", path.length(&mesh));
        }
    }

    #[test]
    fn on_real_meshes_geodesics_are_valid_and_no_longer_than_midpoint_paths() {
        for file in ["rockerarm_5k.obj", "bunny_7k.off", "cad_upright_slivers.off"] {
            let Some(mesh) = real_mesh(file) else { continue };
            let mut random = Random(4);
            for _ in 0..40 {
                let [a, b] = [0; 2].map(|_| VertexId::new(random.below(mesh.n_vertices())));
                let Some(path) = geodesic_in(&mesh, a, b, |_| true) else { continue };
                assert_eq!(path.check(&mesh), Ok(()));
                let Some(strip) = midpoint_strip(&mesh, a, b, &|_| true) else { continue };
                let crossings = strip.into_iter().map(|halfedge| Crossing { halfedge, t: 0.5 }).collect();
                let midpoints = VertexPath { start: a, end: b, crossings };
                assert!(path.length(&mesh) <= midpoints.length(&mesh) * (1.0 + 1e-3));
            }
        }
    }
}
