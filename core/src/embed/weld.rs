//! Making marched arcs paths of edges.
//!
//! Every triangle is cut along the pieces of arcs inside it into polygons, and these into triangles. Whether two
//! arcs cross is read off the order of their ends around the triangle, so it cannot go unnoticed.

use glam::{DVec2, DVec3};

use super::trace::TraceError;
use crate::dual::{Mark, RefinedMesh};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// A point of an arc.
#[derive(Debug, Clone, Copy)]
pub(super) enum Point {
    /// A vertex of the mesh.
    Vertex(VertexId),
    /// The crossing of a half-edge of the triangle that is left, as a fraction of its way.
    Edge(HalfedgeId, f64),
}

impl Point {
    /// Where it is in space.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        match *self {
            Self::Vertex(v) => mesh.position(v),
            Self::Edge(h, t) => mesh.position(mesh.origin(h)) + mesh.vector(h) * t,
        }
    }

    /// The same point of an arc that runs the other way.
    pub fn reversed(&self, mesh: &TriMesh) -> Self {
        match *self {
            Self::Edge(h, t) => mesh.twin(h).map_or(*self, |g| Self::Edge(g, 1.0 - t)),
            Self::Vertex(_) => *self,
        }
    }
}

/// A mesh refined along arcs.
pub(super) struct Welded {
    pub mesh: TriMesh,
    /// The same with the arcs marked.
    pub refined: RefinedMesh,
    pub base_face: Vec<u32>,
    pub map: SeamlessMap,
    /// Vertices of each arc.
    pub paths: Vec<Vec<u32>>,
}

/// Refines `mesh` along `arcs`.
pub(super) fn weld(mesh: &TriMesh, map: &SeamlessMap, arcs: &[Vec<Point>]) -> Result<Welded, TraceError> {
    let mut sheet = Sheet::new(mesh);
    let mut owner = vec![u32::MAX; mesh.n_vertices()];
    let mut paths = Vec::with_capacity(arcs.len());
    for (arc, points) in (0u32..).zip(arcs) {
        for point in points.iter().skip(1).take(points.len().saturating_sub(2)) {
            if let Point::Vertex(v) = *point {
                if owner[v.index()] != u32::MAX {
                    let face = mesh.face(mesh.vertex_halfedge(v));
                    return Err(TraceError::Crossing { arcs: [owner[v.index()], arc], face });
                }
                owner[v.index()] = arc;
            }
        }
        paths.push(sheet.lay(mesh, arc, points));
    }
    for points in &mut sheet.on_edge {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let mut out = Pieces::default();
    for f in mesh.faces() {
        out.cut(&sheet, mesh, map, f)?;
    }
    let refined_mesh = TriMesh::from_faces(sheet.positions, &out.faces)?;
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

/// The points on all edges and the chords in all triangles.
struct Sheet {
    positions: Vec<DVec3>,
    /// Points on each edge: fraction along [`TriMesh::halfedge`] and vertex; in this order after sorting.
    on_edge: Vec<Vec<(f64, u32)>>,
    /// Chords in each triangle: both end vertices and the arc.
    chords: Vec<Vec<[u32; 3]>>,
}

impl Sheet {
    fn new(mesh: &TriMesh) -> Self {
        Self {
            positions: mesh.positions().to_vec(),
            on_edge: vec![Vec::new(); mesh.n_edges()],
            chords: vec![Vec::new(); mesh.n_faces()],
        }
    }

    /// Notes the points and chords of an arc; returns its vertices.
    fn lay(&mut self, mesh: &TriMesh, arc: u32, points: &[Point]) -> Vec<u32> {
        let mut path: Vec<u32> = Vec::with_capacity(points.len());
        for (i, point) in points.iter().enumerate() {
            let vertex = match *point {
                Point::Vertex(v) => v.0,
                Point::Edge(h, t) => {
                    let (e, new) = (mesh.edge(h), self.positions.len() as u32);
                    self.positions.push(point.position(mesh));
                    self.on_edge[e.index()].push((if mesh.halfedge(e) == h { t } else { 1.0 - t }, new));
                    new
                }
            };
            // Between two vertices an arc runs along an edge.
            let face = match (i.checked_sub(1).map(|j| points[j]), *point) {
                (Some(Point::Edge(h, _)), _) => mesh.twin(h).map(|g| mesh.face(g)),
                (Some(Point::Vertex(_)), Point::Edge(h, _)) => Some(mesh.face(h)),
                _ => None,
            };
            if let (Some(f), Some(&before)) = (face, path.last()) {
                self.chords[f.index()].push([before, vertex, arc]);
            }
            path.push(vertex);
        }
        path
    }
}

/// A point on the border of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    /// Place in an equilateral triangle, which says how good pieces are whatever the triangle's own shape.
    place: DVec2,
    uv: DVec2,
    /// The sides it lies on, as bits.
    sides: u8,
}

/// The corners of an equilateral triangle.
const EQUILATERAL: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::new(0.5, 0.866_025_403_784_438_6)];

