//! The half-edge triangle mesh.
//!
//! Half-edge `3 f + i` runs along side `i` of face `f`, from its corner `i` to its corner `i + 1`. Hence face, next and
//! previous half-edge are computed, and only origin and twin are stored. A boundary half-edge has no twin. The mesh is
//! an oriented manifold; [`TriMesh::from_faces`] checks this once, and everything else relies on it.

use glam::DVec3;
use thiserror::Error;

use super::ids::{EdgeId, FaceId, HalfedgeId, VertexId};

/// "No element" in the flat arrays of the kernel.
const NONE: u32 = u32::MAX;

/// Why a list of triangles is not an oriented manifold mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TriMeshError {
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are only {count} vertices")]
    UnknownVertex {
        /// The face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// The number of vertices.
        count: usize,
    },
    /// A face names one vertex twice.
    #[error("face {face} names vertex {vertex} twice")]
    RepeatedVertex {
        /// The face.
        face: usize,
        /// The vertex.
        vertex: u32,
    },
    /// Two faces use an edge in the same direction (inconsistent orientation), or more than two faces share it.
    #[error("edge {from}-{to} is used twice in the same direction (by faces {first} and {second})")]
    NonManifoldEdge {
        /// Start of the directed edge.
        from: u32,
        /// End of the directed edge.
        to: u32,
        /// The first face.
        first: usize,
        /// The second face.
        second: usize,
    },
    /// The faces at a vertex form more than one fan.
    #[error("the faces at vertex {vertex} form more than one fan")]
    NonManifoldVertex {
        /// The vertex.
        vertex: u32,
    },
    /// A vertex belongs to no face.
    #[error("vertex {vertex} belongs to no face")]
    UnusedVertex {
        /// The vertex.
        vertex: u32,
    },
    /// A coordinate is not a finite number.
    #[error("vertex {vertex} has a coordinate that is not finite")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
}

/// An oriented manifold triangle mesh with or without boundary, possibly of several components.
#[derive(Debug, Clone)]
pub struct TriMesh {
    positions: Vec<DVec3>,
    /// Origin vertex of each half-edge.
    origin: Vec<u32>,
    /// Twin of each half-edge, or `NONE` on the boundary.
    twin: Vec<u32>,
    /// Undirected edge of each half-edge.
    edge: Vec<u32>,
    /// One half-edge of each edge: that of smaller id.
    edge_halfedge: Vec<u32>,
    /// One outgoing half-edge of each vertex; at a boundary vertex that without twin.
    vertex_halfedge: Vec<u32>,
}

impl TriMesh {
    /// The mesh of `faces` (three vertex indices each, counter-clockwise seen from outside) over `positions`.
    ///
    /// # Errors
    ///
    /// The first violation of: every coordinate is finite, every face has three different known vertices, the faces form
    /// an oriented manifold, every vertex has a face. See [`TriMeshError`].
    pub fn from_faces(positions: Vec<DVec3>, faces: &[[u32; 3]]) -> Result<Self, TriMeshError> {
        check_faces(&positions, faces)?;
        let origin: Vec<u32> = faces.iter().flatten().copied().collect();
        let twin = find_twins(positions.len(), &origin)?;

        let mut edge = vec![NONE; origin.len()];
        let mut edge_halfedge = Vec::with_capacity(origin.len() / 2);
        for h in 0..origin.len() {
            if edge[h] == NONE {
                edge[h] = edge_halfedge.len() as u32;
                if twin[h] != NONE {
                    edge[twin[h] as usize] = edge[h];
                }
                edge_halfedge.push(h as u32);
            }
        }

        let mut vertex_halfedge = vec![NONE; positions.len()];
        for (h, &v) in origin.iter().enumerate() {
            // At a boundary vertex the half-edge without twin is kept: from there the counter-clockwise traversal visits the
            // whole fan.
            if vertex_halfedge[v as usize] == NONE || twin[h] == NONE {
                vertex_halfedge[v as usize] = h as u32;
            }
        }
        let mesh = Self { positions, origin, twin, edge, edge_halfedge, vertex_halfedge };
        mesh.check_fans()?;
        Ok(mesh)
    }

