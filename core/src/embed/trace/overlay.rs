//! The overlay of arcs and mesh: the mesh is refined so that arcs, traced as isolines, become edge paths.
//!
//! Arcs meet the edges of the mesh in points and its triangles in chords. Every triangle is cut along its chords into
//! convex polygons, and each polygon triangulated. Two chords cross if and only if their ends alternate around the
//! triangle: the decision is combinatorial, so that no crossing is missed. Crossings of arcs are refused or become
//! vertices of both.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::trace::error::TraceError;
use crate::embed::trace::isoline_points::Point;
use crate::embed::trace::isolines::{Line, corner_uv};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, turn};

/// Distance on an edge, as a fraction of it, below which the points of two crossing arcs are merged into one vertex, in
/// which they meet: the triangles between them would be slivers.
const MERGE_DISTANCE: f64 = 1e-4;

/// A mesh refined along arcs.
#[derive(Debug)]
pub(super) struct Overlay {
    /// The refined mesh; the vertices of the input mesh come first.
    pub mesh: TriMesh,
    /// The refined mesh with the edges of arcs marked.
    pub refined: RefinedMesh,
    /// Triangle of the input mesh that each triangle lies in.
    pub base_face: Vec<u32>,
    /// The map on the refined mesh; each triangle has the chart of the triangle it lies in.
    pub map: SeamlessMap,
    /// The vertices of each arc.
    pub paths: Vec<Vec<u32>>,
}

/// What to do where two arcs meet other than at their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meeting {
    /// It is an error.
    Refuse,
    /// They share a vertex.
    Vertex,
}

/// Refines `mesh` along `arcs`, given as sequences of points that start and end at vertices or on the boundary.
///
/// # Errors
///
/// [`TraceError::Crossing`] where arcs meet although that is refused, or run along the same edge; [`TraceError::Mesh`].
pub(super) fn overlay(
    mesh: &TriMesh,
    map: &SeamlessMap,
    arcs: &[Vec<Point>],
    meeting: Meeting,
) -> Result<Overlay, TraceError> {
    let mut markings = Markings::new(mesh);
    markings.add_edge_points(mesh, map, arcs, meeting);
    for (arc, points) in (0u32..).zip(arcs) {
        markings.add_chords(mesh, arc, points, meeting)?;
    }
    let mut out = Subdivision { positions: std::mem::take(&mut markings.positions), ..Subdivision::default() };
    for f in mesh.faces() {
        out.cut(border(&markings, &out.positions, mesh, map, f), &markings.chords[f.index()], f, meeting)?;
    }
    let path = |(arc, points): (u32, &Vec<Point>)| markings.path(&mut out, mesh, (arc, points), meeting);
    let paths = (0u32..).zip(arcs).map(path).collect::<Result<Vec<_>, _>>()?;
    let refined_mesh = TriMesh::from_faces(out.positions, &out.faces)?;
    let jump = refined_mesh.edges().map(|e| {
        let h = refined_mesh.halfedge(e);
        let base = HalfedgeId(out.base_halfedge[h.index()]);
        let change = (base.0 != u32::MAX).then(|| map.transition(mesh, base)).flatten();
        change.map_or(0, |c| (4 - c.turns) % 4)
    });
    let map = SeamlessMap { uv: out.uv, jump: jump.collect() };
    let mut refined = RefinedMesh::new(&refined_mesh);
    for (arc, path) in (0u32..).zip(&paths) {
        for w in path.windows(2) {
            let h = refined.find(w[0], w[1]).ok_or(TraceError::Chain { arc: arc as usize })?;
            if let Mark::Arc(other) = refined.mark(h) {
                return Err(TraceError::Crossing { arcs: [other, arc], face: FaceId(out.base_face[(h / 3) as usize]) });
            }
            refined.set_mark(h, Mark::Arc(arc));
        }
    }
    Ok(Overlay { mesh: refined_mesh, refined, base_face: out.base_face, map, paths })
}

/// A piece of an arc inside a triangle, or a part of it between crossings.
#[derive(Debug, Clone, Copy)]
struct Chord {
    /// The vertices at its ends.
    ends: [u32; 2],
    arc: u32,
    /// The number of the piece in the arc: that of the point at its end.
    piece: u32,
}

/// A point on an edge where an arc, or two, cross it.
#[derive(Debug, Clone, Copy)]
struct EdgePoint {
    /// Fraction along [`TriMesh::halfedge`].
    t: f64,
    vertex: u32,
    arc: u32,
    /// Displacement of the point from the edge in the map, in the chart of the triangle of that half-edge: where two
    /// arcs are merged, the point is their exact crossing in the map.
    shift: DVec2,
}

