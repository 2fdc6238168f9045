//! Smoothing of a quad mesh on the surface, and its projection onto the surface.

use super::boundary::Boundary;
use super::optimise::{Structure, optimise};
use super::projection::Projection;
use super::quad_mesh::QuadMesh;
use super::quality::quality;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Passes of the optimisation; after each the mesh is kept if it is the best so far.
const PASSES: usize = 8;
/// Rounds of the optimisation in each pass.
const ROUNDS: usize = 10;
/// Weight of the initial side lengths in the ideal ones. The given mesh covers the surface evenly; ideal lengths from
/// the present mesh alone let quads slide off a limb, since chords across it are shorter than those around it. So the
/// weight 0 is tried only where folded quads remain.
const INITIAL_WEIGHT: f64 = 0.5;

/// Projects all vertices locally onto `base`, boundary vertices onto the boundary. This is needed where the vertices of
/// the mesh that was refined have moved on the surface, so that the refinement lies only near `base`.
pub fn project(mesh: &mut QuadMesh, base: &TriMesh) {
    let surface = Projection::new(base);
    let boundary = Boundary::new(mesh, base);
    for v in 0..mesh.positions.len() {
        let (p, f) = (mesh.positions[v], mesh.base_face[v]);
        (mesh.positions[v], mesh.base_face[v]) = match boundary.place(v as u32) {
            Some(point) => (point.position, point.face),
            None => surface.project(p, f),
        };
    }
}

