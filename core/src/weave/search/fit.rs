//! How well the layout of some strips fits the shape, told before it is embedded.

use serde::Serialize;

use crate::dual::{Arrangement, Colour, assess};
use crate::embed::{Problem, Settings, arc_headings, predict_fit};
use crate::layout::{QuadLayout, embed};
use crate::progress::Progress;
use crate::surface::SurfaceCurve;
use crate::weave::embedding::preferred_nodes;
use crate::weave::error::WeaveError;
use crate::weave::mesh_role::MeshRole;
use crate::weave::model::Model;

/// What a patch is worth, in degrees of deviation from principal directions: a hundred patches more have to lower it by
/// half a degree.
const PATCH: f64 = 0.005;
/// What conformal distortion is worth, likewise: a tenth more or less of it shows as much as half a degree.
const DISTORTION: f64 = 6.0;
/// What triangles that fold are worth, likewise: of 6000 some 50 more or less, beyond which maps of least squares cannot be
/// unfolded, as much as a degree.
const FOLDS: f64 = 120.0;
/// What a quarter of index is worth, likewise: an irregular node is a point where quads cannot be square.
const QUARTER: f64 = 0.01;
/// What a quarter of index is worth beyond those with which a node can be embedded well and has quads of good angles: of three
/// to six patches.
const EXTREME: f64 = 0.5;
const USUAL: [i32; 2] = [-2, 1];

/// How well a layout fits the shape.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Fit {
    /// The mean deviation from principal directions that is foreseen, in degrees.
    pub alignment: f64,
    /// The mean conformal distortion that is foreseen.
    pub conformal: f64,
    /// The share of triangles that are foreseen to fold before they are made not to.
    pub folded: f64,
    /// Number of patches.
    pub patches: usize,
    /// Number of irregular nodes.
    pub irregular: usize,
    /// The deviation and what the structure is worth, together: the less, the better.
    pub objective: f64,
}

/// The fit of the layout that curves on the woven mesh of a model make, with its nodes moved so many times, and what every
/// triangle adds to its deviation.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] if they make no layout; what drawing and field have to say.
pub(in crate::weave) fn fit(
    model: &Model,
    curves: &[&SurfaceCurve],
    steps: usize,
    progress: &Progress,
) -> Result<(Fit, Vec<f64>), WeaveError> {
    let mesh = &model.mesh;
    let arrangement = Arrangement::new(mesh, curves.iter().copied())?;
    let reports = assess(&arrangement, &model.vertex_curvatures, &model.corners);
    let red: Vec<u32> = (0..reports.len() as u32).filter(|&r| reports[r as usize].colour == Colour::Red).collect();
    let layout = QuadLayout::dual(&arrangement, &red, mesh.euler_characteristic())?;
    let preferred = preferred_nodes(&arrangement, &layout, &reports, mesh, &model.sharp, &model.vertex_curvatures);
    let initial_embedding = embed(&arrangement, &layout, &preferred, progress)?;
    let mesh_role = if model.proxy.is_some() { MeshRole::Proxy } else { MeshRole::Design };
    let job = Problem {
        surface: model.surface(mesh_role),
        layout: &layout,
        initial_embedding: &initial_embedding,
        arc_headings: &arc_headings(&layout),
        pinned_nodes: &[],
        pinned_arcs: &[],
        settings: Settings::default(),
    };
    let foreseen = predict_fit(&job, steps, progress)?;
    let index = |n: &crate::layout::Node| (if n.boundary { 2 } else { 4 }) - n.valence as i32;
    let quarters: i32 = layout.nodes.iter().map(|n| index(n).abs()).sum();
    let beyond = |i: i32| (i - i.clamp(USUAL[0], USUAL[1])).abs();
    let extreme: i32 = layout.nodes.iter().map(|n| beyond(index(n))).sum();
    let patches = layout.patches.len();
    let objective = foreseen.alignment
        + DISTORTION * (foreseen.conformal - 2.0)
        + FOLDS * foreseen.flipped
        + PATCH * patches as f64
        + QUARTER * f64::from(quarters)
        + EXTREME * f64::from(extreme);
    let fit = Fit {
        alignment: foreseen.alignment,
        conformal: foreseen.conformal,
        folded: foreseen.flipped,
        patches,
        irregular: layout.n_irregular(),
        objective,
    };
    Ok((fit, foreseen.shares))
}
