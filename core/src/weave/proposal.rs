//! What is proposed to the designer: loops found on the graph, relaxed to smooth curves.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::elastica::{ElasticaGraph, FoundLoop};
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::{RelaxOptions, Relaxed, SurfaceCurve, SurfacePoint, relax};
use crate::weave::error::WeaveError;
use crate::weave::loop_contacts::LoopContacts;

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
    pub(in crate::weave) fn found(l: &FoundLoop) -> Self {
        let energy = l.length + l.bending;
        let energy = ElasticEnergy { found: energy, now: energy };
        Self { curve: l.curve.clone(), cost: l.cost, energy: Some(energy) }
    }

    /// The same with its curve relaxed.
    pub(in crate::weave) fn relaxed(self, relaxed: Relaxed) -> Self {
        let energy = self.energy.map(|e| ElasticEnergy { now: relaxed.after.total, ..e });
        Self { curve: relaxed.curve, energy, ..self }
    }

    /// The spine as points in space; `mesh` is the one that is woven on.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        self.curve.points(mesh)
    }
}

/// Radii of the tubes in which loops are relaxed, in mean edges: the next one where the loop would meet more than it did.
const TUBES: [f64; 3] = [2.5, 1.2, 0.6];

/// A found loop, relaxed to a smooth curve that still passes `at` and crosses neither features nor placed strips more
/// often than it did.
pub(in crate::weave) fn smoothed_proposal(
    graph: &ElasticaGraph,
    company: &LoopContacts<'_>,
    found: &FoundLoop,
    at: SurfacePoint,
    progress: &Progress,
) -> Result<Proposal, WeaveError> {
    let before = company.met(&found.curve);
    for tube in TUBES {
        let options = RelaxOptions { waypoints: vec![at], tube, ..Default::default() };
        match relax(graph.mesh(), &found.curve, &options, progress) {
            Ok(relaxed) if company.met(&relaxed.curve).no_more_than(&before) => {
                return Ok(Proposal::found(found).relaxed(relaxed));
            }
            Ok(_) => tracing::debug!(tube, "a loop relaxed would cross more than it did"),
            Err(error) => {
                progress.check()?;
                tracing::debug!(%error, "a loop cannot be relaxed");
                break;
            }
        }
    }
    Ok(Proposal::found(found))
}
