//! The sheets of strips: the covered triangles of each strip, joined where the distance from the spine is continuous.
//!
//! A strip may cover a triangle along both families of isolines, and come around to a place at another distance. So one
//! vertex of the mesh can have several distances. A sheet has a vertex of its own for each.

use plait_core::mesh::{FaceId, HalfedgeId, TriMesh, components};
use plait_core::strip::{StripCoverage, StripMap};

/// Distances of a vertex in two triangles that differ by no more are equal; in lengths on the mesh, which has a
/// model size of 1. Far above the rounding of `f32`, far below the distance of two lines.
const SAME_DISTANCE: f32 = 1e-5;

/// Distances below this are those of points on the spine, in lengths on the mesh: 0 up to rounding.
const ON_SPINE: f64 = 1e-7;

/// No vertex of a sheet.
pub const NONE: u32 = u32::MAX;

/// Which strip covers each triangle along both families of isolines, at which distances: as [`StripMap`] has it at first.
#[derive(Clone)]
pub struct Cover<'a> {
    /// The mesh of the strip map.
    pub mesh: &'a TriMesh,
    /// The strips.
    pub strips: &'a [StripCoverage],
    /// See [`StripMap::covered`].
    pub strip: Vec<[Option<u32>; 2]>,
    /// See [`StripMap::spine_distance`].
    pub distance: Vec<[[f32; 3]; 2]>,
}

impl<'a> Cover<'a> {
    /// The cover of a strip map of `mesh`.
    pub fn new(mesh: &'a TriMesh, map: &'a StripMap) -> Self {
        Self { mesh, strips: &map.strips, strip: map.covered.clone(), distance: map.spine_distance.clone() }
    }

    /// Whether a strip is wider than the smaller of two distances on the same side of its spine.
    pub fn is_within(&self, strip: u32, a: f32, b: f32) -> bool {
        let width = self.strips[strip as usize].widths[usize::from(a + b < 0.0)];
        f64::from(a.abs().min(b.abs())) < width
    }
}

/// All sheets of a cover. A corner of a triangle has the number `6 f + 3 k + i`: triangle, family of isolines, corner.
pub struct Sheets {
    /// The vertex of each corner; [`NONE`] where no strip covers the triangle.
    pub vertex_of_corner: Vec<u32>,
    /// Signed distance of each vertex from the spine.
    pub distance: Vec<f64>,
    /// Whether the sheet is cut off at the vertex, other than by its width or by the boundary of the surface.
    pub cut: Vec<bool>,
    /// First entry of `corners` for each vertex, and one past the last.
    first: Vec<u32>,
    /// The corners of each vertex.
    corners: Vec<u32>,
}

impl Sheets {
    /// The sheets of a cover.
    pub fn new(cover: &Cover<'_>) -> Self {
        let across = Across { cover };
        let n = 6 * cover.mesh.n_faces();
        let (label, n_labels) = components(n, |c: u32| across.same_vertex(c));
        let mut vertex_of_label = vec![NONE; n_labels];
        let mut sheets = Self {
            vertex_of_corner: vec![NONE; n],
            distance: Vec::new(),
            cut: Vec::new(),
            first: Vec::new(),
            corners: Vec::new(),
        };
        for c in (0..n as u32).filter(|&c| across.strip(c).is_some()) {
            let vertex = &mut vertex_of_label[label[c as usize] as usize];
            if *vertex == NONE {
                *vertex = sheets.distance.len() as u32;
                sheets.distance.push(f64::from(across.distance(c)));
            }
            sheets.vertex_of_corner[c as usize] = *vertex;
        }
        sheets.sort_corners();
        sheets.find_cuts(cover);
        sheets
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.distance.len()
    }

