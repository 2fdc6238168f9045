//! Why curves could not be arranged.

use thiserror::Error;

use super::path_insertion::NoPath;
use crate::mesh::TriMeshError;
use crate::surface::CurveError;

/// Why curves could not be arranged.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ArrangementError {
    /// A curve does not lie on the mesh.
    #[error("curve {curve}: {source}")]
    Curve {
        /// Index of the curve.
        curve: usize,
        /// What is wrong with it.
        source: CurveError,
    },
    /// A curve could not be inserted into the mesh.
    #[error("curve {curve} could not be inserted into the mesh: {source}")]
    Insertion {
        /// Index of the curve.
        curve: usize,
        /// Where it failed.
        source: NoPath,
    },
    /// A vertex that is neither a transversal crossing of two curves nor an end on the boundary. Curve insertion excludes it.
    #[error("{degree} curve edges meet at vertex {vertex} of the refined mesh")]
    Degree {
        /// Vertex of the refined mesh.
        vertex: u32,
        /// Number of curve edges there.
        degree: usize,
    },
    /// The refined mesh is not a manifold. Curve insertion excludes it.
    #[error("the refined mesh is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
}
