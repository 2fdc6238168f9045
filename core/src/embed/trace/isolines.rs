//! Isoline tracing in a seamless map.
//!
//! A [`Line`] is an isoline in the chart of one triangle; a transition takes it to the chart of the next. The side
//! through which it leaves a triangle depends only on which side of the line the opposite corner lies, so that every
//! step is a choice between two half-edges whatever the rounding. A line that passes close to a vertex goes through the
//! vertex, and one that runs close to an edge goes along the edge, as at the boundary and on features.

use glam::DVec2;

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// Distance of a crossing from an end of its edge, as a fraction of the edge, below which the isoline is led through
/// the vertex: the crossing would leave a sliver.
const SNAP: f64 = 1e-4;
/// Distance from a line below which a point counts as on it, as a fraction of the square root of the map's area: the
/// rounding errors of the map.
const ROUNDING: f64 = 1e-9;
/// Largest fraction of an edge that may count as rounding: also in a triangle smaller than the rounding errors of the
/// map, a crossing in the middle of an edge is not moved to a vertex.
const MAX_ROUNDING: f64 = 0.3;

/// A directed isoline in the chart of a triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    /// The point it starts at, which may lie outside the triangle.
    pub start: DVec2,
    /// The direction it runs in: 0 is +u, 1 is +v, 2 is −u, 3 is −v.
    pub heading: u8,
}

impl Line {
    fn direction(&self) -> DVec2 {
        direction(self.heading)
    }

    /// Signed distance of a point from the line, positive on the left.
    pub fn signed_distance(&self, w: DVec2) -> f64 {
        self.direction().perp_dot(w - self.start)
    }

    /// Coordinate of a point along the line, 0 at its start.
    pub fn along(&self, w: DVec2) -> f64 {
        self.direction().dot(w - self.start)
    }

    /// The line in the opposite direction, with the same start.
    pub fn reversed(&self) -> Self {
        Self { heading: (self.heading + 2) % 4, ..*self }
    }

    /// The intersection of a line along u and one along v; `None` for parallel lines.
    pub fn intersection(&self, other: &Self) -> Option<DVec2> {
        let [along_u, along_v] = if self.heading.is_multiple_of(2) { [self, other] } else { [other, self] };
        let crosses = (self.heading + other.heading) % 2 == 1;
        crosses.then(|| DVec2::new(along_v.start.x, along_u.start.y))
    }

    /// The line in the chart that `change` leads to.
    pub fn in_chart(&self, change: &Transition) -> Self {
        Self { start: change.apply(self.start), heading: (self.heading + change.turns) % 4 }
    }
}

/// The unit vector of a heading.
pub(super) fn direction(heading: u8) -> DVec2 {
    turn(DVec2::X, i32::from(heading))
}

/// A point of a traced isoline, with the isoline in the chart of the half-edge's triangle.
#[derive(Debug, Clone, Copy)]
pub(super) enum Step {
    /// A vertex, as the origin of a half-edge.
    Vertex(HalfedgeId, Line),
    /// The crossing of a half-edge of the triangle that is left.
    Edge(HalfedgeId, Line),
}

/// How an isoline leaves a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exit {
    /// Along the outgoing half-edge of a corner.
    Along,
    /// Through the opposite side of a corner.
    Across,
    /// Along the incoming boundary half-edge of a corner.
    Back,
}

/// One of the isolines that leave a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct OutgoingIsoline {
    /// The corner it leaves through, as outgoing half-edge.
    pub corner: HalfedgeId,
    /// Its heading in the chart of the corner's triangle.
    pub heading: u8,
    /// How it leaves.
    pub exit: Exit,
}

/// Why an isoline ends before it reaches a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// The triangle that comes next is flipped.
    FlippedTriangle(FaceId),
    /// The boundary of the surface.
    Boundary(FaceId),
    /// It does not continue at a vertex.
    Vertex(VertexId),
    /// It is longer than the limit.
    Length(FaceId),
}

/// An isoline traced from one node to another.
#[derive(Debug, Clone)]
pub(super) struct TracedIsoline {
    /// The points; the first and the last are nodes.
    pub steps: Vec<Step>,
    /// Length in the map.
    pub length: f64,
}

