//! The working mesh of an embedding: the surface's own triangles, with a vertex for every node.
//!
//! A node that already is a vertex of the surface stays. Any other is inserted: its triangle is split in three, or
//! the two triangles of its edge in two each. The drawing of the arcs, a refinement of the same surface, is cut
//! along the new edges too, so that each of its triangles lies in one working triangle.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::EmbeddingError;
use crate::layout::Embedding;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// The mesh a layout is optimised on, and the rough drawing of the layout in terms of it.
pub(in crate::embed) struct Working {
    /// The surface with a vertex for every node; the first vertices and triangles are those of the surface.
    pub mesh: TriMesh,
    /// Triangle of the surface that each triangle lies in.
    pub base_face: Vec<FaceId>,
    /// Vertex of each node.
    pub nodes: Vec<VertexId>,
    /// The drawing; the tag of a face is the working triangle it lies in.
    pub drawing: RefinedMesh,
    /// Vertices of each arc in the drawing, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
    /// Vertex of the drawing for each vertex.
    pub drawn: Vec<u32>,
}

impl Working {
    /// Builds the working mesh of `embedding` on `surface`, of which the embedding's first vertices are the vertices.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::Node`] where a node cannot be joined to the corners of its triangle.
    pub(in crate::embed) fn new(surface: &TriMesh, embedding: &Embedding) -> Result<Self, EmbeddingError> {
        let mut drawing = embedding.mesh.clone();
        for f in 0..drawing.n_faces() {
            drawing.tag[f] = embedding.base_face[drawing.base_face(f as u32) as usize];
        }
        let mut faces: Vec<[u32; 3]> = surface.faces().map(|f| surface.face_vertices(f).map(|v| v.0)).collect();
        let mut base_face: Vec<FaceId> = surface.faces().collect();
        let mut positions = surface.positions().to_vec();
        // Vertex of the drawing for each vertex of the working mesh.
        let mut drawn: Vec<u32> = (0..positions.len() as u32).collect();
        let mut arcs = embedding.arcs.clone();
        let mut nodes = Vec::with_capacity(embedding.nodes.len());
        for (n, &x) in embedding.nodes.iter().enumerate() {
            if (x as usize) < surface.n_vertices() {
                nodes.push(VertexId(x));
                continue;
            }
            let mut inserter = Inserter {
                drawing: &mut drawing,
                faces: &mut faces,
                base_face: &mut base_face,
                drawn: &drawn,
                n_surface: surface.n_vertices(),
                arcs: &mut arcs,
            };
            let vertex = positions.len() as u32;
            inserter.insert(x, vertex).ok_or(EmbeddingError::Node { node: n })?;
            positions.push(drawing.positions[x as usize]);
            drawn.push(x);
            nodes.push(VertexId(vertex));
        }
        let mesh = TriMesh::from_faces(positions, &faces)?;
        Ok(Self { mesh, base_face, nodes, drawing, arcs, drawn })
    }

    /// The working half-edge that half-edge `h` of the drawing lies on; `None` inside a working triangle.
    pub(in crate::embed) fn crossing(&self, h: u32) -> Option<HalfedgeId> {
        let t = self.drawing.twin(h)?;
        let (f, g) = (self.drawing.tag[h as usize / 3], self.drawing.tag[t as usize / 3]);
        if f == g {
            return None;
        }
        let sides = self.mesh.face_halfedges(FaceId(f));
        sides.into_iter().find(|&s| self.mesh.twin(s).is_some_and(|t| self.mesh.face(t).0 == g))
    }

    /// The corner of the working triangle of face `f` of the drawing at `v`.
    pub(in crate::embed) fn corner(&self, f: u32, v: VertexId) -> Option<HalfedgeId> {
        let sides = self.mesh.face_halfedges(FaceId(self.drawing.tag[f as usize]));
        sides.into_iter().find(|&s| self.mesh.origin(s) == v)
    }
}

struct Inserter<'a> {
    drawing: &'a mut RefinedMesh,
    faces: &'a mut Vec<[u32; 3]>,
    base_face: &'a mut Vec<FaceId>,
    /// Vertex of the drawing for each working vertex.
    drawn: &'a [u32],
    /// Number of vertices of the surface: these are the same in the drawing.
    n_surface: usize,
    arcs: &'a mut Vec<Vec<u32>>,
}

/// The mark of new edges while they are drawn: no curve has this index.
const SPOKE: Mark = Mark::Curve(u32::MAX);

