//! Boundary vertices of a quad mesh, constrained to the boundary of the surface.
//!
//! Every boundary vertex has an arc length on one of the boundary loops. It moves along the loop only, less than half
//! way towards its two neighbours, so their order does not change and the quads cover the whole loop. Vertices at
//! corners of the boundary do not move.

use std::collections::HashMap;

use glam::DVec3;

use super::quad_mesh::QuadMesh;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Turning of the boundary (radians) above which a boundary vertex is a corner.
const CORNER: f64 = 0.6;
/// Greatest move of a vertex, as a fraction of the way to its neighbour; less than half, since both may move at once.
const REACH: f64 = 0.45;
/// Greatest squared distance, in squared units of the mesh, of a quad mesh vertex from a corner of the boundary to be fixed
/// there.
const AT_CORNER: f64 = 1e-18;
/// Least length of a boundary edge, in units of the mesh, so that arc length increases strictly.
const LEAST_EDGE: f64 = 1e-12;

/// The boundary loops of the surface and the places of quad mesh vertices on them.
#[derive(Debug, Clone)]
pub(super) struct Boundary {
    loops: Vec<BoundaryLoop>,
    places: HashMap<u32, Place>,
}

/// A boundary loop in the direction of its half-edges.
#[derive(Debug, Clone)]
struct BoundaryLoop {
    points: Vec<DVec3>,
    faces: Vec<u32>,
    /// Arc length at each point; the last of `points.len() + 1` entries is the total length.
    arc_length: Vec<f64>,
}

/// A point of a boundary loop.
pub(super) struct BoundaryPoint {
    /// Arc length on the loop.
    pub s: f64,
    pub position: DVec3,
    /// Triangle of the surface at the point.
    pub face: u32,
}

/// The place of a vertex on the boundary.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Index of the loop.
    on: u32,
    s: f64,
    /// The vertices before and after on the boundary.
    neighbours: [u32; 2],
    fixed: bool,
}

impl Boundary {
    /// The boundary of `base` with the boundary vertices of `mesh` at the nearest places.
    pub(super) fn new(mesh: &QuadMesh, base: &TriMesh) -> Self {
        let (loops, index) = boundary_loops(base);
        let mut places = HashMap::new();
        for (v, neighbours) in boundary_neighbours(mesh) {
            let (p, f) = (mesh.positions[v as usize], mesh.base_face[v as usize]);
            let Some((h, t)) = nearest(base, p, f) else { continue };
            let (on, k) = index[&h];
            let along = &loops[on as usize].arc_length;
            let s = along[k as usize] + t * (along[k as usize + 1] - along[k as usize]);
            let corner = if t < 0.5 { base.origin(h) } else { base.target(h) };
            let fixed = is_corner(base, corner) && base.position(corner).distance_squared(p) < AT_CORNER;
            places.insert(v, Place { on, s, neighbours, fixed });
        }
        Self { loops, places }
    }

    /// Whether vertex `v` lies on the boundary.
    pub(super) fn contains(&self, v: u32) -> bool {
        self.places.contains_key(&v)
    }

    /// Whether vertex `v` may not move.
    pub(super) fn is_fixed(&self, v: u32) -> bool {
        self.places.get(&v).is_some_and(|p| p.fixed)
    }

    /// The place of boundary vertex `v`; `None` for inner vertices.
    pub(super) fn place(&self, v: u32) -> Option<BoundaryPoint> {
        let place = self.places.get(&v)?;
        Some(self.loops[place.on as usize].nearest(DVec3::ZERO, place.s, place.s))
    }

    /// The point nearest to `wanted` that boundary vertex `v` may move to; `None` for inner vertices.
    pub(super) fn nearest_allowed(&self, v: u32, wanted: DVec3) -> Option<BoundaryPoint> {
        let place = self.places.get(&v)?;
        let on = &self.loops[place.on as usize];
        let total = on.total();
        let arc_length = |w: u32| self.places.get(&w).filter(|p| p.on == place.on).map(|p| p.s);
        let back = arc_length(place.neighbours[0]).map_or(0.0, |s| (place.s - s).rem_euclid(total));
        let onward = arc_length(place.neighbours[1]).map_or(0.0, |s| (s - place.s).rem_euclid(total));
        Some(on.nearest(wanted, place.s - REACH * back, place.s + REACH * onward))
    }

    /// Moves boundary vertex `v` to arc length `s`.
    pub(super) fn move_to(&mut self, v: u32, s: f64) {
        if let Some(place) = self.places.get_mut(&v) {
            place.s = s.rem_euclid(self.loops[place.on as usize].total());
        }
    }
}

