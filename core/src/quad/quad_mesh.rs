//! A quad mesh that refines a layout.

use glam::DVec3;

/// A quad mesh that refines a layout and lies on a triangle mesh.
#[derive(Debug, Clone)]
pub struct QuadMesh {
    /// Vertex positions, in units of the triangle mesh.
    pub positions: Vec<DVec3>,
    /// Vertices of the quads, counter-clockwise.
    pub quads: Vec<[u32; 4]>,
    /// Layout patch of each quad.
    pub patch: Vec<u32>,
    /// For each vertex a triangle of the triangle mesh that contains it.
    pub base_face: Vec<u32>,
    /// Whether each vertex lies on the boundary.
    pub boundary: Vec<bool>,
    /// Number of layout nodes; they are the first vertices, in order.
    pub n_nodes: usize,
    /// Vertices of each layout arc, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
}
