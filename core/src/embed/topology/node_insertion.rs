//! The working mesh of an embedding: the triangles of the surface, with a vertex for every node.
//!
//! A node at a vertex of the surface stays there. Any other node is inserted: its triangle is split in three, or each
//! triangle beside its edge in two. The initial embedding lives on a refinement of the same surface, in which arcs are
//! edge paths. The new edges are inserted into that refined mesh too, so that each of its faces lies in one working
//! triangle.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::EmbeddingError;
use crate::layout::Embedding;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// The mesh that a layout is optimised on, and the initial embedding of the layout in terms of it.
pub(super) struct WorkingMesh {
    /// The surface with a vertex for every node. The vertices of the surface come first; triangle `f` of the surface,
    /// or a part of it, is triangle `f`.
    pub mesh: TriMesh,
    /// Triangle of the surface that each triangle lies in.
    pub base_face: Vec<FaceId>,
    /// Vertex of each node.
    pub nodes: Vec<VertexId>,
    /// The mesh of the initial embedding; the tag of a face is the working triangle it lies in.
    pub refined: RefinedMesh,
    /// Vertices of each arc in the refined mesh, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
    /// The vertex of the refined mesh at each vertex of the working mesh.
    pub refined_vertex: Vec<u32>,
}

impl WorkingMesh {
    /// The working mesh of `embedding` on `surface`; the first vertices of the embedding's mesh are those of the
    /// surface.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::Node`] where a node cannot be joined to the corners of its triangle.
    pub(super) fn new(surface: &TriMesh, embedding: &Embedding) -> Result<Self, EmbeddingError> {
        let mut refined = embedding.mesh.clone();
        for f in 0..refined.n_faces() {
            refined.tag[f] = embedding.base_face[refined.base_face(f as u32) as usize];
        }
        let mut faces: Vec<[u32; 3]> = surface.faces().map(|f| surface.face_vertices(f).map(|v| v.0)).collect();
        let mut base_face: Vec<FaceId> = surface.faces().collect();
        let mut positions = surface.positions().to_vec();
        let mut refined_vertex: Vec<u32> = (0..positions.len() as u32).collect();
        let mut arcs = embedding.arcs.clone();
        let mut nodes = Vec::with_capacity(embedding.nodes.len());
        for (n, &x) in embedding.nodes.iter().enumerate() {
            if (x as usize) < surface.n_vertices() {
                nodes.push(VertexId(x));
                continue;
            }
            let mut inserter = Inserter {
                refined: &mut refined,
                faces: &mut faces,
                base_face: &mut base_face,
                refined_vertex: &refined_vertex,
                n_surface: surface.n_vertices(),
                arcs: &mut arcs,
            };
            let vertex = positions.len() as u32;
            inserter.insert(x, vertex).ok_or(EmbeddingError::Node { node: n })?;
            positions.push(refined.positions[x as usize]);
            refined_vertex.push(x);
            nodes.push(VertexId(vertex));
        }
        let mesh = TriMesh::from_faces(positions, &faces)?;
        Ok(Self { mesh, base_face, nodes, refined, arcs, refined_vertex })
    }

    /// The half-edge of the working mesh that half-edge `h` of the refined mesh lies on; `None` inside a working
    /// triangle and on the boundary.
    pub(super) fn crossing(&self, h: u32) -> Option<HalfedgeId> {
        let t = self.refined.twin(h)?;
        let (f, g) = (self.refined.tag[h as usize / 3], self.refined.tag[t as usize / 3]);
        if f == g {
            return None;
        }
        let sides = self.mesh.face_halfedges(FaceId(f));
        sides.into_iter().find(|&s| self.mesh.twin(s).is_some_and(|t| self.mesh.face(t).0 == g))
    }

    /// The corner at `v` of the working triangle that face `f` of the refined mesh lies in.
    pub(super) fn corner(&self, f: u32, v: VertexId) -> Option<HalfedgeId> {
        let sides = self.mesh.face_halfedges(FaceId(self.refined.tag[f as usize]));
        sides.into_iter().find(|&s| self.mesh.origin(s) == v)
    }
}

