//! The strip of triangles under a curve, as a list of crossings that can move and pass over vertices.
//!
//! Looking along the curve, every crossed edge has a right and a left end; inside a strip the parameter runs
//! from right (0) to left (1), also at the start of an open curve where the stored half-edge runs the other
//! way. A vertex on one side is passed by a *run*: the crossings in a row that have it as their end on that
//! side. Passing over the vertex replaces this run by the spokes of its fan on the other side.

use glam::DVec3;

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::{Crossing, SurfaceCurve};

/// A side of the curve, seen along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::surface) enum Side {
    /// The side of parameter 0.
    Right,
    /// The side of parameter 1.
    Left,
}

/// One crossing of a [`TriangleStrip`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// As in [`Crossing`].
    pub halfedge: HalfedgeId,
    /// From the right end of the edge to the left one.
    pub t: f64,
    /// Whether it stays where it is.
    pub held: bool,
    /// The segment of the original curve that was nearest last.
    pub reference: usize,
}

/// A curve in its strip.
#[derive(Debug, Clone)]
pub(super) struct TriangleStrip {
    /// The crossings in order.
    pub nodes: Vec<Node>,
    /// Whether the last is followed by the first.
    pub closed: bool,
}

impl TriangleStrip {
    /// The strip of a checked curve; nothing is held yet.
    pub fn new(curve: &SurfaceCurve) -> Self {
        let node = |(i, c): (usize, &Crossing)| {
            let t = if !curve.closed && i == 0 { 1.0 - c.t } else { c.t };
            Node { halfedge: c.halfedge, t, held: false, reference: i }
        };
        Self { nodes: curve.crossings.iter().enumerate().map(node).collect(), closed: curve.closed }
    }

    /// Back to a curve.
    pub fn curve(&self) -> SurfaceCurve {
        let crossing = |(i, n): (usize, &Node)| {
            let t = if self.reversed(i) { 1.0 - n.t } else { n.t };
            Crossing { halfedge: n.halfedge, t }
        };
        SurfaceCurve { crossings: self.nodes.iter().enumerate().map(crossing).collect(), closed: self.closed }
    }

    /// Number of crossings.
    pub fn len(&self) -> usize {
        self.nodes.len()
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

    fn reversed(&self, i: usize) -> bool {
        !self.closed && i == 0
    }

    /// The end of the edge crossed at `i` on one side.
    pub fn end(&self, mesh: &TriMesh, i: usize, side: Side) -> VertexId {
        let h = self.nodes[i].halfedge;
        if (side == Side::Left) == self.reversed(i) { mesh.origin(h) } else { mesh.target(h) }
    }

    /// The half-edge through which segment `i` enters its triangle.
    pub fn entered(&self, mesh: &TriMesh, i: usize) -> HalfedgeId {
        // A checked curve has a twin everywhere but at its open ends, where it enters by the half-edge itself.
        let h = self.nodes[i].halfedge;
        mesh.twin(h).filter(|_| !self.reversed(i)).unwrap_or(h)
    }

    /// The point in space at crossing `i`.
    pub fn point(&self, mesh: &TriMesh, i: usize) -> DVec3 {
        let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(self.end(mesh, i, s)));
        right.lerp(left, self.nodes[i].t)
    }

    /// First crossing and number of crossings of the run through `i` on one side; `None` where the run is the
    /// whole curve.
    pub fn run(&self, mesh: &TriMesh, i: usize, side: Side) -> Option<(usize, usize)> {
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
        Some((first, count))
    }

    /// The part of the strip from `reach` crossings before a run to `reach` after it, as an open strip whose
    /// outermost crossings are held, two on each side; with the position of its first crossing. Held ends are
    /// left out where the curve itself ends, and fewer crossings taken of a short closed curve. `None` where that
    /// leaves nothing to slide.
    ///
    /// As its outermost segments cannot move, its energy differs from that of the whole by a constant.
    pub fn window(&self, mesh: &TriMesh, run: (usize, usize), reach: usize) -> Option<(Self, usize)> {
        let n = self.len();
        let (first, end) = if self.closed {
            let reach = reach.min((n - run.1) / 2);
            if reach < 3 {
                return None;
            }
            (n + run.0 - reach, n + run.0 + run.1 + reach)
        } else {
            (run.0.saturating_sub(reach), n.min(run.0 + run.1 + reach))
        };
        let mut nodes: Vec<Node> = (first..end).map(|k| self.nodes[k % n]).collect();
        let m = nodes.len();
        if self.closed || first > 0 {
            nodes[..2].iter_mut().for_each(|node| node.held = true);
            nodes[0].halfedge = mesh.twin(nodes[0].halfedge)?;
        }
        if self.closed || end < n {
            nodes[m - 2..].iter_mut().for_each(|node| node.held = true);
        }
        Some((Self { nodes, closed: false }, first % n))
    }