/// Where the arcs meet the mesh: points on its edges, chords in its triangles.
struct Markings {
    /// Positions of the vertices of the mesh and of all points on edges.
    positions: Vec<DVec3>,
    /// The points on each edge, in order.
    on_edge: Vec<Vec<EdgePoint>>,
    /// The chords in each triangle.
    chords: Vec<Vec<Chord>>,
    /// The arc that passes through each vertex of the mesh, or `u32::MAX`.
    arc_through: Vec<u32>,
    /// The vertex of each point of each arc.
    vertices: Vec<Vec<u32>>,
}

impl Markings {
    fn new(mesh: &TriMesh) -> Self {
        Self {
            positions: mesh.positions().to_vec(),
            on_edge: vec![Vec::new(); mesh.n_edges()],
            chords: vec![Vec::new(); mesh.n_faces()],
            arc_through: vec![u32::MAX; mesh.n_vertices()],
            vertices: Vec::new(),
        }
    }

    /// Adds the points of arcs on edges as vertices; where crossing arcs share vertices, close points are merged.
    fn add_edge_points(&mut self, mesh: &TriMesh, map: &SeamlessMap, arcs: &[Vec<Point>], meeting: Meeting) {
        let mut raw: Vec<Vec<(f64, usize, usize, Line)>> = vec![Vec::new(); mesh.n_edges()];
        for (arc, points) in arcs.iter().enumerate() {
            self.vertices.push(points.iter().map(|p| if let Point::Vertex(v) = p { v.0 } else { u32::MAX }).collect());
            for (i, point) in points.iter().enumerate() {
                let Point::Edge(h, t, line) = *point else { continue };
                let e = mesh.edge(h);
                raw[e.index()].push(match map.transition(mesh, h) {
                    Some(change) if mesh.halfedge(e) != h => (1.0 - t, arc, i, line.in_chart(&change)),
                    _ => (t, arc, i, line),
                });
            }
        }
        for (e, mut raw) in mesh.edges().zip(raw) {
            raw.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut k = 0;
            while k < raw.len() {
                let (t, arc, i, line) = raw[k];
                let mut edge_point =
                    EdgePoint { t, vertex: self.positions.len() as u32, arc: arc as u32, shift: DVec2::ZERO };
                self.vertices[arc][i] = edge_point.vertex;
                k += 1;
                if let Some(&(other_t, other_arc, other_i, other)) = raw.get(k)
                    && meeting == Meeting::Vertex
                    && other_t - t < MERGE_DISTANCE
                    && let Some(place) = line.intersection(&other)
                {
                    k += 1;
                    self.vertices[other_arc][other_i] = edge_point.vertex;
                    edge_point.t = 0.5 * (t + other_t);
                    let h = mesh.halfedge(e);
                    let on_edge = corner_uv(map, h).lerp(corner_uv(map, mesh.next(h)), edge_point.t);
                    edge_point.shift = place - on_edge;
                }
                let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v));
                self.positions.push(a.lerp(b, edge_point.t));
                self.on_edge[e.index()].push(edge_point);
            }
        }
    }

    /// Adds the chords of an arc.
    fn add_chords(&mut self, mesh: &TriMesh, arc: u32, points: &[Point], meeting: Meeting) -> Result<(), TraceError> {
        for (i, point) in points.iter().enumerate() {
            if let Point::Vertex(v) = *point
                && i > 0
                && i + 1 < points.len()
            {
                let other = std::mem::replace(&mut self.arc_through[v.index()], arc);
                if other != u32::MAX && meeting == Meeting::Refuse {
                    let face = mesh.face(mesh.vertex_halfedge(v));
                    return Err(TraceError::Crossing { arcs: [other, arc], face });
                }
            }
            // Between two vertices an arc runs along an edge and has no chord.
            let face = match (i.checked_sub(1).map(|j| points[j]), *point) {
                (Some(Point::Edge(h, ..)), _) => mesh.twin(h).map(|g| mesh.face(g)),
                (Some(Point::Vertex(_)), Point::Edge(h, ..)) => Some(mesh.face(h)),
                _ => None,
            };
            if let Some(f) = face {
                let vertices = &self.vertices[arc as usize];
                let ends = [vertices[i - 1], vertices[i]];
                self.chords[f.index()].push(Chord { ends, arc, piece: i as u32 });
            }
        }
        Ok(())
    }

    /// The vertices of an arc, with those where it meets others in triangles or on the edges that it runs along.
    fn path(
        &self,
        subdivision: &mut Subdivision,
        mesh: &TriMesh,
        (arc, points): (u32, &[Point]),
        meeting: Meeting,
    ) -> Result<Vec<u32>, TraceError> {
        let vertices = &self.vertices[arc as usize];
        let mut path = vec![vertices[0]];
        for i in 1..vertices.len() {
            let start = subdivision.positions[vertices[i - 1] as usize];
            let mut meetings = subdivision.meetings.remove(&(arc, i as u32)).unwrap_or_default();
            if let (Point::Vertex(a), Point::Vertex(b)) = (points[i - 1], points[i]) {
                let around = |v: VertexId, w: VertexId| mesh.outgoing(v).find(|&h| mesh.target(h) == w);
                if let Some(h) = around(a, b).or_else(|| around(b, a)) {
                    let across = &self.on_edge[mesh.edge(h).index()];
                    if let Some(p) = across.first().filter(|_| meeting == Meeting::Refuse) {
                        return Err(TraceError::Crossing { arcs: [p.arc, arc], face: mesh.face(h) });
                    }
                    meetings.extend(across.iter().map(|p| p.vertex));
                }
            }
            let away = |v: &u32| subdivision.positions[*v as usize].distance_squared(start);
            meetings.sort_by(|a, b| away(a).total_cmp(&away(b)));
            path.extend(meetings);
            path.push(vertices[i]);
        }
        Ok(path)
    }
}

