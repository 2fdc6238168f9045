//! Triangle meshes: half-edge structure, loading and repair, topology, feature edges, traversals.
//!
//! The lowest module after `solve`: everything about a mesh that needs no geometry processing. Of this crate it uses
//! `progress` and `union_find` only.

mod builtin;
mod error;
mod features;
mod ids;
mod kernel;
mod load;
mod normalisation;
mod read;
mod repair;
mod source;
mod subdivide;
mod topology;
mod traversal;
mod triangulate;
mod write;

pub use builtin::{builtin, builtin_names};
pub use error::{FaceRef, LoadError, VertexRef};
pub use features::{SHARP_DIHEDRAL, SHORT_FEATURE, drop_short_features, sharp_edges};
pub use ids::{EdgeId, FaceId, HalfedgeId, VertexId};
pub use kernel::{TriMesh, TriMeshError};
pub use load::{LoadedMesh, load, parse, parse_with};
pub use normalisation::{Normalisation, NormalisedBy, SURFACE_SIZE};
pub use repair::Repair;
pub use source::{MeshSource, fingerprint};
pub use subdivide::loop_subdivision;
pub use topology::{Component, Topology};
pub use traversal::{BreadthFirst, Dijkstra, DistanceQueue, Element, components, dilate};
pub use write::{write_mesh_obj, write_obj};