    /// Puts a window of once `count` crossings back from position `first` on.
    pub fn put_back(&mut self, window: Self, first: usize, count: usize) {
        let (n, m) = (self.len(), window.len());
        let mut nodes = window.nodes;
        // What the window holds is as it was.
        for (k, old) in [(0, first), (1, first + 1), (m - 2, first + count - 2), (m - 1, first + count - 1)] {
            if nodes[k].held {
                nodes[k] = self.nodes[old % n];
            }
        }
        if self.closed {
            nodes.extend((count..n).map(|k| self.nodes[(first + k) % n]));
            self.nodes = nodes;
        } else {
            self.nodes.splice(first..first + count, nodes);
        }
    }

    /// Angle of the fan of the run's vertex that the run sweeps, and the angle of the whole fan, in radians.
    ///
    /// The sweep is taken between the points where the curve enters and leaves the fan; the ends of an open
    /// curve lie on the fan's outer spokes themselves.
    pub fn sweep(&self, mesh: &TriMesh, run: (usize, usize), side: Side) -> (f64, f64) {
        let v = self.end(mesh, run.0, side);
        let center = mesh.position(v);
        let total = mesh.outgoing(v).map(|h| mesh.corner_angle(h)).sum();
        let start = if self.closed || run.0 > 0 { self.before(run.0) } else { run.0 };
        let mut swept = 0.0;
        let mut at = start;
        let steps = run.1 + usize::from(start != run.0);
        for _ in 0..steps {
            if !self.closed && at + 1 == self.len() {
                break;
            }
            let next = self.after(at);
            let (a, b) = (self.point(mesh, at) - center, self.point(mesh, next) - center);
            swept += a.cross(b).length().atan2(a.dot(b));
            at = next;
        }
        (swept, total)
    }

    /// Passes over the vertex of a run: replaces the run by the spokes on the other side of the vertex, at the
    /// distance `t_min` (in edge parameters) from it, and takes back what then runs to and fro.
    ///
    /// Gives `false` and changes nothing where that is not possible: across a boundary, over a held crossing,
    /// or if the curve would vanish.
    pub fn pass(&mut self, mesh: &TriMesh, run: (usize, usize), side: Side, t_min: f64) -> bool {
        let (mut first, mut count) = run;
        let last = (first + count - 1) % self.len();
        let at_start = !self.closed && first == 0;
        let at_end = !self.closed && last + 1 == self.len();
        let fresh = match (at_start, at_end) {
            (true, true) => None,
            (true, false) => Some(spokes_to_boundary_before(mesh, self.entered(mesh, last), side)),
            (false, true) => Some(spokes_to_boundary(mesh, self.nodes[first].halfedge, side)),
            (false, false) => {
                let to = mesh.face(self.entered(mesh, last));
                spokes_across(mesh, self.nodes[first].halfedge, to, side)
            }
        };
        let Some(fresh) = fresh else { return false };
        if fresh.is_empty() {
            while count + 2 < self.len() {
                let (before, after) = ((first + self.len() - 1) % self.len(), (first + count) % self.len());
                if mesh.twin(self.nodes[before].halfedge) != Some(self.nodes[after].halfedge) {
                    break;
                }
                (first, count) = (before, count + 2);
            }
        }
        let n = self.len();
        if n - count + fresh.len() < if self.closed { 3 } else { 2 }
            || (0..count).any(|k| self.nodes[(first + k) % n].held)
        {
            return false;
        }
        let reference = self.nodes[run.0].reference;
        let t = if side == Side::Left { t_min } else { 1.0 - t_min };
        let fresh = fresh.into_iter().map(|halfedge| Node { halfedge, t, held: false, reference });
        if self.closed {
            self.nodes = (count..n).map(|k| self.nodes[(first + k) % n]).chain(fresh).collect();
        } else {
            self.nodes.splice(first..first + count, fresh);
        }
        true
    }
}

/// The crossings that lead around the vertex at the `side` of `first` from the triangle of `first` to the
/// triangle `to`, the other way than over `first`; `None` where the boundary is in the way.
pub(in crate::surface) fn spokes_across(
    mesh: &TriMesh,
    first: HalfedgeId,
    to: FaceId,
    side: Side,
) -> Option<Vec<HalfedgeId>> {
    let turn = |h| if side == Side::Left { mesh.next(h) } else { mesh.prev(h) };
    let mut spokes = Vec::new();
    let mut inside = first;
    while mesh.face(inside) != to {
        let out = turn(inside);
        spokes.push(out);
        inside = mesh.twin(out)?;
    }
    Some(spokes)
}

