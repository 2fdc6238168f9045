//! How far a layout will deviate from principal directions, told before it is embedded.
//!
//! The guiding field with the layout's singularities is a linear solve, and the map follows it as far as it can. Its
//! deviation where the nodes are drawn is below that of the finished embedding, and close to it in rank: enough to choose
//! between layouts, a hundred times as fast.

use super::EmbeddingError;
use super::bending::face_curvature;
use super::descent::Optimizer;
use super::job::Job;
use super::solver::Features;
use super::solver::Solver;
use super::spacing::Spacing;
use super::straight::Crossroads;
use crate::field::{GuidedSystem, Metric};
use crate::progress::Progress;

/// What is foreseen of an embedding.
#[derive(Debug, Clone)]
pub struct Foreseen {
    /// The mean deviation of the guiding field from principal directions, in degrees, weighed by `(κ₁ − κ₂)²` as in
    /// [`Measures::alignment`](super::Measures::alignment).
    pub alignment: f64,
    /// What each triangle of the surface adds to that.
    pub shares: Vec<f64>,
}

/// Foresees how well a layout will follow principal directions.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn foresee(job: &Job<'_>, progress: &Progress) -> Result<Foreseen, EmbeddingError> {
    let (net, sharp, curvature) = Optimizer::net(job)?;
    progress.check()?;
    let guided = GuidedSystem::new(&net.mesh)?;
    let metric = Metric::new(&net.mesh);
    let solver = Solver {
        curvature: &curvature,
        sharp: &sharp,
        roads: &Crossroads::new(job.layout, |_| false),
        spacing: &Spacing::none(job.layout.chords),
        guided: &guided,
        seamless: None,
        sizes: None,
        settings: job.settings,
        features: Features::Pulled,
        loose: &[],
        pull: 1.0,
    };
    let angle = solver.angles(&net, &metric, None, progress)?;
    let mesh = &net.mesh;
    let bending = face_curvature(mesh, &curvature, |_| true);
    let (mut sum, mut weight) = (0.0, 0.0);
    let mut shares = vec![0.0; job.surface.mesh.n_faces()];
    for (f, c) in mesh.faces().zip(&bending) {
        let w = (c.k_max - c.k_min).powi(2) * metric.area(f);
        let d = metric.tangent(mesh, f, angle[f.index()]);
        let (x, y) = (d.dot(c.d_min).abs(), d.dot(c.d_max).abs());
        let off = x.min(y).atan2(x.max(y)).to_degrees();
        weight += w;
        sum += w * off;
        shares[net.base_face[f.index()].index()] += w * off;
    }
    let weight = weight.max(f64::MIN_POSITIVE);
    shares.iter_mut().for_each(|s| *s /= weight);
    Ok(Foreseen { alignment: sum / weight, shares })
}
