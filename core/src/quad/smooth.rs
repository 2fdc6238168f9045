//! Smoothing a quad mesh on the surface, and its quality.

use glam::DVec3;

use super::ground::Ground;
use super::optimise::{Around, optimise};
use super::rail::Rail;
use super::refine::QuadMesh;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Passes of the optimisation, and rounds in each; the best mesh after a pass is kept.
const PASSES: usize = 8;
const ROUNDS: usize = 10;
/// How much of the side lengths aimed at are those of the mesh given, which covers the surface evenly. Lengths that only
/// follow the quads let these slide off a limb, since chords across it are shorter than the way around; they are tried
/// where folds stay.
const KEPT: f64 = 0.5;

/// Scaled Jacobian of every quad: see [`scaled_jacobian`].
pub fn scaled_jacobians(mesh: &QuadMesh) -> Vec<f64> {
    mesh.quads.iter().map(|q| scaled_jacobian(mesh, q)).collect()
}

/// The smallest sine of a quad's corner angles, negative where it is folded.
pub(super) fn scaled_jacobian(mesh: &QuadMesh, quad: &[u32; 4]) -> f64 {
    let [a, b, c, d] = quad.map(|v| mesh.positions[v as usize]);
    let n = (c - a).cross(d - b).normalize_or_zero();
    let corner = |[o, x, y]: [DVec3; 3]| {
        let (x, y) = (x - o, y - o);
        x.cross(y).dot(n) / (x.length() * y.length()).max(f64::MIN_POSITIVE)
    };
    [[a, b, d], [b, c, a], [c, d, b], [d, a, c]].map(corner).into_iter().fold(f64::INFINITY, f64::min)
}

/// Number of folded quads and mean scaled Jacobian.
pub fn quality(mesh: &QuadMesh) -> (usize, f64) {
    let all = scaled_jacobians(mesh);
    let folded = all.iter().filter(|&&s| s <= 0.0).count();
    (folded, all.iter().sum::<f64>() / all.len().max(1) as f64)
}

/// Puts all vertices onto `base`, to the nearest place that is reached from where each is, boundary vertices along the
/// boundary. A refinement of a mesh whose own vertices have moved on the surface lies next to it only.
pub fn project(mesh: &mut QuadMesh, base: &TriMesh) {
    let ground = Ground::new(base);
    let rail = Rail::new(mesh, base);
    for v in 0..mesh.positions.len() {
        let (p, f) = (mesh.positions[v], mesh.base_face[v]);
        (mesh.positions[v], mesh.base_face[v]) = rail.place(v as u32).unwrap_or_else(|| ground.follow(p, f));
    }
}

/// Smooths `mesh` on `base`, never to the worse: fewer folded quads first, then the mean scaled Jacobian.
/// The structure of the mesh does not change. Vertices of which `held` is true stay where they are; those beyond its end
/// are free.
///
/// # Errors
///
/// When cancelled; `mesh` is then as before.
pub fn smooth(mesh: &mut QuadMesh, base: &TriMesh, held: &[bool], progress: &Progress) -> Result<(), Cancelled> {
    let around = Around::new(mesh, held);
    let ground = Ground::new(base);
    let mut best = (quality(mesh), None);
    for kept in [KEPT, 0.0] {
        let mut rail = Rail::new(mesh, base);
        let mut work = mesh.clone();
        for _ in 0..PASSES {
            optimise(&mut work, &ground, &around, &mut rail, (ROUNDS, kept), progress)?;
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

    /// A grid of quads whose corners are those of every second row and column of a mesh's grid.
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

    /// Throws vertices about by up to `far`, back onto the surface.
    fn tangle(mesh: &mut QuadMesh, base: &TriMesh, far: f64) {
        let ground = Ground::new(base);
        for v in 0..mesh.positions.len() {
            let noise = |k: usize| ((v * 7919 + k * 104_729) as f64 * 0.618_033_988_75).fract() - 0.5;
            if !mesh.boundary[v] {
                let wanted = mesh.positions[v] + 2.0 * far * DVec3::new(noise(1), noise(2), noise(3));
                (mesh.positions[v], mesh.base_face[v]) = ground.follow(wanted, mesh.base_face[v]);
            }
        }
    }

    #[test]
    fn a_tangled_torus_is_untangled() {
        let base = torus(48, 24);
        let mut mesh = grid(&base, (24, 48), true);
        let side = mesh.positions[0].distance(mesh.positions[1]);
        tangle(&mut mesh, &base, side);
        let before = quality(&mesh);
        assert!(before.0 > 20, "{before:?}");
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        let after = quality(&mesh);
        assert!(after.0 == 0 && after.1 > 0.85, "{before:?} {after:?}");
        let ground = Ground::new(&base);
        for (&p, &f) in mesh.positions.iter().zip(&mesh.base_face) {
            assert!(ground.follow(p, f).0.distance(p) < 1e-12, "vertices stay on the surface");
        }
    }

    #[test]
    fn what_is_held_stays() {
        let base = torus(48, 24);
        let mut mesh = grid(&base, (24, 48), true);
        let side = mesh.positions[0].distance(mesh.positions[1]);
        tangle(&mut mesh, &base, 0.3 * side);
        let held: Vec<bool> = (0..mesh.positions.len()).map(|v| v % 5 == 0).collect();
        let before = mesh.clone();
        smooth(&mut mesh, &base, &held, &Progress::new()).unwrap();
        assert!(quality(&mesh).1 > quality(&before).1);
        for (v, held) in held.into_iter().enumerate() {
            assert!(!held || mesh.positions[v] == before.positions[v]);
        }
    }

    #[test]
    fn the_boundary_stays_covered_in_order() {
        let base = square(16);
        let mut mesh = grid(&base, (16, 16), false);
        tangle(&mut mesh, &base, 0.1);
        let corners: Vec<usize> = [0, 8, 72, 80].to_vec();
        let before = mesh.positions.clone();
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        assert_eq!(quality(&mesh).0, 0);
        for k in corners {
            assert_eq!(mesh.positions[k], before[k], "corners stay");
        }
        for row in [&mesh.positions[..9], &mesh.positions[72..]] {
            for w in row.windows(2) {
                let step = w[1] - w[0];
                assert!(step.dot(before[1] - before[0]) > 0.0 && step.cross(before[1] - before[0]).length() < 1e-12);
            }
        }
    }

    #[test]
    fn vertices_beside_the_surface_land_on_it() {
        for (base, closed) in [(torus(48, 24), true), (square(16), false)] {
            let size = if closed { (48, 24) } else { (16, 16) };
            let mut mesh = grid(&base, size, closed);
            let before = mesh.positions.clone();
            mesh.positions.iter_mut().enumerate().for_each(|(v, p)| p.z += 1e-3 * (v % 3) as f64);
            project(&mut mesh, &base);
            let ground = Ground::new(&base);
            for ((&p, &f), old) in mesh.positions.iter().zip(&mesh.base_face).zip(&before) {
                assert!(ground.follow(p, f).0.distance(p) < 1e-12 && p.distance(*old) < 3e-3);
            }
        }
    }

    #[test]
    fn a_perfect_grid_stays_as_it_is() {
        let base = square(16);
        let mut mesh = grid(&base, (16, 16), false);
        let before = mesh.positions.clone();
        smooth(&mut mesh, &base, &[], &Progress::new()).unwrap();
        assert!(mesh.positions.iter().zip(&before).all(|(p, q)| p.distance(*q) < 1e-9));
    }
}
