//! Making marched arcs paths of edges.
//!
//! Every triangle is cut along the pieces of arcs inside it into polygons, and these into triangles. Whether two
//! arcs cross is read off the order of their ends around the triangle, so it cannot go unnoticed.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::trace::arcs::TraceError;
use crate::embed::trace::isolines::Line;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, turn};

/// How close to each other, as a fraction of the edge, two arcs that cross may cross an edge before they meet on it:
/// what parts a triangle less evenly than this is no use to anyone.
const TOGETHER: f64 = 1e-4;

/// A point of an arc.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum Point {
    /// A vertex of the mesh.
    Vertex(VertexId),
    /// The crossing of a half-edge of the triangle that is left, as a fraction of its way, and the line in that triangle.
    Edge(HalfedgeId, f64, Line),
}

impl Point {
    /// Where it is in space.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        match *self {
            Self::Vertex(v) => mesh.position(v),
            Self::Edge(h, t, _) => mesh.position(mesh.origin(h)) + mesh.vector(h) * t,
        }
    }

    /// The same point of an arc that runs the other way.
    pub fn reversed(&self, mesh: &TriMesh, map: &SeamlessMap) -> Self {
        let Self::Edge(h, t, line) = *self else { return *self };
        let (Some(g), Some(change)) = (mesh.twin(h), map.transition(mesh, h)) else { return *self };
        Self::Edge(g, 1.0 - t, line.seen(&change).reversed())
    }
}

/// A mesh refined along arcs.
pub(in crate::embed) struct Welded {
    pub mesh: TriMesh,
    /// The same with the arcs marked.
    pub refined: RefinedMesh,
    pub base_face: Vec<u32>,
    pub map: SeamlessMap,
    /// Vertices of each arc.
    pub paths: Vec<Vec<u32>>,
}

/// What it means that two arcs meet other than at their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::embed) enum Meeting {
    /// It is an error.
    Wrong,
    /// Their paths have a vertex in common there.
    Vertex,
}

/// Refines `mesh` along `arcs`.
pub(in crate::embed) fn overlay(
    mesh: &TriMesh,
    map: &SeamlessMap,
    arcs: &[Vec<Point>],
    meeting: Meeting,
) -> Result<Welded, TraceError> {
    let mut sheet = Sheet::new(mesh);
    sheet.mark_edges(mesh, map, arcs, meeting);
    for (arc, points) in (0u32..).zip(arcs) {
        sheet.lay(mesh, arc, points, meeting)?;
    }
    let mut out = Pieces { positions: std::mem::take(&mut sheet.positions), ..Pieces::default() };
    for f in mesh.faces() {
        out.cut(border(&sheet, &out.positions, mesh, map, f), &sheet.chords[f.index()], f, meeting)?;
    }
    let path = |(arc, points): (u32, &Vec<Point>)| sheet.path(&mut out, mesh, (arc, points), meeting);
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
    Ok(Welded { mesh: refined_mesh, refined, base_face: out.base_face, map, paths })
}

/// A piece of an arc inside a triangle, or what is left of it between crossings.
#[derive(Debug, Clone, Copy)]
struct Chord {
    ends: [u32; 2],
    arc: u32,
    /// The piece of the arc, numbered by its second point.
    piece: u32,
}

/// A point on an edge where arcs cross it.
#[derive(Debug, Clone, Copy)]
struct Mile {
    /// Fraction along [`TriMesh::halfedge`].
    t: f64,
    vertex: u32,
    arc: u32,
    /// By how much its place in the map is off the edge, in the chart of the triangle of that half-edge.
    shift: DVec2,
}

/// The points on all edges and the chords in all triangles.
struct Sheet {
    positions: Vec<DVec3>,
    /// Points on each edge, in order.
    on_edge: Vec<Vec<Mile>>,
    chords: Vec<Vec<Chord>>,
    /// Arc through each vertex of the mesh, or `u32::MAX`.
    through: Vec<u32>,
    /// Vertex of each point of each arc.
    vertices: Vec<Vec<u32>>,
}

impl Sheet {
    fn new(mesh: &TriMesh) -> Self {
        Self {
            positions: mesh.positions().to_vec(),
            on_edge: vec![Vec::new(); mesh.n_edges()],
            chords: vec![Vec::new(); mesh.n_faces()],
            through: vec![u32::MAX; mesh.n_vertices()],
            vertices: Vec::new(),
        }
    }

