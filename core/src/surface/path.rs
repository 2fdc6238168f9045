//! Shortest paths between two vertices inside a part of the surface, as lists of crossed edges.
//!
//! Dijkstra over the midpoints of edges finds a strip of triangles from start to end. Unfolded to the plane, the
//! strip holds one shortest path, pulled taut by the funnel algorithm (Lee and Preparata 1984); it bends only
//! at vertices on the rim of the strip. Where the fan of such a vertex on the other side of the path is allowed
//! and narrower than π, the strip is led around there, which shortens the path (as flipping edges out of the
//! way does: Sharp and Crane 2020); until no such vertex is left the path is pulled again. The result is a
//! geodesic of the allowed part, in general the shortest near the one found on midpoints.

mod funnel;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

use super::relax::{Side, spokes_across};
use super::{Crossing, CurveError};
use funnel::{Corner, Unfolded};

/// A fan must be narrower than π by this (radians) to be worth a change of strip; far above rounding.
const MIN_BEND: f64 = 1e-7;

/// A path between two vertices that passes no vertex in between.
///
/// `start` is the corner opposite to the first half-edge crossed, `end` the corner opposite to the twin of the
/// last. Without crossings, start and end are joined by a mesh edge, and the path is this edge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VertexPath {
    /// Where the path starts.
    pub start: VertexId,
    /// Where it ends.
    pub end: VertexId,
    /// The crossings in order, each on the half-edge of the triangle that is left.
    pub crossings: Vec<Crossing>,
}

impl VertexPath {
    /// The points from start to end.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        let at =
            |c: &Crossing| mesh.position(mesh.origin(c.halfedge)).lerp(mesh.position(mesh.target(c.halfedge)), c.t);
        let mut points = vec![mesh.position(self.start)];
        points.extend(self.crossings.iter().map(at));
        points.push(mesh.position(self.end));
        points
    }

    /// Length on the mesh.
    pub fn length(&self, mesh: &TriMesh) -> f64 {
        self.points(mesh).windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    /// The triangles passed, in order; none for a path along an edge.
    pub fn faces(&self, mesh: &TriMesh) -> Vec<FaceId> {
        let last = self.crossings.last().and_then(|c| mesh.twin(c.halfedge));
        self.crossings.iter().map(|c| c.halfedge).chain(last).map(|h| mesh.face(h)).collect()
    }

    /// Checks that the path lies on `mesh`: known edges, inner parameters, consecutive crossings in one
    /// triangle, start and end where they belong.
    ///
    /// # Errors
    ///
    /// The first crossing that violates this; for a path without crossings between vertices that no edge joins,
    /// [`CurveError::TooShort`].
    pub fn check(&self, mesh: &TriMesh) -> Result<(), CurveError> {
        let (Some(first), Some(last)) = (self.crossings.first(), self.crossings.last()) else {
            let known = self.start.index() < mesh.n_vertices() && self.end.index() < mesh.n_vertices();
            let joined = known && joining_edge(mesh, self.start, self.end, &|_| true);
            return if joined { Ok(()) } else { Err(CurveError::TooShort { count: 0 }) };
        };
        let mut entered: Option<HalfedgeId> = None;
        for (crossing, c) in self.crossings.iter().enumerate() {
            if c.halfedge.index() >= mesh.n_halfedges() {
                return Err(CurveError::UnknownHalfedge { crossing });
            }
            if !(c.t > 0.0 && c.t < 1.0) {
                return Err(CurveError::OutsideEdge { crossing });
            }
            if entered.is_some_and(|e| mesh.face(e) != mesh.face(c.halfedge) || e == c.halfedge) {
                return Err(CurveError::Disconnected { crossing });
            }
            entered = Some(mesh.twin(c.halfedge).ok_or(CurveError::Boundary { crossing })?);
        }
        let end = mesh.twin(last.halfedge).map(|h| mesh.opposite(h));
        if mesh.opposite(first.halfedge) != self.start {
            return Err(CurveError::Disconnected { crossing: 0 });
        }
        if end != Some(self.end) {
            return Err(CurveError::Disconnected { crossing: self.crossings.len() - 1 });
        }
        Ok(())
    }
}

/// A geodesic from `start` to `end` through triangles that are `allowed`; `None` if there is none, or if both are
/// one vertex.
///
/// It passes vertices that it bends around (on the rim of the allowed part, or of more than 2π) at a thousandth
/// of an edge.
pub fn geodesic_in(
    mesh: &TriMesh,
    start: VertexId,
    end: VertexId,
    allowed: impl Fn(FaceId) -> bool,
) -> Option<VertexPath> {
    if start == end {
        return None;
    }
    if joining_edge(mesh, start, end, &allowed) {
        return Some(VertexPath { start, end, crossings: Vec::new() });
    }
    let mut strip = midpoint_strip(mesh, start, end, &allowed)?;
    // Each pass shortens the path, so it ends by itself; the bound is for rounding.
    let mut passes = 20 * strip.len() + 100;
    loop {
        trim(mesh, start, end, &mut strip);
        if strip.is_empty() {
            // One triangle holds both ends.
            return Some(VertexPath { start, end, crossings: Vec::new() });
        }
        let unfolded = Unfolded::new(mesh, &strip);
        let corners = unfolded.pull();
        if passes == 0 || !pass_one(mesh, &mut strip, &unfolded, &corners, &allowed) {
            return Some(VertexPath { start, end, crossings: unfolded.crossings(&strip, &corners) });
        }
        passes -= 1;
    }
}

