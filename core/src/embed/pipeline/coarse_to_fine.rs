//! Coarse to fine: the layout of a large mesh is optimised on a small proxy of the mesh first.
//!
//! Optimal node positions depend little on triangles much smaller than patches, but the cost of every step is
//! proportional to the number of triangles. So the layout is transferred to a proxy, optimised there, and transferred
//! back. On the mesh itself remain a first map, constraining features and nodes, and a few node steps.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::setup::PreparedTopology;
use crate::embed::parameterise::injective::InitialMap;
use crate::embed::pipeline::optimise::optimise_on_mesh;
use crate::embed::pipeline::phases::{Observer, Phases};
use crate::embed::pipeline::report::{Next, OptimisedEmbedding, Snapshot};
use crate::embed::problem::{Problem, Settings, Surface};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::layout::{DualCurve, Embedding, PatchMap, QuadLayout, transfer_embedding};
use crate::mesh::{BreadthFirst, FaceId, TriMesh};
use crate::progress::Progress;
use crate::proxy::Proxy;
use crate::surface::{PrincipalCurvature, SurfaceIndex, SurfacePoint, nearest_in_triangle};

/// Number of triangles of the proxy: so many in all, or for each patch where that is more. Chosen by hand.
const PROXY_FACES: usize = 6000;
const PROXY_FACES_PER_PATCH: usize = 60;
/// Least ratio of the number of triangles of the mesh to that of the proxy; below it the detour costs more than it
/// saves.
const MIN_REDUCTION: usize = 2;
/// Factor by which the proxy is refined if the layout does not fit on it.
const PROXY_REFINEMENT: usize = 2;
/// Fractions of the whole optimisation, begin and end: making the proxy, optimising on it, and optimising on the mesh.
/// The first half of the last one is skipped, so that its range begins below the end of the second.
const SIMPLIFYING: [f64; 2] = [0.0, 0.05];
const ON_PROXY: [f64; 2] = [0.05, 0.6];
const ON_MESH: [f64; 2] = [0.2, 1.0];
/// Largest number of Newton steps of the first map on the mesh. It starts near its minimum, and later solves improve
/// it.
const FIRST_NEWTON_STEPS: usize = 8;
/// Penalty weight of features in that map: they lie near isolines already, so that the continuation begins late.
const FEATURE_PENALTY: f64 = 1e3;
/// Node steps on the mesh without features. With features there are none: measured, under this penalty no step lowered
/// the energy.
const FINE_STEPS: usize = 1;

/// Embeds a layout and optimises its embedding, on a proxy first where that is worthwhile. `observer` is shown every
/// improvement and may ask to finish.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise_embedding(
    problem: &Problem<'_>,
    progress: &Progress,
    observer: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    if let Some(done) = coarse_to_fine(problem, progress, observer)? {
        return Ok(done);
    }
    optimise_on_mesh(problem, progress, observer)
}

/// Optimises by way of a proxy; `None` if that is not worthwhile or not possible.
///
/// # Errors
///
/// [`EmbeddingError::Cancelled`].
fn coarse_to_fine(
    problem: &Problem<'_>,
    progress: &Progress,
    observer: Observer<'_>,
) -> Result<Option<OptimisedEmbedding>, EmbeddingError> {
    let Settings { collapse, simplify, integer, .. } = problem.settings;
    let usual = collapse.is_none() && !simplify && integer.is_none();
    let pinned = problem.pinned_nodes.iter().chain(problem.pinned_arcs).any(|&p| p);
    let patches = problem.layout.patches.len();
    // Chord lengths and pinned positions refer to the mesh itself, and a partial layout has no dual curves to transfer.
    if !usual || pinned || patches == 0 {
        return Ok(None);
    }
    let mut target = PROXY_FACES.max(PROXY_FACES_PER_PATCH * patches);
    // A layout that does not fit on a proxy may fit on a finer one.
    while problem.surface.mesh.n_faces() > MIN_REDUCTION * target {
        let found = by_way_of_proxy(problem, target, progress, observer);
        progress.set_range(None);
        progress.check()?;
        match found {
            Ok(Some(done)) => return Ok(Some(done)),
            Ok(None) => tracing::debug!(target, "the layout cannot be transferred to the proxy or back"),
            Err(error) => tracing::debug!(target, %error, "not embedded by way of a proxy"),
        }
        target *= PROXY_REFINEMENT;
    }
    Ok(None)
}

