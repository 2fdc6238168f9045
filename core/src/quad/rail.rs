//! Boundary vertices on the boundary of the surface.
//!
//! Every vertex on the boundary has a place on one of the boundary polylines, measured by arc length. It moves
//! along the polyline only, less than half way to the places of its two neighbours, so that their order never
//! changes and every boundary loop stays covered. Vertices on corners of the boundary stay where they are.

use std::collections::HashMap;

use glam::DVec3;

use super::refine::QuadMesh;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// Boundary vertices where the boundary turns by more than this (radians) are corners.
const CORNER: f64 = 0.6;
/// How far towards a neighbour a vertex may go in one move: less than half, as both may move at once.
const REACH: f64 = 0.45;

/// The boundary of the surface and the places of vertices on it.
#[derive(Debug, Clone)]
pub(super) struct Rail {
    loops: Vec<Track>,
    places: HashMap<u32, Place>,
}

/// A boundary polyline in the direction of its half-edges.
#[derive(Debug, Clone)]
struct Track {
    points: Vec<DVec3>,
    faces: Vec<u32>,
    /// Arc length up to each point; one more entry holds the whole length.
    along: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Place {
    track: u32,
    s: f64,
    /// The vertices before and after on the boundary.
    ends: [u32; 2],
    fixed: bool,
}

impl Rail {
    pub(super) fn new(mesh: &QuadMesh, base: &TriMesh) -> Self {
        let mut loops = Vec::new();
        let mut number: HashMap<HalfedgeId, (u32, u32)> = HashMap::new();
        for start in base.halfedges().filter(|&h| base.twin(h).is_none()) {
            if number.contains_key(&start) {
                continue;
            }
            let mut track = Track { points: Vec::new(), faces: Vec::new(), along: vec![0.0] };
            let mut h = start;
            while !number.contains_key(&h) {
                number.insert(h, (loops.len() as u32, track.points.len() as u32));
                track.points.push(base.position(base.origin(h)));
                track.faces.push(base.face(h).0);
                track.along.push(track.along[track.along.len() - 1] + base.vector(h).length().max(1e-12));
                h = base.vertex_halfedge(base.target(h));
            }
            loops.push(track);
        }
        let mut places = HashMap::new();
        for (v, ends) in neighbours(mesh) {
            let (p, f) = (mesh.positions[v as usize], mesh.base_face[v as usize]);
            let Some((h, t)) = nearest(base, p, f) else { continue };
            let (track, k) = number[&h];
            let on = &loops[track as usize];
            let s = on.along[k as usize] + t * (on.along[k as usize + 1] - on.along[k as usize]);
            let corner = if t < 0.5 { base.origin(h) } else { base.target(h) };
            let fixed = is_corner(base, corner) && base.position(corner).distance_squared(p) < 1e-18;
            places.insert(v, Place { track, s, ends, fixed });
        }
        Self { loops, places }
    }

    /// Whether vertex `v` lies on the boundary.
    pub(super) fn holds(&self, v: u32) -> bool {
        self.places.contains_key(&v)
    }

    /// Whether vertex `v` may not move.
    pub(super) fn is_fixed(&self, v: u32) -> bool {
        self.places.get(&v).is_some_and(|p| p.fixed)
    }

    /// The point of boundary vertex `v` on the boundary, and its triangle.
    pub(super) fn place(&self, v: u32) -> Option<(DVec3, u32)> {
        let place = self.places.get(&v)?;
        let (_, at, face) = self.loops[place.track as usize].nearest(DVec3::ZERO, place.s, place.s);
        Some((at, face))
    }

    /// The place within reach of boundary vertex `v` that is nearest to `wanted`: its arc length, point and
    /// triangle.
    pub(super) fn slide(&self, v: u32, wanted: DVec3) -> Option<(f64, DVec3, u32)> {
        let place = self.places.get(&v)?;
        let track = &self.loops[place.track as usize];
        let total = track.along[track.points.len()];
        let s_of = |w: u32| self.places.get(&w).filter(|p| p.track == place.track).map(|p| p.s);
        let back = s_of(place.ends[0]).map_or(0.0, |s| (place.s - s).rem_euclid(total));
        let onward = s_of(place.ends[1]).map_or(0.0, |s| (s - place.s).rem_euclid(total));
        Some(track.nearest(wanted, place.s - REACH * back, place.s + REACH * onward))
    }

    /// Notes that boundary vertex `v` has gone to arc length `s`.
    pub(super) fn put(&mut self, v: u32, s: f64) {
        if let Some(place) = self.places.get_mut(&v) {
            let track = &self.loops[place.track as usize];
            place.s = s.rem_euclid(track.along[track.points.len()]);
        }
    }
}

impl Track {
    /// The point nearest to `wanted` between two arc lengths, `low` up to a whole turn below `high`.
    fn nearest(&self, wanted: DVec3, low: f64, high: f64) -> (f64, DVec3, u32) {
        let n = self.points.len();
        let total = self.along[n];
        let shift = (low / total).floor();
        let mut k = self.along[1..n].partition_point(|&s| s <= low - shift * total);
        let mut offset = shift * total;
        let mut best = (f64::INFINITY, low, self.points[k], self.faces[k]);
        while offset + self.along[k] <= high {
            let (a, b) = (self.points[k], self.points[(k + 1) % n]);
            let (from, to) = (offset + self.along[k], offset + self.along[k + 1]);
            let t = (wanted - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE);
            let s = (from + t * (to - from)).clamp(from.max(low), to.min(high).max(low));
            let p = a.lerp(b, ((s - from) / (to - from)).clamp(0.0, 1.0));
            let d = p.distance_squared(wanted);
            if d < best.0 {
                best = (d, s, p, self.faces[k]);
            }
            k += 1;
            if k == n {
                k = 0;
                offset += total;
            }
        }
        (best.1, best.2, best.3)
    }
}

/// The vertices on the boundary, in increasing order, each with those before and after it.
fn neighbours(mesh: &QuadMesh) -> Vec<(u32, [u32; 2])> {
    let sides = || mesh.quads.iter().flat_map(|q| (0..4).map(|k| (q[k], q[(k + 1) % 4])));
    let directed: std::collections::HashSet<(u32, u32)> = sides().collect();
    let mut ends = vec![[u32::MAX; 2]; mesh.positions.len()];
    for (a, b) in sides().filter(|&(a, b)| !directed.contains(&(b, a))) {
        ends[a as usize][1] = b;
        ends[b as usize][0] = a;
    }
    (0..).zip(ends).filter(|(_, e)| e[0] != u32::MAX && e[1] != u32::MAX).collect()
}

fn is_corner(base: &TriMesh, v: VertexId) -> bool {
    let angle: f64 = base.outgoing(v).map(|h| base.corner_angle(h)).sum();
    (std::f64::consts::PI - angle).abs() > CORNER
}

/// The boundary half-edge nearest to a point on the boundary, among those at the corners of its triangle, and
/// how far along it the point is.
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
