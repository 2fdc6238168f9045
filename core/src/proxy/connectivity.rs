//! A half-edge mesh with edge collapses and flips, in the memory layout of [`TriMesh`].
//!
//! Half-edge `3 f + i` is side `i` of face `f`. The half-edges of a removed face have the origin [`NONE`]; a removed
//! vertex has the spoke [`NONE`]. Vertices keep the ids of the original mesh.

use crate::mesh::TriMesh;

/// No element, in arrays of ids.
pub(super) const NONE: u32 = u32::MAX;

/// The next half-edge around the triangle.
#[inline]
pub(super) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The previous half-edge around the triangle.
#[inline]
pub(super) fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

/// The changing mesh.
pub(super) struct Connectivity {
    origin: Vec<u32>,
    twin: Vec<u32>,
    /// Whether a half-edge lies on a feature.
    feature: Vec<bool>,
    /// One outgoing half-edge of each vertex, on the boundary if the vertex is.
    spoke: Vec<u32>,
    /// Number of edges at each vertex.
    degree: Vec<u32>,
    n_faces: usize,
}

impl Connectivity {
    /// A copy of `mesh`; `sharp` has a flag for each edge that is a feature.
    pub fn new(mesh: &TriMesh, sharp: &[bool]) -> Self {
        let mut degree = vec![0; mesh.n_vertices()];
        for e in mesh.edges() {
            mesh.edge_vertices(e).iter().for_each(|v| degree[v.index()] += 1);
        }
        Self {
            degree,
            origin: mesh.halfedges().map(|h| mesh.origin(h).0).collect(),
            twin: mesh.halfedges().map(|h| mesh.twin(h).map_or(NONE, |t| t.0)).collect(),
            feature: mesh.halfedges().map(|h| sharp[mesh.edge(h).index()]).collect(),
            spoke: mesh.vertices().map(|v| mesh.vertex_halfedge(v).0).collect(),
            n_faces: mesh.n_faces(),
        }
    }

    /// Number of remaining faces.
    pub fn n_faces(&self) -> usize {
        self.n_faces
    }

    /// Number of half-edges, those of removed faces included.
    pub fn n_halfedges(&self) -> usize {
        self.origin.len()
    }

    /// Whether the face of a half-edge remains.
    #[inline]
    pub fn has(&self, h: u32) -> bool {
        self.origin[h as usize] != NONE
    }

    /// Whether a vertex remains.
    #[inline]
    pub fn has_vertex(&self, v: u32) -> bool {
        self.spoke[v as usize] != NONE
    }

    /// One outgoing half-edge of a remaining vertex.
    pub fn spoke(&self, v: u32) -> u32 {
        self.spoke[v as usize]
    }

