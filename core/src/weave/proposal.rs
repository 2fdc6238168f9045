//! Proposals: loops of the elastica graph, relaxed to smooth curves.

use glam::DVec3;

use crate::elastica::{ElasticaGraph, FoundLoop};
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::{RelaxOptions, Relaxed, SurfaceCurve, Waypoint, relax};
use crate::weave::anchor::Anchor;
use crate::weave::design::ElasticEnergy;
use crate::weave::error::WeaveError;
use crate::weave::loop_contacts::LoopContacts;

/// A strip that could be placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Its spine on the woven mesh.
    pub curve: SurfaceCurve,
    /// Elastica cost of the loop as it was found.
    pub cost: f64,
    /// Its elastic energy, if it is a loop of the elastica graph.
    pub energy: Option<ElasticEnergy>,
    /// The anchors that it was searched through; none for a suggestion.
    pub anchors: Vec<Anchor>,
}

impl Proposal {
    /// The proposal of a loop as it was found.
    pub(in crate::weave) fn found(l: &FoundLoop) -> Self {
        let energy = l.length + l.bending;
        let energy = ElasticEnergy { found: energy, relaxed: energy };
        Self { curve: l.curve.clone(), cost: l.cost, energy: Some(energy), anchors: Vec::new() }
    }

    /// The same proposal with a relaxed curve.
    pub(in crate::weave) fn relaxed(self, relaxed: Relaxed) -> Self {
        let energy = self.energy.map(|e| ElasticEnergy { relaxed: relaxed.after.total, ..e });
        Self { curve: relaxed.curve, energy, ..self }
    }

    /// The points of the spine; `mesh` is the woven mesh.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        self.curve.points(mesh)
    }
}

/// Radii of the tubes in which a loop is relaxed, in mean edge lengths, tried in turn until the relaxed loop crosses no
/// feature or strip more often than before.
const TUBES: [f64; 3] = [2.5, 1.2, 0.6];

/// A found loop relaxed to a smooth curve through the waypoints that crosses no feature and no placed strip more often than the loop
/// does. If that fails in every tube, the loop as it was found. `tie` as in [`RelaxOptions::tie`].
pub(in crate::weave) fn smoothed_proposal(
    graph: &ElasticaGraph,
    contacts: &LoopContacts<'_>,
    found: &FoundLoop,
    waypoints: &[Waypoint],
    tie: f64,
    progress: &Progress,
) -> Result<Proposal, WeaveError> {
    let before = contacts.count(&found.curve);
    for tube in TUBES {
        let options = RelaxOptions { waypoints: waypoints.to_vec(), tube, tie, ..Default::default() };
        match relax(graph.mesh(), &found.curve, &options, progress) {
            Ok(relaxed) if contacts.count(&relaxed.curve).at_most(&before) => {
                return Ok(Proposal::found(found).relaxed(relaxed));
            }
            Ok(_) => tracing::debug!(tube, "the relaxed loop has more crossings"),
            Err(error) => {
                progress.check()?;
                tracing::debug!(%error, "the loop cannot be relaxed");
                break;
            }
        }
    }
    Ok(Proposal::found(found))
}
