//! A disc cut out of a mesh along marked edges.
//!
//! The disc gets vertices of its own, one per wedge between cut edges, so that it is a disc even where both
//! sides of a cut belong to it. Face `k` of the piece is the `k`-th face given, with its corners in the same
//! order, so half-edges translate by arithmetic.

use std::collections::HashMap;

use crate::dual::RefinedMesh;
use crate::mesh::{HalfedgeId, TriMesh, TriMeshError};

/// A part of a mesh as a mesh of its own.
pub(crate) struct Submesh {
    /// The part.
    pub mesh: TriMesh,
    /// Vertex of the whole that each vertex of the part is a copy of.
    pub whole: Vec<u32>,
    /// Place of each face of the whole among the faces of the part.
    index: HashMap<u32, u32>,
}

impl Submesh {
    /// Cuts `faces` out of `whole` along the half-edges for which `cut` holds.
    pub(crate) fn cut_out(whole: &RefinedMesh, faces: &[u32], cut: impl Fn(u32) -> bool) -> Result<Self, TriMeshError> {
        let index: HashMap<u32, u32> = faces.iter().enumerate().map(|(k, &f)| (f, k as u32)).collect();
        let local = |h: u32| 3 * index[&(h / 3)] + h % 3;
        let joined = |h: u32| whole.twin(h).filter(|t| !cut(h) && index.contains_key(&(t / 3)));
        let mut corner = vec![u32::MAX; 3 * faces.len()];
        let mut copies = Vec::new();
        for h in faces.iter().flat_map(|&f| 3 * f..3 * f + 3) {
            if corner[local(h) as usize] != u32::MAX {
                continue;
            }
            let vertex = copies.len() as u32;
            copies.push(whole.origin(h));
            // Clockwise to the first corner of the wedge, then counter-clockwise through all of it.
            let mut first = h;
            while let Some(t) = joined(first) {
                first = crate::dual::next(t);
                if first == h {
                    break;
                }
            }
            let mut g = first;
            loop {
                corner[local(g) as usize] = vertex;
                match joined(crate::dual::prev(g)) {
                    Some(t) if t != first => g = t,
                    _ => break,
                }
            }
        }
        let positions = copies.iter().map(|&v| whole.positions[v as usize]).collect();
        let triangles: Vec<[u32; 3]> = corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Ok(Self { mesh: TriMesh::from_faces(positions, &triangles)?, whole: copies, index })
    }

    /// The half-edge of the part that is half-edge `h` of the whole.
    pub(crate) fn local(&self, h: u32) -> HalfedgeId {
        HalfedgeId(3 * self.index[&(h / 3)] + h % 3)
    }
}
