//! A mesh made ready for weaving: everything that depends on the mesh and the options alone.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::session::WeaveError;
use crate::dual::vertex_curvatures;
use crate::elastica::{ElasticaGraph, ElasticaOptions};
use crate::field::{Guides, Metric, pronounced, shape_field};
use crate::mesh::{
    LoadedMesh, SHARP_DIHEDRAL, SHORT_FEATURE, Topology, TriMesh, VertexId, drop_short_features, sharp_edges,
};
use crate::progress::Progress;
use crate::surface::{PrincipalCurvature, SurfaceIndex, principal_curvature};

/// What the designer may set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Radius of the ball over which curvature is taken, as a fraction of the bounding-box diagonal: smaller
    /// relief does not guide strips.
    pub curvature_radius: f64,
    /// Dihedral angle above which an edge is sharp, in radians.
    pub sharp_dihedral: f64,
    /// Whether strips end at right angles on the boundary.
    pub aligned_boundary: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { curvature_radius: 0.03, sharp_dihedral: SHARP_DIHEDRAL, aligned_boundary: true }
    }
}

/// A mesh made ready.
#[derive(Debug)]
pub struct Model {
    /// The mesh as read, its name, units and repairs.
    pub loaded: LoadedMesh,
    /// The mesh, shared with the graph.
    pub mesh: Arc<TriMesh>,
    /// The options it was made ready with.
    pub options: Options,
    /// Components, genus, boundary.
    pub topology: Topology,
    /// Whether each edge is sharp.
    pub sharp: Vec<bool>,
    /// Principal curvatures at the vertices.
    pub curvature: Vec<PrincipalCurvature>,
    /// What each vertex adds to the curvature of its region.
    pub vertex_curvatures: Vec<f64>,
    /// The elastica graph.
    pub graph: ElasticaGraph,
    /// Points by ray or nearness.
    pub index: Arc<SurfaceIndex>,
    /// Pronounced corners of the shape: singularities of its smooth curvature-guided cross field, with their
    /// index in quarters.
    pub corners: Vec<(VertexId, i8)>,
}

impl Model {
    /// Prepares `loaded`.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Cancelled`], or what the graph or the field have to say.
    pub fn prepare(loaded: LoadedMesh, options: Options, progress: &Progress) -> Result<Self, WeaveError> {
        let mesh = Arc::new(loaded.mesh.clone());
        progress.report("Finding features", 0.02);
        let topology = Topology::new(&mesh);
        let sharp = features(&mesh, &options);
        progress.report("Indexing the surface", 0.05);
        let index = Arc::new(SurfaceIndex::new(&mesh));
        progress.check()?;
        progress.report("Measuring curvature", 0.1);
        let curvature = principal_curvature(&mesh, options.curvature_radius, &sharp);
        progress.check()?;
        progress.report("Finding the corners of the shape", 0.3);
        let corners = shape_corners(&mesh, &curvature, &sharp, progress)?;
        progress.report("Preparing the search for strips", 0.5);
        let elastica = ElasticaOptions { aligned_boundary: options.aligned_boundary, ..Default::default() };
        let graph = ElasticaGraph::build(mesh.clone(), &curvature, &sharp, &elastica, progress)?;
        let vertex_curvatures = vertex_curvatures(&mesh);
        progress.report("Ready", 1.0);
        Ok(Self { loaded, mesh, options, topology, sharp, curvature, vertex_curvatures, graph, index, corners })
    }
}

/// Whether each edge of `mesh` is a feature.
pub(super) fn features(mesh: &TriMesh, options: &Options) -> Vec<bool> {
    let mut sharp = sharp_edges(mesh, options.sharp_dihedral);
    drop_short_features(mesh, &mut sharp, SHORT_FEATURE);
    sharp
}

/// Corners closer together than this fraction of the diagonal, and of opposite index, are noise of the field.
const CORNER_RADIUS: f64 = 0.08;
/// Distance over which a full principal direction prevails over smoothness of the field.
const GUIDE_RADIUS: f64 = 0.15;
/// Relative difference of the principal curvatures that counts as a full guide.
const FULL_ANISOTROPY: f64 = 10.0;

/// The pronounced singularities of the shape's cross field.
///
/// A field that cannot be computed (on a degenerate mesh) leaves a shape without pronounced corners: they
/// advise, but nothing depends on them.
fn shape_corners(
    mesh: &TriMesh,
    curvature: &[PrincipalCurvature],
    sharp: &[bool],
    progress: &Progress,
) -> Result<Vec<(VertexId, i8)>, WeaveError> {
    let metric = Metric::new(mesh);
    let mut directions = Vec::with_capacity(mesh.n_faces());
    let mut weights = Vec::with_capacity(mesh.n_faces());
    for f in mesh.faces() {
        let corners = mesh.face_vertices(f).map(|v| &curvature[v.index()]);
        let strongest = corners
            .into_iter()
            .max_by(|a, b| anisotropy(a).total_cmp(&anisotropy(b)))
            .map_or((DVec3::X, 0.0), |c| (c.d_max, anisotropy(c)));
        directions.push(strongest.0);
        weights.push((strongest.1 / FULL_ANISOTROPY).min(1.0));
    }
    let guides = Guides { directions: &directions, weights: &weights, radius: GUIDE_RADIUS };
    match shape_field(mesh, &metric, Some(guides), sharp, progress) {
        Ok(field) => {
            Ok(pronounced(mesh, &field.singularities, CORNER_RADIUS).into_iter().map(|s| (s.vertex, s.index)).collect())
        }
        Err(error) => {
            progress.check()?;
            tracing::warn!(%error, "no shape field: corners of the shape are not assessed");
            Ok(Vec::new())
        }
    }
}

fn anisotropy(c: &PrincipalCurvature) -> f64 {
    (c.k_max.abs() - c.k_min.abs()).abs()
}