impl Inserter<'_> {
    /// Makes drawn vertex `x` the working vertex `vertex`.
    fn insert(&mut self, x: u32, vertex: u32) -> Option<()> {
        let mut around: Vec<u32> = self.drawing.outgoing(x).iter().map(|h| self.drawing.tag[*h as usize / 3]).collect();
        around.sort_unstable();
        around.dedup();
        // Inside a triangle every corner is joined; on an edge each triangle beside it joins its opposite corner.
        let ends = match around.as_slice() {
            [f] => self.boundary_ends(x, *f),
            [f, g] => {
                let (a, b) = (self.faces[*f as usize], self.faces[*g as usize]);
                Some(a.into_iter().filter(|v| b.contains(v)).collect())
            }
            _ => return None,
        };
        for f in around {
            self.split(f, x, vertex, ends.as_deref())?;
        }
        Some(())
    }

    /// The ends of the boundary edge of `f` that `x` lies on, if it does.
    fn boundary_ends(&self, x: u32, f: u32) -> Option<Vec<u32>> {
        let first = self.drawing.outgoing(x)[0];
        if !self.drawing.is_boundary(first) {
            return None;
        }
        // Along the boundary both ways to the next working vertices.
        let corners = self.faces[f as usize];
        let is_corner = |v: u32| corners.into_iter().find(|&c| self.drawn[c as usize] == v);
        let mut h = first;
        let onward = loop {
            let v = self.drawing.target(h);
            if let Some(c) = is_corner(v) {
                break c;
            }
            h = self.drawing.outgoing(v)[0];
        };
        let at = corners.iter().position(|&c| c == onward)?;
        Some(vec![onward, corners[(at + 2) % 3]])
    }

    /// Splits working triangle `f` at `x`; on an edge only across from `ends`.
    fn split(&mut self, f: u32, x: u32, vertex: u32, ends: Option<&[u32]>) -> Option<()> {
        let corners = self.faces[f as usize];
        let on_edge = |v: u32| ends.is_some_and(|e| e.contains(&v));
        let plane = Plane::new(corners.map(|c| self.drawing.positions[self.drawn[c as usize] as usize]));
        for c in corners.into_iter().filter(|&c| !on_edge(c)) {
            let path = self
                .drawing
                .insert_path(
                    (x, self.drawn[c as usize]),
                    SPOKE,
                    |m, face| m.tag[face as usize] == f,
                    |mark| mark == SPOKE,
                    |m, v| plane.flat(m.positions[v as usize]),
                )
                .ok()?;
            self.pass_on(&path);
        }
        // The new triangles lie beside the sides that `x` is not on.
        let mut first = true;
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            if on_edge(a) && on_edge(b) {
                continue;
            }
            let id = if first { f } else { self.faces.len() as u32 };
            if first {
                self.faces[f as usize] = [vertex, a, b];
            } else {
                self.faces.push([vertex, a, b]);
                self.base_face.push(self.base_face[f as usize]);
                self.retag(f, id, self.drawn[a as usize], self.drawn[b as usize])?;
            }
            first = false;
        }
        self.unmark(x);
        Some(())
    }

    /// Inserts the points at which a new edge crosses arcs into these.
    fn pass_on(&mut self, path: &[u32]) {
        for &x in &path[1..path.len() - 1] {
            let spokes = self.drawing.outgoing(x);
            let mut beside: HashMap<u32, Vec<u32>> = HashMap::new();
            for h in spokes {
                if let Mark::Arc(a) = self.drawing.mark(h) {
                    beside.entry(a).or_default().push(self.drawing.target(h));
                }
            }
            for (a, ends) in beside {
                let arc = &mut self.arcs[a as usize];
                let at = arc.windows(2).position(|w| ends.contains(&w[0]) && ends.contains(&w[1]));
                if let Some(i) = at {
                    arc.insert(i + 1, x);
                }
            }
        }
    }

    /// Gives the part of triangle `f` at its side from `a` to `b` (vertices of the drawing) the tag `id`.
    fn retag(&mut self, f: u32, id: u32, a: u32, b: u32) -> Option<()> {
        let inside = |m: &RefinedMesh, h: u32| m.tag[h as usize / 3] == f;
        // The first drawn half-edge of the side: it leaves `a` and has the outside of `f` to its right.
        let seed = self.drawing.outgoing(a).into_iter().find(|&h| {
            let outside = self.drawing.twin(h).is_none_or(|t| !inside(self.drawing, t));
            inside(self.drawing, h) && outside && self.leads_to(h, b, f)
        })?;
        let mut stack = vec![seed / 3];
        self.drawing.tag[seed as usize / 3] = id;
        while let Some(face) = stack.pop() {
            for h in 3 * face..3 * face + 3 {
                if self.drawing.mark(h) == SPOKE {
                    continue;
                }
                if let Some(t) = self.drawing.twin(h).filter(|&t| self.drawing.tag[t as usize / 3] == f) {
                    self.drawing.tag[t as usize / 3] = id;
                    stack.push(t / 3);
                }
            }
        }
        Some(())
    }

    /// Whether the border of `f` that starts with `h` meets `b` before any other corner of a working triangle.
    fn leads_to(&self, h: u32, b: u32, f: u32) -> bool {
        let mut h = h;
        for _ in 0..self.drawing.n_vertices() {
            let v = self.drawing.target(h);
            if v == b {
                return true;
            }
            if (v as usize) < self.n_surface || self.drawn[self.n_surface..].contains(&v) {
                return false;
            }
            // The next border half-edge: turn left around `v` from the triangle of `h` until `f` ends.
            let mut n = crate::dual::next(h);
            while let Some(t) = self.drawing.twin(n).filter(|&t| self.drawing.tag[t as usize / 3] == f) {
                if self.drawing.mark(n) == SPOKE {
                    return false;
                }
                n = crate::dual::next(t);
            }
            h = n;
        }
        false
    }

    /// Frees the new edges at `x`: from now on tags tell.
    fn unmark(&mut self, x: u32) {
        let mut stack = vec![x];
        while let Some(v) = stack.pop() {
            for h in self.drawing.outgoing(v) {
                for g in [h, crate::dual::prev(h)] {
                    if self.drawing.mark(g) == SPOKE {
                        self.drawing.set_mark(g, Mark::Free);
                        stack.extend([self.drawing.origin(g), self.drawing.target(g)]);
                    }
                }
            }
        }
    }
}

/// Coordinates in the plane of a triangle.
struct Plane {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Plane {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let x = (b - a).normalize_or_zero();
        let y = (c - a).reject_from_normalized(if x == DVec3::ZERO { DVec3::X } else { x }).normalize_or_zero();
        Self { origin: a, x, y }
    }

    fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.x), (p - self.origin).dot(self.y))
    }
}
