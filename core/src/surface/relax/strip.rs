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

/// One crossing of a [`Strip`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    /// As in [`Crossing`].
    pub halfedge: HalfedgeId,
    /// From the right end of the edge to the left one.
    pub t: f64,
    /// The crossing of the original curve that is held here, if any.
    pub held: Option<usize>,
    /// The segment of the original curve that was nearest last.
    pub reference: usize,
}

/// A curve in its strip.
#[derive(Debug, Clone)]
pub(super) struct Strip {
    /// The crossings in order.
    pub nodes: Vec<Node>,
    /// Whether the last is followed by the first.
    pub closed: bool,
}

impl Strip {
    /// The strip of a checked curve; nothing is held yet.
    pub fn new(curve: &SurfaceCurve) -> Self {
        let node = |(i, c): (usize, &Crossing)| {
            let t = if !curve.closed && i == 0 { 1.0 - c.t } else { c.t };
            Node { halfedge: c.halfedge, t, held: None, reference: i }
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
            || (0..count).any(|k| self.nodes[(first + k) % n].held.is_some())
        {
            return false;
        }
        let reference = self.nodes[run.0].reference;
        let t = if side == Side::Left { t_min } else { 1.0 - t_min };
        let fresh = fresh.into_iter().map(|halfedge| Node { halfedge, t, held: None, reference });
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
