//! Improvement of triangles by edge flips and vertex shifts.
//!
//! Flips make the mesh Delaunay where that keeps the shape of the surface. A vertex is shifted towards the centroid of
//! its star (as in Lloyd's relaxation): it is replaced by the tracked vertex of the original nearest to the centroid,
//! so vertices stay on the original surface.

use glam::{DVec2, DVec3};

use super::collapse::{Simplifier, unfolded_edge};
use super::connectivity::NONE;
use super::flat_star::in_face_order;
use super::triangle_shape::roundness;
use super::vertex_kinds::VertexKind;
use crate::progress::{Cancelled, Progress};

/// Most decrease of the cosine between the normals of two triangles by a flip; about 10° from flat.
const FLIP_SLACK: f64 = 0.02;

/// Excess of the opposite angles over π (radians) from which an edge is flipped; leaves regular grids as they are.
const DELAUNAY_SLACK: f64 = 1e-3;

/// Least cosines between the normal of a triangle after a flip and those of both triangles before: for at least one,
/// for each.
const FLIP_NORMALS: [f64; 2] = [0.9, 0.5];

/// Roundness at which a triangle is good enough; a shift may then make it less round, to even out sizes.
const ROUND: f64 = 0.6;

/// Greatest distance from the centroid after a shift, relative to that before. Closer to 1, vertices would keep
/// swapping.
const NEARER: f64 = 0.7;

/// Least height over length of a triangle in the flat star after a shift: tracked vertices in it then have
/// well-conditioned barycentric coordinates.
const FLAT_SHAPE: f64 = 0.05;

/// Least cosine between the normals of a triangle before and after a shift.
const SHIFT_TURN: f64 = 0.8;

/// Greatest distance of a tracked vertex from a crease, relative to the crease's length in the star, to lie on it.
const ON_CREASE: f64 = 1e-9;

impl Simplifier<'_> {
    /// Flips edges and shifts vertices in turn, `rounds` times.
    pub fn improve(&mut self, rounds: usize, progress: &Progress) -> Result<(), Cancelled> {
        for round in 0..rounds {
            progress.check()?;
            progress.report("Improving triangles", round as f64 / rounds as f64);
            self.flip_all();
            self.shift_all();
        }
        progress.check()?;
        self.flip_all();
        self.flip_all();
        Ok(())
    }

    fn flip_all(&mut self) {
        for h in 0..self.mesh.n_halfedges() as u32 {
            if !self.mesh.has(h) {
                continue;
            }
            let g = self.mesh.twin(h);
            if g != NONE && h < g && !self.mesh.is_feature(h) {
                self.try_flip(h);
            }
        }
    }

    /// Flips the inner edge of `h` if it is not Delaunay and the flip keeps topology and shape.
    fn try_flip(&mut self, h: u32) {
        let (ids, flat) = unfolded_edge(&self.mesh, self.positions, h);
        let [a, b, c, d] = flat;
        let angle = |p: DVec2| (a - p).perp_dot(b - p).abs().atan2((a - p).dot(b - p));
        if angle(c) + angle(d) <= std::f64::consts::PI + DELAUNAY_SLACK {
            return;
        }
        let small = |v: u32| self.mesh.degree(v) <= if self.mesh.is_boundary(v) { 3 } else { 4 };
        let mut joined = false;
        self.mesh.for_neighbours(ids[2], |n| joined |= n == ids[3]);
        if joined || small(ids[0]) || small(ids[1]) {
            return;
        }
        let [p, q, r, s] = ids.map(|v| self.positions[v as usize]);
        let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).normalize_or_zero();
        let (old, new) = ([normal(p, q, r), normal(q, p, s)], [normal(r, p, s), normal(s, q, r)]);
        let [one, each] = FLIP_NORMALS;
        let keeps = |n: DVec3| old.iter().any(|o| o.dot(n) > one) && old.iter().all(|o| o.dot(n) > each);
        if new[0].dot(new[1]) + FLIP_SLACK > old[0].dot(old[1]) && new.into_iter().all(keeps) {
            self.flip(h, flat);
        }
    }

    fn shift_all(&mut self) {
        let mut near = Vec::new();
        for v in 0..self.kinds.len() as u32 {
            if self.mesh.has_vertex(v) && self.kinds[v as usize] != VertexKind::Corner {
                self.try_shift(v, &mut near);
            }
        }
    }

    /// Shifts a vertex towards the centroid of its star, on a crease towards the middle of its two crease edges, if a
    /// tracked vertex of its kind is near enough.
    fn try_shift(&mut self, v: u32, near: &mut Vec<(u32, DVec2)>) {
        let kind = self.kinds[v as usize];
        self.star.gather(&self.mesh, v, kind == VertexKind::Crease);
        self.star.flatten(self.positions, v);
        let star = &self.star;
        near.clear();
        let (mut centre, mut total) = (DVec2::ZERO, 0.0);
        for (i, &h) in star.spokes.iter().enumerate() {
            let ends = [star.flat[i], star.flat[star.after(i)]];
            let area = ends[0].perp_dot(ends[1]);
            centre += (ends[0] + ends[1]) * (area / 3.0);
            total += area;
            self.tracked.list(in_face_order(h, [DVec2::ZERO, ends[0], ends[1]]), near);
        }
        centre /= total;
        if let Some(far) = star.crease {
            centre = (star.flat[0] + star.flat[far]) / 2.0;
            let line = ON_CREASE * (star.flat[0].x - star.flat[far].x);
            near.retain(|p| p.1.y.abs() <= line && p.1.x < star.flat[0].x && p.1.x > star.flat[far].x);
        }
        near.retain(|p| self.kinds[p.0 as usize] == kind);
        let distance = |p: &(u32, DVec2)| p.1.distance_squared(centre);
        let Some(&(w, position)) = near.iter().min_by(|p, q| distance(p).total_cmp(&distance(q)).then(p.0.cmp(&q.0)))
        else {
            return;
        };
        if position.distance(centre) < NEARER * centre.length() && self.may_shift(v, w, position) {
            self.shift(v, w, position);
        }
    }

    /// Whether replacing `v` by `w`, at `position` in the flat star, keeps the shape of the surface and of the
    /// triangles.
    fn may_shift(&self, v: u32, w: u32, position: DVec2) -> bool {
        let star = &self.star;
        let (p, q) = (self.positions[v as usize], self.positions[w as usize]);
        let (mut before, mut after) = (1.0f64, 1.0f64);
        for i in 0..star.spokes.len() {
            let j = star.after(i);
            let (x, y) = (star.flat[i] - position, star.flat[j] - position);
            let well_shaped = x.perp_dot(y) > FLAT_SHAPE * x.length_squared().max(y.length_squared());
            if !well_shaped {
                return false;
            }
            let [x, y] = [i, j].map(|i| self.positions[star.ring[i] as usize]);
            let normals = [p, q].map(|o| (x - o).cross(y - o).normalize_or_zero());
            if normals[0].dot(normals[1]) <= SHIFT_TURN {
                return false;
            }
            before = before.min(roundness([p, x, y]));
            after = after.min(roundness([q, x, y]));
        }
        after >= before.min(ROUND)
    }
}
