//! From a map with few folds to one without.
//!
//! With `½ (D + √(ε² m² + D²))` in place of the determinant `D` of a triangle that is turned over, its energy is finite, and
//! the greater the more it is turned over: made less, it unfolds the triangle as far as `ε` tells it to mind. That becomes
//! smaller as the triangle becomes better (Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, Foldover-free Maps in
//! 50 Lines of Code, 2021). All other triangles have the energy that no fold can pass and keep it: folds only ever become
//! fewer, and the map stays near where it was but around them. The relations hold throughout.
//!
//! Triangles that are not turned over may still wind around a node once more or less than they should. No step can change
//! that; such a map is no better than one with folds.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::{InjectiveEnergy, InjectiveMap, NewtonSystem};
use crate::mesh::TriMesh;
use crate::param::folds;
use crate::param::solve::SeamlessSystem;
use crate::progress::{Cancelled, Progress};

/// `ε` as a share of how far a determinant is below zero, and at least, in multiples of the determinant wanted.
const SHARE: f64 = 0.2;
const LEAST: f64 = 1e-6;
/// Steps of Newton's method at most; folds that go are mostly gone after ten.
const STEPS: usize = 30;
/// Steps in a row that may leave as many folds as there were.
const PATIENCE: usize = 12;

impl SeamlessSystem {
    /// A map without folds near one with them, that winds around each vertex by so many quarter turns (0: any number);
    /// `None` if none was found.
    ///
    /// # Errors
    ///
    /// [`Cancelled`].
    pub fn untangle(
        &self,
        newton: &NewtonSystem,
        energy: &InjectiveEnergy<'_>,
        free: Vec<f64>,
        (mesh, quarters): (&TriMesh, &[u32]),
        progress: &Progress,
    ) -> Result<Option<InjectiveMap>, Cancelled> {
        let mut at = InjectiveMap { map: self.map(&free), free, energy: f64::INFINITY };
        let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
        for step in 0..STEPS {
            progress.check()?;
            let slack = |d: f64| if d > LEAST { 0.0 } else { LEAST.hypot(SHARE * d) };
            let minding = energy.with_slack(energy.determinants(&at.map.uv).into_iter().map(slack).collect());
            let Some(start) = self.injective(&minding, at.free) else { return Ok(None) };
            at = start;
            let (matrix, downhill) = self.newton_matrix(newton, &minding, &at.map.uv);
            let solved = newton.symbolic.factor(&matrix).and_then(|f| f.solve(&matrix, &downhill));
            let Ok(direction) = solved else { return Ok(None) };
            let slope: f64 = direction.iter().zip(&downhill).map(|(a, b)| a * b).sum();
            let Some(share) = self.search(&minding, &mut at, &direction, slope) else { return Ok(None) };
            let left = folds(&at.map.uv).len();
            tracing::debug!(step, share, left, "untangled");
            if step % 29 == 0 || left < 3 {
                debug_winds(mesh, &at.map.uv, quarters);
            }
            if left == 0
                && let Some(done) = self.injective(energy, at.free.clone())
            {
                return Ok(Some(done).filter(|done| winds(mesh, &done.map.uv, quarters)));
            }
            patience = if left < fewest { PATIENCE } else { patience - 1 };
            if patience == 0 {
                break;
            }
            fewest = fewest.min(left);
        }
        Ok(None)
    }
}

fn debug_winds(mesh: &TriMesh, uv: &[[DVec2; 3]], quarters: &[u32]) {
    let mut angle = vec![0.0; mesh.n_vertices()];
    let mut neg = vec![0; mesh.n_vertices()];
    let mut n = vec![0; mesh.n_vertices()];
    for f in mesh.faces() {
        let corner = |k: usize| uv[f.index()][k % 3];
        let turned = (corner(1) - corner(0)).perp_dot(corner(2) - corner(0)) <= 0.0;
        for (k, v) in mesh.face_vertices(f).into_iter().enumerate() {
            angle[v.index()] += (corner(k + 1) - corner(k)).angle_to(corner(k + 2) - corner(k));
            n[v.index()] += 1;
            if turned {
                neg[v.index()] += 1;
            }
        }
    }
    let list: Vec<_> = (0..mesh.n_vertices())
        .filter(|&v| neg[v] > 0 || (quarters[v] != 0 && (angle[v] / FRAC_PI_2 - f64::from(quarters[v])).abs() > 0.5))
        .map(|v| (v, quarters[v], (angle[v] / FRAC_PI_2 * 100.0).round() / 100.0, neg[v], n[v]))
        .collect();
    tracing::debug!(n = list.len(), ?list, "winding");
}

/// Whether the corners around each vertex of a map without folds span so many quarter turns.
fn winds(mesh: &TriMesh, uv: &[[DVec2; 3]], quarters: &[u32]) -> bool {
    let mut angle = vec![0.0; mesh.n_vertices()];
    for f in mesh.faces() {
        let corner = |k: usize| uv[f.index()][k % 3];
        for (k, v) in mesh.face_vertices(f).into_iter().enumerate() {
            angle[v.index()] += (corner(k + 1) - corner(k)).angle_to(corner(k + 2) - corner(k));
        }
    }
    let right = |(a, &q): (&f64, &u32)| q == 0 || (a / FRAC_PI_2 - f64::from(q)).abs() < 0.5;
    angle.iter().zip(quarters).all(right)
}
