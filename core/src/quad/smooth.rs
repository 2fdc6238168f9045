//! Smoothing a quad mesh on the surface, and its quality.

use super::ground::Ground;
use super::optimise::{Around, optimise};
use super::rail::Rail;
use super::refine::QuadMesh;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Passes of the optimisation, and rounds in each; the best mesh after a pass is kept.
const PASSES: usize = 8;
const ROUNDS: usize = 10;

/// Scaled Jacobian of every quad: the smallest sine of its corner angles, negative where it is folded.
pub fn scaled_jacobians(mesh: &QuadMesh) -> Vec<f64> {
    let p = |v: u32| mesh.positions[v as usize];
    mesh.quads
        .iter()
        .map(|q| {
            let n = (p(q[2]) - p(q[0])).cross(p(q[3]) - p(q[1])).normalize_or_zero();
            (0..4)
                .map(|k| {
                    let o = p(q[k]);
                    let (x, y) = (p(q[(k + 1) % 4]) - o, p(q[(k + 3) % 4]) - o);
                    x.cross(y).dot(n) / (x.length() * y.length()).max(f64::MIN_POSITIVE)
                })
                .fold(f64::INFINITY, f64::min)
        })
        .collect()
}

/// Number of folded quads and mean scaled Jacobian.
pub fn quality(mesh: &QuadMesh) -> (usize, f64) {
    let all = scaled_jacobians(mesh);
    let folded = all.iter().filter(|&&s| s <= 0.0).count();
    (folded, all.iter().sum::<f64>() / all.len().max(1) as f64)
}

/// Smooths `mesh` on `base`, never to the worse: fewer folded quads first, then the mean scaled Jacobian.
/// The structure of the mesh does not change.
///
/// # Errors
///
/// When cancelled; `mesh` is then as before.
pub fn smooth(mesh: &mut QuadMesh, base: &TriMesh, progress: &Progress) -> Result<(), Cancelled> {
    let around = Around::new(mesh);
    let ground = Ground::new(base);
    let mut rail = Rail::new(mesh, base);
    let mut work = mesh.clone();
    let mut best = (quality(mesh), None);
    for _ in 0..PASSES {
        optimise(&mut work, &ground, &around, &mut rail, ROUNDS, progress)?;
        let now = quality(&work);
        let better = now.0 < best.0.0 || (now.0 == best.0.0 && now.1 > best.0.1);
        if better && work.positions.iter().all(|p| p.is_finite()) {
            best = (now, Some(work.clone()));
        }
    }
    if let (_, Some(better)) = best {
        *mesh = better;
    }
    Ok(())
}
