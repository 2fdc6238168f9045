//! The triangle strip of a curve: a list of crossings that can move along their edges and pass over vertices.
//!
//! Seen along the curve, every crossed edge has a right and a left end. In a strip the parameter goes from right (0) to
//! left (1), also at the start of an open curve, where the stored half-edge goes the other way. A *run* is a maximal
//! sequence of consecutive crossings whose edges have the same vertex as their end on one side. Passing over this
//! vertex replaces the run by the spokes of the vertex' fan on the other side.

use glam::DVec3;

use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::surface::curve::{Crossing, SurfaceCurve};
use crate::surface::vertex_fan::{Side, spokes_across, spokes_from_boundary, spokes_to_boundary};

/// One crossing of a [`TriangleStrip`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StripCrossing {
    /// See [`Crossing::halfedge`].
    pub halfedge: HalfedgeId,
    /// Parameter from the right end of the edge (0) to the left end (1).
    pub t: f64,
    /// Whether the crossing must not move.
    pub fixed: bool,
    /// The nearest segment of the original curve, where the next search for it starts.
    pub reference: usize,
}

/// A maximal sequence of consecutive crossings whose edges share an end on one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Run {
    /// Its first crossing.
    pub first: usize,
    /// Its number of crossings, cyclically from `first` on.
    pub count: usize,
}

/// A curve with the strip of triangles that it traverses.
#[derive(Debug, Clone)]
pub(super) struct TriangleStrip {
    /// The crossings in order.
    pub crossings: Vec<StripCrossing>,
    /// Whether the last is followed by the first.
    pub closed: bool,
}

impl TriangleStrip {
    /// The strip of a valid curve, without fixed crossings.
    pub fn new(curve: &SurfaceCurve) -> Self {
        let crossing = |(i, c): (usize, &Crossing)| {
            let t = if !curve.closed && i == 0 { 1.0 - c.t } else { c.t };
            StripCrossing { halfedge: c.halfedge, t, fixed: false, reference: i }
        };
        Self { crossings: curve.crossings.iter().enumerate().map(crossing).collect(), closed: curve.closed }
    }

    /// The strip's curve.
    pub fn curve(&self) -> SurfaceCurve {
        let crossing = |(i, n): (usize, &StripCrossing)| {
            let t = if self.reversed(i) { 1.0 - n.t } else { n.t };
            Crossing { halfedge: n.halfedge, t }
        };
        SurfaceCurve { crossings: self.crossings.iter().enumerate().map(crossing).collect(), closed: self.closed }
    }

    /// Number of crossings.
    pub fn len(&self) -> usize {
        self.crossings.len()
    }

    /// Number of segments between crossings.
    pub fn n_segments(&self) -> usize {
        if self.closed { self.len() } else { self.len() - 1 }
    }

    /// The crossing after `i`, cyclically.
    pub fn after(&self, i: usize) -> usize {
        if i + 1 == self.len() { 0 } else { i + 1 }
    }

    /// The crossing before `i`, cyclically.
    pub fn before(&self, i: usize) -> usize {
        if i == 0 { self.len() - 1 } else { i - 1 }
    }

    /// Whether the stored half-edge goes from left to right.
    fn reversed(&self, i: usize) -> bool {
        !self.closed && i == 0
    }

    /// The end of the edge crossed at `i` on one side.
    pub fn end(&self, mesh: &TriMesh, i: usize, side: Side) -> VertexId {
        let h = self.crossings[i].halfedge;
        if (side == Side::Left) == self.reversed(i) { mesh.origin(h) } else { mesh.target(h) }
    }

    /// The half-edge through which segment `i` enters its triangle.
    pub fn entered(&self, mesh: &TriMesh, i: usize) -> HalfedgeId {
        // A valid curve has a twin everywhere but at its open ends; it enters the first triangle by the half-edge
        // itself.
        let h = self.crossings[i].halfedge;
        mesh.twin(h).filter(|_| !self.reversed(i)).unwrap_or(h)
    }

