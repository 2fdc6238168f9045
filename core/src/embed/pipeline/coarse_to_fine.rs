//! From coarse to fine: a large mesh has its layout optimised on a small one first.
//!
//! Where nodes want to be does not depend on triangles much smaller than patches, but all that it takes to find out does.
//! So the layout is carried to a proxy of the mesh, optimised there, and carried back; what is left to do on the mesh
//! itself is a first map and a few steps that nodes are off.

use std::collections::VecDeque;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::pipeline::optimise::optimise;
use crate::embed::pipeline::phases::Course;
use crate::embed::problem::{Next, OptimisedEmbedding, Problem, Settings, Snapshot, Surface};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::layout::{DualCurve, Embedding, PatchMap, QuadLayout, carry};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::proxy::Proxy;
use crate::surface::{PrincipalCurvature, SurfaceIndex, SurfacePoint, nearest_in_triangle};

/// Triangles of the small mesh: so many in all, or for each patch where that is more.
const COARSE: usize = 6000;
const PER_PATCH: usize = 60;
/// How many times as many triangles a mesh must have for this to be worth while.
const WORTH: usize = 2;
/// By what factor a mesh that is too coarse for the layout is made finer.
const FINER: usize = 2;
/// What part of the work is to make the proxy, and what is done on it and on the mesh; of the latter the first half is
/// left out.
const SIMPLIFYING: [f64; 2] = [0.0, 0.05];
const ON_PROXY: [f64; 2] = [0.05, 0.6];
const ON_MESH: [f64; 2] = [0.2, 1.0];
/// Steps of Newton's method for the first map on the mesh: it starts near, and all that follows makes it better.
const FIRST_STEPS: usize = 8;
/// How hard features are pulled there, in multiples of what is usual: they are near isolines already.
const PULL: f64 = 1e3;
/// Steps of the nodes on the mesh itself where there are no features: with these pulled hard no step made the energy less.
const FINE_STEPS: usize = 1;

/// Embeds a layout by way of a smaller mesh. `None` if that is not worth while or does not lead anywhere.
///
/// # Errors
///
/// [`EmbeddingError::Cancelled`].
pub(in crate::embed) fn coarse_to_fine(
    job: &Problem<'_>,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<Option<OptimisedEmbedding>, EmbeddingError> {
    let Settings { collapse, simplify, integer, .. } = job.settings;
    let usual = collapse.is_none() && !simplify && integer.is_none();
    let pinned = job.pinned_nodes.iter().chain(job.pinned_arcs).any(|&p| p);
    let patches = job.layout.patches.len();
    if !usual || pinned || patches == 0 {
        return Ok(None);
    }
    let mut target = COARSE.max(PER_PATCH * patches);
    while job.surface.mesh.n_faces() > WORTH * target {
        let found = by_way_of_proxy(job, target, progress, watch);
        progress.set_range(None);
        progress.check()?;
        match found {
            Ok(Some(done)) => return Ok(Some(done)),
            Ok(None) => tracing::debug!(target, "the layout does not fit on the proxy"),
            Err(error) => tracing::debug!(target, %error, "not embedded by way of a proxy"),
        }
        target *= FINER;
    }
    Ok(None)
}

/// As [`coarse_to_fine`]; `None` if the layout cannot be carried to the proxy or back.
fn by_way_of_proxy(
    job: &Problem<'_>,
    target: usize,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<Option<OptimisedEmbedding>, EmbeddingError> {
    let Problem { surface, layout, .. } = *job;
    progress.set_range(Some(SIMPLIFYING));
    progress.report("Simplifying the mesh", 0.0);
    let proxy = Proxy::new(surface.mesh, surface.sharp, target, progress)?;
    let levels = Levels { fine: surface.mesh, proxy: &proxy };
    let Some(initial_embedding) = levels.down(job, progress)? else { return Ok(None) };
    let mesh = proxy.mesh();
    let index = SurfaceIndex::new(mesh);
    let curvature: Vec<PrincipalCurvature> =
        mesh.vertices().map(|v| surface.curvature[proxy.original_vertex(v).index()]).collect();
    let coarse = Surface { mesh, index: &index, curvature: &curvature, sharp: proxy.sharp() };
    progress.set_range(Some(ON_PROXY));
    let on_proxy = Problem { surface: coarse, initial_embedding: &initial_embedding, ..*job };
    let coarse = optimise(&on_proxy, progress, &mut |s| watch(&on_surface(s, surface.index, surface.mesh)))?;
    progress.set_range(Some(ON_MESH));
    let Some(initial_embedding) = levels.up(layout, &coarse.embedding, progress)? else { return Ok(None) };
    let steps = if surface.sharp.contains(&true) { 0 } else { FINE_STEPS };
    let settings = Settings { steps: steps.min(job.settings.steps), ..job.settings };
    let fine = Problem { initial_embedding: &initial_embedding, settings, ..*job };
    let ready = Optimiser::finer_net(&fine)?;
    progress.check()?;
    let guess = levels.guess(&ready.0, &coarse.maps);
    let start = match Optimiser::from_guess(&fine, ready, (&guess, FIRST_STEPS, PULL), progress)? {
        Ok(start) => Ok(start),
        Err(_) => Optimiser::from_drawing(&fine, progress)?,
    };
    let mut course = Course::going_on(&fine, &coarse.report, watch);
    let mut done = course.without_folds(&fine, Ok(start), progress)?;
    course.enter(&mut done.report);
    Ok(Some(done))
}

/// A snapshot on the proxy with its points on the surface.
fn on_surface(snapshot: &Snapshot, index: &SurfaceIndex, mesh: &TriMesh) -> Snapshot {
    let onto = |p: &DVec3| index.nearest(*p).position(mesh);
    let line = |line: &Vec<DVec3>| line.iter().map(onto).collect();
    Snapshot {
        nodes: snapshot.nodes.iter().map(onto).collect(),
        arcs: snapshot.arcs.iter().map(|arc| arc.as_ref().map(line)).collect(),
        ..*snapshot
    }
}

/// A mesh and its proxy.
struct Levels<'a> {
    fine: &'a TriMesh,
    proxy: &'a Proxy,
}

