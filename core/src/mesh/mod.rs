//! Triangle meshes: the half-edge kernel, reading, checking and repair, topology, features.
//!
//! The room for everything that is known of a surface before any geometry processing. Of this
//! crate it may use nothing but `progress`.

mod builtin;
mod features;
mod kernel;
mod load;
mod read;
mod repair;
mod source;
mod subdivide;
mod topology;
mod traversal;
mod triangulate;
mod write;

pub use builtin::{builtin, builtin_names};
pub use features::{SHARP_DIHEDRAL, SHORT_FEATURE, drop_short_features, sharp_edges};
pub use kernel::{EdgeId, FaceId, HalfedgeId, TriMesh, TriMeshError, VertexId};
pub use load::{FaceRef, LoadError, LoadedMesh, Normalisation, VertexRef, load, parse, parse_with};
pub use repair::Repair;
pub use source::{MeshSource, fingerprint};
pub use subdivide::loop_subdivision;
pub use topology::{Component, Topology};
pub use traversal::{BreadthFirst, Dijkstra, DistanceQueue, Element, components, dilate};
pub use write::{write_mesh_obj, write_obj};