/// A corner of a polygon that a triangle is cut into.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    /// Affine position in an equilateral triangle: the quality of parts is measured there, whatever the shape of the
    /// triangle.
    place: DVec2,
    position: DVec3,
    /// Coordinates in the chart of the triangle.
    uv: DVec2,
    /// The sides of the triangle that it lies on, as bits.
    sides: u8,
}

/// The corners of an equilateral triangle of side 1.
const EQUILATERAL: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::new(0.5, 0.866_025_403_784_438_6)];

impl Corner {
    /// The point at fraction `t` from `a` to `b`.
    fn between(a: &Self, b: &Self, t: f64, vertex: u32, sides: u8) -> Self {
        Self {
            vertex,
            place: a.place.lerp(b.place, t),
            position: a.position.lerp(b.position, t),
            uv: a.uv.lerp(b.uv, t),
            sides,
        }
    }
}

/// The triangles of the refined mesh made so far.
#[derive(Default)]
struct Subdivision {
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    uv: Vec<[DVec2; 3]>,
    base_face: Vec<u32>,
    /// Half-edge of the input mesh that each half-edge lies on, or `u32::MAX`.
    base_halfedge: Vec<u32>,
    /// For an arc and the number of a piece of it, the vertices where the piece crosses others inside its triangle.
    meetings: BTreeMap<(u32, u32), Vec<u32>>,
}

impl Subdivision {
    /// Cuts triangle `f`, given by the corners on its border, along its chords.
    fn cut(&mut self, border: Vec<Corner>, chords: &[Chord], f: FaceId, meeting: Meeting) -> Result<(), TraceError> {
        let mut todo = vec![(border, chords.to_vec())];
        while let Some((polygon, mut chords)) = todo.pop() {
            let Some(chord) = chords.pop() else {
                self.triangulate(f, &polygon);
                continue;
            };
            let crossed = |other: u32| TraceError::Crossing { arcs: [chord.arc, other], face: f };
            let place = |v: u32| polygon.iter().position(|c| c.vertex == v);
            let (Some(a), Some(b)) = (place(chord.ends[0]), place(chord.ends[1])) else {
                return Err(crossed(chord.arc));
            };
            let (low, high) = (a.min(b), a.max(b));
            let mut first_part = polygon[low..=high].to_vec();
            let mut second_part: Vec<Corner> = polygon[high..].iter().chain(&polygon[..=low]).copied().collect();
            let inside = |p: &[Corner], c: &Chord| c.ends.iter().all(|&v| p.iter().any(|x| x.vertex == v));
            let (mut first_chords, rest): (Vec<_>, Vec<_>) = chords.into_iter().partition(|c| inside(&first_part, c));
            let (mut second_chords, across): (Vec<_>, Vec<_>) = rest.into_iter().partition(|c| inside(&second_part, c));
            if let Some(c) = across.first().filter(|_| meeting == Meeting::Refuse) {
                return Err(crossed(c.arc));
            }
            let mut shared = Vec::with_capacity(across.len());
            for c in across {
                let [Some(p), Some(q)] = c.ends.map(place) else { return Err(crossed(c.arc)) };
                let t = chord_crossing([polygon[low], polygon[high]], [polygon[p], polygon[q]]);
                let vertex = self.positions.len() as u32;
                let corner = Corner::between(&polygon[low], &polygon[high], t, vertex, 0);
                self.positions.push(corner.position);
                shared.push((t, corner));
                for piece in [chord, c] {
                    self.meetings.entry((piece.arc, piece.piece)).or_default().push(vertex);
                }
                let halves = [Chord { ends: [c.ends[0], vertex], ..c }, Chord { ends: [vertex, c.ends[1]], ..c }];
                let starts_in_first = low < p && p < high;
                first_chords.push(halves[usize::from(!starts_in_first)]);
                second_chords.push(halves[usize::from(starts_in_first)]);
            }
            shared.sort_by(|a, b| a.0.total_cmp(&b.0));
            first_part.extend(shared.iter().rev().map(|s| s.1));
            second_part.extend(shared.iter().map(|s| s.1));
            if first_part.len() < 3 || second_part.len() < 3 {
                return Err(crossed(chord.arc));
            }
            todo.push((second_part, second_chords));
            todo.push((first_part, first_chords));
        }
        Ok(())
    }