/// The triangles made so far.
#[derive(Default)]
struct Pieces {
    faces: Vec<[u32; 3]>,
    uv: Vec<[DVec2; 3]>,
    base_face: Vec<u32>,
    /// Half-edge of the base mesh that each half-edge lies on, or `u32::MAX`.
    base_halfedge: Vec<u32>,
}

impl Pieces {
    /// Cuts a triangle along its chords.
    fn cut(&mut self, sheet: &Sheet, mesh: &TriMesh, map: &SeamlessMap, f: FaceId) -> Result<(), TraceError> {
        let mut todo = vec![(border(sheet, mesh, map, f), sheet.chords[f.index()].clone())];
        while let Some((polygon, mut chords)) = todo.pop() {
            let Some([a, b, arc]) = chords.pop() else {
                self.triangulate(f, &polygon);
                continue;
            };
            let place = |v: u32| polygon.iter().position(|c| c.vertex == v);
            let crossed = |other: u32| TraceError::Crossing { arcs: [arc, other], face: f };
            let (Some(a), Some(b)) = (place(a), place(b)) else { return Err(crossed(arc)) };
            let (a, b) = (a.min(b), a.max(b));
            let one = polygon[a..=b].to_vec();
            let two: Vec<Corner> = polygon[b..].iter().chain(&polygon[..=a]).copied().collect();
            if one.len() < 3 || two.len() < 3 {
                return Err(crossed(arc));
            }
            let inside = |p: &[Corner], c: &[u32; 3]| c[..2].iter().all(|&v| p.iter().any(|x| x.vertex == v));
            let (first, rest): (Vec<_>, Vec<_>) = chords.into_iter().partition(|c| inside(&one, c));
            if let Some(c) = rest.iter().find(|c| !inside(&two, c)) {
                return Err(crossed(c[2]));
            }
            todo.push((two, rest));
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
fn border(sheet: &Sheet, mesh: &TriMesh, map: &SeamlessMap, f: FaceId) -> Vec<Corner> {
    let mut corners = Vec::new();
    for (i, h) in mesh.face_halfedges(f).into_iter().enumerate() {
        let next = (i + 1) % 3;
        let (from, to) = (map.uv[f.index()][i], map.uv[f.index()][next]);
        let sides = 1 << i | 1 << ((i + 2) % 3);
        corners.push(Corner { vertex: mesh.origin(h).0, place: EQUILATERAL[i], uv: from, sides });
        let e = mesh.edge(h);
        let points = &sheet.on_edge[e.index()];
        let forward = mesh.halfedge(e) == h;
        corners.extend((0..points.len()).map(|k| {
            let (s, vertex) = if forward { points[k] } else { points[points.len() - 1 - k] };
            let t = if forward { s } else { 1.0 - s };
            Corner { vertex, place: EQUILATERAL[i].lerp(EQUILATERAL[next], t), uv: from.lerp(to, t), sides: 1 << i }
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