    /// Checks that every vertex has exactly one fan of faces.
    fn check_fans(&self) -> Result<(), TriMeshError> {
        let mut degree = vec![0u32; self.n_vertices()];
        for &v in &self.origin {
            degree[v as usize] += 1;
        }
        for v in self.vertices() {
            if degree[v.index()] == 0 {
                return Err(TriMeshError::UnusedVertex { vertex: v.0 });
            }
            if self.outgoing(v).count() as u32 != degree[v.index()] {
                return Err(TriMeshError::NonManifoldVertex { vertex: v.0 });
            }
        }
        Ok(())
    }

    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.positions.len()
    }

    /// Number of triangles.
    pub fn n_faces(&self) -> usize {
        self.origin.len() / 3
    }

    /// Number of half-edges, three per triangle.
    pub fn n_halfedges(&self) -> usize {
        self.origin.len()
    }

    /// Number of undirected edges.
    pub fn n_edges(&self) -> usize {
        self.edge_halfedge.len()
    }

    /// All vertices in order.
    pub fn vertices(&self) -> impl DoubleEndedIterator<Item = VertexId> + Clone + use<> {
        (0..self.n_vertices() as u32).map(VertexId)
    }

    /// All triangles in order.
    pub fn faces(&self) -> impl DoubleEndedIterator<Item = FaceId> + Clone + use<> {
        (0..self.n_faces() as u32).map(FaceId)
    }

    /// All edges in order.
    pub fn edges(&self) -> impl DoubleEndedIterator<Item = EdgeId> + Clone + use<> {
        (0..self.n_edges() as u32).map(EdgeId)
    }

    /// All half-edges in order.
    pub fn halfedges(&self) -> impl DoubleEndedIterator<Item = HalfedgeId> + Clone + use<> {
        (0..self.n_halfedges() as u32).map(HalfedgeId)
    }

    /// Positions of all vertices.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Position of a vertex.
    #[inline]
    pub fn position(&self, v: VertexId) -> DVec3 {
        self.positions[v.index()]
    }

    /// The vertex a half-edge starts at.
    #[inline]
    pub fn origin(&self, h: HalfedgeId) -> VertexId {
        VertexId(self.origin[h.index()])
    }

    /// The vertex a half-edge ends at.
    #[inline]
    pub fn target(&self, h: HalfedgeId) -> VertexId {
        self.origin(self.next(h))
    }

    /// The vertex of the triangle of `h` opposite to `h`.
    #[inline]
    pub fn opposite(&self, h: HalfedgeId) -> VertexId {
        self.origin(self.prev(h))
    }

    /// The next half-edge around the triangle, counter-clockwise.
    #[inline]
    pub fn next(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId(if h.0 % 3 == 2 { h.0 - 2 } else { h.0 + 1 })
    }

    /// The previous half-edge around the triangle.
    #[inline]
    pub fn prev(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId(if h.0.is_multiple_of(3) { h.0 + 2 } else { h.0 - 1 })
    }

    /// The oppositely directed half-edge of the neighbouring triangle; `None` on the boundary.
    #[inline]
    pub fn twin(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let t = self.twin[h.index()];
        (t != NONE).then_some(HalfedgeId(t))
    }

    /// The triangle a half-edge belongs to.
    #[inline]
    pub fn face(&self, h: HalfedgeId) -> FaceId {
        FaceId(h.0 / 3)
    }

    /// The edge a half-edge lies on.
    #[inline]
    pub fn edge(&self, h: HalfedgeId) -> EdgeId {
        EdgeId(self.edge[h.index()])
    }

    /// The half-edge of smaller id of an edge; on the boundary its only one.
    #[inline]
    pub fn halfedge(&self, e: EdgeId) -> HalfedgeId {
        HalfedgeId(self.edge_halfedge[e.index()])
    }

    /// The three half-edges of a triangle, in order.
    #[inline]
    pub fn face_halfedges(&self, f: FaceId) -> [HalfedgeId; 3] {
        [0, 1, 2].map(|i| HalfedgeId(3 * f.0 + i))
    }

    /// The three corners of a triangle, in order.
    #[inline]
    pub fn face_vertices(&self, f: FaceId) -> [VertexId; 3] {
        self.face_halfedges(f).map(|h| self.origin(h))
    }

    /// The two ends of an edge, in the direction of [`Self::halfedge`].
    #[inline]
    pub fn edge_vertices(&self, e: EdgeId) -> [VertexId; 2] {
        let h = self.halfedge(e);
        [self.origin(h), self.target(h)]
    }

    /// One outgoing half-edge; at a boundary vertex the one that has no twin.
    #[inline]
    pub fn vertex_halfedge(&self, v: VertexId) -> HalfedgeId {
        HalfedgeId(self.vertex_halfedge[v.index()])
    }

    /// The outgoing half-edges of a vertex counter-clockwise, one per incident triangle.
    ///
    /// At a boundary vertex the first one has no twin. The last edge of the fan has no outgoing half-edge and is left
    /// out; [`Self::spokes`] has it.
    pub fn outgoing(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let first = self.vertex_halfedge(v);
        let mut next = Some(first);
        std::iter::from_fn(move || {
            let h = next?;
            next = self.twin(self.prev(h)).filter(|&n| n != first);
            Some(h)
        })
    }

    /// Whether an edge has a triangle on one side only.
    #[inline]
    pub fn is_boundary_edge(&self, e: EdgeId) -> bool {
        self.twin(self.halfedge(e)).is_none()
    }

    /// Whether a vertex lies on the boundary.
    #[inline]
    pub fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.twin(self.vertex_halfedge(v)).is_none()
    }

    /// The half-edge without twin that ends at a boundary vertex; some incoming half-edge at an inner vertex.
    pub fn incoming_boundary(&self, v: VertexId) -> HalfedgeId {
        let last = self.outgoing(v).last();
        self.prev(last.unwrap_or(self.vertex_halfedge(v)))
    }

    /// Moves a vertex; the connectivity stays.
    pub(crate) fn set_position(&mut self, v: VertexId, position: DVec3) {
        self.positions[v.index()] = position;
    }

    /// The same triangles, with every vertex moved by `map`.
    pub(crate) fn mapped(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        Self { positions: self.positions.iter().map(|&p| map(p)).collect(), ..self.clone() }
    }

    /// The vector along a half-edge.
    #[inline]
    pub fn vector(&self, h: HalfedgeId) -> DVec3 {
        self.position(self.target(h)) - self.position(self.origin(h))
    }

    /// Length of an edge.
    #[inline]
    pub fn edge_length(&self, e: EdgeId) -> f64 {
        self.vector(self.halfedge(e)).length()
    }

    /// Mean length of all edges; zero without edges.
    pub fn mean_edge_length(&self) -> f64 {
        self.edges().map(|e| self.edge_length(e)).sum::<f64>() / self.n_edges().max(1) as f64
    }

    /// The unit normal of a triangle times twice its area.
    #[inline]
    pub fn face_area_vector(&self, f: FaceId) -> DVec3 {
        let [a, b, c] = self.face_vertices(f).map(|v| self.position(v));
        (b - a).cross(c - a)
    }

    /// Unit normal of a triangle; zero if the triangle is degenerate.
    #[inline]
    pub fn face_normal(&self, f: FaceId) -> DVec3 {
        self.face_area_vector(f).normalize_or_zero()
    }

    /// Area of a triangle.
    #[inline]
    pub fn face_area(&self, f: FaceId) -> f64 {
        0.5 * self.face_area_vector(f).length()
    }

    /// Interior angle of the triangle of `h` at the origin of `h`, in radians.
    #[inline]
    pub fn corner_angle(&self, h: HalfedgeId) -> f64 {
        let a = self.vector(h);
        let b = -self.vector(self.prev(h));
        a.cross(b).length().atan2(a.dot(b))
    }

    /// Euler characteristic `V − E + F`.
    pub fn euler_characteristic(&self) -> i64 {
        self.n_vertices() as i64 - self.n_edges() as i64 + self.n_faces() as i64
    }
}

