//! A triangle mesh that is refined so that curves become paths of its edges.
//!
//! The only operations are splitting an edge and splitting a triangle at a new vertex. A path from vertex `p`
//! to vertex `q` is drawn by splitting, in order, the edges it crosses: splitting an edge joins the new vertex
//! to the corners opposite to it, and those are `p` or the vertex made just before, and the next one or `q`.
//! So a drawn path never passes through an older vertex, two paths can only meet where one crosses an edge of
//! the other, and every meeting is a transversal crossing of exactly two (D1 and D2 of Campen, section 5.1).
//!
//! Which edges a path crosses is found by a shortest path over triangles in which crossing an older path
//! costs more than anything else. Coordinates only choose among routes that are equal in this respect, so
//! rounding can make a path ugly but not wrong.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use glam::{DVec2, DVec3};

use crate::mesh::{TriMesh, TriMeshError, VertexId};

/// "No element" in the flat arrays.
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

/// A drawn path could not be continued: its ends are not joined by the triangles it may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no way from vertex {from} to vertex {to} through the triangles allowed")]
pub struct NoPath {
    /// Start vertex.
    pub from: u32,
    /// End vertex.
    pub to: u32,
}

/// An oriented manifold triangle mesh under refinement.
///
/// Half-edge `3 f + i` runs along side `i` of face `f`, as in [`TriMesh`].
#[derive(Debug, Clone)]
pub struct RefinedMesh {
    /// Position of each vertex.
    pub positions: Vec<DVec3>,
    /// Free coordinates of each vertex, interpolated when edges are split.
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
    /// A free label of each face, inherited when it is split.
    pub tag: Vec<u32>,
}

impl RefinedMesh {
    /// A copy of `mesh` with nothing drawn on it yet.
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

    /// The corner opposite to a half-edge.
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

    /// Whether a half-edge has a triangle on its own side only.
    #[inline]
    pub fn is_boundary(&self, h: u32) -> bool {
        self.twin[h as usize] == NONE
    }

    /// An outgoing half-edge of `v`.
    #[inline]
    pub fn vertex_halfedge(&self, v: u32) -> u32 {
        self.vertex_halfedge[v as usize]
    }

    /// The outgoing half-edges of `v`, counter-clockwise; at the boundary beginning with the boundary one.
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

    /// Half-edge from `a` to `b` or, where only that exists, from `b` to `a`.
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

    /// Marks an edge.
    pub fn set_mark(&mut self, h: u32, mark: Mark) {
        self.mark[h as usize] = mark;
        if let Some(t) = self.twin(h) {
            self.mark[t as usize] = mark;
        }
    }

    /// Splits the edge of `h` at fraction `t` of its way; returns the new vertex.
    ///
    /// `h` then ends at the new vertex. Marks stay on both halves, and the two new edges across are free.
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

    /// Splits a triangle at the mean of its corners; returns the new vertex.
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

    /// Appends a free-standing face cut out of `parent`; returns its first half-edge.
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

    fn join(&mut self, h: u32, g: u32) {
        self.twin[h as usize] = g;
        self.twin[g as usize] = h;
    }

    /// Draws a path from `p` to `q` and marks its edges with `mark`; returns its vertices.
    ///
    /// The path uses triangles that `allowed` accepts, crosses as few marked edges as possible — none at all
    /// if `barrier` holds for their mark — and stays close to the straight segment in the plane of `plane`.
    ///
    /// # Errors
    ///
    /// [`NoPath`] if the triangles allowed do not join the ends.
    pub fn insert_path(
        &mut self,
        (p, q): (u32, u32),
        mark: Mark,
        allowed: impl Fn(&Self, u32) -> bool,
        barrier: impl Fn(Mark) -> bool,
        plane: impl Fn(&Self, u32) -> DVec2,
    ) -> Result<Vec<u32>, NoPath> {
        if let Some(h) = self.find(p, q)
            && self.mark(h) == Mark::Free
            && (allowed(self, h / 3) || self.twin(h).is_some_and(|t| allowed(self, t / 3)))
        {
            self.set_mark(h, mark);
            return Ok(vec![p, q]);
        }
        let crossed = self.route((p, q), allowed, barrier, &plane).ok_or(NoPath { from: p, to: q })?;
        let (start, end) = (plane(self, p), plane(self, q));
        let mut path = vec![p];
        for h in crossed {
            let (a, b) = (plane(self, self.origin(h)), plane(self, self.target(h)));
            let x = self.split_edge(h, meet(start, end, a, b));
            path.push(x);
        }
        path.push(q);
        for w in path.windows(2) {
            let h = self.find(w[0], w[1]).ok_or(NoPath { from: w[0], to: w[1] })?;
            self.set_mark(h, mark);
        }
        Ok(path)
    }