/// Optimises by way of a proxy of `target` triangles; `None` if the layout cannot be transferred to it or back.
fn by_way_of_proxy(
    problem: &Problem<'_>,
    target: usize,
    progress: &Progress,
    observer: Observer<'_>,
) -> Result<Option<OptimisedEmbedding>, EmbeddingError> {
    let Problem { surface, layout, .. } = *problem;
    progress.set_range(Some(SIMPLIFYING));
    progress.report("Simplifying the mesh", 0.0);
    let proxy = Proxy::new(surface.mesh, surface.sharp, target, progress)?;
    let transfer = ProxyTransfer { fine: surface.mesh, proxy: &proxy };
    let Some(initial_embedding) = transfer.to_proxy(problem, progress)? else { return Ok(None) };
    let mesh = proxy.mesh();
    let index = SurfaceIndex::new(mesh);
    let curvature: Vec<PrincipalCurvature> =
        mesh.vertices().map(|v| surface.curvature[proxy.original_vertex(v).index()]).collect();
    let coarse = Surface { mesh, index: &index, curvature: &curvature, sharp: proxy.sharp() };
    progress.set_range(Some(ON_PROXY));
    let on_proxy = Problem { surface: coarse, initial_embedding: &initial_embedding, ..*problem };
    let mut projected = |s: &Snapshot| observer(&projected_snapshot(s, surface.index, surface.mesh));
    // The proxy may be large enough for a proxy of its own.
    let coarse = optimise_embedding(&on_proxy, progress, &mut projected)?;
    progress.set_range(Some(ON_MESH));
    let Some(initial_embedding) = transfer.to_mesh(layout, &coarse.embedding, progress)? else { return Ok(None) };
    let steps = if surface.sharp.contains(&true) { 0 } else { FINE_STEPS };
    let settings = Settings { steps: steps.min(problem.settings.steps), ..problem.settings };
    let fine = Problem { initial_embedding: &initial_embedding, settings, ..*problem };
    let prepared = PreparedTopology::refined(&fine)?;
    progress.check()?;
    let guess = transfer.map_on_mesh(&prepared.topology, &coarse.maps);
    let initial = (InitialMap::UpToQuarterTurns(&guess), FIRST_NEWTON_STEPS);
    let start = match Optimiser::injective(&fine, prepared, initial, FEATURE_PENALTY, progress)? {
        Ok(start) => Ok(start),
        // The map of the initial embedding is a worse start, but has no flipped triangles.
        Err(_) => Optimiser::from_initial_embedding(&fine, progress)?,
    };
    let mut phases = Phases::continued(&fine, &coarse.report, observer);
    let mut done = phases.injective_phase(&fine, Ok(start), progress)?;
    phases.complete_report(&mut done.report);
    Ok(Some(done))
}

/// A snapshot of the proxy with its points projected onto the surface.
fn projected_snapshot(snapshot: &Snapshot, index: &SurfaceIndex, mesh: &TriMesh) -> Snapshot {
    let onto = |p: &DVec3| index.nearest(*p).position(mesh);
    let line = |line: &Vec<DVec3>| line.iter().map(onto).collect();
    Snapshot {
        nodes: snapshot.nodes.iter().map(onto).collect(),
        arcs: snapshot.arcs.iter().map(|arc| arc.as_ref().map(line)).collect(),
        ..*snapshot
    }
}

/// Transfer of embeddings and maps between a mesh and its proxy.
struct ProxyTransfer<'a> {
    fine: &'a TriMesh,
    proxy: &'a Proxy,
}

