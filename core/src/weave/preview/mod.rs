//! Data that a window shows of a session, computed on the meshes: the arrangement under the design mesh, polylines of arcs,
//! and the distortion of each triangle.

pub(in crate::weave) mod arc_polylines;
pub(in crate::weave) mod design_overlay;
pub(in crate::weave) mod face_distortion;
