//! A triangle mesh under refinement, with marked edges.
//!
//! The only operations are splitting an edge and splitting a triangle at a new vertex. Marked edges are the paths of curves or
//! layout arcs ([`super::path_insertion`]).

use glam::{DVec2, DVec3};

use crate::mesh::{TriMesh, TriMeshError, VertexId};

/// The index that stands for no element in the flat arrays.
pub(crate) const NONE: u32 = u32::MAX;

/// What runs along an edge of a [`RefinedMesh`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mark {
    /// Nothing.
    Free,
    /// The curve with this index.
    Curve(u32),
    /// The layout arc with this index.
    Arc(u32),
}

/// An oriented manifold triangle mesh under refinement.
///
/// Half-edge `3 f + i` runs along side `i` of face `f`, as in [`TriMesh`].
#[derive(Debug, Clone)]
pub struct RefinedMesh {
    /// Position of each vertex.
    pub positions: Vec<DVec3>,
    /// Coordinates of each vertex, for the caller's use; interpolated when edges and faces are split.
    pub uv: Vec<DVec2>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    mark: Vec<Mark>,
    /// Half-edge of the original mesh that a half-edge lies on, or `NONE`.
    base_halfedge: Vec<u32>,
    /// An outgoing half-edge of each vertex.
    vertex_halfedge: Vec<u32>,
    /// Triangle of the original mesh that each face lies in.
    base_face: Vec<u32>,
    /// A label of each face, for the caller's use; inherited when the face is split.
    pub tag: Vec<u32>,
}