/// Where a point lies relative to a directed line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Ahead,
    Behind,
}

/// The isolines of a map.
pub(super) struct Isolines<'a> {
    pub mesh: &'a TriMesh,
    pub map: &'a SeamlessMap,
    /// The node at each vertex, `u32::MAX` for none; isolines end at nodes.
    pub node: &'a [u32],
    /// Distances below this are rounding errors; see [`map_rounding`].
    pub rounding: f64,
    /// Whether isolines continue through flipped triangles.
    pub cross_flipped: bool,
}

/// The current position of a trace.
enum At {
    /// At the origin of a corner.
    Vertex(HalfedgeId),
    /// In the triangle of a half-edge, which is crossed next.
    Leaving(HalfedgeId),
}

/// Coordinates of the origin of a half-edge in the chart of its triangle.
pub(super) fn corner_uv(map: &SeamlessMap, h: HalfedgeId) -> DVec2 {
    map.uv[h.index() / 3][h.index() % 3]
}

/// The node at each vertex of a mesh, or `u32::MAX`.
pub(super) fn nodes_at(mesh: &TriMesh, node_vertex: &[VertexId]) -> Vec<u32> {
    let mut node = vec![u32::MAX; mesh.n_vertices()];
    for (n, v) in (0u32..).zip(node_vertex) {
        node[v.index()] = n;
    }
    node
}

/// The distance in `map` below which differences are rounding errors.
pub(super) fn map_rounding(map: &SeamlessMap) -> f64 {
    let area: f64 = map.uv.iter().map(|[a, b, c]| 0.5 * (*b - *a).perp_dot(*c - *a).abs()).sum();
    ROUNDING * area.sqrt()
}