/// Checks coordinates and vertex indices.
fn check_faces(positions: &[DVec3], faces: &[[u32; 3]]) -> Result<(), TriMeshError> {
    if let Some(v) = positions.iter().position(|p| !p.is_finite()) {
        return Err(TriMeshError::NotFinite { vertex: v as u32 });
    }
    for (face, &[a, b, c]) in faces.iter().enumerate() {
        for vertex in [a, b, c] {
            if vertex as usize >= positions.len() {
                return Err(TriMeshError::UnknownVertex { face, vertex, count: positions.len() });
            }
        }
        if a == b || a == c {
            return Err(TriMeshError::RepeatedVertex { face, vertex: a });
        }
        if b == c {
            return Err(TriMeshError::RepeatedVertex { face, vertex: b });
        }
    }
    Ok(())
}

/// The twin of every half-edge, or `NONE`: half-edges are grouped by origin and sorted by target, so that the twin is
/// found by bisection whatever the valence.
fn find_twins(n_vertices: usize, origin: &[u32]) -> Result<Vec<u32>, TriMeshError> {
    let target = |h: usize| origin[if h % 3 == 2 { h - 2 } else { h + 1 }];
    let mut first = vec![0u32; n_vertices + 1];
    for &v in origin {
        first[v as usize + 1] += 1;
    }
    for v in 0..n_vertices {
        first[v + 1] += first[v];
    }
    let mut fill = first.clone();
    let mut out = vec![0u32; origin.len()];
    for (h, &v) in origin.iter().enumerate() {
        out[fill[v as usize] as usize] = h as u32;
        fill[v as usize] += 1;
    }
    for v in 0..n_vertices {
        let range = first[v] as usize..first[v + 1] as usize;
        let out = &mut out[range];
        out.sort_unstable_by_key(|&h| (target(h as usize), h));
        if let Some(w) = out.windows(2).find(|w| target(w[0] as usize) == target(w[1] as usize)) {
            let (first, second) = (w[0] as usize / 3, w[1] as usize / 3);
            return Err(TriMeshError::NonManifoldEdge { from: v as u32, to: target(w[0] as usize), first, second });
        }
    }
    let twin = (0..origin.len()).map(|h| {
        let b = target(h) as usize;
        let at_end = &out[first[b] as usize..first[b + 1] as usize];
        at_end.binary_search_by_key(&origin[h], |&g| target(g as usize)).map_or(NONE, |i| at_end[i])
    });
    Ok(twin.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        TriMesh::from_faces(p.to_vec(), &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap()
    }

    #[test]
    fn a_tetrahedron_is_closed_and_consistent() {
        let m = tetrahedron();
        assert_eq!((m.n_vertices(), m.n_edges(), m.n_faces()), (4, 6, 4));
        assert_eq!(m.euler_characteristic(), 2);
        for h in m.halfedges() {
            let t = m.twin(h).unwrap();
            assert_eq!(m.twin(t), Some(h));
            assert_eq!((m.origin(t), m.target(t)), (m.target(h), m.origin(h)));
            assert_eq!(m.edge(t), m.edge(h));
        }
        for v in m.vertices() {
            assert_eq!(m.outgoing(v).count(), 3);
            assert!(m.outgoing(v).all(|h| m.origin(h) == v));
        }
    }

    #[test]
    fn a_boundary_fan_starts_at_the_boundary() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let m = TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
        assert!(m.vertices().all(|v| m.is_boundary_vertex(v)));
        assert_eq!(m.outgoing(VertexId(0)).count(), 2);
        assert_eq!(m.edges().filter(|&e| m.is_boundary_edge(e)).count(), 4);
    }

    #[test]
    fn a_vertex_may_have_any_valence() {
        // A disc of 200 000 triangles around one vertex: time quadratic in the valence would not end.
        let n = 200_000u32;
        let rim = (0..n).map(|i| DVec3::new(f64::from(i).cos(), f64::from(i).sin(), 0.0));
        let faces: Vec<[u32; 3]> = (0..n).map(|i| [0, i + 1, (i + 1) % n + 1]).collect();
        let m = TriMesh::from_faces(std::iter::once(DVec3::ZERO).chain(rim).collect(), &faces).unwrap();
        assert_eq!((m.outgoing(VertexId(0)).count(), m.euler_characteristic()), (n as usize, 1));
    }

    #[test]
    fn lists_that_are_no_oriented_manifold_are_refused() {
        let p = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let err = |f: &[[u32; 3]]| TriMesh::from_faces(p.clone(), f).unwrap_err();
        assert!(matches!(err(&[[0, 1, 9]]), TriMeshError::UnknownVertex { vertex: 9, .. }));
        assert!(matches!(err(&[[0, 1, 1]]), TriMeshError::RepeatedVertex { vertex: 1, .. }));
        assert!(matches!(err(&[[0, 1, 2], [0, 1, 3]]), TriMeshError::NonManifoldEdge { .. }));
        assert!(matches!(err(&[[0, 1, 2], [0, 3, 4]]), TriMeshError::NonManifoldVertex { vertex: 0 }));
        assert!(matches!(err(&[[0, 1, 2]]), TriMeshError::UnusedVertex { vertex: 3 }));
    }
}
