//! Triangle meshes: the half-edge kernel, reading, checking and repair, topology, features.
//!
//! The room for everything that is known of a surface before any geometry processing. It may use nothing
//! else of this crate.

mod builtin;
mod features;
mod kernel;
mod load;
mod read;
mod repair;
mod source;
mod topology;
mod triangulate;
mod write;

pub use builtin::{builtin, builtin_names};
pub use features::{SHARP_DIHEDRAL, SHORT_FEATURE, drop_short_features, sharp_edges};
pub use kernel::{EdgeId, FaceId, HalfedgeId, TriMesh, TriMeshError, VertexId};
pub use load::{FaceRef, LoadError, LoadedMesh, Normalization, VertexRef, load, parse};
pub use repair::Repair;
pub use source::{MeshSource, fingerprint};
pub use topology::{Component, Topology};
pub use write::{write_mesh_obj, write_obj};