impl Isolines<'_> {
    /// Coordinates of the origin of `h` in the chart of its triangle.
    pub fn uv(&self, h: HalfedgeId) -> DVec2 {
        corner_uv(self.map, h)
    }

    /// The next corner counter-clockwise around the origin of `corner`, and the transition to it; `None` at the
    /// boundary.
    fn ccw(&self, corner: HalfedgeId) -> Option<(HalfedgeId, Transition)> {
        let h = self.mesh.prev(corner);
        Some((self.mesh.twin(h)?, self.map.transition(self.mesh, h)?))
    }

    /// The next corner clockwise, likewise.
    fn cw(&self, corner: HalfedgeId) -> Option<(HalfedgeId, Transition)> {
        let t = self.mesh.twin(corner)?;
        Some((self.mesh.next(t), self.map.transition(self.mesh, corner)?))
    }

    /// Where the end of an edge vector lies relative to the line from its origin with a heading.
    fn side(&self, edge: DVec2, heading: u8) -> Side {
        let d = direction(heading);
        let (signed_distance, length) = (d.perp_dot(edge), edge.length());
        if signed_distance.abs() <= self.rounding.min(MAX_ROUNDING * length) {
            if d.dot(edge) > 0.0 { Side::Ahead } else { Side::Behind }
        } else if signed_distance > 0.0 {
            Side::Left
        } else {
            Side::Right
        }
    }

    /// Where the target of an outgoing half-edge lies relative to the line from its origin with a heading.
    fn side_of_edge(&self, corner: HalfedgeId, heading: u8) -> Side {
        self.side(self.uv(self.mesh.next(corner)) - self.uv(corner), heading)
    }

    /// How a line with a heading leaves the origin of `corner` through this corner, if it does. An edge belongs to the
    /// corner counter-clockwise of it.
    fn exit(&self, corner: HalfedgeId, heading: u8) -> Option<Exit> {
        let first = self.side_of_edge(corner, heading);
        let second = match self.ccw(corner) {
            Some((next, change)) => self.side_of_edge(next, (heading + change.turns) % 4),
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
    /// even if the map is not aligned with it exactly.
    pub fn outgoing(&self, v: VertexId) -> Vec<OutgoingIsoline> {
        let mut outgoing: Vec<OutgoingIsoline> = Vec::new();
        // Around a vertex with flipped triangles a heading is met three times: forward, backward in the flipped
        // triangle, and forward again. It is one isoline, so that each backward passage cancels the isoline before it,
        // and one before all others the last.
        let mut before_all = 0;
        for corner in self.mesh.outgoing(v) {
            let all = (0..4)
                .filter_map(|heading| Some(OutgoingIsoline { corner, heading, exit: self.exit(corner, heading)? }));
            let mut here: Vec<OutgoingIsoline> = all.collect();
            // Headings are cyclic: the first of several in one corner is the one whose predecessor is not among them.
            let begin = here.iter().position(|s| here.iter().all(|o| (o.heading + 1) % 4 != s.heading));
            here.rotate_left(begin.unwrap_or(0));
            outgoing.extend(here);
            let back = if self.cross_flipped { self.headings_passed_clockwise(corner) } else { 0 };
            before_all += back.saturating_sub(outgoing.len());
            outgoing.truncate(outgoing.len().saturating_sub(back));
        }
        outgoing.truncate(outgoing.len().saturating_sub(before_all));
        if self.mesh.is_boundary_vertex(v) {
            let first = self.mesh.vertex_halfedge(v);
            let last = self.mesh.outgoing(v).last().unwrap_or(first);
            let nearest = |edge: DVec2| {
                let dots = [0, 1, 2, 3].map(|k| direction(k).dot(edge));
                (1..4u8).fold(0, |best, k| if dots[usize::from(k)] > dots[usize::from(best)] { k } else { best })
            };
            outgoing.retain(|s| !(s.corner == first && s.exit == Exit::Along || s.exit == Exit::Back));
            let edge = self.uv(self.mesh.next(first)) - self.uv(first);
            outgoing.insert(0, OutgoingIsoline { corner: first, heading: nearest(edge), exit: Exit::Along });
            let edge = self.uv(self.mesh.prev(last)) - self.uv(last);
            outgoing.push(OutgoingIsoline { corner: last, heading: nearest(edge), exit: Exit::Back });
        }
        outgoing
    }

    /// The number of headings that a corner of a flipped triangle passes clockwise.
    fn headings_passed_clockwise(&self, corner: HalfedgeId) -> usize {
        let (w, a, b) = (self.uv(corner), self.uv(self.mesh.next(corner)), self.uv(self.mesh.prev(corner)));
        if (a - w).perp_dot(b - w) >= 0.0 {
            return 0;
        }
        let within = |k: &u8| direction(*k).perp_dot(a - w) > 0.0 && direction(*k).perp_dot(b - w) < 0.0;
        (0..4).filter(within).count()
    }

    /// The positions in `outgoing` of the isolines that have a heading, given in the chart of a corner at the same
    /// vertex and transported around the vertex; sorted by the angle to the middle of that corner.
    pub fn with_heading(&self, outgoing: &[OutgoingIsoline], corner: HalfedgeId, heading: u8) -> Vec<usize> {
        let angle = |at: HalfedgeId| {
            let w = self.uv(at);
            (self.uv(self.mesh.next(at)) - w).angle_to(self.uv(self.mesh.prev(at)) - w).abs()
        };
        let mut found: Vec<(f64, usize)> = Vec::new();
        for clockwise in [false, true] {
            // Angle from the middle of the first corner to the outgoing half-edge, with the fan laid out in one plane.
            let (mut at, mut heading, mut turned) = (corner, heading, -0.5 * angle(corner));
            loop {
                for (i, s) in outgoing.iter().enumerate() {
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

    /// The index of the reversed trace among the isolines `outgoing` from the node where a trace ends.
    pub fn arrival(&self, steps: &[Step], outgoing: &[OutgoingIsoline]) -> Option<usize> {
        let (corner, line) = match *steps {
            [.., Step::Edge(h, line), Step::Vertex(..)] => {
                (self.mesh.prev(self.mesh.twin(h)?), line.in_chart(&self.map.transition(self.mesh, h)?))
            }
            [.., Step::Vertex(corner, line)] => (corner, line),
            _ => return None,
        };
        self.with_heading(outgoing, corner, (line.heading + 2) % 4).first().copied()
    }

    /// Traces an isoline to the first node, at most for a length of `limit` in the map.
    pub fn trace(&self, isoline: OutgoingIsoline, limit: f64) -> Result<TracedIsoline, Stop> {
        let mut steps = Vec::new();
        let length = self.trace_into(&mut steps, isoline, limit)?;
        Ok(TracedIsoline { steps, length })
    }

    /// As [`Self::trace`]; the points are added to `steps`, also if the trace stops before a node. Returns the length.
    pub fn trace_into(&self, steps: &mut Vec<Step>, isoline: OutgoingIsoline, limit: f64) -> Result<f64, Stop> {
        let mesh = self.mesh;
        let along_boundary =
            isoline.exit == Exit::Back || isoline.exit == Exit::Along && mesh.twin(isoline.corner).is_none();
        let mut line = Line { start: self.uv(isoline.corner), heading: isoline.heading };
        steps.push(Step::Vertex(isoline.corner, line));
        let mut at = self.leave(isoline.corner, isoline.exit);
        // An isoline crosses a half-edge at most once, except among flipped triangles, where it might be periodic.
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
                    let (next, in_chart, exit) = self.pass(corner, line, along_boundary.then_some(isoline.exit))?;
                    line = in_chart;
                    at = self.leave(next, exit);
                }
                At::Leaving(h) => {
                    let t = self.crossing(h, &line);
                    let (right, left) = (self.uv(h), self.uv(mesh.next(h)));
                    if let Some(end) = self.snapped_vertex(h, t, &line) {
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
                    if !self.cross_flipped && self.map.is_flipped(mesh.face(g)) {
                        return Err(Stop::FlippedTriangle(mesh.face(g)));
                    }
                    line = line.in_chart(&change);
                    let apex_left = line.signed_distance(self.uv(mesh.prev(g))) > 0.0;
                    at = At::Leaving(if apex_left { mesh.next(g) } else { mesh.prev(g) });
                }
            }
        }
        Err(Stop::Length(mesh.face(isoline.corner)))
    }

    /// Where a line crosses a half-edge from right (origin) to left (target), as a fraction of the half-edge.
    pub fn crossing(&self, h: HalfedgeId, line: &Line) -> f64 {
        let (right, left) = (line.signed_distance(self.uv(h)), line.signed_distance(self.uv(self.mesh.next(h))));
        -right / (left - right)
    }

    /// The corner at an end of `h` through which a line that crosses `h` at `t` is led instead; `None` if the crossing
    /// is kept.
    fn snapped_vertex(&self, h: HalfedgeId, t: f64, line: &Line) -> Option<HalfedgeId> {
        let end = if t < 0.5 { h } else { self.mesh.next(h) };
        let signed_distance = line.signed_distance(self.uv(end));
        let rounding =
            self.rounding / (line.signed_distance(self.uv(self.mesh.next(h))) - line.signed_distance(self.uv(h))).abs();
        let away = t.min(1.0 - t);
        let goes = away <= rounding.min(MAX_ROUNDING)
            || away <= SNAP && (away <= 0.0 || self.may_move(end, signed_distance, line.heading));
        goes.then_some(end)
    }

    /// Whether the origin of a corner can be moved in the map onto a line at `signed_distance` from it without flipping
    /// a triangle.
    fn may_move(&self, corner: HalfedgeId, signed_distance: f64, heading: u8) -> bool {
        self.fan(corner, -signed_distance * direction((heading + 1) % 4)).into_iter().all(|(h, shift)| {
            let (a, b, c) = (self.uv(h), self.uv(self.mesh.next(h)), self.uv(self.mesh.prev(h)));
            (b - a).perp_dot(c - a) <= 0.0 || (b - a - shift).perp_dot(c - a - shift) > 0.0
        })
    }

    /// All corners at the origin of `corner`, each with the vector that is `vector` in the chart of `corner`,
    /// transported to its own chart.
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

    /// How a line continues at a vertex that is not a node: the corner, the line in its chart, and the exit. A line
    /// that began along the boundary, in the direction of its half-edges or against it, follows the boundary.
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
                (at, line) = (next, line.in_chart(&change));
                if at == from {
                    return Err(lost);
                }
            }
        }
        Err(lost)
    }
}

/// Removes the last crossings of edges at `v`: a line through `v` does not cross them.
fn drop_crossings_at(mesh: &TriMesh, steps: &mut Vec<Step>, v: VertexId) {
    while let Some(&Step::Edge(h, _)) = steps.last()
        && (mesh.origin(h) == v || mesh.target(h) == v)
    {
        steps.pop();
    }
}
