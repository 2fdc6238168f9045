//! The start of the injective phase: from the initial embedding, from a least-squares map, or from the map of a coarser
//! mesh.
//!
//! An initial embedding with every patch mapped bijectively onto its rectangle, with opposite sides of equal length, is
//! an injective seamless map of the whole surface, whatever its distortion. From any start the energy
//! ([`InjectiveEnergy`](crate::param::InjectiveEnergy)) is descended with arcs constrained to isolines but otherwise
//! free to move on the surface.

use glam::{DVec2, DVec3};

use crate::dual::{Mark, RefinedMesh};
use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::setup::PreparedTopology;
use crate::embed::parameterise::injective::{Flipped, InitialMap};
use crate::embed::parameterise::solve::{FeatureConstraint, MapKind};
use crate::embed::problem::{Problem, Surface};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::field::is_feature_dominated;
use crate::layout::{Embedding, PatchMap, QuadLayout, map_patches};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::DistortionWeights;
use crate::progress::Progress;
use crate::surface::PrincipalCurvature;

/// Weight λ of the size term of the energy: large enough to keep limbs and the patches of one chord from shrinking to
/// nothing, small enough not to distort angles. Measured with 0.06, 0.03 and 0.02: the conformal distortion of botijo
/// (99 patches) is 2.064, 2.056 and 2.053, that of elephant_12k 2.130, 2.128 and 2.120, with a strength of principal
/// directions of 3.4.
const SIZE_WEIGHT: f64 = 0.02;
/// The same for surfaces whose shape is given by features, whose constraints squeeze the triangles between them: with
/// less, some features of the fan disk cannot be constrained.
const SIZE_WEIGHT_FEATURES: f64 = 0.06;
/// Largest number of Newton steps of the first map; it has converged long before.
const FIRST_NEWTON_STEPS: usize = 60;

impl<'a> Optimiser<'a> {
    /// Sets up the injective phase from the harmonic maps of the patches of the initial embedding. The result is
    /// [`Flipped`] if these flip triangles.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn from_initial_embedding(
        problem: &Problem<'a>,
        progress: &Progress,
    ) -> Result<Result<Self, Flipped>, EmbeddingError> {
        let Problem { surface, layout, initial_embedding, arc_headings, .. } = *problem;
        let mapped = MappedEmbedding::new(layout, initial_embedding, progress)?;
        let mut topology = EmbeddingTopology::new(&mapped.mesh, &mapped.embedding, layout, arc_headings)?;
        for f in &mut topology.base_face {
            *f = FaceId(mapped.base_face[f.index()]);
        }
        let (sharp, curvature) = (mapped.sharp(&surface), mapped.curvature(&surface));
        let prepared = PreparedTopology { topology, sharp, curvature };
        let start = (InitialMap::Injective(&mapped.uv), FIRST_NEWTON_STEPS);
        Self::injective(problem, prepared, start, 1.0, progress)
    }

    /// Sets up the injective phase from the final map of another phase. The result is [`Flipped`] if that flips
    /// triangles which cannot be untangled.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn from_map_of(
        problem: &Problem<'a>,
        other: Optimiser<'_>,
        progress: &Progress,
    ) -> Result<Result<Self, Flipped>, EmbeddingError> {
        let Optimiser { state, sharp, curvature, .. } = other;
        let prepared = PreparedTopology { topology: state.topology, sharp, curvature };
        let start = (InitialMap::Injective(&state.solution.map.uv), FIRST_NEWTON_STEPS);
        Self::injective(problem, prepared, start, 1.0, progress)
    }

    /// Sets up the injective phase on a prepared topology from an initial map, descended by the given number of Newton
    /// steps, with the given penalty weight of features. The result is [`Flipped`] if there is no injective map near
    /// the initial one.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn injective(
        problem: &Problem<'a>,
        prepared: PreparedTopology,
        (initial, steps): (InitialMap<'_>, usize),
        penalty: f64,
        progress: &Progress,
    ) -> Result<Result<Self, Flipped>, EmbeddingError> {
        let Surface { mesh, sharp, .. } = problem.surface;
        let size = if is_feature_dominated(mesh, sharp) { SIZE_WEIGHT_FEATURES } else { SIZE_WEIGHT };
        let distortion = DistortionWeights { anisotropy: problem.settings.anisotropy, size };
        let kind = MapKind::Injective { distortion, initial, steps };
        Self::with_map(problem, prepared, (kind, FeatureConstraint::Penalty(penalty)), progress)
    }
}

/// An initial embedding with its patch maps, put together to a mesh and a seamless map of the surface.
struct MappedEmbedding {
    /// The surface with all arcs as edge paths.
    mesh: TriMesh,
    /// The triangle of the surface of the problem that each triangle lies in.
    base_face: Vec<u32>,
    /// The embedding on this mesh.
    embedding: Embedding,
    /// The coordinates of the corners of each triangle, in the chart of its patch.
    uv: Vec<[DVec2; 3]>,
}

impl MappedEmbedding {
    /// Maps the patches of an embedding and joins their meshes.
    fn new(layout: &QuadLayout, initial_embedding: &Embedding, progress: &Progress) -> Result<Self, EmbeddingError> {
        let maps = map_patches(layout, initial_embedding, progress)?;
        let mut positions: Vec<DVec3> = initial_embedding.mesh.positions.clone();
        let (mut faces, mut base_face, mut uv) = (Vec::new(), Vec::new(), Vec::new());
        let mut seeds = Vec::with_capacity(maps.len());
        for PatchMap { mesh, parent, base_face: base, uv: at, .. } in &maps {
            let first_new = positions.len() - parent.len();
            let global = |v: usize| parent.get(v).copied().unwrap_or((first_new + v) as u32);
            positions.extend(&mesh.positions()[parent.len()..]);
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

    /// The principal curvatures at the vertices. A vertex that was added has those of the nearest corner of its base
    /// triangle.
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
