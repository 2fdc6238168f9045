//! Submeshes cut out along marked edges.
//!
//! A submesh has its own vertices, one per wedge between cut edges. A region is therefore a disc even where it lies on
//! both sides of a cut. Face `k` of the submesh is the `k`-th given face with its corners in the same order, so that
//! half-edges are converted by arithmetic.

use std::collections::HashMap;

use crate::dual::{RefinedMesh, next, prev};
use crate::mesh::{HalfedgeId, TriMesh, TriMeshError};

/// Faces of a mesh as a mesh of their own.
pub(crate) struct Submesh {
    /// The submesh.
    pub mesh: TriMesh,
    /// Vertex of the parent mesh that each vertex of the submesh is a copy of.
    pub parent: Vec<u32>,
    /// Index in the submesh of each face of the parent mesh.
    index: HashMap<u32, u32>,
}

impl Submesh {
    /// Cuts `faces` out of `parent` along the half-edges for which `cut` holds.
    ///
    /// # Errors
    ///
    /// If the submesh is not a manifold.
    pub(crate) fn cut_out(
        parent: &RefinedMesh,
        faces: &[u32],
        cut: impl Fn(u32) -> bool,
    ) -> Result<Self, TriMeshError> {
        let index: HashMap<u32, u32> = faces.iter().enumerate().map(|(k, &f)| (f, k as u32)).collect();
        let local = |h: u32| 3 * index[&(h / 3)] + h % 3;
        let joined = |h: u32| parent.twin(h).filter(|t| !cut(h) && index.contains_key(&(t / 3)));
        let mut corner = vec![u32::MAX; 3 * faces.len()];
        let mut copies = Vec::new();
        for h in faces.iter().flat_map(|&f| 3 * f..3 * f + 3) {
            if corner[local(h) as usize] != u32::MAX {
                continue;
            }
            let vertex = copies.len() as u32;
            copies.push(parent.origin(h));
            // Clockwise to the first corner of the wedge, then counter-clockwise through the wedge.
            let mut first = h;
            while let Some(t) = joined(first) {
                first = next(t);
                if first == h {
                    break;
                }
            }
            let mut g = first;
            loop {
                corner[local(g) as usize] = vertex;
                match joined(prev(g)) {
                    Some(t) if t != first => g = t,
                    _ => break,
                }
            }
        }
        let positions = copies.iter().map(|&v| parent.positions[v as usize]).collect();
        let triangles: Vec<[u32; 3]> = corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Ok(Self { mesh: TriMesh::from_faces(positions, &triangles)?, parent: copies, index })
    }

    /// The half-edge of the submesh that is half-edge `h` of the parent mesh.
    pub(crate) fn local(&self, h: u32) -> HalfedgeId {
        HalfedgeId(3 * self.index[&(h / 3)] + h % 3)
    }
}