impl BoundaryLoop {
    fn total(&self) -> f64 {
        self.arc_length[self.points.len()]
    }

    /// The point nearest to `wanted` between two arc lengths; `low` is at most a whole turn below `high`.
    fn nearest(&self, wanted: DVec3, low: f64, high: f64) -> BoundaryPoint {
        let n = self.points.len();
        let total = self.total();
        let turns = (low / total).floor();
        let mut k = self.arc_length[1..n].partition_point(|&s| s <= low - turns * total);
        let mut offset = turns * total;
        let mut least = f64::INFINITY;
        let mut best = BoundaryPoint { s: low, position: self.points[k], face: self.faces[k] };
        while offset + self.arc_length[k] <= high {
            let (a, b) = (self.points[k], self.points[(k + 1) % n]);
            let (from, to) = (offset + self.arc_length[k], offset + self.arc_length[k + 1]);
            let t = (wanted - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE);
            let s = (from + t * (to - from)).clamp(from.max(low), to.min(high).max(low));
            let position = a.lerp(b, ((s - from) / (to - from)).clamp(0.0, 1.0));
            let distance = position.distance_squared(wanted);
            if distance < least {
                least = distance;
                best = BoundaryPoint { s, position, face: self.faces[k] };
            }
            k += 1;
            if k == n {
                k = 0;
                offset += total;
            }
        }
        best
    }
}

/// The boundary loops of a surface, and for each boundary half-edge the index of its loop and its index there.
fn boundary_loops(base: &TriMesh) -> (Vec<BoundaryLoop>, HashMap<HalfedgeId, (u32, u32)>) {
    let mut loops = Vec::new();
    let mut index: HashMap<HalfedgeId, (u32, u32)> = HashMap::new();
    for start in base.halfedges().filter(|&h| base.twin(h).is_none()) {
        if index.contains_key(&start) {
            continue;
        }
        let mut new = BoundaryLoop { points: Vec::new(), faces: Vec::new(), arc_length: vec![0.0] };
        let mut h = start;
        while !index.contains_key(&h) {
            index.insert(h, (loops.len() as u32, new.points.len() as u32));
            new.points.push(base.position(base.origin(h)));
            new.faces.push(base.face(h).0);
            new.arc_length.push(new.arc_length[new.arc_length.len() - 1] + base.vector(h).length().max(LEAST_EDGE));
            h = base.vertex_halfedge(base.target(h));
        }
        loops.push(new);
    }
    (loops, index)
}

/// The boundary vertices in order of ids, each with the vertices before and after it on the boundary.
fn boundary_neighbours(mesh: &QuadMesh) -> Vec<(u32, [u32; 2])> {
    let sides = || mesh.quads.iter().flat_map(|q| (0..4).map(|k| (q[k], q[(k + 1) % 4])));
    let directed: std::collections::HashSet<(u32, u32)> = sides().collect();
    let mut ends = vec![[u32::MAX; 2]; mesh.positions.len()];
    for (a, b) in sides().filter(|&(a, b)| !directed.contains(&(b, a))) {
        ends[a as usize][1] = b;
        ends[b as usize][0] = a;
    }
    (0..).zip(ends).filter(|(_, e)| e[0] != u32::MAX && e[1] != u32::MAX).collect()
}

/// Whether the boundary turns by more than [`CORNER`] at a vertex.
fn is_corner(base: &TriMesh, v: VertexId) -> bool {
    let angle: f64 = base.outgoing(v).map(|h| base.corner_angle(h)).sum();
    (std::f64::consts::PI - angle).abs() > CORNER
}

/// The boundary half-edge nearest to a point of triangle `f`, among those at the corners of the triangle, and the
/// parameter of the nearest point on it. `None` if there is none.
fn nearest(base: &TriMesh, p: DVec3, f: u32) -> Option<(HalfedgeId, f64)> {
    let around = base.face_vertices(FaceId(f)).into_iter().filter(|&v| base.is_boundary_vertex(v));
    let edges = around.flat_map(|v| {
        let last = base.outgoing(v).last();
        [Some(base.vertex_halfedge(v)), last.map(|h| base.prev(h))].into_iter().flatten()
    });
    let fractions = edges.map(|h| {
        let (a, e) = (base.position(base.origin(h)), base.vector(h));
        let t = ((p - a).dot(e) / e.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (h, t, (a + e * t).distance_squared(p))
    });
    fractions.min_by(|a, b| a.2.total_cmp(&b.2)).map(|(h, t, _)| (h, t))
}
