//! Positions of removed vertices on the changing mesh.
//!
//! When a flat polygon is re-triangulated, the removed vertices in it are located in the new triangles. So each vertex
//! of the original keeps a position on the current mesh through all changes, and neighbours keep neighbouring
//! positions.

use glam::DVec2;

use super::connectivity::NONE;
use super::flat_star::{FlatFace, flat_weights};

/// The removed vertices of the original, each with its face and barycentric coordinates on the current mesh.
pub(super) struct TrackedVertices {
    /// First tracked vertex in each face.
    head: Vec<u32>,
    /// Next tracked vertex in the same face.
    next: Vec<u32>,
    /// Face of each tracked vertex; `NONE` for vertices of the current mesh.
    face: Vec<u32>,
    weights: Vec<[f64; 3]>,
}

impl TrackedVertices {
    /// Tracks no vertex yet.
    pub fn new(n_vertices: usize, n_faces: usize) -> Self {
        Self {
            head: vec![NONE; n_faces],
            next: vec![NONE; n_vertices],
            face: vec![NONE; n_vertices],
            weights: vec![[0.0; 3]; n_vertices],
        }
    }

    /// Face and barycentric coordinates of a tracked vertex; `None` for a vertex of the current mesh.
    pub fn location(&self, v: u32) -> Option<(u32, [f64; 3])> {
        let face = self.face[v as usize];
        (face != NONE).then(|| (face, self.weights[v as usize]))
    }

    /// Removes all tracked vertices from a flat triangle and appends them to `out`, with positions in the plane.
    pub fn take(&mut self, (face, corners): FlatFace, out: &mut Vec<(u32, DVec2)>) {
        self.list((face, corners), out);
        self.head[face as usize] = NONE;
    }

    /// Appends the tracked vertices of a flat triangle to `out`, with positions in the plane.
    pub fn list(&self, (face, corners): FlatFace, out: &mut Vec<(u32, DVec2)>) {
        let mut v = self.head[face as usize];
        while v != NONE {
            let w = self.weights[v as usize];
            out.push((v, corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]));
            v = self.next[v as usize];
        }
    }

    /// Inserts a vertex at `p` into one of some flat triangles: the first that contains it, else the one with the
    /// largest least barycentric coordinate, to which it is clamped.
    pub fn insert(&mut self, v: u32, p: DVec2, faces: &[FlatFace]) {
        let mut best = (f64::NEG_INFINITY, NONE, [0.0; 3]);
        for &(face, corners) in faces {
            let w = flat_weights(p, corners);
            let least = w[0].min(w[1]).min(w[2]);
            if least > best.0 {
                best = (least, face, w);
                if least >= 0.0 {
                    break;
                }
            }
        }
        let (_, face, w) = best;
        let w = w.map(|x| x.max(0.0));
        let sum = w[0] + w[1] + w[2];
        let i = v as usize;
        self.weights[i] = w.map(|x| x / sum);
        self.face[i] = face;
        self.next[i] = self.head[face as usize];
        self.head[face as usize] = v;
    }

    /// Marks a vertex, already taken out of its triangle, as a vertex of the current mesh.
    pub fn untrack(&mut self, v: u32) {
        self.face[v as usize] = NONE;
    }
}