impl RefinedMesh {
    /// A copy of `mesh` without marks.
    pub fn new(mesh: &TriMesh) -> Self {
        let halfedges = || mesh.halfedges();
        Self {
            positions: mesh.positions().to_vec(),
            uv: vec![DVec2::ZERO; mesh.n_vertices()],
            origin: halfedges().map(|h| mesh.origin(h).0).collect(),
            twin: halfedges().map(|h| mesh.twin(h).map_or(NONE, |t| t.0)).collect(),
            mark: vec![Mark::Free; mesh.n_halfedges()],
            base_halfedge: (0..mesh.n_halfedges() as u32).collect(),
            vertex_halfedge: mesh.vertices().map(|v| mesh.vertex_halfedge(v).0).collect(),
            base_face: (0..mesh.n_faces() as u32).collect(),
            tag: vec![0; mesh.n_faces()],
        }
    }

    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.positions.len()
    }

    /// Number of triangles.
    pub fn n_faces(&self) -> usize {
        self.base_face.len()
    }

    /// Origin vertex of a half-edge.
    #[inline]
    pub fn origin(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// Target vertex of a half-edge.
    #[inline]
    pub fn target(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    /// The vertex opposite to a half-edge in its triangle.
    #[inline]
    pub fn opposite(&self, h: u32) -> u32 {
        self.origin[prev(h) as usize]
    }

    /// Twin of a half-edge; `None` on the boundary.
    #[inline]
    pub fn twin(&self, h: u32) -> Option<u32> {
        let t = self.twin[h as usize];
        (t != NONE).then_some(t)
    }

    /// What runs along a half-edge.
    #[inline]
    pub fn mark(&self, h: u32) -> Mark {
        self.mark[h as usize]
    }

    /// The half-edge of the original mesh that `h` lies on, if any.
    #[inline]
    pub fn base_halfedge(&self, h: u32) -> Option<u32> {
        let b = self.base_halfedge[h as usize];
        (b != NONE).then_some(b)
    }

    /// The triangle of the original mesh that face `f` lies in.
    #[inline]
    pub fn base_face(&self, f: u32) -> u32 {
        self.base_face[f as usize]
    }

    /// Whether a half-edge lies on the boundary, that is has no twin.
    #[inline]
    pub fn is_boundary(&self, h: u32) -> bool {
        self.twin[h as usize] == NONE
    }

    /// An outgoing half-edge of `v`.
    #[inline]
    pub fn vertex_halfedge(&self, v: u32) -> u32 {
        self.vertex_halfedge[v as usize]
    }

    /// The outgoing half-edges of `v`, counter-clockwise; at the boundary, from the boundary half-edge on.
    pub fn outgoing(&self, v: u32) -> Vec<u32> {
        let start = self.vertex_halfedge[v as usize];
        let mut first = start;
        while let Some(t) = self.twin(first) {
            first = next(t);
            if first == start {
                break;
            }
        }
        let mut list = vec![first];
        let mut h = first;
        while let Some(t) = self.twin(prev(h)) {
            h = t;
            if h == first {
                break;
            }
            list.push(h);
        }
        list
    }

    /// The neighbours of a vertex, counter-clockwise; at the boundary from the target of the boundary half-edge that
    /// leaves it to the origin of the one that arrives.
    pub fn neighbours(&self, v: u32) -> Vec<u32> {
        let outgoing = self.outgoing(v);
        let mut list: Vec<u32> = outgoing.iter().map(|&h| self.target(h)).collect();
        let last = outgoing[outgoing.len() - 1];
        if self.is_boundary(prev(last)) {
            list.push(self.opposite(last));
        }
        list
    }

    /// Half-edge from `a` to `b`, or from `b` to `a` if only that exists, as on the boundary; `None` without an edge.
    pub fn find(&self, a: u32, b: u32) -> Option<u32> {
        self.outgoing(a).into_iter().find_map(|h| {
            if self.target(h) == b {
                Some(h)
            } else if self.opposite(h) == b && self.is_boundary(prev(h)) {
                Some(prev(h))
            } else {
                None
            }
        })
    }

    /// Sets the mark of an edge.
    pub fn set_mark(&mut self, h: u32, mark: Mark) {
        self.mark[h as usize] = mark;
        if let Some(t) = self.twin(h) {
            self.mark[t as usize] = mark;
        }
    }

    /// Splits the edge of `h` at the fraction `t` from its origin; returns the new vertex.
    ///
    /// `h` then ends at the new vertex. Both halves keep the mark; the new edges to the opposite vertices are free.
    pub fn split_edge(&mut self, h: u32, t: f64) -> u32 {
        let (a, b) = (self.origin(h) as usize, self.target(h) as usize);
        let x = self.add_vertex(self.positions[a].lerp(self.positions[b], t), self.uv[a].lerp(self.uv[b], t));
        let twin = self.twin(h);
        let far = self.halve(h, x);
        match twin {
            Some(g) => {
                let near = self.halve(g, x);
                // `g` now runs from b to x beside `far`, and `near` from x to a beside `h`.
                self.join(h, near);
                self.join(far, g);
            }
            None => self.twin[far as usize] = NONE,
        }
        self.vertex_halfedge[x as usize] = far;
        x
    }

    /// Splits the triangle of `h` by joining `x`, a new vertex on `h`, to the opposite corner. Returns the
    /// half-edge from `x` to the old target; its twin is left to the caller.
    fn halve(&mut self, h: u32, x: u32) -> u32 {
        let (n, f) = (next(h), h / 3);
        let (b, c) = (self.origin(n), self.opposite(h));
        let new = self.add_face([x, b, c], f);
        let (far, outer, inner) = (new, new + 1, new + 2);
        self.mark[far as usize] = self.mark(h);
        self.base_halfedge[far as usize] = self.base_halfedge[h as usize];
        // The side b → c moves to the new face; the side x → c takes its place.
        self.mark[outer as usize] = self.mark(n);
        self.base_halfedge[outer as usize] = self.base_halfedge[n as usize];
        match self.twin(n) {
            Some(t) => self.join(outer, t),
            None => self.twin[outer as usize] = NONE,
        }
        self.origin[n as usize] = x;
        self.mark[n as usize] = Mark::Free;
        self.base_halfedge[n as usize] = NONE;
        self.join(n, inner);
        self.vertex_halfedge[b as usize] = outer;
        self.vertex_halfedge[c as usize] = inner;
        far
    }

    /// Splits a triangle at the mean of its vertices; returns the new vertex.
    pub fn split_face(&mut self, f: u32) -> u32 {
        let [ha, hb, hc] = [3 * f, 3 * f + 1, 3 * f + 2];
        let [a, b, c] = [ha, hb, hc].map(|h| self.origin(h));
        let mean = |p: DVec3, q: DVec3, r: DVec3| (p + q + r) / 3.0;
        let at = [a, b, c].map(|v| v as usize);
        let position = mean(self.positions[at[0]], self.positions[at[1]], self.positions[at[2]]);
        let x = self.add_vertex(position, (self.uv[at[0]] + self.uv[at[1]] + self.uv[at[2]]) / 3.0);
        let bcx = self.add_face([b, c, x], f);
        let cax = self.add_face([c, a, x], f);
        for (from, to) in [(hb, bcx), (hc, cax)] {
            self.mark[to as usize] = self.mark(from);
            self.base_halfedge[to as usize] = self.base_halfedge[from as usize];
            match self.twin(from) {
                Some(t) => self.join(to, t),
                None => self.twin[to as usize] = NONE,
            }
        }
        for h in [hb, hc] {
            self.mark[h as usize] = Mark::Free;
            self.base_halfedge[h as usize] = NONE;
        }
        // The face itself becomes a, b, x.
        self.origin[hc as usize] = x;
        self.join(hb, bcx + 2);
        self.join(bcx + 1, cax + 2);
        self.join(cax + 1, hc);
        self.vertex_halfedge[a as usize] = ha;
        self.vertex_halfedge[b as usize] = bcx;
        self.vertex_halfedge[c as usize] = cax;
        self.vertex_halfedge[x as usize] = hc;
        x
    }

    fn add_vertex(&mut self, position: DVec3, uv: DVec2) -> u32 {
        self.positions.push(position);
        self.uv.push(uv);
        self.vertex_halfedge.push(NONE);
        self.positions.len() as u32 - 1
    }

    /// Appends a face without twins that is part of `parent`; returns its first half-edge.
    fn add_face(&mut self, corners: [u32; 3], parent: u32) -> u32 {
        let first = self.origin.len() as u32;
        self.origin.extend(corners);
        self.twin.extend([NONE; 3]);
        self.mark.extend([Mark::Free; 3]);
        self.base_halfedge.extend([NONE; 3]);
        self.base_face.push(self.base_face[parent as usize]);
        self.tag.push(self.tag[parent as usize]);
        first
    }

    /// Makes two half-edges twins.
    fn join(&mut self, h: u32, g: u32) {
        self.twin[h as usize] = g;
        self.twin[g as usize] = h;
    }

    /// The refined mesh as a triangle mesh, with the same numbering of vertices, faces and half-edges.
    ///
    /// # Errors
    ///
    /// Only if the refined mesh is not a manifold, which would be a defect of this module.
    pub fn to_mesh(&self) -> Result<TriMesh, TriMeshError> {
        let faces: Vec<[u32; 3]> = self.origin.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        TriMesh::from_faces(self.positions.clone(), &faces)
    }

    /// The vertices of face `f`.
    pub fn corners(&self, f: u32) -> [u32; 3] {
        [0, 1, 2].map(|i| self.origin(3 * f + i))
    }

    /// The number of marked edges at `v`.
    pub fn marked_degree(&self, v: u32) -> usize {
        let outgoing = self.outgoing(v);
        let last = outgoing.last().map_or(NONE, |&h| prev(h));
        let closing = usize::from(last != NONE && self.is_boundary(last) && self.mark(last) != Mark::Free);
        outgoing.iter().filter(|&&h| self.mark(h) != Mark::Free).count() + closing
    }

    /// The vertex of the original mesh that `v` is, if it is one; `n_base` is the number of original vertices.
    pub fn base_vertex(&self, v: u32, n_base: usize) -> Option<VertexId> {
        ((v as usize) < n_base).then_some(VertexId(v))
    }
}

/// Next half-edge around the triangle.
#[inline]
pub fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// Previous half-edge around the triangle.
#[inline]
pub fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    #[test]
    fn splitting_edges_and_faces_keeps_a_manifold() {
        let mut mesh = RefinedMesh::new(&square(2));
        mesh.tag[3] = 7;
        let x = mesh.split_face(3);
        assert_eq!((mesh.n_vertices(), mesh.n_faces(), mesh.outgoing(x).len()), (10, 10, 3));
        assert!(mesh.outgoing(x).iter().all(|h| mesh.tag[*h as usize / 3] == 7 && mesh.base_face(h / 3) == 3));
        let boundary = mesh.find(0, 1).unwrap();
        let y = mesh.split_edge(boundary, 0.25);
        assert_eq!((mesh.positions[y as usize], mesh.n_faces()), (DVec3::new(0.125, 0.0, 0.0), 11));
        let inner = mesh.find(1, 4).unwrap();
        let z = mesh.split_edge(inner, 0.5);
        assert_eq!((mesh.outgoing(z).len(), mesh.n_faces()), (4, 13));
        assert_eq!(mesh.to_mesh().unwrap().euler_characteristic(), 1);
    }

    #[test]
    fn both_halves_of_a_split_edge_keep_its_mark() {
        let mut mesh = RefinedMesh::new(&square(2));
        let h = mesh.find(1, 4).unwrap();
        mesh.set_mark(h, Mark::Curve(0));
        let base = mesh.base_halfedge(h);
        let x = mesh.split_edge(h, 0.5);
        assert_eq!(mesh.marked_degree(x), 2);
        for (a, b) in [(1, x), (x, 4)] {
            let half = mesh.find(a, b).unwrap();
            assert_eq!((mesh.mark(half), mesh.base_halfedge(half)), (Mark::Curve(0), base));
        }
    }

    #[test]
    fn neighbours_at_the_boundary_run_from_one_boundary_edge_to_the_other() {
        let mesh = RefinedMesh::new(&square(2));
        let neighbours = mesh.neighbours(1);
        assert_eq!((neighbours[0], neighbours[neighbours.len() - 1]), (2, 0));
        assert_eq!(mesh.neighbours(4).len(), 6);
        // Only one direction of a boundary edge has a half-edge.
        assert_eq!(mesh.find(0, 1), mesh.find(1, 0));
        assert_eq!(mesh.find(0, 8), None);
    }
}
