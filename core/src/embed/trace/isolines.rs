//! Marching along isolines of a seamless map.
//!
//! A [`Line`] is an isoline seen in the chart of one triangle; it goes over into the next by the change of chart.
//! Which side of a triangle it leaves through is decided by the sides of the line that the corners lie on, so that
//! each step is a choice between two half-edges whatever rounding does. A line that comes close to a vertex goes
//! through it; and a line that runs close to an edge goes along it, as at the boundary and on creases.

use glam::DVec2;

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// How close to its end, as a fraction of the edge, a line crosses an edge before it goes through the vertex
/// instead: what parts a triangle less evenly than this is no use to anyone.
const SNAP: f64 = 1e-4;
/// Distance from a line, as a fraction of the whole map's size, that is rounding of the map itself.
const EXACT: f64 = 1e-9;
/// However small a triangle is, only this fraction of its extent counts as close.
const WITHIN: f64 = 0.3;

/// A directed isoline in the chart of some triangle.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) struct Line {
    /// Where it starts, whether or not that lies in the triangle.
    pub start: DVec2,
    /// The direction it runs in: 0 is +u, 1 is +v, 2 is −u, 3 is −v.
    pub heading: u8,
}

impl Line {
    fn direction(&self) -> DVec2 {
        direction(self.heading)
    }

    /// Signed distance of a point, positive on the left.
    pub fn off(&self, w: DVec2) -> f64 {
        self.direction().perp_dot(w - self.start)
    }

    /// How far along the line a point is.
    pub fn along(&self, w: DVec2) -> f64 {
        self.direction().dot(w - self.start)
    }

    /// The line run the other way; where it starts is no end of it.
    pub fn reversed(&self) -> Self {
        Self { heading: (self.heading + 2) % 4, ..*self }
    }

    /// Where two lines cross, unless they run in the same direction or against each other.
    pub fn meet(&self, other: &Self) -> Option<DVec2> {
        let [along_u, along_v] = if self.heading.is_multiple_of(2) { [self, other] } else { [other, self] };
        let crosses = (self.heading + other.heading) % 2 == 1;
        crosses.then(|| DVec2::new(along_v.start.x, along_u.start.y))
    }

    /// The line in another chart.
    pub fn seen(&self, change: &Transition) -> Self {
        Self { start: change.apply(self.start), heading: (self.heading + change.turns) % 4 }
    }
}

/// The unit vector of a heading.
pub(in crate::embed) fn direction(heading: u8) -> DVec2 {
    turn(DVec2::X, i32::from(heading))
}

/// A point of a marched line; the line is given in the chart of the triangle of the half-edge.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum Step {
    /// A vertex, as the origin of a half-edge.
    Vertex(HalfedgeId, Line),
    /// The crossing of a half-edge of the triangle that is left.
    Edge(HalfedgeId, Line),
}

/// How a line leaves a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::embed) enum Exit {
    /// Along the outgoing half-edge of a corner.
    Along,
    /// Through the opposite side of a corner.
    Across,
    /// Along the incoming boundary half-edge of a corner.
    Back,
}

/// One of the isolines that leave a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::embed) struct Slot {
    /// The corner it leaves through, as outgoing half-edge.
    pub corner: HalfedgeId,
    /// Its heading in the chart there.
    pub heading: u8,
    /// How it leaves.
    pub exit: Exit,
}

/// Why a line ends before it meets a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::embed) enum Stop {
    /// The triangle that comes next is turned over.
    Fold(FaceId),
    /// The boundary of the surface.
    Boundary(FaceId),
    /// No way on from a vertex.
    Vertex(VertexId),
    /// Longer than allowed.
    Length(FaceId),
}

/// A marched line from one node to another.
#[derive(Debug, Clone)]
pub(in crate::embed) struct Marched {
    /// The points, vertices of nodes first and last.
    pub steps: Vec<Step>,
    /// Length in the map.
    pub length: f64,
}

/// Which way a point lies of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Ahead,
    Behind,
}

/// Isolines of a map.
pub(in crate::embed) struct Isolines<'a> {
    pub mesh: &'a TriMesh,
    pub map: &'a SeamlessMap,
    /// The node at each vertex, `u32::MAX` for none; lines end there.
    pub node: &'a [u32],
    /// Distance that is rounding.
    pub exact: f64,
    /// Whether lines go on through triangles that are turned over.
    pub through_folds: bool,
}

/// Where a marching line is, in the triangle of the half-edge.
enum At {
    Vertex(HalfedgeId),
    Leaving(HalfedgeId),
}

