//! Former names, until all callers use the present ones.

use std::sync::Arc;

use glam::DVec2;

use super::{
    Effort, FlipRemoval, InjectiveEnergy, InjectiveMap, NewtonSystem, OrientedTriangle, ParamError, SeamlessSystem,
};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::surface::Metric;

#[allow(missing_docs, clippy::missing_errors_doc)]
impl SeamlessSystem {
    pub fn newton(&mut self) -> Result<Arc<NewtonSystem>, ParamError> {
        self.newton_system()
    }

    pub fn injective(&self, energy: &InjectiveEnergy<'_>, free: Vec<f64>) -> Option<InjectiveMap> {
        self.injective_map(energy, free)
    }

    pub fn approach(
        &mut self,
        mesh: (&TriMesh, &Metric),
        by: (&NewtonSystem, &InjectiveEnergy<'_>),
        from: (&[f64], &[[DVec2; 3]]),
        progress: &Progress,
    ) -> Result<Result<InjectiveMap, Vec<FaceId>>, ParamError> {
        self.enforce_constraints(mesh, by, from, progress)
    }

    pub fn unfold(
        &self,
        triangles: &[OrientedTriangle],
        at: (&[f64], &[u32]),
        effort: Effort,
        progress: &Progress,
    ) -> Result<FlipRemoval, ParamError> {
        self.remove_flips(triangles, at, effort, progress)
    }
}