/// Whether an edge at an allowed triangle joins two vertices.
fn joining_edge(mesh: &TriMesh, a: VertexId, b: VertexId, allowed: &impl Fn(FaceId) -> bool) -> bool {
    mesh.outgoing(a).any(|h| (mesh.target(h) == b || mesh.opposite(h) == b) && allowed(mesh.face(h)))
}

/// A distance in a queue, ordered as numbers are.
#[derive(PartialEq)]
struct Distance(f64);

impl Eq for Distance {}

impl PartialOrd for Distance {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Distance {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The half-edges crossed on a shortest way over midpoints.
fn midpoint_strip(
    mesh: &TriMesh,
    start: VertexId,
    end: VertexId,
    allowed: &impl Fn(FaceId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let middle = |h| 0.5 * (mesh.position(mesh.origin(h)) + mesh.position(mesh.target(h)));
    let mut distance = vec![f64::INFINITY; mesh.n_halfedges()];
    let mut parent: Vec<Option<HalfedgeId>> = vec![None; mesh.n_halfedges()];
    let mut queue = BinaryHeap::new();
    for out in mesh.outgoing(start).filter(|&h| allowed(mesh.face(h))) {
        let h = mesh.next(out);
        distance[h.index()] = middle(h).distance(mesh.position(start));
        queue.push(Reverse((Distance(distance[h.index()]), h)));
    }
    let mut best: Option<(f64, HalfedgeId)> = None;
    while let Some(Reverse((Distance(d), h))) = queue.pop() {
        if best.is_some_and(|b| b.0 <= d) {
            break;
        }
        let Some(entered) = mesh.twin(h).filter(|&g| d <= distance[h.index()] && allowed(mesh.face(g))) else {
            continue;
        };
        if mesh.opposite(entered) == end {
            let total = d + middle(h).distance(mesh.position(end));
            if best.is_none_or(|b| total < b.0) {
                best = Some((total, h));
            }
        }
        for next in [mesh.next(entered), mesh.prev(entered)] {
            let there = d + middle(h).distance(middle(next));
            if there < distance[next.index()] {
                distance[next.index()] = there;
                parent[next.index()] = Some(h);
                queue.push(Reverse((Distance(there), next)));
            }
        }
    }
    let mut strip: Vec<HalfedgeId> = std::iter::successors(Some(best?.1), |h| parent[h.index()]).collect();
    strip.reverse();
    Some(strip)
}

/// Takes back what runs to and fro, and cuts off what comes before the last visit to the start and after the
/// first one to the end.
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

/// Leads the strip around the first corner that allows it; `false` where none does.
fn pass_one(
    mesh: &TriMesh,
    strip: &mut Vec<HalfedgeId>,
    unfolded: &Unfolded,
    corners: &[Corner],
    allowed: &impl Fn(FaceId) -> bool,
) -> bool {
    for (k, c) in corners.iter().enumerate() {
        let h = strip[c.first];
        let v = if c.side == Side::Left { mesh.target(h) } else { mesh.origin(h) };
        if mesh.is_boundary_vertex(v) {
            continue;
        }
        let from = if k == 0 { unfolded.start } else { corners[k - 1].point };
        let to = corners.get(k + 1).map_or(unfolded.end, |c| c.point);
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
    use super::super::relax::testing::{Random, cylinder, real_mesh};
    use super::*;

    /// A flat square of `n` by `n` cells, vertices shaken, with random diagonals.
    fn plane(n: usize, jitter: f64) -> TriMesh {
        let mut random = Random(9);
        let mut positions = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let mut at = |k: usize| {
                    let shake = 2.0 * jitter * (random.unit() - 0.5);
                    (k as f64 + if k == 0 || k == n { 0.0 } else { shake }) / n as f64
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
    fn in_the_plane_paths_are_straight() {
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
            // Vertices exactly on the way are passed at a thousandth of an edge.
            assert!(
                (path.length(&mesh) / straight - 1.0).abs() < 1e-4,
                "{a:?} {b:?} {}",
                path.length(&mesh) / straight
            );
        }
    }

    #[test]
    fn a_wall_is_walked_around() {
        let mesh = plane(20, 0.0);
        // A wall at half the width that leaves the uppermost tenth open.
        let center = |f: FaceId| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
        let allowed = |f: FaceId| {
            let c = center(f);
            !(c.x > 0.45 && c.x < 0.55 && c.y < 0.9)
        };
        let path = geodesic_in(&mesh, VertexId(0), VertexId(20), allowed).unwrap();
        assert_eq!(path.check(&mesh), Ok(()));
        assert!(path.faces(&mesh).into_iter().all(allowed));
        let shortest = 2.0 * (0.45f64 * 0.45 + 0.81).sqrt() + 0.1;
        assert!((path.length(&mesh) / shortest - 1.0).abs() < 1e-3, "{} {shortest}", path.length(&mesh));
        let closed = |f: FaceId| (center(f).x - 0.5).abs() > 0.05;
        assert_eq!(geodesic_in(&mesh, VertexId(0), VertexId(20), closed), None);
    }

    #[test]
    fn neighbours_are_joined_by_their_edge() {
        let mesh = plane(4, 0.0);
        let path = geodesic_in(&mesh, VertexId(6), VertexId(7), |_| true).unwrap();
        assert!(path.crossings.is_empty() && path.check(&mesh).is_ok());
        assert_eq!(geodesic_in(&mesh, VertexId(6), VertexId(6), |_| true), None);
        let wrong = VertexPath { start: VertexId(0), end: VertexId(24), crossings: Vec::new() };
        assert_eq!(wrong.check(&mesh), Err(CurveError::TooShort { count: 0 }));
    }

    #[test]
    fn around_a_cylinder_the_way_is_that_of_the_unrolled() {
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
    fn on_real_meshes_paths_are_valid_and_no_longer_than_edge_paths() {
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