/// The node at each vertex of a mesh, or `u32::MAX`.
pub(in crate::embed) fn nodes_at(mesh: &TriMesh, node_vertex: &[VertexId]) -> Vec<u32> {
    let mut node = vec![u32::MAX; mesh.n_vertices()];
    for (n, v) in (0u32..).zip(node_vertex) {
        node[v.index()] = n;
    }
    node
}

/// Distances below this are rounding of `map`.
pub(in crate::embed) fn exactness(map: &SeamlessMap) -> f64 {
    let area: f64 = map.uv.iter().map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a).abs()).sum();
    EXACT * area.sqrt()
}

impl Isolines<'_> {
    pub fn uv(&self, h: HalfedgeId) -> DVec2 {
        self.map.uv[h.index() / 3][h.index() % 3]
    }

    /// The next corner counter-clockwise around the origin of `corner`, and the change of chart to it.
    fn ccw(&self, corner: HalfedgeId) -> Option<(HalfedgeId, Transition)> {
        let h = self.mesh.prev(corner);
        Some((self.mesh.twin(h)?, self.map.transition(self.mesh, h)?))
    }

    /// The next corner clockwise.
    fn cw(&self, corner: HalfedgeId) -> Option<(HalfedgeId, Transition)> {
        let t = self.mesh.twin(corner)?;
        Some((self.mesh.next(t), self.map.transition(self.mesh, corner)?))
    }

    /// Where the end of an edge vector lies of a line from its origin.
    fn side(&self, edge: DVec2, heading: u8) -> Side {
        let d = direction(heading);
        let (off, length) = (d.perp_dot(edge), edge.length());
        if off.abs() <= self.exact.min(WITHIN * length) {
            if d.dot(edge) > 0.0 { Side::Ahead } else { Side::Behind }
        } else if off > 0.0 {
            Side::Left
        } else {
            Side::Right
        }
    }

    /// Where the target of an outgoing half-edge lies of a line from its origin.
    fn spoke(&self, corner: HalfedgeId, heading: u8) -> Side {
        self.side(self.uv(self.mesh.next(corner)) - self.uv(corner), heading)
    }

    /// How a line with some heading leaves the origin of `corner` through this corner. An edge belongs to the
    /// corner counter-clockwise of it.
    fn exit(&self, corner: HalfedgeId, heading: u8) -> Option<Exit> {
        let first = self.spoke(corner, heading);
        let second = match self.ccw(corner) {
            Some((next, change)) => self.spoke(next, (heading + change.turns) % 4),
            None => self.side(self.uv(self.mesh.prev(corner)) - self.uv(corner), heading),
        };
        match (first, second) {
            (Side::Ahead, _) => Some(Exit::Along),
            (_, Side::Ahead) => self.ccw(corner).is_none().then_some(Exit::Back),
            (Side::Right, Side::Left) => (!self.map.is_flipped(self.mesh.face(corner))).then_some(Exit::Across),
            _ => None,
        }
    }

    /// The isolines that leave a vertex, counter-clockwise. On the boundary the first and the last run along it,
    /// whatever the map says.
    pub fn slots(&self, v: VertexId) -> Vec<Slot> {
        let mut slots: Vec<Slot> = Vec::new();
        // Going round, a heading that a fold passes back over and then again is one and the same: such a passage
        // back takes the slot before it away, and one before all slots the last.
        let mut before_all = 0;
        for corner in self.mesh.outgoing(v) {
            let all = (0..4).filter_map(|heading| Some(Slot { corner, heading, exit: self.exit(corner, heading)? }));
            let mut here: Vec<Slot> = all.collect();
            // Of two or three neighbouring headings the first is that with no other before it.
            let begin = here.iter().position(|s| here.iter().all(|o| (o.heading + 1) % 4 != s.heading));
            here.rotate_left(begin.unwrap_or(0));
            slots.extend(here);
            let back = if self.through_folds { self.passed_back(corner) } else { 0 };
            before_all += back.saturating_sub(slots.len());
            slots.truncate(slots.len().saturating_sub(back));
        }
        slots.truncate(slots.len().saturating_sub(before_all));
        if self.mesh.is_boundary_vertex(v) {
            let first = self.mesh.vertex_halfedge(v);
            let last = self.mesh.outgoing(v).last().unwrap_or(first);
            let nearest = |edge: DVec2| {
                let dots = [0, 1, 2, 3].map(|k| direction(k).dot(edge));
                (1..4u8).fold(0, |best, k| if dots[usize::from(k)] > dots[usize::from(best)] { k } else { best })
            };
            slots.retain(|s| !(s.corner == first && s.exit == Exit::Along || s.exit == Exit::Back));
            let edge = self.uv(self.mesh.next(first)) - self.uv(first);
            slots.insert(0, Slot { corner: first, heading: nearest(edge), exit: Exit::Along });
            let edge = self.uv(self.mesh.prev(last)) - self.uv(last);
            slots.push(Slot { corner: last, heading: nearest(edge), exit: Exit::Back });
        }
        slots
    }

    /// The number of headings that a corner of a triangle that is turned over passes clockwise.
    fn passed_back(&self, corner: HalfedgeId) -> usize {
        let (w, a, b) = (self.uv(corner), self.uv(self.mesh.next(corner)), self.uv(self.mesh.prev(corner)));
        if (a - w).perp_dot(b - w) >= 0.0 {
            return 0;
        }
        let within = |k: &u8| direction(*k).perp_dot(a - w) > 0.0 && direction(*k).perp_dot(b - w) < 0.0;
        (0..4).filter(within).count()
    }

    /// The places in `slots` of those that have a heading, given in the chart of a corner at the same vertex, when
    /// the chart is carried around the vertex; those first that are met with the least turning.
    pub fn matching(&self, slots: &[Slot], corner: HalfedgeId, heading: u8) -> Vec<usize> {
        let angle = |at: HalfedgeId| {
            let w = self.uv(at);
            (self.uv(self.mesh.next(at)) - w).angle_to(self.uv(self.mesh.prev(at)) - w).abs()
        };
        let mut found: Vec<(f64, usize)> = Vec::new();
        for clockwise in [false, true] {
            // Angle from the middle of the corner to the outgoing half-edge, all laid out in one plane.
            let (mut at, mut heading, mut turned) = (corner, heading, -0.5 * angle(corner));
            loop {
                for (i, s) in slots.iter().enumerate() {
                    if s.corner == at && s.heading == heading && found.iter().all(|f| f.1 != i) {
                        let edge = self.uv(self.mesh.next(at)) - self.uv(at);
                        found.push(((turned + edge.angle_to(direction(heading))).abs(), i));
                    }
                }
                let Some((next, change)) = (if clockwise { self.cw(at) } else { self.ccw(at) }) else { break };
                turned += if clockwise { -angle(next) } else { angle(at) };
                (at, heading) = (next, (heading + change.turns) % 4);
                if at == corner {
                    break;
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|f| f.1).collect()
    }

    /// Which of `slots` at the node where a line ends is the line turned round.
    pub fn arrival(&self, steps: &[Step], slots: &[Slot]) -> Option<usize> {
        let (corner, line) = match *steps {
            [.., Step::Edge(h, line), Step::Vertex(..)] => {
                (self.mesh.prev(self.mesh.twin(h)?), line.seen(&self.map.transition(self.mesh, h)?))
            }
            [.., Step::Vertex(corner, line)] => (corner, line),
            _ => return None,
        };
        self.matching(slots, corner, (line.heading + 2) % 4).first().copied()
    }

    /// Marches from a slot to the first node, no farther than `limit`.
    pub fn march(&self, slot: Slot, limit: f64) -> Result<Marched, Stop> {
        let mut steps = Vec::new();
        let length = self.march_into(&mut steps, slot, limit)?;
        Ok(Marched { steps, length })
    }

    /// The same; the points met are added to `steps`, also where there is no node at the end. Returns the length.
    pub fn march_into(&self, steps: &mut Vec<Step>, slot: Slot, limit: f64) -> Result<f64, Stop> {
        let mesh = self.mesh;
        let along_boundary = slot.exit == Exit::Back || slot.exit == Exit::Along && mesh.twin(slot.corner).is_none();
        let mut line = Line { start: self.uv(slot.corner), heading: slot.heading };
        steps.push(Step::Vertex(slot.corner, line));
        let mut at = self.leave(slot.corner, slot.exit);
        // A line meets no side of a triangle twice but at fold-overs, where it might go round for ever.
        for _ in 0..mesh.n_halfedges() {
            match at {
                At::Vertex(corner) => {
                    let (v, length) = (mesh.origin(corner), line.along(self.uv(corner)));
                    drop_crossings_at(mesh, steps, v);
                    steps.push(Step::Vertex(corner, line));
                    if self.node[v.index()] != u32::MAX {
                        return Ok(length);
                    }
                    if length > limit {
                        return Err(Stop::Length(mesh.face(corner)));
                    }
                    let (next, seen, exit) = self.pass(corner, line, along_boundary.then_some(slot.exit))?;
                    line = seen;
                    at = self.leave(next, exit);
                }
                At::Leaving(h) => {
                    let t = self.crossing(h, &line);
                    let (right, left) = (self.uv(h), self.uv(mesh.next(h)));
                    if let Some(end) = self.close(h, t, &line) {
                        at = At::Vertex(end);
                        continue;
                    }
                    steps.push(Step::Edge(h, line));
                    if line.along(right.lerp(left, t)) > limit {
                        return Err(Stop::Length(mesh.face(h)));
                    }
                    let (Some(g), Some(change)) = (mesh.twin(h), self.map.transition(mesh, h)) else {
                        return Err(Stop::Boundary(mesh.face(h)));
                    };
                    if !self.through_folds && self.map.is_flipped(mesh.face(g)) {
                        return Err(Stop::Fold(mesh.face(g)));
                    }
                    line = line.seen(&change);
                    let apex_left = line.off(self.uv(mesh.prev(g))) > 0.0;
                    at = At::Leaving(if apex_left { mesh.next(g) } else { mesh.prev(g) });
                }
            }
        }
        Err(Stop::Length(mesh.face(slot.corner)))
    }

    /// Where a line meets a half-edge with its origin on the right and its target on the left, as a fraction.
    pub fn crossing(&self, h: HalfedgeId, line: &Line) -> f64 {
        let (right, left) = (line.off(self.uv(h)), line.off(self.uv(self.mesh.next(h))));
        -right / (left - right)
    }

    /// The corner of the triangle of `h`, at an end of `h`, that a line which crosses `h` at `t` goes through instead.
    fn close(&self, h: HalfedgeId, t: f64, line: &Line) -> Option<HalfedgeId> {
        let end = if t < 0.5 { h } else { self.mesh.next(h) };
        let off = line.off(self.uv(end));
        let rounding = self.exact / (line.off(self.uv(self.mesh.next(h))) - line.off(self.uv(h))).abs();
        let away = t.min(1.0 - t);
        let goes =
            away <= rounding.min(WITHIN) || away <= SNAP && (away <= 0.0 || self.may_move(end, off, line.heading));
        goes.then_some(end)
    }

    /// Whether the origin of a corner can be moved to a line that it is `off` without turning a triangle over.
    fn may_move(&self, corner: HalfedgeId, off: f64, heading: u8) -> bool {
        self.fan(corner, -off * direction((heading + 1) % 4)).into_iter().all(|(h, shift)| {
            let (a, b, c) = (self.uv(h), self.uv(self.mesh.next(h)), self.uv(self.mesh.prev(h)));
            (b - a).perp_dot(c - a) <= 0.0 || (b - a - shift).perp_dot(c - a - shift) > 0.0
        })
    }

    /// All corners at the origin of `corner`, each with a vector that is given in its chart as `vector`.
    pub fn fan(&self, corner: HalfedgeId, vector: DVec2) -> Vec<(HalfedgeId, DVec2)> {
        let mut fan = vec![(corner, vector)];
        for clockwise in [false, true] {
            let (mut at, mut vector) = (corner, vector);
            while let Some((next, change)) = if clockwise { self.cw(at) } else { self.ccw(at) } {
                (at, vector) = (next, turn(vector, i32::from(change.turns)));
                if at == corner {
                    return fan;
                }
                fan.push((at, vector));
            }
        }
        fan
    }

    fn leave(&self, corner: HalfedgeId, exit: Exit) -> At {
        match exit {
            Exit::Along => At::Vertex(self.mesh.next(corner)),
            Exit::Across => At::Leaving(self.mesh.next(corner)),
            Exit::Back => At::Vertex(self.mesh.prev(corner)),
        }
    }

    /// How a line goes on from a vertex that is no node: the corner, the line in its chart, and the exit. A line
    /// that began along the boundary, in the direction of its half-edges or back, follows it.
    fn pass(&self, from: HalfedgeId, line: Line, boundary: Option<Exit>) -> Result<(HalfedgeId, Line, Exit), Stop> {
        let lost = Stop::Vertex(self.mesh.origin(from));
        for clockwise in [false, true] {
            let (mut at, mut line) = (from, line);
            loop {
                let exit = match boundary {
                    None => self.exit(at, line.heading),
                    Some(Exit::Back) => self.ccw(at).is_none().then_some(Exit::Back),
                    Some(_) => self.cw(at).is_none().then_some(Exit::Along),
                };
                if let Some(exit) = exit {
                    return Ok((at, line, exit));
                }
                let Some((next, change)) = (if clockwise { self.cw(at) } else { self.ccw(at) }) else { break };
                (at, line) = (next, line.seen(&change));
                if at == from {
                    return Err(lost);
                }
            }
        }
        Err(lost)
    }
}

/// Takes back the last crossings of edges at `v`: a line that goes through `v` does not cross them.
fn drop_crossings_at(mesh: &TriMesh, steps: &mut Vec<Step>, v: VertexId) {
    while let Some(&Step::Edge(h, _)) = steps.last()
        && (mesh.origin(h) == v || mesh.target(h) == v)
    {
        steps.pop();
    }
}
