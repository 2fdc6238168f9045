//! Rounder triangles of more even size: edge flips and shifts of vertices.
//!
//! Flips make the mesh Delaunay where that keeps its shape. A vertex is shifted towards the center of its star (as in
//! Lloyd's relaxation) by giving its place to the nearest vertex of the original there; so it stays on the original.

use glam::{DVec2, DVec3};

use super::collapse::{Simplifier, hinge};
use super::connectivity::NONE;
use super::shape::{Kind, roundness};
use super::star::in_face_order;
use crate::progress::{Cancelled, Progress};

/// By how much (cosine) a flip may crease the two triangles more than they were. About 10° from flat.
const FLIP_SLACK: f64 = 0.02;

/// A triangle at least this round counts as good enough; the shift may then serve even size.
const ROUND: f64 = 0.6;

/// A vertex is shifted only if that takes it this much nearer to the center; else vertices would go on swapping.
const NEARER: f64 = 0.7;

impl Simplifier<'_> {
    /// Flips and shifts in turn, `rounds` times.
    pub fn improve(&mut self, rounds: usize, progress: &Progress) -> Result<(), Cancelled> {
        for round in 0..rounds {
            progress.check()?;
            progress.report("Evening out", round as f64 / rounds as f64);
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

    fn try_flip(&mut self, h: u32) {
        let (ids, flat) = hinge(&self.mesh, self.positions, h);
        let [a, b, c, d] = flat;
        let angle = |p: DVec2| (a - p).perp_dot(b - p).abs().atan2((a - p).dot(b - p));
        // The slack leaves regular grids as they are.
        if angle(c) + angle(d) <= std::f64::consts::PI + 1e-3 {
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
        let keeps = |n: DVec3| old.iter().any(|o| o.dot(n) > 0.9) && old.iter().all(|o| o.dot(n) > 0.5);
        if new[0].dot(new[1]) + FLIP_SLACK > old[0].dot(old[1]) && new.into_iter().all(keeps) {
            self.flip(h, flat);
        }
    }

    fn shift_all(&mut self) {
        let mut near = Vec::new();
        for v in 0..self.kinds.len() as u32 {
            if self.mesh.has_vertex(v) && self.kinds[v as usize] != Kind::Corner {
                self.try_shift(v, &mut near);
            }
        }
    }

    fn try_shift(&mut self, v: u32, near: &mut Vec<(u32, DVec2)>) {
        let kind = self.kinds[v as usize];
        self.star.gather(&self.mesh, v, kind == Kind::Crease);
        self.star.flatten(self.positions, v);
        let star = &self.star;
        near.clear();
        let (mut center, mut total) = (DVec2::ZERO, 0.0);
        for (i, &h) in star.spokes.iter().enumerate() {
            let ends = [star.flat[i], star.flat[star.after(i)]];
            let area = ends[0].perp_dot(ends[1]);
            center += (ends[0] + ends[1]) * (area / 3.0);
            total += area;
            self.tracked.look(in_face_order(h, [DVec2::ZERO, ends[0], ends[1]]), near);
        }
        center /= total;
        if let Some(far) = star.crease {
            center = (star.flat[0] + star.flat[far]) / 2.0;
            let line = 1e-9 * (star.flat[0].x - star.flat[far].x);
            near.retain(|p| p.1.y.abs() <= line && p.1.x < star.flat[0].x && p.1.x > star.flat[far].x);
        }
        near.retain(|p| self.kinds[p.0 as usize] == kind);
        let distance = |p: &(u32, DVec2)| p.1.distance_squared(center);
        let Some(&(w, place)) = near.iter().min_by(|p, q| distance(p).total_cmp(&distance(q)).then(p.0.cmp(&q.0)))
        else {
            return;
        };
        if place.distance(center) < NEARER * center.length() && self.may_shift(v, w, place) {
            self.shift(v, w, place);
        }
    }

    fn may_shift(&self, v: u32, w: u32, place: DVec2) -> bool {
        let star = &self.star;
        let (p, q) = (self.positions[v as usize], self.positions[w as usize]);
        let (mut before, mut after) = (1.0f64, 1.0f64);
        for i in 0..star.spokes.len() {
            let j = star.after(i);
            let (x, y) = (star.flat[i] - place, star.flat[j] - place);
            // As for collapses: points in the flat triangle must be well placed.
            let upright = x.perp_dot(y) > 0.05 * x.length_squared().max(y.length_squared());
            if !upright {
                return false;
            }
            let [x, y] = [i, j].map(|i| self.positions[star.ring[i] as usize]);
            let normals = [p, q].map(|o| (x - o).cross(y - o).normalize_or_zero());
            if normals[0].dot(normals[1]) <= 0.8 {
                return false;
            }
            before = before.min(roundness([p, x, y]));
            after = after.min(roundness([q, x, y]));
        }
        after >= before.min(ROUND)
    }
}