    /// The vertex at the start of a half-edge.
    #[inline]
    pub fn origin(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// The vertex at the end of a half-edge.
    #[inline]
    pub fn target(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    /// The twin of a half-edge, or `NONE`.
    #[inline]
    pub fn twin(&self, h: u32) -> u32 {
        self.twin[h as usize]
    }

    /// Whether a half-edge lies on a feature.
    #[inline]
    pub fn is_feature(&self, h: u32) -> bool {
        self.feature[h as usize]
    }

    /// Whether a vertex lies on the boundary.
    #[inline]
    pub fn is_boundary(&self, v: u32) -> bool {
        self.twin[self.spoke[v as usize] as usize] == NONE
    }

    /// The corners of a face.
    pub fn corners(&self, face: u32) -> [u32; 3] {
        [0, 1, 2].map(|i| self.origin[3 * face as usize + i])
    }

    /// Calls `visit` with the outgoing half-edges of a vertex, counter-clockwise; at a boundary vertex from the boundary on.
    #[inline]
    pub fn for_spokes(&self, v: u32, mut visit: impl FnMut(u32)) {
        let first = self.spoke[v as usize];
        let mut h = first;
        loop {
            visit(h);
            h = self.twin[prev(h) as usize];
            if h == NONE || h == first {
                return;
            }
        }
    }

    /// Calls `visit` with the neighbours of a vertex, counter-clockwise from the boundary.
    #[inline]
    pub fn for_neighbours(&self, v: u32, mut visit: impl FnMut(u32)) {
        let mut last = NONE;
        self.for_spokes(v, |h| {
            visit(self.target(h));
            last = prev(h);
        });
        if self.twin[last as usize] == NONE {
            visit(self.origin[last as usize]);
        }
    }

    /// Number of edges at a vertex.
    #[inline]
    pub fn degree(&self, v: u32) -> usize {
        self.degree[v as usize] as usize
    }

    /// Collapses the edge from `a` to `b` to the vertex `b`. `spokes` are all outgoing half-edges of `a`. The link
    /// condition must hold.
    pub fn collapse(&mut self, spokes: &[u32], a: u32, b: u32) {
        // The edge itself is removed, and below one edge of each pair that becomes one.
        self.degree[b as usize] += self.degree[a as usize];
        self.degree[b as usize] -= 2;
        for &h in spokes {
            self.origin[h as usize] = b;
        }
        for &h in spokes {
            let f = h - h % 3;
            // A face at the collapsed edge now has `b` as two of its corners; it is removed.
            let sides = [f, f + 1, f + 2];
            let Some(&loop_side) = sides.iter().find(|&&s| self.origin(s) == b && self.target(s) == b) else {
                continue;
            };
            let (x, y) = (self.twin[next(loop_side) as usize], self.twin[prev(loop_side) as usize]);
            let feature = self.feature[next(loop_side) as usize] || self.feature[prev(loop_side) as usize];
            let c = self.origin[prev(loop_side) as usize];
            self.degree[b as usize] -= 1;
            self.degree[c as usize] -= 1;
            for (s, other) in [(x, y), (y, x)] {
                if s != NONE {
                    self.twin[s as usize] = other;
                    self.feature[s as usize] = feature;
                }
            }
            // `x` goes from `c` to `b`, `y` from `b` to `c`: the remaining ones may become spokes of their origins.
            for v in [b, c] {
                let spoke = self.spoke[v as usize];
                if spoke != NONE && spoke - spoke % 3 == f {
                    self.spoke[v as usize] = NONE;
                }
            }
            if x != NONE && (self.spoke[c as usize] == NONE || y == NONE) {
                self.spoke[c as usize] = x;
            }
            if y != NONE && (self.spoke[b as usize] == NONE || x == NONE) {
                self.spoke[b as usize] = y;
            }
            for s in sides {
                self.origin[s as usize] = NONE;
                self.twin[s as usize] = NONE;
            }
            self.n_faces -= 1;
        }
        self.spoke[a as usize] = NONE;
        self.restore_spokes(spokes, b);
    }

    /// Sets the spokes of `b` and its neighbours where they were in a removed face, and the boundary spoke of `b`.
    fn restore_spokes(&mut self, spokes: &[u32], b: u32) {
        for &h in spokes.iter().filter(|&&h| self.origin[h as usize] != NONE) {
            let out = prev(h);
            for s in [h, next(h), out] {
                let v = self.origin[s as usize];
                if self.spoke[v as usize] == NONE || self.twin[s as usize] == NONE {
                    self.spoke[v as usize] = s;
                }
            }
        }
        debug_assert!(self.spoke[b as usize] != NONE);
    }

    /// Flips the inner edge of `h`, from `a b` to `d c` in its two triangles `a b c` and `b a d`.
    ///
    /// The face of `h` becomes `c a d`, that of its twin `d b c`, with their corners in this order.
    pub fn flip(&mut self, h: u32) {
        let g = self.twin[h as usize];
        let (a, b) = (self.origin(h), self.origin(g));
        let (c, d) = (self.origin(prev(h)), self.origin(prev(g)));
        let (f, e) = (h - h % 3, g - g % 3);
        for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
            self.degree[v as usize] = self.degree[v as usize].wrapping_add_signed(change);
        }
        // The outer sides b c, c a, a d, d b: their twins and feature flags, and their new half-edges.
        let old = [next(h), prev(h), next(g), prev(g)].map(|s| (self.twin[s as usize], self.feature[s as usize]));
        let new = [e + 1, f, f + 1, e];
        for (s, v) in [(f, c), (f + 1, a), (f + 2, d), (e, d), (e + 1, b), (e + 2, c)] {
            self.origin[s as usize] = v;
        }
        for ((t, feature), s) in old.into_iter().zip(new) {
            self.twin[s as usize] = t;
            self.feature[s as usize] = feature;
            if t != NONE {
                self.twin[t as usize] = s;
            }
            // Each of the four corners is the origin of one outer side.
            let v = self.origin[s as usize] as usize;
            let was = self.spoke[v] - self.spoke[v] % 3;
            if was == f || was == e || t == NONE {
                self.spoke[v] = s;
            }
        }
        (self.twin[f as usize + 2], self.twin[e as usize + 2]) = (e + 2, f + 2);
        (self.feature[f as usize + 2], self.feature[e as usize + 2]) = (false, false);
    }

    /// Replaces vertex `v` by vertex `w`; `spokes` are all outgoing half-edges of `v`.
    pub fn replace(&mut self, spokes: &[u32], v: u32, w: u32) {
        for &h in spokes {
            self.origin[h as usize] = w;
        }
        self.spoke[w as usize] = self.spoke[v as usize];
        self.degree[w as usize] = self.degree[v as usize];
        self.spoke[v as usize] = NONE;
    }
}