/// Smooths `mesh` on `base` without making it worse, by the number of folded quads, then by the mean scaled Jacobian.
/// Connectivity does not change. Vertices with `fixed` true do not move; those beyond its end are free.
///
/// # Errors
///
/// When cancelled; `mesh` is then unchanged.
pub fn smooth(mesh: &mut QuadMesh, base: &TriMesh, fixed: &[bool], progress: &Progress) -> Result<(), Cancelled> {
    let structure = Structure::new(mesh, fixed);
    let surface = Projection::new(base);
    let mut best = (quality(mesh), None);
    for initial_weight in [INITIAL_WEIGHT, 0.0] {
        let mut boundary = Boundary::new(mesh, base);
        let mut work = mesh.clone();
        for _ in 0..PASSES {
            optimise(&mut work, &surface, &structure, &mut boundary, (ROUNDS, initial_weight), progress)?;
            let now = quality(&work);
            let better = now.0 < best.0.0 || (now.0 == best.0.0 && now.1 > best.0.1);
            if better && work.positions.iter().all(|p| p.is_finite()) {
                best = (now, Some(work.clone()));
            }
        }
        if best.0.0 == 0 {
            break;
        }
    }
    if let (_, Some(better)) = best {
        *mesh = better;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::VertexId;
    use crate::testing::{square, torus};

    /// A grid of quads on every second row and column of a mesh's grid.
    fn grid(base: &TriMesh, (rows, columns): (usize, usize), closed: bool) -> QuadMesh {
        let (m, n) = (rows / 2, columns / 2);
        let wide = if closed { columns } else { columns + 1 };
        let (tall, across) = if closed { (m, n) } else { (m + 1, n + 1) };
        let id = |i: usize, j: usize| ((i % tall) * across + j % across) as u32;
        let vertices: Vec<VertexId> =
            (0..tall * across).map(|k| VertexId::new(2 * (k / across) * wide + 2 * (k % across))).collect();
        let cells = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
        let quads: Vec<[u32; 4]> =
            cells.map(|(i, j)| [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)]).collect();
        QuadMesh {
            positions: vertices.iter().map(|&v| base.position(v)).collect(),
            base_face: vertices.iter().map(|&v| base.face(base.vertex_halfedge(v)).0).collect(),
            boundary: vertices.iter().map(|&v| base.is_boundary_vertex(v)).collect(),
            patch: vec![0; quads.len()],
            quads,
            n_nodes: 1,
            arcs: Vec::new(),
        }
    }

    /// Displaces inner vertices by up to `far` in each coordinate, then projects them onto the surface.
    fn displace(mesh: &mut QuadMesh, base: &TriMesh, far: f64) {
        let surface = Projection::new(base);
        for v in 0..mesh.positions.len() {
            let noise = |k: usize| ((v * 7919 + k * 104_729) as f64 * 0.618_033_988_75).fract() - 0.5;
            if !mesh.boundary[v] {
                let wanted = mesh.positions[v] + 2.0 * far * DVec3::new(noise(1), noise(2), noise(3));
                (mesh.positions[v], mesh.base_face[v]) = surface.project(wanted, mesh.base_face[v]);
            }
        }
    }

    #[test]
    fn folded_quads_on_a_torus_are_unfolded() {
        let base = torus(48, 24);
        let mut mesh = grid(&base, (24, 48), true);
        let side = mesh.positions[0].distance(mesh.positions[1]);
        displace(&mut mesh, &base, side);
        let before = quality(&mesh);
        assert!(before.0 > 20, "{before:?}");
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        let after = quality(&mesh);
        assert!(after.0 == 0 && after.1 > 0.85, "{before:?} {after:?}");
        let surface = Projection::new(&base);
        for (&p, &f) in mesh.positions.iter().zip(&mesh.base_face) {
            assert!(surface.project(p, f).0.distance(p) < 1e-12, "a vertex has left the surface");
        }
    }

    #[test]
    fn fixed_vertices_do_not_move() {
        let base = torus(48, 24);
        let mut mesh = grid(&base, (24, 48), true);
        let side = mesh.positions[0].distance(mesh.positions[1]);
        displace(&mut mesh, &base, 0.3 * side);
        let fixed: Vec<bool> = (0..mesh.positions.len()).map(|v| v % 5 == 0).collect();
        let before = mesh.clone();
        smooth(&mut mesh, &base, &fixed, &Progress::new()).unwrap();
        assert!(quality(&mesh).1 > quality(&before).1);
        for (v, fixed) in fixed.into_iter().enumerate() {
            assert!(!fixed || mesh.positions[v] == before.positions[v]);
        }
    }

    #[test]
    fn boundary_vertices_keep_their_order_and_corners() {
        let base = square(16);
        let mut mesh = grid(&base, (16, 16), false);
        displace(&mut mesh, &base, 0.1);
        let corners: Vec<usize> = [0, 8, 72, 80].to_vec();
        let before = mesh.positions.clone();
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        assert_eq!(quality(&mesh).0, 0);
        for k in corners {
            assert_eq!(mesh.positions[k], before[k], "a corner has moved");
        }
        for row in [&mesh.positions[..9], &mesh.positions[72..]] {
            for w in row.windows(2) {
                let step = w[1] - w[0];
                assert!(step.dot(before[1] - before[0]) > 0.0 && step.cross(before[1] - before[0]).length() < 1e-12);
            }
        }
    }

    #[test]
    fn vertices_near_the_surface_are_projected_onto_it() {
        for (base, closed) in [(torus(48, 24), true), (square(16), false)] {
            let size = if closed { (48, 24) } else { (16, 16) };
            let mut mesh = grid(&base, size, closed);
            let before = mesh.positions.clone();
            mesh.positions.iter_mut().enumerate().for_each(|(v, p)| p.z += 1e-3 * (v % 3) as f64);
            project(&mut mesh, &base);
            let surface = Projection::new(&base);
            for ((&p, &f), old) in mesh.positions.iter().zip(&mesh.base_face).zip(&before) {
                assert!(surface.project(p, f).0.distance(p) < 1e-12 && p.distance(*old) < 3e-3);
            }
        }
    }

    #[test]
    fn a_perfect_grid_does_not_change() {
        let base = square(16);
        let mut mesh = grid(&base, (16, 16), false);
        let before = mesh.positions.clone();
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        assert!(mesh.positions.iter().zip(&before).all(|(p, q)| p.distance(*q) < 1e-9));
    }
}
