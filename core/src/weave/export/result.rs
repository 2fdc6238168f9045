//! The result of an export.

use std::collections::BTreeMap;

use crate::embed::{EmbeddingReport, Measures, Surface, measure_patches};
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::quad::QuadMesh;
use crate::surface::{PrincipalCurvature, face_curvature};
use crate::weave::mesh_role::MeshRole;

/// Durations in seconds, by the name of the work.
pub type Times = BTreeMap<String, f64>;

/// The embedding that an optimisation started with.
#[derive(Debug, Clone)]
pub struct InitialState {
    /// The embedding.
    pub initial_embedding: Embedding,
    /// Measures of its harmonic patch maps; `None` where patches could not be mapped.
    pub measures: Option<Measures>,
    /// Principal curvatures of the triangles of the surface.
    pub(in crate::weave) face_curvature: Vec<PrincipalCurvature>,
}

impl InitialState {
    /// `maps` are the harmonic maps of its patches.
    pub(super) fn new(initial_embedding: &Embedding, maps: Option<&[PatchMap]>, surface: &Surface<'_>) -> Self {
        let face_curvature = face_curvature(surface.mesh, surface.curvature, |_| true);
        let measures = maps.map(|maps| measure_patches(maps, &face_curvature).0);
        Self { initial_embedding: initial_embedding.clone(), measures, face_curvature }
    }
}

/// A layout, embedded and refined to quads.
#[derive(Debug)]
pub struct Export {
    /// Its structure.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The mesh of layout, embedding and maps. The quads always lie on the design mesh.
    pub mesh_role: MeshRole,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// The quad mesh that refines it.
    pub quads: QuadMesh,
    /// The report of the optimisation, or why it failed; `None` without an optimisation.
    pub optimised: Option<Result<EmbeddingReport, String>>,
    /// The embedding before the optimisation.
    pub initial: InitialState,
    /// Durations of the parts of the work.
    pub seconds: Times,
}

impl Export {
    /// Whether chords of the layout were collapsed.
    pub fn has_collapsed(&self) -> bool {
        matches!(&self.optimised, Some(Ok(report)) if !report.collapsed_chords.is_empty())
    }

    /// The measures of the embedding.
    pub fn measures(&self) -> Measures {
        measure_patches(&self.maps, &self.initial.face_curvature).0
    }
}
