//! The triangles under repair, and the repairs that need no traversal of the surface.

use std::collections::HashMap;

use glam::DVec3;

use super::report::Repair;
use crate::mesh::error::{FaceRef, LoadError, VertexRef};
use crate::mesh::read::RawMesh;
use crate::mesh::triangulate::Triangles;

/// The triangles of a file between the steps of repair.
pub(super) struct TriangleSoup {
    pub(super) raw: RawMesh,
    pub(super) faces: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    pub(super) source: Vec<u32>,
    pub(super) repairs: Vec<Repair>,
}

/// "None" in lists of sides and vertices.
pub(super) const NONE: u32 = u32::MAX;

/// For each side `3 f + i` of triangle `f`, the side of the neighbouring triangle, or `NONE`.
pub(super) type Pairs = Vec<u32>;

impl TriangleSoup {
    pub(super) fn new(raw: RawMesh, triangles: Triangles) -> Self {
        Self { faces: triangles.faces, source: triangles.source, repairs: Vec::new(), raw }
    }

    /// The face of a triangle, for messages.
    pub(super) fn face_ref(&self, triangle: usize) -> FaceRef {
        self.raw.face_ref(self.source[triangle] as usize)
    }

    /// A vertex, for messages.
    pub(super) fn vertex_ref(&self, vertex: usize) -> VertexRef {
        VertexRef { number: vertex + self.raw.base, position: self.raw.positions[vertex] }
    }

    /// Welds vertices of equal position if the format is a triangle soup, or if no two faces share a vertex.
    pub(super) fn weld(&mut self) {
        let unshared = self.faces.len() > 1 && self.is_unshared();
        if !self.raw.soup && !unshared {
            return;
        }
        let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.raw.positions.len());
        let mut kept: Vec<DVec3> = Vec::new();
        let mut welded = Vec::with_capacity(self.raw.positions.len());
        for &p in &self.raw.positions {
            // Adding zero turns −0 into 0.
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            let next = kept.len() as u32;
            let v = *known.entry(key).or_insert(next);
            if v == next {
                kept.push(p);
            }
            welded.push(v);
        }
        let count = welded.len() - kept.len();
        if count > 0 && !self.raw.soup {
            self.repairs.push(Repair::Welded { count });
        }
        self.raw.positions = kept;
        for v in self.faces.iter_mut().flatten() {
            *v = welded[*v as usize];
        }
    }

    /// Whether no two polygons share a vertex.
    fn is_unshared(&self) -> bool {
        let mut used_by = vec![NONE; self.raw.positions.len()];
        (0..self.raw.n_polygons()).all(|i| {
            self.raw.polygon(i).iter().all(|&v| {
                let user = std::mem::replace(&mut used_by[v as usize], i as u32);
                user == NONE || user == i as u32
            })
        })
    }

    /// Drops triangles with equal corners; `polygons` are those dropped by triangulation.
    pub(super) fn drop_degenerate(&mut self, polygons: &[u32]) {
        let degenerate = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
        let triangles = (0..self.faces.len()).filter(|&f| degenerate(&self.faces[f])).map(|f| self.source[f]);
        let mut dropped: Vec<u32> = polygons.iter().copied().chain(triangles).collect();
        dropped.sort_unstable();
        dropped.dedup();
        if let Some(&first) = dropped.first() {
            let first = self.raw.face_ref(first as usize);
            self.repairs.push(Repair::DroppedDegenerateFaces { count: dropped.len(), first });
        }
        let drop: Vec<bool> = self.faces.iter().map(degenerate).collect();
        self.drop_triangles(&drop);
    }

    /// Drops all but the first of the triangles with the same three corners.
    pub(super) fn drop_duplicates(&mut self) {
        let sorted = |f: u32| {
            let mut corners = self.faces[f as usize];
            corners.sort_unstable();
            corners
        };
        let mut order: Vec<u32> = (0..self.faces.len() as u32).collect();
        order.sort_unstable_by_key(|&f| (sorted(f), f));
        let mut drop = vec![false; self.faces.len()];
        for w in order.windows(2) {
            drop[w[1] as usize] = sorted(w[0]) == sorted(w[1]);
        }
        if let Some(first) = drop.iter().position(|&d| d) {
            let count = drop.iter().filter(|&&d| d).count();
            self.repairs.push(Repair::DroppedDuplicateFaces { count, first: self.face_ref(first) });
        }
        self.drop_triangles(&drop);
    }

    fn drop_triangles(&mut self, drop: &[bool]) {
        let mut keep = drop.iter().map(|d| !d);
        self.faces.retain(|_| keep.next().unwrap_or(true));
        let mut keep = drop.iter().map(|d| !d);
        self.source.retain(|_| keep.next().unwrap_or(true));
    }

    /// The ends of side `h`, in its direction.
    pub(super) fn side(&self, h: u32) -> (u32, u32) {
        let f = self.faces[h as usize / 3];
        (f[h as usize % 3], f[(h as usize + 1) % 3])
    }

    /// Pairs the sides of neighbouring triangles, whatever their directions.
    ///
    /// # Errors
    ///
    /// [`LoadError::NonManifoldEdge`].
    pub(super) fn pair_edges(&self) -> Result<Pairs, LoadError> {
        let key = |h: u32| {
            let (a, b) = self.side(h);
            (a.min(b), a.max(b))
        };
        let mut sides: Vec<((u32, u32), u32)> = (0..3 * self.faces.len() as u32).map(|h| (key(h), h)).collect();
        sides.sort_unstable();
        let mut pairs = vec![NONE; sides.len()];
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            match *edge {
                [_] => {}
                [(_, h), (_, g)] => {
                    pairs[h as usize] = g;
                    pairs[g as usize] = h;
                }
                _ => {
                    let ((a, b), _) = edge[0];
                    return Err(LoadError::NonManifoldEdge {
                        from: self.vertex_ref(a as usize),
                        to: self.vertex_ref(b as usize),
                        count: edge.len(),
                        first: self.face_ref(edge[0].1 as usize / 3),
                        second: self.face_ref(edge[1].1 as usize / 3),
                    });
                }
            }
        }
        Ok(pairs)
    }

    /// Drops vertices without triangle and renumbers the others in order.
    pub(super) fn drop_unused(&mut self) {
        let mut used = vec![false; self.raw.positions.len()];
        for &v in self.faces.iter().flatten() {
            used[v as usize] = true;
        }
        let Some(first) = used.iter().position(|u| !u) else { return };
        let count = used.iter().filter(|&&u| !u).count();
        self.repairs.push(Repair::DroppedUnusedVertices { count, first: self.vertex_ref(first) });
        let mut new_index = vec![NONE; used.len()];
        let mut kept = Vec::with_capacity(used.len() - count);
        for v in (0..used.len()).filter(|&v| used[v]) {
            new_index[v] = kept.len() as u32;
            kept.push(self.raw.positions[v]);
        }
        self.raw.positions = kept;
        for v in self.faces.iter_mut().flatten() {
            *v = new_index[*v as usize];
        }
    }
}
