//! How well the layout of strips fits the shape, predicted without optimising its embedding.

use serde::Serialize;

use crate::dual::{Arrangement, assess};
use crate::embed::{Problem, Settings, arc_headings, predict_fit};
use crate::layout::Node;
use crate::progress::Progress;
use crate::surface::SurfaceCurve;
use crate::weave::embedding::{Place, embedded_dual};
use crate::weave::error::WeaveError;
use crate::weave::model::Model;

/// Weight of the number of patches, in degrees of deviation: a hundred patches more are worth half a degree.
const PATCH_WEIGHT: f64 = 0.005;
/// Weight of the conformal distortion above 2, in degrees: a tenth is worth about half a degree.
const DISTORTION_WEIGHT: f64 = 6.0;
/// Weight of the share of flipped triangles, in degrees: 50 of 6000, from which on maps of least squares cannot be made
/// injective, are worth a degree.
const FLIPPED_WEIGHT: f64 = 120.0;
/// Weight of a quarter of index, in degrees: at an irregular node quads cannot be square.
const INDEX_WEIGHT: f64 = 0.01;
/// Weight of a quarter of index beyond [`USUAL_INDICES`], in degrees.
const EXTREME_INDEX_WEIGHT: f64 = 0.5;
/// Indices, in quarters, of nodes that can be embedded well and have quads of good angles: of three to six patches.
const USUAL_INDICES: [i32; 2] = [-2, 1];

/// How well a layout fits the shape.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Fit {
    /// Predicted mean deviation from principal directions, in degrees.
    pub alignment: f64,
    /// Predicted mean conformal distortion, 2 at best.
    pub conformal: f64,
    /// Predicted share of triangles that the map of least squares flips.
    pub flipped: f64,
    /// Number of patches.
    pub patches: usize,
    /// Number of irregular nodes.
    pub irregular: usize,
    /// The objective of improving, in degrees: the weighted sum of deviation, distortion and structure. Lower is
    /// better.
    pub objective: f64,
}

/// The predicted fit of the layout of curves on the woven mesh, after `steps` steps of its nodes, and the contribution of
/// each triangle to the deviation.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] if the curves have no layout, or why it cannot be embedded.
pub(in crate::weave) fn fit(
    model: &Model,
    curves: &[&SurfaceCurve],
    steps: usize,
    progress: &Progress,
) -> Result<(Fit, Vec<f64>), WeaveError> {
    let arrangement = Arrangement::new(&model.mesh, curves.iter().copied())?;
    let reports = assess(&arrangement, &model.vertex_curvatures, &model.corners);
    let place = Place { mesh: &model.mesh, sharp: &model.sharp, vertex_curvatures: &model.vertex_curvatures };
    let (layout, initial_embedding) = embedded_dual(&arrangement, &reports, place, progress)?;
    let problem = Problem {
        surface: model.surface(model.woven_role()),
        layout: &layout,
        initial_embedding: &initial_embedding,
        arc_headings: &arc_headings(&layout),
        pinned_nodes: &[],
        pinned_arcs: &[],
        settings: Settings::default(),
    };
    let predicted = predict_fit(&problem, steps, progress)?;
    let index = |n: &Node| (if n.boundary { 2 } else { 4 }) - n.valence as i32;
    let quarters: i32 = layout.nodes.iter().map(|n| index(n).abs()).sum();
    let beyond = |i: i32| (i - i.clamp(USUAL_INDICES[0], USUAL_INDICES[1])).abs();
    let extreme: i32 = layout.nodes.iter().map(|n| beyond(index(n))).sum();
    let patches = layout.patches.len();
    let objective = predicted.alignment
        + DISTORTION_WEIGHT * (predicted.conformal - 2.0)
        + FLIPPED_WEIGHT * predicted.flipped
        + PATCH_WEIGHT * patches as f64
        + INDEX_WEIGHT * f64::from(quarters)
        + EXTREME_INDEX_WEIGHT * f64::from(extreme);
    let fit = Fit {
        alignment: predicted.alignment,
        conformal: predicted.conformal,
        flipped: predicted.flipped,
        patches,
        irregular: layout.n_irregular(),
        objective,
    };
    Ok((fit, predicted.shares))
}
