//! Where maps without folds start: from the drawing of a layout, from another map, from a guess.
//!
//! A drawing with every patch mapped one to one onto its rectangle, opposite sides of equal length, is a seamless map of
//! the whole surface without folds, however bad its shape. From there the energy of [`crate::param::InjectiveEnergy`] is
//! made less, with the arcs free to move across the surface: only that they are isolines is kept.

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::{Known, Optimiser};
use crate::embed::parameterise::solve::{Aim, Features, Folded, Start};
use crate::embed::parameterise::state::State;
use crate::embed::problem::{Problem, Surface};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::field::is_feature_dominated;
use crate::layout::{Embedding, PatchMap, QuadLayout, map_patches};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::DistortionWeights;
use crate::progress::Progress;
use crate::surface::PrincipalCurvature;

/// A drawing on a mesh of its own, with a map of each triangle in the chart of its patch.
pub(in crate::embed) struct Drawn {
    /// The surface with all arcs as edge paths.
    pub mesh: TriMesh,
    /// Triangle of the original surface that each triangle lies in.
    pub base_face: Vec<u32>,
    /// The layout drawn on it.
    pub embedding: Embedding,
    /// The coordinates of the corners of each triangle, in the chart of its patch.
    pub uv: Vec<[DVec2; 3]>,
}

impl Drawn {
    /// Maps the patches of a drawing and puts them together again.
    pub(in crate::embed) fn new(
        layout: &QuadLayout,
        initial_embedding: &Embedding,
        progress: &Progress,
    ) -> Result<Self, EmbeddingError> {
        let maps = map_patches(layout, initial_embedding, progress)?;
        let mut positions: Vec<DVec3> = initial_embedding.mesh.positions.clone();
        let (mut faces, mut base_face, mut uv) = (Vec::new(), Vec::new(), Vec::new());
        let mut seeds = Vec::with_capacity(maps.len());
        for PatchMap { mesh, whole, base_face: base, uv: at, .. } in &maps {
            let first_new = positions.len() - whole.len();
            let global = |v: usize| whole.get(v).copied().unwrap_or((first_new + v) as u32);
            positions.extend(&mesh.positions()[whole.len()..]);
            seeds.push(faces.len() as u32);
            for f in mesh.faces() {
                let corners = mesh.face_vertices(f);
                faces.push(corners.map(|v| global(v.index())));
                uv.push(corners.map(|v| at[v.index()]));
            }
            base_face.extend(base);
        }
        let mesh = TriMesh::from_faces(positions, &faces)?;
        let mut refined = RefinedMesh::new(&mesh);
        for (a, path) in initial_embedding.arcs.iter().enumerate() {
            for w in path.windows(2) {
                let h = refined.find(w[0], w[1]).ok_or(EmbeddingError::Arc { arc: a })?;
                refined.set_mark(h, Mark::Arc(a as u32));
            }
        }
        let embedding = Embedding {
            base_face: (0..mesh.n_faces() as u32).collect(),
            nodes: initial_embedding.nodes.clone(),
            arcs: initial_embedding.arcs.clone(),
            arc_parameters: initial_embedding.arc_parameters.clone(),
            seeds,
            mesh: refined,
        };
        Ok(Self { mesh, base_face, embedding, uv })
    }
}

/// How much size counts beside shape: enough to keep limbs and the patches of one strip from shrinking away, little enough
/// not to be paid for by angles. With 0.06, 0.03 and 0.02 the conformal distortion of botijo (99 patches) is 2.064, 2.056 and
/// 2.053, that of elephant_12k 2.130, 2.128 and 2.120, with guides of 3.4.
const SIZE: f64 = 0.02;
/// Where features carry the shape, which squeeze what lies between them: with less some of the fan disk cannot be held.
const SIZE_CREASED: f64 = 0.06;
/// Steps of Newton's method for a first map: it has long converged by then.
const STEPS: usize = 60;