    /// Makes the vertices of all points of arcs.
    fn mark_edges(&mut self, mesh: &TriMesh, map: &SeamlessMap, arcs: &[Vec<Point>], meeting: Meeting) {
        let mut raw: Vec<Vec<(f64, usize, usize, Line)>> = vec![Vec::new(); mesh.n_edges()];
        for (arc, points) in arcs.iter().enumerate() {
            self.vertices.push(points.iter().map(|p| if let Point::Vertex(v) = p { v.0 } else { u32::MAX }).collect());
            for (i, point) in points.iter().enumerate() {
                let Point::Edge(h, t, line) = *point else { continue };
                let e = mesh.edge(h);
                raw[e.index()].push(match map.transition(mesh, h) {
                    Some(change) if mesh.halfedge(e) != h => (1.0 - t, arc, i, line.seen(&change)),
                    _ => (t, arc, i, line),
                });
            }
        }
        for (e, mut raw) in mesh.edges().zip(raw) {
            raw.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut k = 0;
            while k < raw.len() {
                let (t, arc, i, line) = raw[k];
                let mut mile = Mile { t, vertex: self.positions.len() as u32, arc: arc as u32, shift: DVec2::ZERO };
                self.vertices[arc][i] = mile.vertex;
                k += 1;
                if let Some(&(other_t, other_arc, other_i, other)) = raw.get(k)
                    && meeting == Meeting::Vertex
                    && other_t - t < TOGETHER
                    && let Some(place) = line.meet(&other)
                {
                    k += 1;
                    self.vertices[other_arc][other_i] = mile.vertex;
                    mile.t = 0.5 * (t + other_t);
                    let h = mesh.halfedge(e);
                    let uv = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
                    mile.shift = place - uv(h).lerp(uv(mesh.next(h)), mile.t);
                }
                let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v));
                self.positions.push(a.lerp(b, mile.t));
                self.on_edge[e.index()].push(mile);
            }
        }
    }

    /// Notes the chords of an arc.
    fn lay(&mut self, mesh: &TriMesh, arc: u32, points: &[Point], meeting: Meeting) -> Result<(), TraceError> {
        for (i, point) in points.iter().enumerate() {
            if let Point::Vertex(v) = *point
                && i > 0
                && i + 1 < points.len()
            {
                let other = std::mem::replace(&mut self.through[v.index()], arc);
                if other != u32::MAX && meeting == Meeting::Wrong {
                    let face = mesh.face(mesh.vertex_halfedge(v));
                    return Err(TraceError::Crossing { arcs: [other, arc], face });
                }
            }
            // Between two vertices an arc runs along an edge.
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

    /// The vertices of an arc with those where it meets others.
    fn path(
        &self,
        pieces: &mut Pieces,
        mesh: &TriMesh,
        (arc, points): (u32, &[Point]),
        meeting: Meeting,
    ) -> Result<Vec<u32>, TraceError> {
        let vertices = &self.vertices[arc as usize];
        let mut path = vec![vertices[0]];
        for i in 1..vertices.len() {
            let start = pieces.positions[vertices[i - 1] as usize];
            let mut met = pieces.met.remove(&(arc, i as u32)).unwrap_or_default();
            if let (Point::Vertex(a), Point::Vertex(b)) = (points[i - 1], points[i]) {
                let around = |v: VertexId, w: VertexId| mesh.outgoing(v).find(|&h| mesh.target(h) == w);
                if let Some(h) = around(a, b).or_else(|| around(b, a)) {
                    let across = &self.on_edge[mesh.edge(h).index()];
                    if let Some(p) = across.first().filter(|_| meeting == Meeting::Wrong) {
                        return Err(TraceError::Crossing { arcs: [p.arc, arc], face: mesh.face(h) });
                    }
                    met.extend(across.iter().map(|p| p.vertex));
                }
            }
            let away = |v: &u32| pieces.positions[*v as usize].distance_squared(start);
            met.sort_by(|a, b| away(a).total_cmp(&away(b)));
            path.extend(met);
            path.push(vertices[i]);
        }
        Ok(path)
    }
}

/// A point on the border of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    /// Place in an equilateral triangle, which says how good pieces are whatever the triangle's own shape.
    place: DVec2,
    position: DVec3,
    uv: DVec2,
    /// The sides it lies on, as bits.
    sides: u8,
}

/// The corners of an equilateral triangle.
const EQUILATERAL: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::new(0.5, 0.866_025_403_784_438_6)];

