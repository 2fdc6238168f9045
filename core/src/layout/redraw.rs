//! The drawing of a layout without some of its chords.
//!
//! The layout dual to the curves through the middles of the chords that are kept ([`Dual`]) is drawn as any woven one
//! ([`super::embed`]): a merged node lies in the region in which those it was made of lay, every other node stays where
//! it was.

use thiserror::Error;

use super::collapse::{CollapseError, CollapsedLayout};
use super::dual::Dual;
use super::initial_embedding::{Embedding, InitialEmbeddingError, embed};
use super::structure::{LayoutError, QuadLayout};
use crate::dual::{ArrangementError, NoPath};
use crate::mesh::{TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// A layout and its drawing without some of the chords of another.
#[derive(Debug, Clone)]
pub struct Reembedded {
    /// What is left.
    pub layout: QuadLayout,
    /// Its drawing on the same surface.
    pub embedding: Embedding,
    /// For each node before the one that it has become.
    pub nodes: Vec<u32>,
    /// For each arc before the one that it has become; none for those of chords that are gone.
    pub arcs: Vec<Option<u32>>,
    /// For each chord before its number, unless it is gone.
    pub chords: Vec<Option<u32>>,
}

/// Why a layout could not be drawn without some of its chords.
#[derive(Debug, Error)]
pub enum ReembeddingError {
    /// What would be left is no layout.
    #[error(transparent)]
    Collapse(#[from] CollapseError),
    /// A patch is not a disc of four sides.
    #[error("patch {patch} is not drawn as a disc of four sides")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// An arc of the drawing is no path of edges.
    #[error("arc {arc} is not drawn as a path of edges")]
    Arc {
        /// The arc.
        arc: usize,
    },
    /// A patch could not be mapped.
    #[error("patch {patch}: {source}")]
    Solve {
        /// The patch.
        patch: usize,
        /// What the solver says.
        source: SolveError,
    },
    /// A dual curve could not be drawn.
    #[error("patch {patch}: {source}")]
    Draw {
        /// The patch.
        patch: usize,
        /// Where it failed.
        source: NoPath,
    },
    /// The dual curves are no arrangement.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The parts do not fit together again.
    #[error("the dual of the drawing is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
    /// The layout of the dual curves is not the one that was to come of it.
    #[error("the dual of the drawing is another layout: {0}")]
    Other(#[from] LayoutError),
    /// The layout could not be drawn.
    #[error(transparent)]
    Embed(#[from] InitialEmbeddingError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Draws `layout`, drawn as `drawing` on a surface of `n_surface` vertices, without the chords that are `gone`. Of nodes
/// that merge, one for which `stays` holds keeps its place, else one of the valence of the merged node.
///
/// # Errors
///
/// See [`ReembeddingError`].
pub fn redraw(
    layout: &QuadLayout,
    drawing: &Embedding,
    gone: &[bool],
    stays: impl Fn(usize) -> bool,
    n_surface: usize,
    progress: &Progress,
) -> Result<Reembedded, ReembeddingError> {
    let collapsed = layout.without(gone)?;
    let Dual { arrangement, base_face, drawing, middles } = Dual::new(layout, drawing, gone, n_surface, progress)?;
    let dual = QuadLayout::dual(&arrangement, &[], collapsed.layout.euler())?;
    let region = |v: u32| arrangement.region_left_of(arrangement.refined.vertex_halfedge(v));
    let nodes: Vec<u32> = drawing.nodes.iter().map(|&v| region(v)).collect();
    let preferred = places(layout, &drawing, &dual, &nodes, stays);
    let segment = |v: u32| arrangement.refined.outgoing(v).into_iter().find_map(|h| arrangement.segment_at(h));
    let arc = |(a, target): (usize, &Option<(u32, bool)>)| {
        target.and_then(|_| segment(middles[a])).map(|(segment, _)| segment)
    };
    let arcs: Vec<Option<u32>> = collapsed.arcs.iter().enumerate().map(arc).collect();
    check(&collapsed, &dual, &nodes)?;
    let mut embedding = embed(&arrangement, &dual, &preferred, progress)?;
    embedding.base_face.iter_mut().for_each(|f| *f = base_face[*f as usize]);
    let mut chords = vec![None; layout.chords];
    for (a, target) in arcs.iter().enumerate() {
        if let Some(target) = *target {
            chords[layout.arcs[a].chord as usize] = Some(dual.arcs[target as usize].chord);
        }
    }
    Ok(Reembedded { layout: dual, embedding, nodes, arcs, chords })
}

/// Checks that the layout dual to the drawn curves has the nodes that the deletion of chords has left.
fn check(collapsed: &CollapsedLayout, dual: &QuadLayout, nodes: &[u32]) -> Result<(), ReembeddingError> {
    for (n, &found) in nodes.iter().enumerate() {
        let (wanted, found) = (&collapsed.layout.nodes[collapsed.nodes[n] as usize], &dual.nodes[found as usize]);
        if wanted != found {
            let (valence, corners) = (wanted.valence, found.valence);
            return Err(LayoutError::Valence { node: n, valence, corners }.into());
        }
    }
    Ok(())
}

/// The vertex at which each node of `dual` is to lie, if any: that of the only node it is made of, or of one that stays,
/// or of one of its own valence.
fn places(
    layout: &QuadLayout,
    drawing: &Embedding,
    dual: &QuadLayout,
    nodes: &[u32],
    stays: impl Fn(usize) -> bool,
) -> Vec<Option<VertexId>> {
    let mut made_of: Vec<Vec<usize>> = vec![Vec::new(); dual.nodes.len()];
    for (old, &new) in nodes.iter().enumerate() {
        made_of[new as usize].push(old);
    }
    let place = |(new, old): (usize, &Vec<usize>)| {
        let alike = |&n: &usize| layout.nodes[n] == dual.nodes[new];
        let chosen = match old.as_slice() {
            &[only] => Some(only),
            list => list.iter().copied().find(|&n| stays(n)).or_else(|| list.iter().copied().find(alike)),
        };
        chosen.map(|n| VertexId(drawing.nodes[n]))
    };
    made_of.iter().enumerate().map(place).collect()
}
