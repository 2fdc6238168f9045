//! Smooth, crease and corner vertices, and vertex normals.

use glam::DVec3;

use crate::mesh::TriMesh;

/// Cosine of 45°, the turning of a feature or boundary at a vertex above which the vertex is a corner.
const CORNER_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// How a vertex may move during simplification and smoothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VertexKind {
    /// Off features and boundaries: anywhere on the surface.
    Smooth,
    /// On one feature or boundary: along it.
    Crease,
    /// A corner: not at all.
    Corner,
}

/// The kind of each vertex; `sharp` has a flag per edge.
pub(super) fn vertex_kinds(mesh: &TriMesh, sharp: &[bool]) -> Vec<VertexKind> {
    let kind = |v| {
        let mut ends = [DVec3::ZERO; 2];
        let mut n = 0;
        let mut add = |arm: DVec3| {
            if n < 2 {
                ends[n] = arm.normalize_or_zero();
            }
            n += 1;
        };
        for h in mesh.outgoing(v).filter(|&h| mesh.twin(h).is_none() || sharp[mesh.edge(h).index()]) {
            add(mesh.vector(h));
        }
        if mesh.is_boundary_vertex(v) {
            add(-mesh.vector(mesh.incoming_boundary(v)));
        }
        match n {
            0 => VertexKind::Smooth,
            2 if -ends[0].dot(ends[1]) > CORNER_COSINE => VertexKind::Crease,
            _ => VertexKind::Corner,
        }
    };
    mesh.vertices().map(kind).collect()
}

/// Unit vertex normals, the area-weighted means of the face normals; zero where these cancel.
pub(super) fn vertex_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.n_vertices()];
    for f in mesh.faces() {
        let n = mesh.face_area_vector(f);
        for v in mesh.face_vertices(f) {
            normals[v.index()] += n;
        }
    }
    normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::VertexId;
    use crate::testing::square;

    #[test]
    fn corners_and_sides_of_a_square_are_told_from_its_inside() {
        let mesh = square(3);
        let kinds = vertex_kinds(&mesh, &vec![false; mesh.n_edges()]);
        let count = |kind| kinds.iter().filter(|k| **k == kind).count();
        assert_eq!([VertexKind::Corner, VertexKind::Crease, VertexKind::Smooth].map(count), [4, 8, 4]);
    }

    #[test]
    fn the_end_of_a_feature_is_a_corner() {
        let mesh = square(4);
        // One sharp edge between two inner vertices.
        let [a, b] = [VertexId(6), VertexId(7)];
        let sharp: Vec<bool> = mesh.edges().map(|e| mesh.edge_vertices(e).iter().all(|v| [a, b].contains(v))).collect();
        let kinds = vertex_kinds(&mesh, &sharp);
        assert_eq!([a, b].map(|v| kinds[v.index()]), [VertexKind::Corner; 2]);
    }

    #[test]
    fn normals_of_a_flat_surface_are_its_own() {
        assert!(vertex_normals(&square(3)).iter().all(|n| n.distance(DVec3::Z) < 1e-15));
    }
}
