//! What is proposed to the designer: loops found on the graph, relaxed to smooth curves.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::session::WeaveError;
use crate::elastica::{ElasticaGraph, FoundLoop};
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::{RelaxOptions, Relaxed, SurfaceCurve, SurfacePoint, relax};

/// A strip that could be placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Its spine, on the mesh that is woven on.
    pub curve: SurfaceCurve,
    /// Cost of the loop that was found.
    pub cost: f64,
    /// Its elastic energy, if it was found as a loop of the graph.
    pub energy: Option<ElasticEnergy>,
}

/// Elastic energy of a loop, its length and weighted squared curvature, before and after it was relaxed. Alignment does
/// not belong to it: relaxing keeps to the tube that the search chose with regard to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ElasticEnergy {
    /// As it was found and priced, in steps of the graph.
    pub found: f64,
    /// As it is now, a curve on the surface; the same as long as it was not relaxed.
    pub now: f64,
}

impl Proposal {
    /// A loop as it was found.
    pub(super) fn found(l: &FoundLoop) -> Self {
        let energy = l.length + l.bending;
        let energy = ElasticEnergy { found: energy, now: energy };
        Self { curve: l.curve.clone(), cost: l.cost, energy: Some(energy) }
    }

    /// The same with its curve relaxed.
    pub(super) fn relaxed(self, relaxed: Relaxed) -> Self {
        let energy = self.energy.map(|e| ElasticEnergy { now: relaxed.after.total, ..e });
        Self { curve: relaxed.curve, energy, ..self }
    }

    /// The spine as points in space; `mesh` is the one that is woven on.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        self.curve.points(mesh)
    }
}

/// A found loop, relaxed to a smooth curve that still passes `at`.
pub(super) fn polished(
    graph: &ElasticaGraph,
    found: &FoundLoop,
    at: SurfacePoint,
    progress: &Progress,
) -> Result<Proposal, WeaveError> {
    let options = RelaxOptions { through: vec![at], ..Default::default() };
    let proposal = Proposal::found(found);
    match relax(graph.mesh(), &found.curve, &options, progress) {
        Ok(relaxed) => Ok(proposal.relaxed(relaxed)),
        Err(error) => {
            progress.check()?;
            tracing::debug!(%error, "a loop is shown as found");
            Ok(proposal)
        }
    }
}
