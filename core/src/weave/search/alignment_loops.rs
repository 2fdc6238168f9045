//! Loops aligned to the smooth cross field of the shape.
//!
//! The elastica graph aligns loops to principal directions only where the absolute principal curvatures differ, not on flat
//! parts or saddles. The alignment of a layout counts saddles as well, and between aligned parts strips have to turn from one
//! to the next. The smooth curvature-aligned cross field gives a direction everywhere: in a second graph loops follow it, as
//! in dual loops meshing (Campen, Quad Layouts, chapter 5).

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

/// Distance over which a principal direction of mean weight outweighs smoothness of the field, in model sizes:
/// as far as fields of layouts can usually follow directions.
const ALIGNMENT_RADIUS: f64 = 0.08;
/// Largest weight of a direction, relative to the mean, so that limbs do not dominate the field of the flanks.
const MAX_WEIGHT: f64 = 4.0;
/// Factor of the squared deviation in the cost of a loop: 10° off the field a loop costs six times as much as along it, as
/// with the anisotropy of 30 of dual loops.
const DEVIATION_FACTOR: f64 = 300.0;

/// A shape's smooth cross field, and the graph of loops along it.
pub(in crate::weave) struct AlignmentGraph {
    pub graph: ElasticaGraph,
    /// Two perpendicular directions of the field at each vertex.
    cross: Vec<[DVec3; 2]>,
}

impl AlignmentGraph {
    /// The graph of a model; `None` if the field cannot be computed, since searches work without aligned loops.
    pub(in crate::weave) fn new(model: &Model, progress: &Progress) -> Result<Option<Self>, Cancelled> {
        let found = Self::along_field(model, progress);
        progress.check()?;
        Ok(found
            .inspect_err(|error| tracing::warn!(%error, "no curvature-aligned field: no aligned loops are tried"))
            .ok())
    }

    fn along_field(model: &Model, progress: &Progress) -> Result<Self, WeaveError> {
        let mesh = &model.mesh;
        let metric = Metric::new(mesh);
        let field = smooth_field(model, &metric, progress)?;
        let pairs: Vec<[DVec3; 2]> = mesh.vertices().map(|v| cross_at(mesh, &metric, &field, v)).collect();
        let along = |[x, y]: &[DVec3; 2]| PrincipalCurvature {
            k_min: 0.0,
            k_max: DEVIATION_FACTOR.sqrt(),
            d_min: *x,
            d_max: *y,
        };
        let directions: Vec<PrincipalCurvature> = pairs.iter().map(along).collect();
        let options = ElasticaOptions { aligned_boundary: model.options.aligned_boundary, ..Default::default() };
        let graph = ElasticaGraph::build(mesh.clone(), &directions, &model.sharp, &options, progress)?;
        Ok(Self { graph, cross: pairs })
    }

    /// Queries for loops through a vertex along either direction of the field.
    pub(in crate::weave) fn queries(&self, v: VertexId) -> [Query; 2] {
        self.cross[v.index()].map(|d| (v, Some(d)))
    }
}

/// The smooth cross field, aligned to principal directions with the squared difference of curvatures as weight.
fn smooth_field(model: &Model, metric: &Metric, progress: &Progress) -> Result<CrossField, WeaveError> {
    let mesh = &model.mesh;
    let curvature = face_curvature(mesh, &model.curvature, |_| true);
    let anisotropy: Vec<f64> = curvature.iter().map(|c| (c.k_max - c.k_min).powi(2)).collect();
    let (sum, area) = mesh.faces().zip(&anisotropy).fold((0.0, 0.0), |(sum, area), (f, w)| {
        let a = metric.area(f);
        (sum + w * a, area + a)
    });
    let mean = (sum / area).max(f64::MIN_POSITIVE);
    let weights: Vec<f64> = anisotropy.iter().map(|w| (w / mean).min(MAX_WEIGHT)).collect();
    let directions: Vec<DVec3> = curvature.iter().map(|c| c.d_max).collect();
    let alignment = AlignmentDirections { directions: &directions, weights: &weights, radius: ALIGNMENT_RADIUS };
    Ok(feature_aligned_field(mesh, metric, Some(alignment), &model.sharp, progress)?)
}

/// Two perpendicular directions of the field at a vertex: the mean over the triangles around it, weighted by angle.
fn cross_at(mesh: &TriMesh, metric: &Metric, field: &CrossField, v: VertexId) -> [DVec3; 2] {
    let normal: DVec3 = mesh.outgoing(v).map(|h| mesh.face_area_vector(mesh.face(h))).sum();
    let n = normal.normalize_or(DVec3::Z);
    let (x, y) = n.any_orthonormal_pair();
    // Fourfold angles represent a cross independently of which of its directions is taken.
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
    use crate::weave::options::Options;

    #[test]
    fn loops_follow_the_circles_of_a_torus_from_any_point() {
        let loaded = builtin("torus").unwrap();
        let model = Model::prepare(loaded, Options::default(), &Progress::new()).unwrap();
        let aligned = AlignmentGraph::new(&model, &Progress::new()).unwrap().unwrap();
        let none = DirectionMask::all_open();
        let (mut alignment, mut length) = (0.0, 0.0);
        for v in (0..model.mesh.n_vertices()).step_by(97).map(VertexId::new) {
            for (v, direction) in aligned.queries(v) {
                let query = ProposalQuery { direction, ..ProposalQuery::cheapest(v, &none) };
                let found = aligned.graph.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
                let l = &found.loops[0];
                // At most 10° off the field: not all directions are geodesics of the graph.
                assert!(
                    l.alignment < 0.0154 * DEVIATION_FACTOR * l.length,
                    "{direction:?}: {} of {}",
                    l.alignment,
                    l.length
                );
                (alignment, length) = (alignment + l.alignment, length + l.length);
            }
        }
        // On average less than 5.5° off.
        assert!(alignment < 0.0046 * DEVIATION_FACTOR * length, "{alignment} of {length}");
    }
}
