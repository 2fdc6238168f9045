//! How well a layout will fit a surface, told before it is embedded.
//!
//! Where the nodes are drawn, the guiding field with the layout's singularities and the map of least squares along it are
//! linear solves. How far the field deviates from principal directions, and how far the map is from following the field,
//! are not what the finished embedding has, but close to it in rank: enough to choose between layouts, a hundred times as
//! fast.

use super::EmbeddingError;
use super::bending::face_curvature;
use super::descent::Optimizer;
use super::job::Job;
use super::solver::{Aim, Features};
use super::state::State;
use crate::progress::Progress;

/// What is foreseen of an embedding.
#[derive(Debug, Clone)]
pub struct Foreseen {
    /// The mean deviation of the guiding field from principal directions, in degrees, weighed by `(κ₁ − κ₂)²` as in
    /// [`Measures::alignment`](super::Measures::alignment).
    pub alignment: f64,
    /// The energy of the map over the area of the surface.
    pub energy: f64,
    /// What each triangle of the surface adds to the deviation.
    pub shares: Vec<f64>,
}

/// Foresees how well a layout will fit the surface.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn foresee(job: &Job<'_>, progress: &Progress) -> Result<Foreseen, EmbeddingError> {
    let ready = Optimizer::net(job)?;
    progress.check()?;
    let optimizer = Optimizer::on(job, ready, (Aim::LeastSquares, Features::Pulled(1.0)), progress)?
        .map_err(|_| EmbeddingError::Folded)?;
    let State { net, metric, field, solution, .. } = optimizer.state();
    let mesh = &net.mesh;
    let bending = face_curvature(mesh, &optimizer.curvature, |_| true);
    let (mut area, mut weight) = (0.0, 0.0);
    let mut shares = vec![0.0; job.surface.mesh.n_faces()];
    for (f, c) in mesh.faces().zip(&bending) {
        let w = (c.k_max - c.k_min).powi(2) * metric.area(f);
        let d = metric.tangent(mesh, f, field.angle[f.index()]);
        let (x, y) = (d.dot(c.d_min).abs(), d.dot(c.d_max).abs());
        area += metric.area(f);
        weight += w;
        shares[net.base_face[f.index()].index()] += w * x.min(y).atan2(x.max(y)).to_degrees();
    }
    let weight = weight.max(f64::MIN_POSITIVE);
    shares.iter_mut().for_each(|s| *s /= weight);
    let energy = solution.energy / area.max(f64::MIN_POSITIVE);
    Ok(Foreseen { alignment: shares.iter().sum(), energy, shares })
}