    /// The half-edges crossed on the way from `p` to `q`, each seen from the triangle that is entered: drawing
    /// splits the triangle that is left before, so that only these keep their ids.
    fn route(
        &self,
        (p, q): (u32, u32),
        allowed: impl Fn(&Self, u32) -> bool,
        barrier: impl Fn(Mark) -> bool,
        plane: &impl Fn(&Self, u32) -> DVec2,
    ) -> Option<Vec<u32>> {
        let (start, end) = (plane(self, p), plane(self, q));
        let scale = start.distance(end).max(f64::MIN_POSITIVE);
        let mut best: HashMap<u32, (f64, u32)> = HashMap::new();
        let mut heap = BinaryHeap::new();
        for h in self.outgoing(p) {
            let f = h / 3;
            if allowed(self, f) {
                best.insert(f, (0.0, NONE));
                heap.push(Reverse((Cost(0.0), f)));
            }
        }
        while let Some(Reverse((Cost(cost), f))) = heap.pop() {
            if cost > best[&f].0 {
                continue;
            }
            if (0..3).any(|i| self.origin(3 * f + i) == q) {
                return Some(self.backtrack(f, &best));
            }
            for i in 0..3 {
                let h = 3 * f + i;
                let Some(t) = self.twin(h) else { continue };
                let g = t / 3;
                // A path leaves its first triangle through the side opposite to its start.
                let leaves_badly = [self.origin(h), self.target(h)].iter().any(|&v| v == p || v == q);
                if leaves_badly || !allowed(self, g) {
                    continue;
                }
                let mark = self.mark(h);
                if mark != Mark::Free && barrier(mark) {
                    continue;
                }
                let (a, b) = (plane(self, self.origin(h)), plane(self, self.target(h)));
                let away = distance_to_segment(start, end, a, b) / scale;
                let price = cost + if mark == Mark::Free { 0.0 } else { CROSSING } + STEP + away.min(1e3);
                if best.get(&g).is_none_or(|&(old, _)| price < old) {
                    best.insert(g, (price, t));
                    heap.push(Reverse((Cost(price), g)));
                }
            }
        }
        None
    }

    fn backtrack(&self, mut f: u32, best: &HashMap<u32, (f64, u32)>) -> Vec<u32> {
        let mut crossed = Vec::new();
        loop {
            let h = best[&f].1;
            let Some(left) = (h != NONE).then(|| self.twin(h)).flatten() else {
                crossed.reverse();
                return crossed;
            };
            crossed.push(h);
            f = left / 3;
        }
    }

    /// The mesh as it is now, with the same numbering of vertices, faces and half-edges.
    ///
    /// # Errors
    ///
    /// Only if the refinement is not a manifold any more, which would be a defect of this module.
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
        let neighbours = self.outgoing(v);
        let last = neighbours.last().map_or(NONE, |&h| prev(h));
        let closing = usize::from(last != NONE && self.is_boundary(last) && self.mark(last) != Mark::Free);
        neighbours.iter().filter(|&&h| self.mark(h) != Mark::Free).count() + closing
    }

    /// The id of an original vertex, if `v` is one; `n_base` is the number of original vertices.
    pub fn base_vertex(&self, v: u32, n_base: usize) -> Option<VertexId> {
        ((v as usize) < n_base).then_some(VertexId(v))
    }
}

/// Price of crossing a marked edge: above the sum of all else that a route can cost.
const CROSSING: f64 = 1e9;
/// Price of one more triangle: small beside straying from the straight line, so that it only breaks ties.
const STEP: f64 = 1e-3;
/// How close to the end of an edge a path may cross it, as a fraction of the edge.
const MARGIN: f64 = 0.02;

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

/// Where the line `p q` meets the segment `a b`, as a fraction of the way from `a` to `b`, kept off the ends.
fn meet(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (d, e) = (q - p, b - a);
    let t = (p - a).perp_dot(d) / e.perp_dot(d);
    if t.is_finite() { t.clamp(MARGIN, 1.0 - MARGIN) } else { 0.5 }
}

/// Distance of the segment `a b` from the segment `p q`: zero where they cross.
fn distance_to_segment(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = q - p;
    let (sa, sb) = (d.perp_dot(a - p), d.perp_dot(b - p));
    let length = d.length().max(f64::MIN_POSITIVE);
    if sa * sb <= 0.0 { 0.0 } else { sa.abs().min(sb.abs()) / length }
}

/// A finite price, ordered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cost(pub f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}