    /// Position of crossing `i` in space.
    pub fn point(&self, mesh: &TriMesh, i: usize) -> DVec3 {
        let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(self.end(mesh, i, s)));
        right.lerp(left, self.crossings[i].t)
    }

    /// The run through `i` on one side; `None` where it would be the whole curve.
    pub fn run(&self, mesh: &TriMesh, i: usize, side: Side) -> Option<Run> {
        let v = self.end(mesh, i, side);
        let (mut first, mut last, mut count) = (i, i, 1);
        while (self.closed || first > 0) && self.end(mesh, self.before(first), side) == v {
            first = self.before(first);
            count += 1;
            if count >= self.len() {
                return None;
            }
        }
        while (self.closed || last + 1 < self.len()) && self.end(mesh, self.after(last), side) == v {
            last = self.after(last);
            count += 1;
            if count >= self.len() {
                return None;
            }
        }
        Some(Run { first, count })
    }

    /// The part of the strip from `reach` crossings before a run to `reach` after it, as an open strip, and the index
    /// of its first crossing in this strip.
    ///
    /// The two outermost crossings on each side are fixed, except where the curve itself ends; so the energy of the
    /// window differs from that of the whole strip by a constant. Of a short closed curve fewer crossings are taken;
    /// `None` where too few are left to move.
    pub fn window(&self, mesh: &TriMesh, run: Run, reach: usize) -> Option<(Self, usize)> {
        let n = self.len();
        let (first, end) = if self.closed {
            let reach = reach.min((n - run.count) / 2);
            if reach < 3 {
                return None;
            }
            (n + run.first - reach, n + run.first + run.count + reach)
        } else {
            (run.first.saturating_sub(reach), n.min(run.first + run.count + reach))
        };
        let mut crossings: Vec<StripCrossing> = (first..end).map(|k| self.crossings[k % n]).collect();
        let m = crossings.len();
        if self.closed || first > 0 {
            crossings[..2].iter_mut().for_each(|c| c.fixed = true);
            crossings[0].halfedge = mesh.twin(crossings[0].halfedge)?;
        }
        if self.closed || end < n {
            crossings[m - 2..].iter_mut().for_each(|c| c.fixed = true);
        }
        Some((Self { crossings, closed: false }, first % n))
    }

    /// Replaces the `count` crossings from `first` on, from which `window` was taken, by the crossings of `window`.
    pub fn replace_window(&mut self, window: Self, first: usize, count: usize) {
        let (n, m) = (self.len(), window.len());
        let mut crossings = window.crossings;
        // The crossings fixed in the window have not moved; take them as they were.
        for (k, old) in [(0, first), (1, first + 1), (m - 2, first + count - 2), (m - 1, first + count - 1)] {
            if crossings[k].fixed {
                crossings[k] = self.crossings[old % n];
            }
        }
        if self.closed {
            crossings.extend((count..n).map(|k| self.crossings[(first + k) % n]));
            self.crossings = crossings;
        } else {
            self.crossings.splice(first..first + count, crossings);
        }
    }

    /// The angle of the vertex' fan that the curve sweeps along a run, and the angle of the whole fan, in radians.
    ///
    /// The sweep is measured between the points where the curve enters and leaves the fan. An open curve that ends in
    /// the fan does so on one of its outer spokes.
    pub fn swept_angle(&self, mesh: &TriMesh, run: Run, side: Side) -> (f64, f64) {
        let v = self.end(mesh, run.first, side);
        let centre = mesh.position(v);
        let total = mesh.outgoing(v).map(|h| mesh.corner_angle(h)).sum();
        let start = if self.closed || run.first > 0 { self.before(run.first) } else { run.first };
        let mut swept = 0.0;
        let mut at = start;
        let steps = run.count + usize::from(start != run.first);
        for _ in 0..steps {
            if !self.closed && at + 1 == self.len() {
                break;
            }
            let next = self.after(at);
            let (a, b) = (self.point(mesh, at) - centre, self.point(mesh, next) - centre);
            swept += a.cross(b).length().atan2(a.dot(b));
            at = next;
        }
        (swept, total)
    }

    /// Passes over the vertex of a run: replaces the run by the spokes on the other side of the vertex, at the distance
    /// `t_min` (in edge parameters) from it, and removes pairs of crossings that then cross one edge in both
    /// directions.
    ///
    /// Returns `false` and changes nothing where that is impossible: across a boundary, over a fixed crossing, or if
    /// too few crossings would be left.
    pub fn pass_vertex(&mut self, mesh: &TriMesh, run: Run, side: Side, t_min: f64) -> bool {
        let Some(fresh) = self.opposite_spokes(mesh, run, side) else { return false };
        let Run { mut first, mut count } = run;
        if fresh.is_empty() {
            while count + 2 < self.len() {
                let (before, after) = ((first + self.len() - 1) % self.len(), (first + count) % self.len());
                if mesh.twin(self.crossings[before].halfedge) != Some(self.crossings[after].halfedge) {
                    break;
                }
                (first, count) = (before, count + 2);
            }
        }
        let n = self.len();
        if n - count + fresh.len() < if self.closed { 3 } else { 2 }
            || (0..count).any(|k| self.crossings[(first + k) % n].fixed)
        {
            return false;
        }
        let reference = self.crossings[run.first].reference;
        let t = if side == Side::Left { t_min } else { 1.0 - t_min };
        let fresh = fresh.into_iter().map(|halfedge| StripCrossing { halfedge, t, fixed: false, reference });
        if self.closed {
            self.crossings = (count..n).map(|k| self.crossings[(first + k) % n]).chain(fresh).collect();
        } else {
            self.crossings.splice(first..first + count, fresh);
        }
        true
    }

    /// The spokes on the other side of a run's vertex; `None` across a boundary.
    fn opposite_spokes(&self, mesh: &TriMesh, run: Run, side: Side) -> Option<Vec<HalfedgeId>> {
        let last = (run.first + run.count - 1) % self.len();
        let at_start = !self.closed && run.first == 0;
        let at_end = !self.closed && last + 1 == self.len();
        match (at_start, at_end) {
            (true, true) => None,
            (true, false) => Some(spokes_from_boundary(mesh, self.entered(mesh, last), side)),
            (false, true) => Some(spokes_to_boundary(mesh, self.crossings[run.first].halfedge, side)),
            (false, false) => {
                let to = mesh.face(self.entered(mesh, last));
                spokes_across(mesh, self.crossings[run.first].halfedge, to, side)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::testing::{cylinder, ring, upright};

    #[test]
    fn a_strip_has_the_crossings_of_its_curve() {
        let mesh = cylinder(12, 8, 0.1);
        for curve in [ring(&mesh, 12, 4, 0.3), upright(&mesh, 12, 8, 2)] {
            let strip = TriangleStrip::new(&curve);
            let back = strip.curve();
            for (i, (a, b)) in back.crossings.iter().zip(&curve.crossings).enumerate() {
                assert!(a.halfedge == b.halfedge && (a.t - b.t).abs() < 1e-15);
                assert!(strip.point(&mesh, i).distance(curve.point(&mesh, i)) < 1e-12);
            }
        }
    }

    #[test]
    fn passing_a_vertex_twice_restores_the_crossings() {
        let mesh = cylinder(12, 8, 0.1);
        for (curve, ends) in [(ring(&mesh, 12, 4, 0.3), false), (upright(&mesh, 12, 8, 2), true)] {
            let strip = TriangleStrip::new(&curve);
            let mut done = 0;
            for i in 0..strip.len() {
                for (side, other) in [(Side::Left, Side::Right), (Side::Right, Side::Left)] {
                    let (v, run) = (strip.end(&mesh, i, side), strip.run(&mesh, i, side).unwrap());
                    let mut moved = strip.clone();
                    assert!(moved.pass_vertex(&mesh, run, side, 0.03));
                    assert_eq!(moved.curve().check(&mesh), Ok(()));
                    let at = (0..moved.len()).find(|&k| moved.end(&mesh, k, other) == v).unwrap();
                    let back = moved.run(&mesh, at, other).unwrap();
                    // Each spoke is crossed on one side or the other; a boundary vertex has one spoke more than
                    // triangles.
                    let spokes = mesh.outgoing(v).count() + usize::from(mesh.is_boundary_vertex(v));
                    assert_eq!(run.count + back.count, spokes);
                    assert!(moved.pass_vertex(&mesh, back, other, 0.03));
                    assert_eq!(moved.curve().check(&mesh), Ok(()));
                    let list = |s: &TriangleStrip| {
                        let mut list: Vec<HalfedgeId> = s.crossings.iter().map(|n| n.halfedge).collect();
                        if s.closed {
                            list.sort();
                        }
                        list
                    };
                    assert_eq!(list(&moved), list(&strip));
                    done += usize::from(mesh.is_boundary_vertex(v));
                }
            }
            assert_eq!(done > 0, ends);
        }
    }

    #[test]
    fn a_boundary_and_a_fixed_crossing_cannot_be_passed() {
        let mesh = cylinder(12, 8, 0.0);
        let low = ring(&mesh, 12, 0, 0.1);
        let mut strip = TriangleStrip::new(&low);
        let bottom = |s: &TriangleStrip, i, side| mesh.is_boundary_vertex(s.end(&mesh, i, side));
        let i = (0..strip.len()).find(|&i| bottom(&strip, i, Side::Right)).unwrap();
        let run = strip.run(&mesh, i, Side::Right).unwrap();
        assert!(!strip.pass_vertex(&mesh, run, Side::Right, 0.03));
        let run = strip.run(&mesh, i, Side::Left).unwrap();
        strip.crossings[i].fixed = true;
        assert!(!strip.pass_vertex(&mesh, run, Side::Left, 0.03));
        strip.crossings[i].fixed = false;
        assert!(strip.pass_vertex(&mesh, run, Side::Left, 0.03));
    }

    #[test]
    fn replacing_a_window_by_itself_changes_nothing() {
        let mesh = cylinder(20, 16, 0.1);
        for curve in [ring(&mesh, 20, 4, 0.3), upright(&mesh, 20, 16, 2)] {
            let strip = TriangleStrip::new(&curve);
            for i in 0..strip.len() {
                let run = strip.run(&mesh, i, Side::Left).unwrap();
                let (window, first) = strip.window(&mesh, run, 6).unwrap();
                assert!(window.crossings.iter().filter(|n| n.fixed).count() >= 2);
                let mut whole = strip.clone();
                let count = window.len();
                whole.replace_window(window, first, count);
                if strip.closed {
                    whole.crossings.rotate_right(first);
                }
                assert_eq!(whole.crossings, strip.crossings);
            }
        }
    }
}