    /// The corners of a vertex.
    pub fn corners(&self, vertex: usize) -> &[u32] {
        &self.corners[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }

    /// The vertices joined by an edge to the vertex of these corners, some of them twice.
    pub fn neighbours(&self, corners: &[u32]) -> impl Iterator<Item = u32> {
        let others = corners.iter().flat_map(|&c| [following(c), preceding(c)]);
        others.map(|c| self.vertex_of_corner[c as usize])
    }

    /// Whether the vertex lies on the spine of its strip.
    pub fn is_on_spine(&self, vertex: usize) -> bool {
        self.distance[vertex].abs() < ON_SPINE
    }

    /// The vertices of a covered triangle.
    pub fn triangle(&self, f: usize, k: usize) -> [usize; 3] {
        [0, 1, 2].map(|i| self.vertex_of_corner[6 * f + 3 * k + i] as usize)
    }

    fn sort_corners(&mut self) {
        self.first = vec![0; self.len() + 1];
        let of_corner = || self.vertex_of_corner.iter().enumerate().filter(|&(_, &v)| v != NONE);
        of_corner().for_each(|(_, &v)| self.first[v as usize + 1] += 1);
        for v in 0..self.distance.len() {
            self.first[v + 1] += self.first[v];
        }
        let mut next = self.first.clone();
        self.corners = vec![0; self.first[self.distance.len()] as usize];
        for (c, &v) in of_corner() {
            self.corners[next[v as usize] as usize] = c as u32;
            next[v as usize] += 1;
        }
    }

    /// Marks the ends of sides that have no continuation on the other side, though the strip is wider.
    fn find_cuts(&mut self, cover: &Cover<'_>) {
        let across = Across { cover };
        self.cut = vec![false; self.len()];
        for c in (0..self.vertex_of_corner.len() as u32).filter(|&c| across.strip(c).is_some()) {
            let (h, next) = (across.side(c), following(c));
            let inner = cover.mesh.twin(h).is_some();
            if inner && across.continued(c).is_none() && across.is_within(c, next) {
                for c in [c, next] {
                    self.cut[self.vertex_of_corner[c as usize] as usize] = true;
                }
            }
        }
    }
}

/// Whether two distances of a vertex from a spine are equal.
pub fn is_same(a: f32, b: f32) -> bool {
    (a - b).abs() < SAME_DISTANCE
}

/// The corner after `c` in its triangle.
pub fn following(c: u32) -> u32 {
    c - c % 3 + (c + 1) % 3
}

/// The corner before `c` in its triangle.
pub fn preceding(c: u32) -> u32 {
    c - c % 3 + (c + 2) % 3
}

/// The way from triangle to triangle within a sheet.
struct Across<'a> {
    cover: &'a Cover<'a>,
}

impl Across<'_> {
    /// The strip that covers the triangle of a corner, with the family of the corner.
    fn strip(&self, c: u32) -> Option<u32> {
        self.cover.strip[c as usize / 6][c as usize / 3 % 2]
    }

    fn distance(&self, c: u32) -> f32 {
        self.cover.distance[c as usize / 6][c as usize / 3 % 2][c as usize % 3]
    }

    /// The half-edge from a corner to the following one.
    fn side(&self, c: u32) -> HalfedgeId {
        self.cover.mesh.face_halfedges(FaceId(c / 6))[c as usize % 3]
    }

    /// Whether a part of the side between two corners lies within the width of the strip.
    fn is_within(&self, a: u32, b: u32) -> bool {
        self.strip(a).is_some_and(|strip| self.cover.is_within(strip, self.distance(a), self.distance(b)))
    }

    /// The two corners beyond the side from `c` to the following corner: at the same two vertices, in that order.
    fn continued(&self, c: u32) -> Option<[u32; 2]> {
        let strip = self.strip(c)?;
        let mesh = self.cover.mesh;
        let t = mesh.twin(self.side(c))?;
        let (start, end) = (mesh.next(t).index() as u32 % 3, t.index() as u32 % 3);
        let same = |a: u32, b: u32| is_same(self.distance(a), self.distance(b));
        let beyond = [0, 3].map(|family| 6 * mesh.face(t).0 + family);
        let beyond = beyond.map(|base| [base + start, base + end]);
        beyond.into_iter().find(|&[a, b]| self.strip(a) == Some(strip) && same(a, c) && same(b, following(c)))
    }

    /// The corners at the vertex of `c` in the two triangles beside that of `c`.
    fn same_vertex(&self, c: u32) -> impl Iterator<Item = u32> {
        let ahead = self.continued(c).map(|[start, _]| start);
        let behind = self.continued(preceding(c)).map(|[_, end]| end);
        ahead.into_iter().chain(behind)
    }
}
