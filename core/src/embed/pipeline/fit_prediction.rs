//! How well a layout will fit a surface, told before it is embedded.
//!
//! Where the nodes are drawn, the guiding field with the layout's singularities and the map of least squares along it are
//! linear solves. What is measured of finished embeddings is measured of this map, as if what folds were squeezed. It is
//! not the same, but close to it in rank: enough to choose between many layouts, a hundred times as fast. Some steps of the
//! nodes bring it closer, and show which folds do not go away.

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::quality::{TriangleMeasure, measure_map};
use crate::embed::parameterise::solve::{Aim, Features};
use crate::embed::parameterise::state::State;
use crate::embed::problem::Problem;
use crate::progress::Progress;
use crate::surface::face_curvature;

/// The most that the distortion of a triangle counts, and that of one that folds: few triangles of embeddings have more.
const WORST: f64 = 4.0;

/// What is foreseen of an embedding.
#[derive(Debug, Clone)]
pub struct PredictedFit {
    /// The mean deviation of the map from principal directions, in degrees, as
    /// [`Measures::alignment`](crate::embed::Measures::alignment).
    pub alignment: f64,
    /// Its conformal distortion, as [`Measures::conformal`](crate::embed::Measures::conformal), but of no triangle more than it
    /// can be made: what folds here will be squeezed.
    pub conformal: f64,
    /// The share of triangles that are folded: what does not go away when nodes move can hardly be unfolded.
    pub folded: f64,
    /// What each triangle of the surface adds to the deviation.
    pub shares: Vec<f64>,
}

/// Foresees how well a layout will fit the surface, with the nodes moved so many times.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn predict_fit(job: &Problem<'_>, steps: usize, progress: &Progress) -> Result<PredictedFit, EmbeddingError> {
    let ready = Optimiser::net(job)?;
    progress.check()?;
    let mut optimiser = Optimiser::on(job, ready, (Aim::LeastSquares, Features::Pulled(1.0)), progress)?
        .map_err(|_| EmbeddingError::Folded)?;
    for _ in 0..steps {
        progress.check()?;
        optimiser.step(progress)?;
    }
    let State { net, solution, .. } = optimiser.state();
    let mesh = &net.mesh;
    let bending = face_curvature(mesh, &optimiser.curvature, |_| true);
    let (_, triangles) = measure_map(mesh, &solution.map, &bending);
    let area: f64 = triangles.iter().map(|t| t.area).sum();
    let weight: f64 = triangles.iter().map(|t| t.area * t.anisotropy).sum();
    let (area, weight) = (area.max(f64::MIN_POSITIVE), weight.max(f64::MIN_POSITIVE));
    let distortion = |t: &TriangleMeasure| if t.flipped { WORST } else { t.conformal.min(WORST) };
    let conformal = triangles.iter().map(|t| t.area * distortion(t)).sum::<f64>() / area;
    let mut shares = vec![0.0; job.surface.mesh.n_faces()];
    for (t, base) in triangles.iter().zip(&net.base_face) {
        shares[base.index()] += t.area * t.anisotropy * t.deviation / weight;
    }
    let folded = optimiser.state().flipped() as f64 / mesh.n_faces() as f64;
    Ok(PredictedFit { alignment: shares.iter().sum(), conformal, folded, shares })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Arrangement;
    use crate::embed::{Settings, Surface, arc_headings};
    use crate::layout::{QuadLayout, embed};
    use crate::surface::{SurfaceCurve, SurfaceIndex, principal_curvature};
    use crate::testing::{column, diagonal, row, torus};

    const N: u32 = 24;

    /// What is foreseen of the layout of some curves on a torus.
    fn of(curves: &[SurfaceCurve], steps: usize) -> PredictedFit {
        let mesh = torus(N, N);
        let arrangement = Arrangement::new(&mesh, curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
        let initial_embedding =
            embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
        let sharp = vec![false; mesh.n_edges()];
        let curvature = principal_curvature(&mesh, 0.03, &sharp);
        let index = SurfaceIndex::new(&mesh);
        let job = Problem {
            surface: Surface { mesh: &mesh, index: &index, curvature: &curvature, sharp: &sharp },
            layout: &layout,
            initial_embedding: &initial_embedding,
            arc_headings: &arc_headings(&layout),
            pinned_nodes: &[],
            pinned_arcs: &[],
            settings: Settings::default(),
        };
        let found = predict_fit(&job, steps, &Progress::new()).unwrap();
        assert_eq!(found.shares.len(), mesh.n_faces());
        assert!((found.shares.iter().sum::<f64>() - found.alignment).abs() < 1e-12);
        found
    }

    #[test]
    fn circles_suit_a_torus_and_windings_do_not() {
        let along = of(&[row(N, 3, true, 0.4), column(N, N, 5, true, 0.4)], 0);
        assert!(along.alignment < 2.5 && along.conformal < 2.02, "{} {}", along.alignment, along.conformal);
        let wound = of(&[diagonal(N), column(N, N, 5, true, 0.4)], 0);
        assert!(wound.conformal > along.conformal + 0.3, "{} {}", wound.conformal, along.conformal);
    }

    #[test]
    fn what_is_foreseen_becomes_no_worse_when_nodes_move() {
        let curves =
            [row(N, 3, true, 0.4), row(N, 5, true, 0.4), column(N, N, 5, true, 0.4), column(N, N, 6, true, 0.4)];
        let [drawn, moved] = [0, 3].map(|steps| of(&curves, steps));
        let price = |f: &PredictedFit| f.alignment + 10.0 * f.conformal;
        assert!(price(&moved) <= price(&drawn) + 1e-2, "{} {}", price(&moved), price(&drawn));
    }
}