impl<'a> Optimiser<'a> {
    /// Sets up an optimisation without folds that starts from the drawing. [`Folded`] if that folds itself.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn from_drawing(
        job: &Problem<'a>,
        progress: &Progress,
    ) -> Result<Result<Self, Folded>, EmbeddingError> {
        let drawn = Drawn::new(job.layout, job.initial_embedding, progress)?;
        let mut net = EmbeddingTopology::new(&drawn.mesh, &drawn.embedding, job.layout, job.arc_headings)?;
        for f in &mut net.base_face {
            *f = FaceId(drawn.base_face[f.index()]);
        }
        let (sharp, curvature) = (drawn.sharp(&job.surface), drawn.curvature(&job.surface));
        let aim = Aim::InjectiveMap { shape: shape(job), start: Start::Map(&drawn.uv), steps: STEPS };
        Self::on(job, (net, sharp, curvature), (aim, Features::Pulled(1.0)), progress)
    }

    /// The net of a drawn layout, with what is known of its mesh, and enough triangles around irregular nodes for a map
    /// without folds.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn finer_net(job: &Problem<'_>) -> Result<Known, EmbeddingError> {
        let (net, sharp, curvature) = Self::net(job)?;
        Ok(match net.refine_at_irregular_nodes(&net.angle, &sharp, &curvature)? {
            Some((net, carried)) => (net, carried.sharp, carried.at_vertex),
            None => (net, sharp, curvature),
        })
    }

    /// Sets up an optimisation without folds on a net from the coordinates of the corners of each triangle in a map nearly
    /// like those wanted, up to translations and quarter turns, in so many steps of Newton's method at most, with features
    /// pulled so many times as hard as usual. [`Folded`] if there is no map without folds near that.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn from_guess(
        job: &Problem<'a>,
        known: Known,
        (uv, steps, pull): (&[[DVec2; 3]], usize, f64),
        progress: &Progress,
    ) -> Result<Result<Self, Folded>, EmbeddingError> {
        let aim = Aim::InjectiveMap { shape: shape(job), start: Start::Turned(uv), steps };
        Self::on(job, known, (aim, Features::Pulled(pull)), progress)
    }

    /// Sets up an optimisation without folds that starts from where another has ended. [`Folded`] if that map folds.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn from_map(
        job: &Problem<'a>,
        (state, sharp, curvature): (State, Vec<bool>, Vec<PrincipalCurvature>),
        progress: &Progress,
    ) -> Result<Result<Self, Folded>, EmbeddingError> {
        let aim = Aim::InjectiveMap { shape: shape(job), start: Start::Map(&state.solution.map.uv), steps: STEPS };
        Self::on(job, (state.net, sharp, curvature), (aim, Features::Pulled(1.0)), progress)
    }
}

fn shape(job: &Problem<'_>) -> DistortionWeights {
    let size = if is_feature_dominated(job.surface.mesh, job.surface.sharp) { SIZE_CREASED } else { SIZE };
    DistortionWeights { anisotropy: job.settings.anisotropy, size }
}

impl Drawn {
    /// Whether each edge lies on a sharp edge of the surface.
    fn sharp(&self, surface: &Surface<'_>) -> Vec<bool> {
        let base = |h: HalfedgeId| FaceId(self.base_face[h.index() / 3]);
        let between = |f: FaceId, g: FaceId| {
            let sides = surface.mesh.face_halfedges(f).into_iter();
            let mut shared = sides.filter(|&s| surface.mesh.twin(s).is_some_and(|t| surface.mesh.face(t) == g));
            shared.any(|s| surface.sharp[surface.mesh.edge(s).index()])
        };
        let lies = |h: HalfedgeId| {
            let t = self.mesh.twin(h)?;
            Some(base(h) != base(t) && between(base(h), base(t)))
        };
        self.mesh.edges().map(|e| lies(self.mesh.halfedge(e)).unwrap_or(false)).collect()
    }

    /// The principal curvatures at the vertices, for those added that of the nearest corner of their triangle.
    fn curvature(&self, surface: &Surface<'_>) -> Vec<PrincipalCurvature> {
        let n = surface.mesh.n_vertices();
        let at = |v: VertexId| {
            if v.index() < n {
                return surface.curvature[v.index()];
            }
            let face = FaceId(self.base_face[self.mesh.vertex_halfedge(v).index() / 3]);
            let corners = surface.mesh.face_vertices(face);
            let far = |w: &VertexId| surface.mesh.position(*w).distance_squared(self.mesh.position(v));
            let nearest = corners.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            surface.curvature[nearest.unwrap_or(corners[0]).index()]
        };
        self.mesh.vertices().map(at).collect()
    }
}
