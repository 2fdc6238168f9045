//! The triangles around a vertex, laid flat, and the points that lie in them.
//!
//! As in MAPS (Lee, Sweldens, Schröder, Cowsar, Dobkin 1998) the star of a vertex is flattened by the polar map: lengths
//! of the spokes are kept, angles are scaled to a full turn in all; on a feature or the boundary to half a turn on
//! each side, so that the crease is straight. Every change of the mesh re-triangulates a flat polygon and finds the
//! points in it again in the new triangles: so each vertex of the original keeps its place through all changes, and
//! the place of neighbours stays one of neighbours.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::connectivity::{Connectivity, NONE, prev};

/// A star laid flat, its vertex at the origin. Buffers are kept from use to use.
#[derive(Default)]
pub(super) struct Star {
    /// The outgoing half-edges counter-clockwise, one per triangle.
    pub spokes: Vec<u32>,
    /// Their ends, and at the boundary the end of the last edge.
    pub ring: Vec<u32>,
    /// The ring in the plane.
    pub flat: Vec<DVec2>,
    /// Whether the vertex is an inner one.
    pub closed: bool,
    /// The second end of the crease in the ring, whose first is at 0.
    pub crease: Option<usize>,
}

impl Star {
    /// Gathers the star of `v`; one on a crease starts on it.
    pub fn gather(&mut self, mesh: &Connectivity, v: u32, crease: bool) {
        self.spokes.clear();
        self.ring.clear();
        mesh.for_spokes(v, |h| self.spokes.push(h));
        let first = self.spokes[0];
        self.closed = mesh.twin(first) != NONE;
        self.crease = None;
        if crease && self.closed {
            let mut ends = (0..self.spokes.len()).filter(|&i| mesh.is_feature(self.spokes[i]));
            if let (Some(i), Some(j)) = (ends.next(), ends.next()) {
                self.spokes.rotate_left(i);
                self.crease = Some(j - i);
            }
        }
        self.ring.extend(self.spokes.iter().map(|&h| mesh.target(h)));
        if !self.closed {
            let last = self.spokes[self.spokes.len() - 1];
            self.ring.push(mesh.origin(prev(last)));
            self.crease = Some(self.spokes.len());
        }
    }

    /// Position in the ring after `i`.
    #[inline]
    pub fn after(&self, i: usize) -> usize {
        if i + 1 == self.ring.len() { 0 } else { i + 1 }
    }

    /// Lays the star flat.
    pub fn flatten(&mut self, positions: &[DVec3], v: u32) {
        let center = positions[v as usize];
        let n = self.spokes.len();
        let arm = |i: usize| positions[self.ring[i] as usize] - center;
        // First the angle at which each ring vertex is, then the vertex.
        self.flat.clear();
        let mut sums = [0.0, 0.0];
        let split = self.crease.unwrap_or(n);
        for i in 0..n {
            let part = usize::from(i >= split);
            let (a, b) = (arm(i), arm(self.after(i)));
            self.flat.push(DVec2::new(sums[part], 0.0));
            sums[part] += a.cross(b).length().atan2(a.dot(b));
        }
        let whole = if self.crease.is_some() { PI } else { TAU };
        for i in 0..self.ring.len() {
            let angle = if i >= split {
                whole + if i < n { self.flat[i].x * PI / sums[1] } else { 0.0 }
            } else {
                self.flat[i].x * whole / sums[0]
            };
            let place = if i == split { -DVec2::X } else { DVec2::from_angle(angle) } * arm(i).length();
            if i < n { self.flat[i] = place } else { self.flat.push(place) }
        }
    }
}

/// The weights of `p` in a flat triangle; negative ones where it is outside.
#[inline]
pub(super) fn flat_weights(p: DVec2, [a, b, c]: [DVec2; 3]) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    [(b - p).perp_dot(c - p) / area, (c - p).perp_dot(a - p) / area, (a - p).perp_dot(b - p) / area]
}

/// A triangle of a flat polygon: the face, and its corners in the order of the face.
pub(super) type FlatFace = (u32, [DVec2; 3]);

/// The original vertices that are no vertices any more: where they lie on the changing mesh.
pub(super) struct Tracked {
    /// First point in each face.
    head: Vec<u32>,
    /// Next point in the same face.
    next: Vec<u32>,
    /// The face a point lies in; `NONE` for what is still a vertex.
    face: Vec<u32>,
    weights: Vec<[f64; 3]>,
}

impl Tracked {
    /// No vertex is gone yet.
    pub fn new(n_vertices: usize, n_faces: usize) -> Self {
        Self {
            head: vec![NONE; n_faces],
            next: vec![NONE; n_vertices],
            face: vec![NONE; n_vertices],
            weights: vec![[0.0; 3]; n_vertices],
        }
    }

    /// The face and weights of a point that is no vertex.
    pub fn place(&self, v: u32) -> Option<(u32, [f64; 3])> {
        let face = self.face[v as usize];
        (face != NONE).then(|| (face, self.weights[v as usize]))
    }

    /// Takes all points out of a flat triangle and appends them with their places in the plane.
    pub fn lift(&mut self, (face, corners): FlatFace, out: &mut Vec<(u32, DVec2)>) {
        let mut v = std::mem::replace(&mut self.head[face as usize], NONE);
        while v != NONE {
            let w = self.weights[v as usize];
            out.push((v, corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]));
            v = self.next[v as usize];
        }
    }

    /// Appends the points of a flat triangle and leaves them there.
    pub fn look(&self, (face, corners): FlatFace, out: &mut Vec<(u32, DVec2)>) {
        let mut v = self.head[face as usize];
        while v != NONE {
            let w = self.weights[v as usize];
            out.push((v, corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]));
            v = self.next[v as usize];
        }
    }

    /// Puts a point where it lies in flat triangles: the one it is deepest in.
    pub fn drop_in(&mut self, v: u32, p: DVec2, faces: &[FlatFace]) {
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

    /// Makes a point that was lifted a vertex.
    pub fn forget(&mut self, v: u32) {
        self.face[v as usize] = NONE;
    }
}

/// The triangle of a half-edge in the plane: its corners, given from the origin of the half-edge on, in face order.
#[inline]
pub(super) fn in_face_order(spoke: u32, corners: [DVec2; 3]) -> FlatFace {
    let mut ordered = [DVec2::ZERO; 3];
    for (i, c) in corners.into_iter().enumerate() {
        ordered[(spoke as usize + i) % 3] = c;
    }
    (spoke / 3, ordered)
}
