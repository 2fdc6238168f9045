//! A mesh made ready for weaving: everything that depends on the mesh and the options alone.
//!
//! A large mesh is woven on a proxy: features, curvature, corners and search graph are those of the proxy. What only the
//! embedding needs of the mesh itself is made when it is asked for; see `ground`.

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::dual::vertex_curvatures;
use crate::elastica::{ElasticaGraph, ElasticaOptions};
use crate::field::{AlignmentDirections, cancel_opposite_pairs, feature_aligned_field};
use crate::mesh::{
    LoadedMesh, SHARP_DIHEDRAL, SHORT_FEATURE, Topology, TriMesh, VertexId, drop_short_features, sharp_edges,
};
use crate::progress::{Cancelled, Progress};
use crate::proxy::{Proxy, ProxyError};
use crate::surface::Metric;
use crate::surface::{PrincipalCurvature, SurfaceIndex, principal_curvature};
use crate::weave::error::WeaveError;

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
    /// Triangles of the proxy that meshes of more than twice as many are woven on; 0: every mesh is woven on itself.
    #[serde(skip_serializing_if = "is_usual_proxy")]
    pub proxy: u32,
    /// Radius over which the surface is smoothed for weaving, as a fraction of the bounding-box diagonal: strips pass over
    /// smaller relief. 0: not at all. A smoothed mesh is a proxy, of whatever size.
    #[serde(skip_serializing_if = "is_zero")]
    pub smoothing: f64,
}

/// Triangles of a proxy. See `docs/decisions.md` for the figures.
const PROXY: u32 = 30_000;
/// A mesh has a proxy from this many times its size on: below, it gains less than it loses in detail.
const WORTH_IT: usize = 2;

fn is_usual_proxy(n: &u32) -> bool {
    *n == PROXY
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl Default for Options {
    fn default() -> Self {
        Self {
            curvature_radius: 0.03,
            sharp_dihedral: SHARP_DIHEDRAL,
            aligned_boundary: true,
            proxy: PROXY,
            smoothing: 0.0,
        }
    }
}

/// A mesh made ready.
#[derive(Debug)]
pub struct Model {
    /// The mesh as read, its name, units and repairs.
    pub loaded: LoadedMesh,
    /// The mesh that is woven on, shared with the graph: the one read, or its proxy.
    pub mesh: Arc<TriMesh>,
    /// Where another mesh is woven on than the one read: the maps between both.
    pub proxy: Option<Proxy>,
    /// The options it was made ready with.
    pub options: Options,
    /// Components, genus, boundary of the mesh as read.
    pub topology: Topology,
    /// Whether each edge of the mesh that is woven on is sharp.
    pub sharp: Vec<bool>,
    /// Principal curvatures at its vertices.
    pub curvature: Vec<PrincipalCurvature>,
    /// What each vertex adds to the curvature of its region.
    pub vertex_curvatures: Vec<f64>,
    /// The elastica graph.
    pub graph: ElasticaGraph,
    /// Points by ray or nearness of the mesh as read.
    pub index: Arc<SurfaceIndex>,
    /// Pronounced corners of the shape: singularities of its smooth curvature-guided cross field, with their
    /// index in quarters.
    pub corners: Vec<(VertexId, i8)>,
    /// What the mesh as read has of its own where it has a proxy.
    pub(in crate::weave) own: Own,
}

/// What only the embedding needs where a mesh has a proxy; empty otherwise.
#[derive(Debug, Default)]
pub(in crate::weave) struct Own {
    /// Whether each edge of the mesh as read is sharp.
    pub sharp: Vec<bool>,
    /// Its curvature, once it was asked for.
    pub curvature: OnceLock<Vec<PrincipalCurvature>>,
    /// Points of the proxy by nearness, once they were asked for.
    pub proxy_index: OnceLock<SurfaceIndex>,
}

impl Model {
    /// Prepares `loaded`.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Cancelled`], or what the graph or the field have to say.
    pub fn prepare(loaded: LoadedMesh, options: Options, progress: &Progress) -> Result<Self, WeaveError> {
        progress.report("Finding features", 0.02);
        let topology = Topology::new(&loaded.mesh);
        let sharp = features(&loaded.mesh, &options);
        progress.report("Indexing the surface", 0.05);
        let index = Arc::new(SurfaceIndex::new(&loaded.mesh));
        progress.check()?;
        let proxy = proxy_of(&loaded.mesh, &sharp, &options, progress)?;
        let (mesh, sharp, own) = match &proxy {
            None => (loaded.mesh.clone(), sharp, Own::default()),
            Some(proxy) => (Arc::new(proxy.mesh().clone()), proxy.sharp().to_vec(), Own { sharp, ..Own::default() }),
        };
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
        Ok(Self {
            loaded,
            mesh,
            proxy,
            options,
            topology,
            sharp,
            curvature,
            vertex_curvatures,
            graph,
            index,
            corners,
            own,
        })
    }
}

/// The proxy of a mesh that is to be woven on one. Where none can be made, the mesh is woven on itself.
fn proxy_of(
    mesh: &TriMesh,
    sharp: &[bool],
    options: &Options,
    progress: &Progress,
) -> Result<Option<Proxy>, Cancelled> {
    let (target, n) = (options.proxy as usize, mesh.n_faces());
    let large = target > 0 && n > WORTH_IT * target;
    if !large && options.smoothing <= 0.0 {
        return Ok(None);
    }
    progress.report("Simplifying", 0.06);
    match Proxy::new(mesh, sharp, if large { target } else { n }, progress) {
        Ok(mut proxy) => {
            if options.smoothing > 0.0 {
                proxy.smooth(options.smoothing);
            }
            Ok(Some(proxy))
        }
        Err(ProxyError::Cancelled(cancelled)) => Err(cancelled),
        Err(error) => {
            tracing::warn!(%error, "no proxy");
            Ok(None)
        }
    }
}

/// Whether each edge of `mesh` is a feature.
pub(in crate::weave) fn features(mesh: &TriMesh, options: &Options) -> Vec<bool> {
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
    let guides = AlignmentDirections { directions: &directions, weights: &weights, radius: GUIDE_RADIUS };
    match feature_aligned_field(mesh, &metric, Some(guides), sharp, progress) {
        Ok(field) => Ok(cancel_opposite_pairs(mesh, &field.singularities, CORNER_RADIUS)
            .into_iter()
            .map(|s| (s.vertex, s.index))
            .collect()),
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
