//! Prediction of how well a layout will fit a surface, before it is embedded.
//!
//! For nodes at their initial positions, the guiding field and the least-squares map take linear solves only. The
//! quality measures of this map are not those of the finished embedding, but nearly in the same order, which suffices
//! to choose between many layouts, a hundred times as fast. Some node steps bring them closer and show which flipped
//! triangles persist.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::setup::PreparedTopology;
use crate::embed::parameterise::quality::{TriangleMeasure, measure_map};
use crate::embed::parameterise::solve::{FeatureConstraint, MapKind};
use crate::embed::parameterise::state::State;
use crate::embed::problem::Problem;
use crate::progress::Progress;
use crate::surface::face_curvature;

/// Bound of the conformal distortion of one triangle, and the value of a flipped one, which an injective map will
/// squeeze. Few triangles of finished embeddings have more.
const MAX_CONFORMAL: f64 = 4.0;

/// The predicted quality of an embedding.
#[derive(Debug, Clone)]
pub struct PredictedFit {
    /// Alignment error of the least-squares map in degrees, as
    /// [`Measures::alignment`](crate::embed::Measures::alignment).
    pub alignment: f64,
    /// Its conformal distortion, as [`Measures::conformal`](crate::embed::Measures::conformal), but with a smaller
    /// bound for each triangle.
    pub conformal: f64,
    /// The share of triangles that are flipped, 0 to 1. Those that persist while nodes move can hardly be removed.
    pub flipped: f64,
    /// The contribution of each triangle of the surface to the alignment error, in degrees.
    pub shares: Vec<f64>,
}

/// Predicts how well a layout will fit the surface, after the given number of node steps.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn predict_fit(problem: &Problem<'_>, steps: usize, progress: &Progress) -> Result<PredictedFit, EmbeddingError> {
    let prepared = PreparedTopology::new(problem)?;
    progress.check()?;
    // Least squares ignore penalties: features do not constrain the map.
    let kind = (MapKind::LeastSquares, FeatureConstraint::Penalty(1.0));
    let mut optimiser =
        Optimiser::with_map(problem, prepared, kind, progress)?.map_err(|_| EmbeddingError::NoInjectiveMap)?;
    for _ in 0..steps {
        progress.check()?;
        optimiser.step(progress)?;
    }
    let State { topology, solution, .. } = optimiser.state();
    let mesh = &topology.mesh;
    let curvature = face_curvature(mesh, &optimiser.curvature, |_| true);
    let (_, triangles) = measure_map(mesh, &solution.map, &curvature);
    let area: f64 = triangles.iter().map(|t| t.area).sum();
    let weight: f64 = triangles.iter().map(|t| t.area * t.anisotropy).sum();
    let (area, weight) = (area.max(f64::MIN_POSITIVE), weight.max(f64::MIN_POSITIVE));
    let distortion = |t: &TriangleMeasure| if t.flipped { MAX_CONFORMAL } else { t.conformal.min(MAX_CONFORMAL) };
    let conformal = triangles.iter().map(|t| t.area * distortion(t)).sum::<f64>() / area;
    let mut shares = vec![0.0; problem.surface.mesh.n_faces()];
    for (t, base) in triangles.iter().zip(&topology.base_face) {
        shares[base.index()] += t.area * t.anisotropy * t.deviation / weight;
    }
    let flipped = optimiser.state().flipped() as f64 / mesh.n_faces() as f64;
    Ok(PredictedFit { alignment: shares.iter().sum(), conformal, flipped, shares })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Arrangement;
    use crate::embed::{Settings, Surface, arc_headings};
    use crate::layout::{QuadLayout, initial_embedding};
    use crate::surface::{SurfaceCurve, SurfaceIndex, principal_curvature};
    use crate::testing::{column, diagonal, row, torus};

    const N: u32 = 24;

    /// The predicted fit of the layout dual to some curves on a torus.
    fn predicted(curves: &[SurfaceCurve], steps: usize) -> PredictedFit {
        let mesh = torus(N, N);
        let arrangement = Arrangement::new(&mesh, curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
        let initial_embedding =
            initial_embedding(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
        let sharp = vec![false; mesh.n_edges()];
        let curvature = principal_curvature(&mesh, 0.03, &sharp);
        let index = SurfaceIndex::new(&mesh);
        let problem = Problem {
            surface: Surface { mesh: &mesh, index: &index, curvature: &curvature, sharp: &sharp },
            layout: &layout,
            initial_embedding: &initial_embedding,
            arc_headings: &arc_headings(&layout),
            pinned_nodes: &[],
            pinned_arcs: &[],
            settings: Settings::default(),
        };
        let found = predict_fit(&problem, steps, &Progress::new()).unwrap();
        assert_eq!(found.shares.len(), mesh.n_faces());
        assert!((found.shares.iter().sum::<f64>() - found.alignment).abs() < 1e-12);
        found
    }

    #[test]
    fn circles_along_a_torus_fit_better_than_windings() {
        let along = predicted(&[row(N, 3, true, 0.4), column(N, N, 5, true, 0.4)], 0);
        assert!(along.alignment < 2.5 && along.conformal < 2.02, "{} {}", along.alignment, along.conformal);
        let wound = predicted(&[diagonal(N), column(N, N, 5, true, 0.4)], 0);
        assert!(wound.conformal > along.conformal + 0.3, "{} {}", wound.conformal, along.conformal);
    }

    #[test]
    fn node_steps_do_not_worsen_the_predicted_fit() {
        let curves =
            [row(N, 3, true, 0.4), row(N, 5, true, 0.4), column(N, N, 5, true, 0.4), column(N, N, 6, true, 0.4)];
        let [initial, moved] = [0, 3].map(|steps| predicted(&curves, steps));
        let objective = |f: &PredictedFit| f.alignment + 10.0 * f.conformal;
        let (initial, moved) = (objective(&initial), objective(&moved));
        assert!(moved <= initial + 1e-2, "{moved} {initial}");
    }
}