impl ProxyTransfer<'_> {
    /// The initial embedding of the problem on the proxy; `None` if there is none.
    fn to_proxy(&self, problem: &Problem<'_>, progress: &Progress) -> Result<Option<Embedding>, EmbeddingError> {
        let given = (problem.layout, problem.initial_embedding, self.fine.n_vertices());
        let place = |n: usize| {
            let at = surface_point(self.fine, problem.initial_embedding, problem.initial_embedding.nodes[n]);
            Some(self.proxy.to_proxy(self.fine, at).nearest_vertex(self.proxy.mesh()))
        };
        let transferred = |line: &DualCurve| {
            let found = self.proxy.polyline_to_proxy(self.fine, &line.points, line.closed);
            found.inspect_err(|error| tracing::debug!(%error, "a curve cannot be transferred to the proxy")).ok()
        };
        Ok(transfer_embedding(given, self.proxy.mesh(), transferred, place, progress)?)
    }

    /// An embedding on the proxy as an initial embedding on the mesh; `None` if there is none.
    fn to_mesh(
        &self,
        layout: &QuadLayout,
        embedding: &Embedding,
        progress: &Progress,
    ) -> Result<Option<Embedding>, EmbeddingError> {
        let place = |n: usize| {
            let at = surface_point(self.proxy.mesh(), embedding, embedding.nodes[n]);
            Some(self.proxy.to_original(self.fine, at).nearest_vertex(self.fine))
        };
        let transferred = |line: &DualCurve| {
            let found = self.proxy.polyline_to_original(self.fine, &line.points, line.closed);
            found.inspect_err(|error| tracing::debug!(%error, "a curve cannot be transferred to the mesh")).ok()
        };
        Ok(transfer_embedding(
            (layout, embedding, self.proxy.mesh().n_vertices()),
            self.fine,
            transferred,
            place,
            progress,
        )?)
    }

    /// The map of the proxy on the triangles of a topology of the mesh, up to translations and quarter turns: each
    /// triangle takes the affine map of the nearest triangle of a patch on the proxy.
    fn map_on_mesh(&self, topology: &EmbeddingTopology, maps: &[PatchMap]) -> Vec<[DVec2; 3]> {
        let mut pieces: Vec<Vec<Affine>> = vec![Vec::new(); self.proxy.mesh().n_faces()];
        for map in maps {
            for f in map.mesh.faces() {
                pieces[map.base_face[f.index()] as usize].extend(Affine::of(map, f));
            }
        }
        let mesh = &topology.mesh;
        let found = |f: FaceId| {
            let centroid = mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
            let face = topology.base_face[f.index()];
            let corners = self.fine.face_vertices(face).map(|v| self.fine.position(v));
            let at = SurfacePoint { face, weights: nearest_in_triangle(centroid, &corners) };
            let there = self.proxy.to_proxy(self.fine, at);
            let at = there.position(self.proxy.mesh());
            let near = pieces[there.face.index()].iter();
            near.min_by(|a, b| a.centroid.distance_squared(at).total_cmp(&b.centroid.distance_squared(at))).copied()
        };
        let mut maps: Vec<Option<Affine>> = mesh.faces().collect::<Vec<_>>().into_par_iter().map(found).collect();
        // Triangles of the proxy all of whose pieces are degenerate have no map: take that of a neighbour.
        let mut search = BreadthFirst::new(mesh.n_faces());
        for f in mesh.faces().filter(|f| maps[f.index()].is_some()) {
            search.start(f);
        }
        while let Some(f) = search.visit() {
            for (_, g) in mesh.adjacent_faces(f) {
                if search.reach(g, ()) {
                    maps[g.index()] = maps[f.index()];
                }
            }
        }
        let uv = |f: FaceId| {
            let map = maps[f.index()].unwrap_or_default();
            mesh.face_vertices(f).map(|v| map.uv(mesh.position(v)))
        };
        mesh.faces().map(uv).collect()
    }
}

/// The affine map of a triangle, up to a translation.
#[derive(Debug, Clone, Copy, Default)]
struct Affine {
    centroid: DVec3,
    /// The gradients of both coordinates.
    gradients: [DVec3; 2],
}

impl Affine {
    /// The map of a triangle of a patch; `None` if the triangle is degenerate.
    fn of(map: &PatchMap, f: FaceId) -> Option<Self> {
        let corners = map.mesh.face_vertices(f);
        let [a, b, c] = corners.map(|v| map.mesh.position(v));
        let [ua, ub, uc] = corners.map(|v| map.uv[v.index()]);
        let area = (b - a).cross(c - a);
        let hats = [c - b, a - c, b - a].map(|side| area.cross(side) / area.length_squared());
        let gradient = |k: usize| hats[0] * ua[k] + hats[1] * ub[k] + hats[2] * uc[k];
        let gradients = [gradient(0), gradient(1)];
        let finite = gradients.iter().all(|g| g.is_finite());
        finite.then_some(Self { centroid: (a + b + c) / 3.0, gradients })
    }

    fn uv(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.gradients[0].dot(p), self.gradients[1].dot(p))
    }
}

/// The point of `mesh` where a vertex of an embedding on its refinement lies.
fn surface_point(mesh: &TriMesh, embedding: &Embedding, v: u32) -> SurfacePoint {
    let face = FaceId(embedding.base_face[embedding.mesh.vertex_halfedge(v) as usize / 3]);
    let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
    SurfacePoint { face, weights: nearest_in_triangle(embedding.mesh.positions[v as usize], &corners) }
}