/// Inserts nodes one by one into the working triangles and into the refined mesh.
struct Inserter<'a> {
    refined: &'a mut RefinedMesh,
    faces: &'a mut Vec<[u32; 3]>,
    base_face: &'a mut Vec<FaceId>,
    /// See [`WorkingMesh::refined_vertex`].
    refined_vertex: &'a [u32],
    /// Number of vertices of the surface, which are the first of the refined mesh, too.
    n_surface: usize,
    arcs: &'a mut Vec<Vec<u32>>,
}

/// The mark of the new edges at a node until the parts of its triangle are tagged: no curve has this index.
const NEW_EDGE: Mark = Mark::Curve(u32::MAX);

impl Inserter<'_> {
    /// Makes vertex `x` of the refined mesh vertex `vertex` of the working mesh; `None` if that cannot be done.
    fn insert(&mut self, x: u32, vertex: u32) -> Option<()> {
        let mut around: Vec<u32> = self.refined.outgoing(x).iter().map(|h| self.refined.tag[*h as usize / 3]).collect();
        around.sort_unstable();
        around.dedup();
        // Inside a triangle `x` is joined to each corner; on an edge it is joined to the opposite corner of each
        // triangle.
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
        let first = self.refined.outgoing(x)[0];
        if !self.refined.is_boundary(first) {
            return None;
        }
        // Forward along the boundary to the next corner; the other end is the corner before it.
        let corners = self.faces[f as usize];
        let is_corner = |v: u32| corners.into_iter().find(|&c| self.refined_vertex[c as usize] == v);
        let mut h = first;
        let onward = loop {
            let v = self.refined.target(h);
            if let Some(c) = is_corner(v) {
                break c;
            }
            h = self.refined.outgoing(v)[0];
        };
        let at = corners.iter().position(|&c| c == onward)?;
        Some(vec![onward, corners[(at + 2) % 3]])
    }

    /// Splits working triangle `f` at `x`, which lies on the side between `ends`, or inside the triangle if there are
    /// none.
    fn split(&mut self, f: u32, x: u32, vertex: u32, ends: Option<&[u32]>) -> Option<()> {
        let corners = self.faces[f as usize];
        let on_edge = |v: u32| ends.is_some_and(|e| e.contains(&v));
        let plane = Plane::new(corners.map(|c| self.refined.positions[self.refined_vertex[c as usize] as usize]));
        for c in corners.into_iter().filter(|&c| !on_edge(c)) {
            let path = self
                .refined
                .insert_path(
                    (x, self.refined_vertex[c as usize]),
                    NEW_EDGE,
                    |m, face| m.tag[face as usize] == f,
                    |mark| mark == NEW_EDGE,
                    |m, v| plane.project(m.positions[v as usize]),
                )
                .ok()?;
            self.insert_crossings(&path);
        }
        // One new triangle for each side that `x` does not lie on; the first takes the number `f`.
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
                self.tag_part(f, id, self.refined_vertex[a as usize], self.refined_vertex[b as usize])?;
            }
            first = false;
        }
        self.clear_marks(x);
        Some(())
    }

    /// Inserts the vertices at which a new edge crosses arcs into the paths of these arcs.
    fn insert_crossings(&mut self, path: &[u32]) {
        for &x in &path[1..path.len() - 1] {
            let outgoing = self.refined.outgoing(x);
            let mut beside: HashMap<u32, Vec<u32>> = HashMap::new();
            for h in outgoing {
                if let Mark::Arc(a) = self.refined.mark(h) {
                    beside.entry(a).or_default().push(self.refined.target(h));
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

    /// Gives the part of triangle `f` at its side from `a` to `b` (vertices of the refined mesh) the tag `id`.
    fn tag_part(&mut self, f: u32, id: u32, a: u32, b: u32) -> Option<()> {
        let inside = |m: &RefinedMesh, h: u32| m.tag[h as usize / 3] == f;
        // The first half-edge on the side: it leaves `a`, and on its right `f` ends.
        let seed = self.refined.outgoing(a).into_iter().find(|&h| {
            let outside = self.refined.twin(h).is_none_or(|t| !inside(self.refined, t));
            inside(self.refined, h) && outside && self.side_ends_at(h, b, f)
        })?;
        let mut stack = vec![seed / 3];
        self.refined.tag[seed as usize / 3] = id;
        while let Some(face) = stack.pop() {
            for h in 3 * face..3 * face + 3 {
                if self.refined.mark(h) == NEW_EDGE {
                    continue;
                }
                if let Some(t) = self.refined.twin(h).filter(|&t| self.refined.tag[t as usize / 3] == f) {
                    self.refined.tag[t as usize / 3] = id;
                    stack.push(t / 3);
                }
            }
        }
        Some(())
    }

    /// Whether the border of `f` that starts with `h` reaches `b` before any other vertex of the working mesh.
    fn side_ends_at(&self, h: u32, b: u32, f: u32) -> bool {
        let mut h = h;
        for _ in 0..self.refined.n_vertices() {
            let v = self.refined.target(h);
            if v == b {
                return true;
            }
            if (v as usize) < self.n_surface || self.refined_vertex[self.n_surface..].contains(&v) {
                return false;
            }
            // The next half-edge on the border: around `v` from the face of `h` until `f` ends.
            let mut n = crate::dual::next(h);
            while let Some(t) = self.refined.twin(n).filter(|&t| self.refined.tag[t as usize / 3] == f) {
                if self.refined.mark(n) == NEW_EDGE {
                    return false;
                }
                n = crate::dual::next(t);
            }
            h = n;
        }
        false
    }

    /// Removes the marks of the new edges at `x`; from now on the tags tell the parts apart.
    fn clear_marks(&mut self, x: u32) {
        let mut stack = vec![x];
        while let Some(v) = stack.pop() {
            for h in self.refined.outgoing(v) {
                for g in [h, crate::dual::prev(h)] {
                    if self.refined.mark(g) == NEW_EDGE {
                        self.refined.set_mark(g, Mark::Free);
                        stack.extend([self.refined.origin(g), self.refined.target(g)]);
                    }
                }
            }
        }
    }
}

/// Orthonormal coordinates in the plane of a triangle.
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

    fn project(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.x), (p - self.origin).dot(self.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::torus_layout;
    use crate::testing::torus;

    #[test]
    fn triangles_with_inserted_nodes_are_covered_by_their_parts() {
        let mesh = torus(12, 8);
        let (_, mut embedding) = torus_layout(&mesh, [12, 8], [1, 5], [2, 8]);
        // A vertex of an arc inside the surface becomes a node where the surface has no vertex.
        let n_surface = mesh.n_vertices();
        let inside = embedding.arcs.iter().flatten().find(|&&v| v as usize >= n_surface).copied();
        embedding.nodes.extend(inside);
        let working = WorkingMesh::new(&mesh, &embedding).unwrap();
        assert_eq!(working.mesh.n_vertices(), n_surface + usize::from(inside.is_some()));
        assert_eq!(working.mesh.euler_characteristic(), mesh.euler_characteristic());
        for (&v, &x) in working.nodes.iter().zip(&embedding.nodes) {
            assert_eq!(working.mesh.position(v), working.refined.positions[x as usize]);
        }
        // The new edges need not be straight in the refined mesh, so that only the triangles of the surface keep their area.
        let (mut area, mut parts) = (vec![0.0; mesh.n_faces()], vec![0.0; mesh.n_faces()]);
        for f in 0..working.refined.n_faces() as u32 {
            let corner = |h: u32| working.refined.positions[working.refined.origin(h) as usize];
            let [a, b, c] = [3 * f, 3 * f + 1, 3 * f + 2].map(corner);
            let working_face = working.refined.tag[f as usize] as usize;
            area[working.base_face[working_face].index()] += 0.5 * (b - a).cross(c - a).length();
        }
        for f in working.mesh.faces() {
            parts[working.base_face[f.index()].index()] += working.mesh.face_area(f);
        }
        for f in mesh.faces() {
            assert!((area[f.index()] - mesh.face_area(f)).abs() < 1e-12, "refined faces in {f:?}");
            assert!((parts[f.index()] - mesh.face_area(f)).abs() < 1e-12, "working triangles in {f:?}");
        }
    }
}
