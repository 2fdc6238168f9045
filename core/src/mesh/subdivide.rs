//! Loop subdivision (Loop 1987): 1-to-4 refinement with smoothing.
//!
//! The new vertex of an edge is 3/8 of each end and 1/8 of each opposite corner. An old vertex moves towards the mean of its
//! neighbours, with Warren's weights: 3/16 at valence 3, else 3/8 over the valence. Boundaries and creases are subdivided
//! as cubic splines; vertices where more than two of these edges meet stay.

use glam::DVec3;

use super::ids::{EdgeId, VertexId};
use super::kernel::{TriMesh, TriMeshError};

/// One step of Loop subdivision. `crease` has a flag per edge; boundary edges are creases in any case. Returned with the
/// mesh are the flags of its edges: both halves of each marked edge are marked.
///
/// # Errors
///
/// [`TriMeshError`] if the new positions are not finite.
pub fn loop_subdivision(mesh: &TriMesh, crease: &[bool]) -> Result<(TriMesh, Vec<bool>), TriMeshError> {
    let is_crease = |e: EdgeId| mesh.is_boundary_edge(e) || crease[e.index()];
    let old = mesh.vertices().map(|v| moved_vertex(mesh, v, &is_crease));
    let new = mesh.edges().map(|e| {
        let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v));
        let h = mesh.halfedge(e);
        match mesh.twin(h).filter(|_| !is_crease(e)) {
            None => 0.5 * (a + b),
            Some(t) => {
                let [c, d] = [h, t].map(|h| mesh.position(mesh.opposite(h)));
                0.375 * (a + b) + 0.125 * (c + d)
            }
        }
    });
    let middle = |h| (mesh.n_vertices() + mesh.edge(h).index()) as u32;
    let faces: Vec<[u32; 3]> = mesh
        .faces()
        .flat_map(|f| {
            let ([a, b, c], [x, y, z]) = (mesh.face_vertices(f).map(|v| v.0), mesh.face_halfedges(f).map(middle));
            [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
        })
        .collect();
    let fine = TriMesh::from_faces(old.chain(new).collect(), &faces)?;
    let n = mesh.n_vertices();
    let mark = |e: EdgeId| {
        // Half of an old edge joins an old vertex with a new one; edges inside old triangles join two new ones.
        let [a, b] = fine.edge_vertices(e).map(VertexId::index);
        let (low, high) = (a.min(b), a.max(b));
        low < n && crease[high - n]
    };
    let marks = fine.edges().map(mark).collect();
    Ok((fine, marks))
}

/// The new position of an old vertex.
fn moved_vertex(mesh: &TriMesh, v: VertexId, is_crease: &impl Fn(EdgeId) -> bool) -> DVec3 {
    let at = mesh.position(v);
    let (mut sum, mut n, mut crease_sum, mut n_creases) = (DVec3::ZERO, 0.0, DVec3::ZERO, 0);
    for (h, w) in mesh.spokes(v) {
        sum += mesh.position(w);
        n += 1.0;
        if is_crease(mesh.edge(h)) {
            crease_sum += mesh.position(w);
            n_creases += 1;
        }
    }
    match n_creases {
        // The end of a crease is smoothed like a vertex without creases.
        0 | 1 => {
            let weight = if n == 3.0 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) };
            at * (1.0 - n * weight) + sum * weight
        }
        2 => 0.75 * at + 0.125 * crease_sum,
        _ => at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{SHARP_DIHEDRAL, Topology, builtin, sharp_edges};

    #[test]
    fn subdivision_keeps_the_topology() {
        for name in ["pretzel", "sleeve"] {
            let mesh = builtin(name).unwrap().mesh;
            let (fine, _) = loop_subdivision(&mesh, &vec![false; mesh.n_edges()]).unwrap();
            let [before, after] = [&mesh, &fine].map(Topology::new);
            assert_eq!(fine.n_faces(), 4 * mesh.n_faces());
            assert_eq!((before.genus, before.boundary_loops.len()), (after.genus, after.boundary_loops.len()));
        }
    }

    #[test]
    fn a_cube_keeps_its_creases() {
        let p = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let quads = [[0u32, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mut mesh = TriMesh::from_faces((0..8).map(p).collect(), &faces).unwrap();
        let mut crease = sharp_edges(&mesh, SHARP_DIHEDRAL);
        assert_eq!(crease.iter().filter(|&&c| c).count(), 12);
        for k in 1..=2 {
            (mesh, crease) = loop_subdivision(&mesh, &crease).unwrap();
            assert_eq!(crease.iter().filter(|&&c| c).count(), 12 << k);
            assert_eq!(crease, sharp_edges(&mesh, SHARP_DIHEDRAL));
        }
        let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
        assert!((area - 6.0).abs() < 1e-12, "{area}");
    }
}
