//! A coarse stand-in for a large mesh, with a map both ways.
//!
//! Loops are sought, woven and mapped on the proxy; they are shown and embedded on the original. The proxy has the
//! topology and the features of the original, near-isotropic triangles of even size, and its vertices are vertices
//! of the original. All through the simplification every vertex that goes keeps its place on the mesh that is left
//! (successive self-parameterization), so the map between both is one of neighbourhoods: it cannot jump to another
//! sheet, however close. May use the mesh and the surface.

mod collapse;
mod connectivity;
mod curve;
mod improve;
mod map;
mod quadric;
mod shape;
mod smooth;
mod star;
mod string;

use thiserror::Error;

use crate::mesh::{TriMesh, TriMeshError};
use crate::progress::{Cancelled, Progress};
use collapse::Simplifier;

pub use curve::CurveTransferError;
pub use map::Proxy;

/// Rounds of flips and shifts half way and at the end. Each gains less than the one before; after these the
/// triangles change little any more.
const ROUNDS: [usize; 2] = [1, 4];

/// The improvement half way happens at this many times the target.
const HALF_WAY: usize = 3;

/// Why a proxy cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ProxyError {
    /// The list of sharp edges is not one of this mesh.
    #[error("{given} flags for the sharp edges of a mesh of {edges} edges")]
    Sharp {
        /// Number of flags.
        given: usize,
        /// Number of edges.
        edges: usize,
    },
    /// The result is not a manifold.
    #[error("simplification went wrong: {0}")]
    Mesh(#[from] TriMeshError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Proxy {
    /// Simplifies `original` to about `target` triangles, or as far as topology, features and shape allow.
    ///
    /// `sharp` tells for each edge whether it is a feature; features and boundaries stay, their corners exactly. An
    /// original of no more than `target` triangles is its own proxy.
    ///
    /// # Errors
    ///
    /// A list of features of another length, or [`Cancelled`].
    pub fn new(original: &TriMesh, sharp: &[bool], target: usize, progress: &Progress) -> Result<Self, ProxyError> {
        if sharp.len() != original.n_edges() {
            return Err(ProxyError::Sharp { given: sharp.len(), edges: original.n_edges() });
        }
        let kinds = shape::kinds(original, sharp);
        let normals = shape::vertex_normals(original);
        let length = shape::even_length(original, target);
        let mut work = Simplifier::new(original, sharp, kinds, &normals, length);
        if original.n_faces() > target {
            if original.n_faces() > HALF_WAY * target {
                work.reduce(HALF_WAY * target, progress)?;
                work.improve(ROUNDS[0], progress)?;
            }
            work.reduce(target, progress)?;
            work.improve(ROUNDS[1], progress)?;
        }
        Self::finish(original, &work, &normals, progress)
    }
}

#[cfg(test)]
mod tests;
