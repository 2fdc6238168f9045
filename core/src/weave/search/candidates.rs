//! Candidates: the cheapest loops through many points.

use glam::DVec3;
use rayon::prelude::*;

use crate::elastica::{DirectionMask, ElasticaGraph, ProposalQuery, SearchWorkspace};
use crate::mesh::VertexId;
use crate::progress::Progress;
use crate::weave::error::WeaveError;
use crate::weave::model::Model;
use crate::weave::proposal::Proposal;

/// Largest number of search states settled per query; bounds the time on large meshes. Chosen by hand.
const BUDGET: u64 = 120_000;

/// A vertex and the direction in which loops pass it; `None` for the cheapest loops in any direction.
pub(in crate::weave) type Query = (VertexId, Option<DVec3>);

/// The loops of all queries, the cheapest first, at most `most`.
pub(in crate::weave) fn loops(
    graph: &ElasticaGraph,
    queries: &[Query],
    mask: &DirectionMask,
    most: usize,
    progress: &Progress,
) -> Result<Vec<Proposal>, WeaveError> {
    graph.prepare_boundary_costs(progress)?;
    let share = queries.len().div_ceil(rayon::current_num_threads()).max(1);
    let found: Vec<Vec<Proposal>> = queries
        .par_chunks(share)
        .map(|queries| {
            let mut work = SearchWorkspace::new();
            let mut list = Vec::new();
            for &(vertex, direction) in queries {
                let query = ProposalQuery { budget: BUDGET, direction, ..ProposalQuery::alternatives(vertex, mask) };
                let found = graph.proposals(&query, &mut work, progress)?;
                list.extend(found.loops.iter().map(Proposal::found));
            }
            Ok(list)
        })
        .collect::<Result<_, WeaveError>>()?;
    tracing::debug!(queries = queries.len(), "searched");
    let mut all: Vec<Proposal> = found.into_iter().flatten().collect();
    all.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    // Queries at several vertices of a loop find the same loop.
    all.dedup_by(|b, a| (b.cost - a.cost).abs() < 1e-6 * a.cost && a.curve.crossings.len() == b.curve.crossings.len());
    all.truncate(most);
    Ok(all)
}

/// Queries for loops through a vertex in four directions, 45° apart.
pub(in crate::weave) fn around(model: &Model, v: VertexId) -> [Query; 4] {
    let mesh = &model.mesh;
    let normal: DVec3 = mesh.outgoing(v).map(|h| mesh.face_area_vector(mesh.face(h))).sum();
    let n = normal.normalize_or(DVec3::Z);
    let (x, y) = n.any_orthonormal_pair();
    [x, x + y, y, y - x].map(|d| (v, Some(d)))
}