/// The crossings that lead from the triangle of `first` around its vertex to the boundary, the other way than
/// over `first`. The last is a boundary half-edge.
fn spokes_to_boundary(mesh: &TriMesh, first: HalfedgeId, side: Side) -> Vec<HalfedgeId> {
    let turn = |h| if side == Side::Left { mesh.next(h) } else { mesh.prev(h) };
    let mut spokes = vec![turn(first)];
    while let Some(inside) = spokes.last().and_then(|&h| mesh.twin(h)) {
        spokes.push(turn(inside));
    }
    spokes
}

/// The crossings that lead from the boundary around the vertex of `entered` to the triangle of `entered`, the
/// other way than over `entered`. The first is a boundary half-edge.
fn spokes_to_boundary_before(mesh: &TriMesh, entered: HalfedgeId, side: Side) -> Vec<HalfedgeId> {
    let turn = |h| if side == Side::Left { mesh.prev(h) } else { mesh.next(h) };
    let mut spokes = Vec::new();
    let mut inside = turn(entered);
    while let Some(from) = mesh.twin(inside) {
        spokes.push(from);
        inside = turn(from);
    }
    spokes.push(inside);
    spokes.reverse();
    spokes
}

#[cfg(test)]
mod tests {
    use super::super::testing::{cylinder, ring, upright};
    use super::*;

    #[test]
    fn to_a_strip_and_back() {
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
    fn passing_there_and_back_restores_the_crossings() {
        let mesh = cylinder(12, 8, 0.1);
        for (curve, ends) in [(ring(&mesh, 12, 4, 0.3), false), (upright(&mesh, 12, 8, 2), true)] {
            let strip = TriangleStrip::new(&curve);
            let mut done = 0;
            for i in 0..strip.len() {
                for (side, other) in [(Side::Left, Side::Right), (Side::Right, Side::Left)] {
                    let (v, run) = (strip.end(&mesh, i, side), strip.run(&mesh, i, side).unwrap());
                    let mut moved = strip.clone();
                    assert!(moved.pass(&mesh, run, side, 0.03));
                    assert_eq!(moved.curve().check(&mesh), Ok(()));
                    let at = (0..moved.len()).find(|&k| moved.end(&mesh, k, other) == v).unwrap();
                    let back = moved.run(&mesh, at, other).unwrap();
                    // All spokes are crossed on one side or the other; one more than triangles at a boundary.
                    let spokes = mesh.outgoing(v).count() + usize::from(mesh.is_boundary_vertex(v));
                    assert_eq!(run.1 + back.1, spokes);
                    assert!(moved.pass(&mesh, back, other, 0.03));
                    assert_eq!(moved.curve().check(&mesh), Ok(()));
                    let list = |s: &TriangleStrip| {
                        let mut list: Vec<HalfedgeId> = s.nodes.iter().map(|n| n.halfedge).collect();
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
    fn nothing_passes_over_a_boundary_or_a_held_crossing() {
        let mesh = cylinder(12, 8, 0.0);
        let low = ring(&mesh, 12, 0, 0.1);
        let mut strip = TriangleStrip::new(&low);
        let bottom = |s: &TriangleStrip, i, side| mesh.is_boundary_vertex(s.end(&mesh, i, side));
        let i = (0..strip.len()).find(|&i| bottom(&strip, i, Side::Right)).unwrap();
        let run = strip.run(&mesh, i, Side::Right).unwrap();
        assert!(!strip.pass(&mesh, run, Side::Right, 0.03));
        let run = strip.run(&mesh, i, Side::Left).unwrap();
        strip.nodes[i].held = true;
        assert!(!strip.pass(&mesh, run, Side::Left, 0.03));
        strip.nodes[i].held = false;
        assert!(strip.pass(&mesh, run, Side::Left, 0.03));
    }

    #[test]
    fn a_window_put_back_changes_nothing() {
        let mesh = cylinder(20, 16, 0.1);
        for curve in [ring(&mesh, 20, 4, 0.3), upright(&mesh, 20, 16, 2)] {
            let strip = TriangleStrip::new(&curve);
            for i in 0..strip.len() {
                let run = strip.run(&mesh, i, Side::Left).unwrap();
                let (window, first) = strip.window(&mesh, run, 6).unwrap();
                assert!(window.nodes.iter().filter(|n| n.held).count() >= 2);
                let mut whole = strip.clone();
                let count = window.len();
                whole.put_back(window, first, count);
                if strip.closed {
                    whole.nodes.rotate_right(first);
                }
                assert_eq!(whole.nodes, strip.nodes);
            }
        }
    }
}
