//! Re-embedding of a layout after chord collapse.
//!
//! The remaining layout is dual to the curves of the remaining chords ([`DualCurves`]). It gets an initial embedding
//! like any layout dual to an arrangement ([`initial_embedding`]). A merged node lies in the union of the regions of
//! the nodes it is merged from; every other node keeps its position.

use thiserror::Error;

use super::collapse::{CollapseError, CollapsedLayout};
use super::dual_curves::{DualCurves, DualCurvesError};
use super::embedding::Embedding;
use super::initial_embedding::{InitialEmbeddingError, initial_embedding};
use super::structure::{LayoutError, QuadLayout};
use crate::dual::ArrangementError;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};

/// A layout after deletion of chords, with its embedding and maps from the nodes, arcs and chords before.
#[derive(Debug, Clone)]
pub struct Reembedded {
    /// The remaining layout.
    pub layout: QuadLayout,
    /// Its embedding on the same surface.
    pub embedding: Embedding,
    /// For each node before, the node it is merged into.
    pub nodes: Vec<u32>,
    /// For each arc before, the arc it is merged into; `None` for arcs of deleted chords.
    pub arcs: Vec<Option<u32>>,
    /// For each chord before, its new index; `None` if it is deleted.
    pub chords: Vec<Option<u32>>,
}

/// Why a layout could not be re-embedded after deletion of chords or on another mesh.
#[derive(Debug, Error)]
pub enum ReembeddingError {
    /// The chords cannot be deleted.
    #[error(transparent)]
    Collapse(#[from] CollapseError),
    /// The dual curves could not be computed.
    #[error(transparent)]
    DualCurves(#[from] DualCurvesError),
    /// The curves do not form an arrangement.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The dual of the curves is not the expected layout.
    #[error("the dual of the curves is not the expected layout: {0}")]
    Other(#[from] LayoutError),
    /// The layout could not be embedded.
    #[error(transparent)]
    Embed(#[from] InitialEmbeddingError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Deletes the chords marked in `deleted` from `layout`, embedded as `embedding` on a surface of `n_surface` vertices,
/// and embeds the remaining layout. A merged node takes the position of a node for which `stays` holds, else that of a
/// node with the valence of the merged node.
///
/// # Errors
///
/// See [`ReembeddingError`].
pub fn reembed(
    layout: &QuadLayout,
    embedding: &Embedding,
    deleted: &[bool],
    stays: impl Fn(usize) -> bool,
    n_surface: usize,
    progress: &Progress,
) -> Result<Reembedded, ReembeddingError> {
    let collapsed = layout.without_chords(deleted)?;
    let DualCurves { arrangement, base_face, embedding, middles } =
        DualCurves::new(layout, embedding, deleted, n_surface, progress)?;
    let dual = QuadLayout::dual(&arrangement, &[], collapsed.layout.euler())?;
    let region = |v: u32| arrangement.region_left_of(arrangement.refined.vertex_halfedge(v));
    let nodes: Vec<u32> = embedding.nodes.iter().map(|&v| region(v)).collect();
    let preferred = positions(layout, &embedding, &dual, &nodes, stays);
    let segment = |v: u32| arrangement.refined.outgoing(v).into_iter().find_map(|h| arrangement.segment_at(h));
    let arc = |(a, target): (usize, &Option<(u32, bool)>)| {
        target.and_then(|_| segment(middles[a])).map(|(segment, _)| segment)
    };
    let arcs: Vec<Option<u32>> = collapsed.arcs.iter().enumerate().map(arc).collect();
    check(&collapsed, &dual, &nodes)?;
    let mut embedding = initial_embedding(&arrangement, &dual, &preferred, progress)?;
    embedding.base_face.iter_mut().for_each(|f| *f = base_face[*f as usize]);
    let mut chords = vec![None; layout.chords];
    for (a, target) in arcs.iter().enumerate() {
        if let Some(target) = *target {
            chords[layout.arcs[a].chord as usize] = Some(dual.arcs[target as usize].chord);
        }
    }
    Ok(Reembedded { layout: dual, embedding, nodes, arcs, chords })
}

/// Checks that the dual of the curves has the nodes of the collapsed layout.
fn check(collapsed: &CollapsedLayout, dual: &QuadLayout, nodes: &[u32]) -> Result<(), ReembeddingError> {
    for (n, &found) in nodes.iter().enumerate() {
        let (expected, found) = (&collapsed.layout.nodes[collapsed.nodes[n] as usize], &dual.nodes[found as usize]);
        if expected != found {
            let (valence, corners) = (expected.valence, found.valence);
            return Err(LayoutError::Valence { node: n, valence, corners }.into());
        }
    }
    Ok(())
}

/// The vertex at which each node of `dual` should lie: that of the only node it is merged from, else of one that stays,
/// else of one of the same valence.
fn positions(
    layout: &QuadLayout,
    embedding: &Embedding,
    dual: &QuadLayout,
    nodes: &[u32],
    stays: impl Fn(usize) -> bool,
) -> Vec<Option<VertexId>> {
    let mut merged: Vec<Vec<usize>> = vec![Vec::new(); dual.nodes.len()];
    for (old, &new) in nodes.iter().enumerate() {
        merged[new as usize].push(old);
    }
    let position = |(new, old): (usize, &Vec<usize>)| {
        let alike = |&n: &usize| layout.nodes[n] == dual.nodes[new];
        let chosen = match old.as_slice() {
            &[only] => Some(only),
            list => list.iter().copied().find(|&n| stays(n)).or_else(|| list.iter().copied().find(alike)),
        };
        chosen.map(|n| VertexId(embedding.nodes[n]))
    };
    merged.iter().enumerate().map(position).collect()
}