impl Levels<'_> {
    /// The drawing of the job on the proxy.
    fn down(&self, job: &Problem<'_>, progress: &Progress) -> Result<Option<Embedding>, EmbeddingError> {
        let drawn = (job.layout, job.initial_embedding, self.fine.n_vertices());
        let place = |n: usize| {
            let at = point(self.fine, job.initial_embedding, job.initial_embedding.nodes[n]);
            Some(self.proxy.to_proxy(self.fine, at).nearest_vertex(self.proxy.mesh()))
        };
        let carried = |line: &DualCurve| {
            let found = self.proxy.polyline_to_proxy(self.fine, &line.points, line.closed);
            found.inspect_err(|error| tracing::debug!(%error, "a curve cannot be carried to the proxy")).ok()
        };
        Ok(carry(drawn, self.proxy.mesh(), carried, place, progress)?)
    }

    /// A drawing on the proxy, drawn on the mesh.
    fn up(
        &self,
        layout: &QuadLayout,
        initial_embedding: &Embedding,
        progress: &Progress,
    ) -> Result<Option<Embedding>, EmbeddingError> {
        let place = |n: usize| {
            Some(self.original_vertex(point(self.proxy.mesh(), initial_embedding, initial_embedding.nodes[n])))
        };
        let carried = |line: &DualCurve| {
            let found = self.proxy.polyline_to_original(self.fine, &line.points, line.closed);
            found.inspect_err(|error| tracing::debug!(%error, "a curve cannot be carried back")).ok()
        };
        Ok(carry((layout, initial_embedding, self.proxy.mesh().n_vertices()), self.fine, carried, place, progress)?)
    }

    /// The map of the proxy on a net on the mesh: coordinates of the corners of each triangle up to translations and quarter
    /// turns.
    fn guess(&self, net: &EmbeddingTopology, maps: &[PatchMap]) -> Vec<[DVec2; 3]> {
        let mut pieces: Vec<Vec<Affine>> = vec![Vec::new(); self.proxy.mesh().n_faces()];
        for map in maps {
            for f in map.mesh.faces() {
                pieces[map.base_face[f.index()] as usize].extend(Affine::of(map, f));
            }
        }
        let mesh = &net.mesh;
        let found = |f: FaceId| {
            let center = mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
            let face = net.base_face[f.index()];
            let corners = self.fine.face_vertices(face).map(|v| self.fine.position(v));
            let at = SurfacePoint { face, weights: nearest_in_triangle(center, &corners) };
            let there = self.proxy.to_proxy(self.fine, at);
            let at = there.position(self.proxy.mesh());
            let near = pieces[there.face.index()].iter();
            near.min_by(|a, b| a.center.distance_squared(at).total_cmp(&b.center.distance_squared(at))).copied()
        };
        let mut maps: Vec<Option<Affine>> = mesh.faces().collect::<Vec<_>>().into_par_iter().map(found).collect();
        // Where that is not known, as its piece was none, it is the map next to it.
        let mut queue: VecDeque<FaceId> = mesh.faces().filter(|f| maps[f.index()].is_some()).collect();
        while let Some(f) = queue.pop_front() {
            for g in mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h)).map(|h| mesh.face(h)) {
                if maps[g.index()].is_none() {
                    maps[g.index()] = maps[f.index()];
                    queue.push_back(g);
                }
            }
        }
        let uv = |f: FaceId| {
            let map = maps[f.index()].unwrap_or_default();
            mesh.face_vertices(f).map(|v| map.uv(mesh.position(v)))
        };
        mesh.faces().map(uv).collect()
    }

    fn original_vertex(&self, at: SurfacePoint) -> VertexId {
        self.proxy.to_original(self.fine, at).nearest_vertex(self.fine)
    }
}

/// The map of a triangle of the proxy.
#[derive(Debug, Clone, Copy, Default)]
struct Affine {
    center: DVec3,
    /// The gradients of both coordinates.
    gradients: [DVec3; 2],
}

impl Affine {
    /// That of a triangle of a patch; `None` if the triangle is none.
    fn of(map: &PatchMap, f: FaceId) -> Option<Self> {
        let corners = map.mesh.face_vertices(f);
        let [a, b, c] = corners.map(|v| map.mesh.position(v));
        let [ua, ub, uc] = corners.map(|v| map.uv[v.index()]);
        let area = (b - a).cross(c - a);
        let hats = [c - b, a - c, b - a].map(|side| area.cross(side) / area.length_squared());
        let gradient = |k: usize| hats[0] * ua[k] + hats[1] * ub[k] + hats[2] * uc[k];
        let gradients = [gradient(0), gradient(1)];
        let finite = gradients.iter().all(|g| g.is_finite());
        finite.then_some(Self { center: (a + b + c) / 3.0, gradients })
    }

    fn uv(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.gradients[0].dot(p), self.gradients[1].dot(p))
    }
}

/// Where a vertex of a drawing lies on the mesh that it refines.
fn point(mesh: &TriMesh, initial_embedding: &Embedding, v: u32) -> SurfacePoint {
    let face = FaceId(initial_embedding.base_face[initial_embedding.mesh.vertex_halfedge(v) as usize / 3]);
    let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
    SurfacePoint { face, weights: nearest_in_triangle(initial_embedding.mesh.positions[v as usize], &corners) }
}
