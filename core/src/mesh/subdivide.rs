//! Subdivision after Loop (1987): every triangle becomes four, and the surface smoother.
//!
//! An edge's new vertex is 3/8 of its ends and 1/8 of the corners opposite; an old vertex moves towards the mean of
//! its neighbours (weights of Warren). Along boundaries and creases the cubic spline of the curve stands instead;
//! where a crease ends or several meet, the vertex stays.

use glam::DVec3;

use super::kernel::{EdgeId, TriMesh, TriMeshError, VertexId};

/// The mesh with every triangle in four, smooth but along the edges marked in `crease` and on the boundary; and the
/// halves of these creases, marked among the new edges.
///
/// # Errors
///
/// More elements than ids can name.
pub fn loop_subdivision(mesh: &TriMesh, crease: &[bool]) -> Result<(TriMesh, Vec<bool>), TriMeshError> {
    let hard = |e: EdgeId| mesh.is_boundary_edge(e) || crease[e.index()];
    let old = mesh.vertices().map(|v| moved(mesh, v, &hard));
    let new = mesh.edges().map(|e| {
        let [a, b] = mesh.edge_vertices(e).map(|v| mesh.position(v));
        let h = mesh.halfedge(e);
        match mesh.twin(h).filter(|_| !hard(e)) {
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
        // A half of an old edge joins its new vertex with an old one; the new edges inside triangles do not.
        let [a, b] = fine.edge_vertices(e).map(VertexId::index);
        let (low, high) = (a.min(b), a.max(b));
        low < n && crease[high - n]
    };
    let marks = fine.edges().map(mark).collect();
    Ok((fine, marks))
}

fn moved(mesh: &TriMesh, v: VertexId, hard: &impl Fn(EdgeId) -> bool) -> DVec3 {
    let at = mesh.position(v);
    let (mut sum, mut n, mut along, mut n_hard) = (DVec3::ZERO, 0.0, DVec3::ZERO, 0);
    let mut add = |w: VertexId, e: EdgeId| {
        sum += mesh.position(w);
        n += 1.0;
        if hard(e) {
            along += mesh.position(w);
            n_hard += 1;
        }
    };
    for h in mesh.outgoing(v) {
        add(mesh.target(h), mesh.edge(h));
        // On the boundary the last edge has no half-edge that leaves `v`.
        let back = mesh.prev(h);
        if mesh.twin(back).is_none() {
            add(mesh.origin(back), mesh.edge(back));
        }
    }
    match n_hard {
        0 | 1 => {
            let weight = if n == 3.0 { 3.0 / 16.0 } else { 3.0 / (8.0 * n) };
            at * (1.0 - n * weight) + sum * weight
        }
        2 => 0.75 * at + 0.125 * along,
        _ => at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{SHARP_DIHEDRAL, Topology, builtin, sharp_edges};

    #[test]
    fn topology_stays_and_triangles_become_four() {
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