    /// Triangulates a convex polygon such that the least quality of a triangle is largest, by dynamic programming over
    /// the diagonals.
    fn triangulate(&mut self, f: FaceId, polygon: &[Corner]) {
        let n = polygon.len();
        let mut best = vec![(f64::INFINITY, 0); n * n];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let worst = |k: usize| quality(polygon, [i, k, j]).min(best[i * n + k].0).min(best[k * n + j].0);
                let choice = (i + 1..j).map(|k| (worst(k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
                best[i * n + j] = choice.unwrap_or((0.0, i + 1));
            }
        }
        let mut todo = vec![(0, n - 1)];
        while let Some((i, j)) = todo.pop() {
            if j - i >= 2 {
                let k = best[i * n + j].1;
                self.add(f, [polygon[i], polygon[k], polygon[j]]);
                todo.extend([(i, k), (k, j)]);
            }
        }
    }

    /// Adds a triangle that lies in triangle `f`.
    fn add(&mut self, f: FaceId, corners: [Corner; 3]) {
        self.faces.push(corners.map(|c| c.vertex));
        self.uv.push(corners.map(|c| c.uv));
        self.base_face.push(f.0);
        for i in 0..3 {
            let side = corners[i].sides & corners[(i + 1) % 3].sides;
            self.base_halfedge.push(if side == 0 { u32::MAX } else { 3 * f.0 + side.trailing_zeros() });
        }
    }
}

/// The corners of a triangle and the points on its sides as a polygon, counter-clockwise.
fn border(markings: &Markings, positions: &[DVec3], mesh: &TriMesh, map: &SeamlessMap, f: FaceId) -> Vec<Corner> {
    let mut corners = Vec::new();
    let ends = [0, 1, 2].map(|i| {
        let vertex = mesh.face_vertices(f)[i];
        let (position, uv) = (positions[vertex.index()], map.uv[f.index()][i]);
        Corner { vertex: vertex.0, place: EQUILATERAL[i], position, uv, sides: 1 << i | 1 << ((i + 2) % 3) }
    });
    for (i, h) in mesh.face_halfedges(f).into_iter().enumerate() {
        corners.push(ends[i]);
        let e = mesh.edge(h);
        let points = &markings.on_edge[e.index()];
        let forward = mesh.halfedge(e) == h;
        let turned = if forward { 0 } else { map.transition(mesh, h).map_or(0, |c| 4 - c.turns) };
        corners.extend((0..points.len()).map(|k| {
            let edge_point = points[if forward { k } else { points.len() - 1 - k }];
            let t = if forward { edge_point.t } else { 1.0 - edge_point.t };
            let corner = Corner::between(&ends[i], &ends[(i + 1) % 3], t, edge_point.vertex, 1 << i);
            Corner { uv: corner.uv + turn(edge_point.shift, i32::from(turned)), ..corner }
        }));
    }
    corners
}

/// Doubled area over the squared longest side, in the equilateral triangle; zero for three corners on one side.
fn quality(polygon: &[Corner], corners: [usize; 3]) -> f64 {
    let [a, b, c] = corners.map(|i| polygon[i]);
    if a.sides & b.sides & c.sides != 0 {
        return 0.0;
    }
    let [a, b, c] = [a, b, c].map(|x| x.place);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    (b - a).perp_dot(c - a) / longest
}

/// Where chord `c` crosses chord `d` in the map, as a fraction of `c` strictly between its ends.
fn chord_crossing(c: [Corner; 2], d: [Corner; 2]) -> f64 {
    // Least distance of the crossing from the ends of the chord, as a fraction of it: the vertices must stay distinct.
    const APART: f64 = 1e-6;
    let ([a, b], [p, q]) = (c.map(|x| x.uv), d.map(|x| x.uv));
    let t = (p - a).perp_dot(q - p) / (b - a).perp_dot(q - p);
    if t.is_finite() { t.clamp(APART, 1.0 - APART) } else { 0.5 }
}