impl Corner {
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

/// The triangles made so far.
#[derive(Default)]
struct Pieces {
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    uv: Vec<[DVec2; 3]>,
    base_face: Vec<u32>,
    /// Half-edge of the base mesh that each half-edge lies on, or `u32::MAX`.
    base_halfedge: Vec<u32>,
    /// Vertices where a piece of an arc meets others inside its triangle.
    met: BTreeMap<(u32, u32), Vec<u32>>,
}

impl Pieces {
    /// Cuts a triangle with a given border along its chords.
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
            let mut one = polygon[low..=high].to_vec();
            let mut two: Vec<Corner> = polygon[high..].iter().chain(&polygon[..=low]).copied().collect();
            let inside = |p: &[Corner], c: &Chord| c.ends.iter().all(|&v| p.iter().any(|x| x.vertex == v));
            let (mut first, rest): (Vec<_>, Vec<_>) = chords.into_iter().partition(|c| inside(&one, c));
            let (mut second, across): (Vec<_>, Vec<_>) = rest.into_iter().partition(|c| inside(&two, c));
            if let Some(c) = across.first().filter(|_| meeting == Meeting::Wrong) {
                return Err(crossed(c.arc));
            }
            let mut shared = Vec::with_capacity(across.len());
            for c in across {
                let [Some(p), Some(q)] = c.ends.map(place) else { return Err(crossed(c.arc)) };
                let t = meet([polygon[low], polygon[high]], [polygon[p], polygon[q]]);
                let vertex = self.positions.len() as u32;
                let corner = Corner::between(&polygon[low], &polygon[high], t, vertex, 0);
                self.positions.push(corner.position);
                shared.push((t, corner));
                for piece in [chord, c] {
                    self.met.entry((piece.arc, piece.piece)).or_default().push(vertex);
                }
                let halves = [Chord { ends: [c.ends[0], vertex], ..c }, Chord { ends: [vertex, c.ends[1]], ..c }];
                let starts_in_one = low < p && p < high;
                first.push(halves[usize::from(!starts_in_one)]);
                second.push(halves[usize::from(starts_in_one)]);
            }
            shared.sort_by(|a, b| a.0.total_cmp(&b.0));
            one.extend(shared.iter().rev().map(|s| s.1));
            two.extend(shared.iter().map(|s| s.1));
            if one.len() < 3 || two.len() < 3 {
                return Err(crossed(chord.arc));
            }
            todo.push((two, second));
            todo.push((one, first));
        }
        Ok(())
    }

    /// Cuts a convex polygon into triangles of which the worst is as good as possible.
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

/// The corners of a triangle and the points on its sides, counter-clockwise.
fn border(sheet: &Sheet, positions: &[DVec3], mesh: &TriMesh, map: &SeamlessMap, f: FaceId) -> Vec<Corner> {
    let mut corners = Vec::new();
    let ends = [0, 1, 2].map(|i| {
        let vertex = mesh.face_vertices(f)[i];
        let (position, uv) = (positions[vertex.index()], map.uv[f.index()][i]);
        Corner { vertex: vertex.0, place: EQUILATERAL[i], position, uv, sides: 1 << i | 1 << ((i + 2) % 3) }
    });
    for (i, h) in mesh.face_halfedges(f).into_iter().enumerate() {
        corners.push(ends[i]);
        let e = mesh.edge(h);
        let points = &sheet.on_edge[e.index()];
        let forward = mesh.halfedge(e) == h;
        let turned = if forward { 0 } else { map.transition(mesh, h).map_or(0, |c| 4 - c.turns) };
        corners.extend((0..points.len()).map(|k| {
            let mile = points[if forward { k } else { points.len() - 1 - k }];
            let t = if forward { mile.t } else { 1.0 - mile.t };
            let corner = Corner::between(&ends[i], &ends[(i + 1) % 3], t, mile.vertex, 1 << i);
            Corner { uv: corner.uv + turn(mile.shift, i32::from(turned)), ..corner }
        }));
    }
    corners
}

/// Area by the square of the longest side; zero also where two corners lie on one side with the third.
fn quality(polygon: &[Corner], corners: [usize; 3]) -> f64 {
    let [a, b, c] = corners.map(|i| polygon[i]);
    if a.sides & b.sides & c.sides != 0 {
        return 0.0;
    }
    let [a, b, c] = [a, b, c].map(|x| x.place);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    (b - a).perp_dot(c - a) / longest
}

/// Where the chord `c` meets the chord `d` in the map, as a fraction of `c` off its ends.
fn meet(c: [Corner; 2], d: [Corner; 2]) -> f64 {
    // Distance from its ends below which a crossing is put off them: what is nearer is not told apart.
    const APART: f64 = 1e-6;
    let ([a, b], [p, q]) = (c.map(|x| x.uv), d.map(|x| x.uv));
    let t = (p - a).perp_dot(q - p) / (b - a).perp_dot(q - p);
    if t.is_finite() { t.clamp(APART, 1.0 - APART) } else { 0.5 }
}
