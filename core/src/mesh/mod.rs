//! Triangle meshes: the half-edge kernel, reading, checking and repair, topology, features.
//!
//! The room for everything that is known of a surface before any geometry processing. It may use nothing
//! else of this crate.

mod kernel;

pub use kernel::{EdgeId, FaceId, HalfedgeId, TriMesh, TriMeshError, VertexId};
