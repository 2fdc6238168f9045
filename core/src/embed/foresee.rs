//! How well a layout will fit a surface, told before it is embedded.
//!
//! Where the nodes are drawn, the guiding field with the layout's singularities and the map of least squares along it are
//! linear solves. How far the field deviates from principal directions, how far the map is from following the field, and
//! how much of it folds, are not what the finished embedding has, but close to it in rank: enough to choose between many
//! layouts, a hundred times as fast. Some steps of the nodes bring it closer, and show which folds do not go away.

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
    /// The share of the map's triangles that fold.
    pub folded: f64,
    /// What each triangle of the surface adds to the deviation.
    pub shares: Vec<f64>,
}

/// Foresees how well a layout will fit the surface, with the nodes moved so many times.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn foresee(job: &Job<'_>, steps: usize, progress: &Progress) -> Result<Foreseen, EmbeddingError> {
    let ready = Optimizer::net(job)?;
    progress.check()?;
    let mut optimizer = Optimizer::on(job, ready, (Aim::LeastSquares, Features::Pulled(1.0)), progress)?
        .map_err(|_| EmbeddingError::Folded)?;
    for _ in 0..steps {
        progress.check()?;
        optimizer.step(progress)?;
    }
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
    let folded = optimizer.state().flipped() as f64 / mesh.n_faces().max(1) as f64;
    Ok(Foreseen { alignment: shares.iter().sum(), energy, folded, shares })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Arrangement;
    use crate::embed::{Settings, Surface, headings};
    use crate::layout::{QuadLayout, embed};
    use crate::surface::{SurfaceCurve, SurfaceIndex, principal_curvature};
    use crate::testing::{column, diagonal, row, torus};

    const N: u32 = 24;

    /// What is foreseen of the layout of some curves on a torus.
    fn of(curves: &[SurfaceCurve], steps: usize) -> Foreseen {
        let mesh = torus(N, N);
        let arrangement = Arrangement::new(&mesh, curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
        let drawing = embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
        let sharp = vec![false; mesh.n_edges()];
        let curvature = principal_curvature(&mesh, 0.03, &sharp);
        let index = SurfaceIndex::new(&mesh);
        let job = Job {
            surface: Surface { mesh: &mesh, index: &index, curvature: &curvature, sharp: &sharp },
            layout: &layout,
            drawing: &drawing,
            headings: &headings(&layout),
            pinned_nodes: &[],
            pinned_arcs: &[],
            settings: Settings::default(),
        };
        let found = foresee(&job, steps, &Progress::new()).unwrap();
        assert_eq!(found.shares.len(), mesh.n_faces());
        assert!((found.shares.iter().sum::<f64>() - found.alignment).abs() < 1e-12);
        found
    }

    #[test]
    fn circles_suit_a_torus_and_windings_do_not() {
        let along = of(&[row(N, 3, true, 0.4), column(N, N, 5, true, 0.4)], 0);
        assert!(along.alignment < 2.0 && along.energy < 0.1 && along.folded < 0.01, "{along:?}");
        let wound = of(&[diagonal(N), column(N, N, 5, true, 0.4)], 0);
        assert!(wound.energy > 3.0 * along.energy, "{} {}", wound.energy, along.energy);
    }

    #[test]
    fn what_is_foreseen_becomes_no_worse_when_nodes_move() {
        let curves =
            [row(N, 3, true, 0.4), row(N, 5, true, 0.4), column(N, N, 5, true, 0.4), column(N, N, 6, true, 0.4)];
        let [drawn, moved] = [0, 3].map(|steps| of(&curves, steps));
        assert!(moved.energy <= drawn.energy, "{} {}", moved.energy, drawn.energy);
    }
}
