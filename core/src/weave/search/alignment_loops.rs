//! The smooth cross field of a shape as a guide for loops.
//!
//! Loops of the elastica graph keep to pointwise principal directions where curvature is anisotropic, and go anywhere
//! where it is not, on flat parts as on saddles, where both curvatures are equal but for their sign. How well a layout
//! follows the shape counts saddles as much as tubes, and between tubes strips have to turn so that they fit the next one.
//! The smooth cross field tells how: in a second graph loops keep to it everywhere, as in dual loops meshing (Campen, Quad
//! Layouts, chapter 5).

use glam::DVec3;

use crate::elastica::{ElasticaGraph, ElasticaOptions};
use crate::field::{AlignmentDirections, CrossField, feature_aligned_field};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::Metric;
use crate::surface::PrincipalCurvature;
use crate::surface::face_curvature;
use crate::weave::error::WeaveError;
use crate::weave::model::Model;
use crate::weave::search::candidates::Query;

/// Distance over which a mean principal direction prevails over smoothness of the field: as far as fields of layouts can
/// usually follow directions.
const RADIUS: f64 = 0.08;
/// How many times as much as the mean a direction counts at most, so that limbs do not draw the field of the flanks.
const FIRMEST: f64 = 4.0;
/// The factor of the deviation in the cost of a loop: at 10° off a loop costs six times as much as along the field, as
/// with the anisotropy of 30 by which dual loops follow theirs.
const PULL: f64 = 300.0;

/// A shape's smooth cross field, and the graph of loops along it.
pub(in crate::weave) struct AlignmentGraph {
    pub graph: ElasticaGraph,
    /// One of the four directions of the field at each vertex.
    cross: Vec<[DVec3; 2]>,
}

impl AlignmentGraph {
    /// `None` where there is no such field: loops do without it.
    pub(in crate::weave) fn new(model: &Model, progress: &Progress) -> Result<Option<Self>, Cancelled> {
        let found = Self::along_field(model, progress);
        progress.check()?;
        Ok(found.inspect_err(|error| tracing::warn!(%error, "no smooth field to guide loops")).ok())
    }

    fn along_field(model: &Model, progress: &Progress) -> Result<Self, WeaveError> {
        let mesh = &model.mesh;
        let metric = Metric::new(mesh);
        let field = smooth_field(model, &metric, progress)?;
        let pairs: Vec<[DVec3; 2]> = mesh.vertices().map(|v| cross_at(mesh, &metric, &field, v)).collect();
        let along = |[x, y]: &[DVec3; 2]| PrincipalCurvature { k_min: 0.0, k_max: PULL.sqrt(), d_min: *x, d_max: *y };
        let directions: Vec<PrincipalCurvature> = pairs.iter().map(along).collect();
        let options = ElasticaOptions { aligned_boundary: model.options.aligned_boundary, ..Default::default() };
        let graph = ElasticaGraph::build(mesh.clone(), &directions, &model.sharp, &options, progress)?;
        Ok(Self { graph, cross: pairs })
    }

    /// Queries for loops through a vertex along the field, in either direction.
    pub(in crate::weave) fn queries(&self, v: VertexId) -> [Query; 2] {
        self.cross[v.index()].map(|d| (v, Some(d)))
    }
}

/// The cross field that follows principal directions the more the more curvatures differ, and else is smooth.
fn smooth_field(model: &Model, metric: &Metric, progress: &Progress) -> Result<CrossField, WeaveError> {
    let mesh = &model.mesh;
    let bending = face_curvature(mesh, &model.curvature, |_| true);
    let anisotropy: Vec<f64> = bending.iter().map(|c| (c.k_max - c.k_min).powi(2)).collect();
    let (sum, area) = mesh.faces().zip(&anisotropy).fold((0.0, 0.0), |(sum, area), (f, w)| {
        let a = metric.area(f);
        (sum + w * a, area + a)
    });
    let mean = (sum / area).max(f64::MIN_POSITIVE);
    let weights: Vec<f64> = anisotropy.iter().map(|w| (w / mean).min(FIRMEST)).collect();
    let directions: Vec<DVec3> = bending.iter().map(|c| c.d_max).collect();
    let guides = AlignmentDirections { directions: &directions, weights: &weights, radius: RADIUS };
    Ok(feature_aligned_field(mesh, metric, Some(guides), &model.sharp, progress)?)
}

/// Two directions at right angles of the field around a vertex.
fn cross_at(mesh: &TriMesh, metric: &Metric, field: &CrossField, v: VertexId) -> [DVec3; 2] {
    let normal: DVec3 = mesh.outgoing(v).map(|h| mesh.face_area_vector(mesh.face(h))).sum();
    let n = normal.normalize_or(DVec3::Z);
    let (x, y) = n.any_orthonormal_pair();
    // The mean of what stands for a cross whichever of its directions is taken.
    let (mut re, mut im) = (0.0, 0.0);
    for h in mesh.outgoing(v) {
        let f = mesh.face(h);
        let d = field.direction(mesh, metric, f, 0);
        let angle = 4.0 * d.dot(y).atan2(d.dot(x));
        let weight = mesh.corner_angle(h);
        re += weight * angle.cos();
        im += weight * angle.sin();
    }
    let angle = 0.25 * f64::atan2(im, re);
    let d = x * angle.cos() + y * angle.sin();
    [d, n.cross(d)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elastica::{DirectionMask, ProposalQuery, SearchWorkspace};
    use crate::mesh::builtin;
    use crate::weave::Options;

    #[test]
    fn loops_keep_to_the_circles_of_a_torus_from_any_point() {
        let loaded = builtin("torus").unwrap();
        let model = Model::prepare(loaded, Options::default(), &Progress::new()).unwrap();
        let guidance = AlignmentGraph::new(&model, &Progress::new()).unwrap().unwrap();
        let none = DirectionMask::none();
        let (mut alignment, mut length) = (0.0, 0.0);
        for v in (0..model.mesh.n_vertices()).step_by(97).map(VertexId::new) {
            for (v, direction) in guidance.queries(v) {
                let query = ProposalQuery { direction, ..ProposalQuery::cheapest(v, &none) };
                let found = guidance.graph.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
                let l = &found.loops[0];
                // 10° off where they deviate most: not all directions are geodesics of the graph.
                assert!(l.alignment < 0.0154 * PULL * l.length, "{direction:?}: {} of {}", l.alignment, l.length);
                (alignment, length) = (alignment + l.alignment, length + l.length);
            }
        }
        // On average less than 5° off.
        assert!(alignment < 0.0038 * PULL * length, "{alignment} of {length}");
    }
}
