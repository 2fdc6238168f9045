//! A mesh prepared for weaving: everything that depends on the mesh and the options alone.
//!
//! The *design mesh* is the mesh as loaded. The *woven mesh* is the one that strips are woven on: the design mesh, or the
//! proxy of a large one. Features, curvature, corners and the search graph are those of the woven mesh. What the embedding
//! needs of a design mesh that has a proxy is computed on demand ([`DesignMeshData`]).

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::dual::vertex_curvatures;
use crate::elastica::{ElasticaGraph, ElasticaOptions};
use crate::field::{AlignmentDirections, cancel_opposite_pairs, feature_aligned_field};
use crate::mesh::{LoadedMesh, SHORT_FEATURE, Topology, TriMesh, VertexId, drop_short_features, sharp_edges};
use crate::progress::{Cancelled, Progress};
use crate::proxy::{Proxy, ProxyError};
use crate::surface::{Metric, PrincipalCurvature, SurfaceIndex, principal_curvature};
use crate::weave::error::WeaveError;
use crate::weave::options::Options;

/// A mesh has a proxy if it has more than this many times the proxy's triangles. With fewer, the time gained is small beside
/// the detail lost.
const LEAST_SIMPLIFICATION: usize = 2;

/// A mesh prepared for weaving.
#[derive(Debug)]
pub struct Model {
    /// The mesh as read, its name, units and repairs.
    pub loaded: LoadedMesh,
    /// The woven mesh, shared with the graph.
    pub mesh: Arc<TriMesh>,
    /// The proxy with the maps between it and the design mesh, if the woven mesh is a proxy.
    pub proxy: Option<Proxy>,
    /// The options it was prepared with.
    pub options: Options,
    /// Components, genus and boundary of the design mesh.
    pub topology: Topology,
    /// Whether each edge of the woven mesh is a sharp feature.
    pub sharp: Vec<bool>,
    /// Principal curvatures at the vertices of the woven mesh.
    pub curvature: Vec<PrincipalCurvature>,
    /// Contribution of each vertex of the woven mesh to the total curvature of its region, in radians.
    pub vertex_curvatures: Vec<f64>,
    /// The elastica graph on the woven mesh.
    pub graph: ElasticaGraph,
    /// Ray and nearest-point queries on the design mesh.
    pub index: Arc<SurfaceIndex>,
    /// Pronounced corners of the shape, on the woven mesh: singularities of its smooth curvature-aligned cross field, with
    /// their index in quarters.
    pub corners: Vec<(VertexId, i8)>,
    /// Data of the design mesh where the woven mesh is a proxy; empty otherwise.
    pub(in crate::weave) design_data: DesignMeshData,
}

/// What the embedding needs of a design mesh that has a proxy.
#[derive(Debug, Default)]
pub(in crate::weave) struct DesignMeshData {
    /// Whether each edge of the design mesh is a sharp feature.
    pub sharp: Vec<bool>,
    /// Principal curvatures of the design mesh, computed on first use.
    pub curvature: OnceLock<Vec<PrincipalCurvature>>,
    /// Nearest-point queries on the proxy, built on first use.
    pub proxy_index: OnceLock<SurfaceIndex>,
}

impl Model {
    /// Prepares a mesh for weaving; it is normalised as the options say.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Cancelled`], [`WeaveError::Elastica`] or [`WeaveError::Field`].
    pub fn prepare(loaded: LoadedMesh, options: Options, progress: &Progress) -> Result<Self, WeaveError> {
        let loaded = loaded.normalised_by(options.normalised_by);
        progress.report("Finding features", 0.02);
        let topology = Topology::new(&loaded.mesh);
        let sharp = features(&loaded.mesh, &options);
        progress.report("Indexing the surface", 0.05);
        let index = Arc::new(SurfaceIndex::new(&loaded.mesh));
        progress.check()?;
        let proxy = proxy_of(&loaded.mesh, &sharp, &options, progress)?;
        let (mesh, sharp, design_data) = match &proxy {
            None => (loaded.mesh.clone(), sharp, DesignMeshData::default()),
            Some(proxy) => {
                let design_data = DesignMeshData { sharp, ..DesignMeshData::default() };
                (Arc::new(proxy.mesh().clone()), proxy.sharp().to_vec(), design_data)
            }
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
            design_data,
        })
    }
}

/// The proxy of a mesh that is large or to be smoothed. `None` for other meshes, and where no proxy can be built.
fn proxy_of(
    mesh: &TriMesh,
    sharp: &[bool],
    options: &Options,
    progress: &Progress,
) -> Result<Option<Proxy>, Cancelled> {
    let (target, n) = (options.proxy as usize, mesh.n_faces());
    let large = target > 0 && n > LEAST_SIMPLIFICATION * target;
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
            tracing::warn!(%error, "no proxy: strips are woven on the design mesh");
            Ok(None)
        }
    }
}

/// Whether each edge of `mesh` is a sharp feature: sharp, in a connected group of sharp edges that is not short.
pub(in crate::weave) fn features(mesh: &TriMesh, options: &Options) -> Vec<bool> {
    let mut sharp = sharp_edges(mesh, options.sharp_dihedral);
    drop_short_features(mesh, &mut sharp, SHORT_FEATURE);
    sharp
}

/// Singularities of opposite index closer together than this, as a fraction of the model size, cancel as noise of the
/// field.
const CORNER_RADIUS: f64 = 0.08;
/// Distance over which a fully weighted principal direction outweighs smoothness of the field, as a fraction of the
/// model size.
const ALIGNMENT_RADIUS: f64 = 0.15;
/// Difference of the absolute principal curvatures from which on a principal direction has full weight, in inverse
/// model sizes.
const FULL_ANISOTROPY: f64 = 10.0;

/// The pronounced singularities of the curvature-aligned cross field.
///
/// If the field cannot be computed (on a degenerate mesh), the shape has no pronounced corners. They only advise the
/// designer; no layout needs them.
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
    let alignment = AlignmentDirections { directions: &directions, weights: &weights, radius: ALIGNMENT_RADIUS };
    match feature_aligned_field(mesh, &metric, Some(alignment), sharp, progress) {
        Ok(field) => Ok(cancel_opposite_pairs(mesh, &field.singularities, CORNER_RADIUS)
            .into_iter()
            .map(|s| (s.vertex, s.index))
            .collect()),
        Err(error) => {
            progress.check()?;
            tracing::warn!(%error, "no curvature-aligned field: corners of the shape are not assessed");
            Ok(Vec::new())
        }
    }
}

fn anisotropy(c: &PrincipalCurvature) -> f64 {
    (c.k_max.abs() - c.k_min.abs()).abs()
}
