//! Untangling: from a map with few flipped triangles to a locally injective one.
//!
//! For a flipped triangle the determinant `D` in the denominators of the energy is replaced by `½ (D + √(ε² m² + D²))`
//! (Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, Foldover-free Maps in 50 Lines of Code, 2021). Its
//! energy is then finite, and decreasing it drives `D` towards positive values. `ε` becomes smaller as the triangle
//! improves. All other triangles keep the energy that is infinite for flipped triangles, so the number of flipped
//! triangles never grows, and the map changes little away from them. The constraints hold throughout.
//!
//! Limits: the angles of positively oriented triangles around a vertex may still sum to a wrong multiple of the full
//! angle. No step can change that; such maps are rejected.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::{InjectiveEnergy, InjectiveMap};
use crate::mesh::TriMesh;
use crate::param::flipped_triangles;
use crate::param::newton_system::NewtonSystem;
use crate::param::seamless_system::SeamlessSystem;
use crate::progress::{Cancelled, Progress};

/// `ε` of a flipped triangle as a share of the absolute value of its determinant, in multiples of the target.
const EPSILON_SHARE: f64 = 0.2;
/// Least `ε` of a flipped triangle. Triangles with a larger determinant, in multiples of the target, count as
/// positively oriented.
const MIN_EPSILON: f64 = 1e-6;
/// Largest number of Newton steps. Triangles that can be untangled usually are after ten.
const MAX_STEPS: usize = 30;
/// Steps in a row that may leave the number of flipped triangles unchanged.
const PATIENCE: usize = 12;

impl SeamlessSystem {
    /// A locally injective map near the map with free variables `free`. `quarters` prescribes the angle around each
    /// vertex in quarter turns (0: any). `None` if no such map was found.
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
        for step in 0..MAX_STEPS {
            progress.check()?;
            let epsilon = |d: f64| if d > MIN_EPSILON { 0.0 } else { MIN_EPSILON.hypot(EPSILON_SHARE * d) };
            let regularised = energy.regularised(energy.determinants(&at.map.uv).into_iter().map(epsilon).collect());
            let Some(start) = self.injective_map(&regularised, at.free) else { return Ok(None) };
            at = start;
            let (matrix, downhill) = self.newton_matrix(newton, &regularised, &at.map.uv);
            let Ok(direction) = newton.solve(&matrix, &downhill) else { return Ok(None) };
            let slope: f64 = direction.iter().zip(&downhill).map(|(a, b)| a * b).sum();
            let Some(share) = self.line_search(&regularised, &mut at, &direction, slope) else { return Ok(None) };
            let flipped = flipped_triangles(&at.map.uv).len();
            tracing::debug!(step, share, flipped, "untangling");
            if flipped == 0
                && let Some(done) = self.injective_map(energy, at.free.clone())
            {
                return Ok(Some(done).filter(|done| has_angles(mesh, &done.map.uv, quarters)));
            }
            patience = if flipped < fewest { PATIENCE } else { patience - 1 };
            if patience == 0 {
                break;
            }
            fewest = fewest.min(flipped);
        }
        Ok(None)
    }
}

/// Whether the corners around each vertex of a locally injective map span the prescribed quarter turns.
fn has_angles(mesh: &TriMesh, uv: &[[DVec2; 3]], quarters: &[u32]) -> bool {
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
