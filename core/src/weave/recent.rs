//! A cache of the proposals at the vertices under the latest positions of the pointer.
//!
//! A moving pointer stays near a vertex for some steps and returns to it. Proposals at a vertex are valid as long as the
//! strips are the same. A cancelled search keeps the best loop that it had proved.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::elastica::{Certainty, DirectionMask, ElasticaGraph, FoundLoop, ProposalQuery, SearchWorkspace, Selection};
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};
use crate::weave::design::StripId;
use crate::weave::woven::Woven;

/// Capacity of the cache, in vertices: those under a small movement of the pointer. Chosen by hand.
const CAPACITY: usize = 16;

/// The cache and the workspaces of the searches.
#[derive(Debug, Default)]
pub(in crate::weave) struct RecentSearches {
    pub(in crate::weave) workspace: SearchWorkspace,
    /// Workspace of searches that avoid the directions of spines only. It is separate because the preparation of a search
    /// depends on the mask.
    spine_workspace: SearchWorkspace,
    /// The strips that the cache is valid for.
    woven: Option<Arc<Woven>>,
    /// The most recent last.
    found: VecDeque<Found>,
    /// The directions open to the strip that was edited last.
    edited: Option<MaskWithout>,
}

/// The directions that are open to a strip which replaces a placed one.
#[derive(Debug)]
struct MaskWithout {
    woven: Arc<Woven>,
    replaced: StripId,
    mask: Arc<DirectionMask>,
}

/// Loops found at a vertex.
#[derive(Debug)]
struct Found {
    vertex: VertexId,
    best: Option<FoundLoop>,
    /// All loops, if the search has ended.
    all: Option<Arc<Vec<FoundLoop>>>,
}

impl RecentSearches {
    /// The loops proposed at a vertex. The first loop and the best one are handed to `watch` as soon as they are found.
    pub(in crate::weave) fn proposals(
        &mut self,
        graph: &ElasticaGraph,
        woven: &Arc<Woven>,
        vertex: VertexId,
        progress: &Progress,
        watch: &mut dyn FnMut(Certainty, &FoundLoop),
    ) -> Result<Arc<Vec<FoundLoop>>, Cancelled> {
        if !self.woven.as_ref().is_some_and(|w| Arc::ptr_eq(w, woven)) {
            self.woven = Some(Arc::clone(woven));
            self.found.clear();
        }
        let known = self.found.iter().position(|f| f.vertex == vertex).and_then(|i| self.found.remove(i));
        let mut found = known.unwrap_or(Found { vertex, best: None, all: None });
        let result = match &found.all {
            Some(all) => {
                if let Some(best) = &found.best {
                    watch(Certainty::Proved, best);
                }
                Ok(Arc::clone(all))
            }
            None => {
                let searched = self.search(graph, woven, vertex, progress, &mut found.best, watch).map(Arc::new);
                found.all = searched.as_ref().ok().map(Arc::clone);
                searched
            }
        };
        if self.found.len() == CAPACITY {
            self.found.pop_front();
        }
        self.found.push_back(found);
        result
    }

    /// The directions that are open while a strip is replaced; computed once for one strip.
    pub(in crate::weave) fn mask_without(
        &mut self,
        woven: &Arc<Woven>,
        replaced: StripId,
        compute: impl FnOnce() -> DirectionMask,
    ) -> Arc<DirectionMask> {
        if let Some(known) = &self.edited
            && known.replaced == replaced
            && Arc::ptr_eq(&known.woven, woven)
        {
            return Arc::clone(&known.mask);
        }
        let mask = Arc::new(compute());
        self.edited = Some(MaskWithout { woven: Arc::clone(woven), replaced, mask: Arc::clone(&mask) });
        mask
    }

    fn search(
        &mut self,
        graph: &ElasticaGraph,
        woven: &Woven,
        vertex: VertexId,
        progress: &Progress,
        best: &mut Option<FoundLoop>,
        watch: &mut dyn FnMut(Certainty, &FoundLoop),
    ) -> Result<Vec<FoundLoop>, Cancelled> {
        if let Some(best) = best {
            watch(Certainty::Found, best);
        }
        // The best loop at the previous vertex starts the search.
        let nearby = self.found.iter().rev().find_map(|f| f.best.as_ref());
        let mut searched = |mask: &DirectionMask, work: &mut SearchWorkspace| {
            let selection = Selection { classes: Some(&woven.classes), ..Selection::alternatives() };
            let query = ProposalQuery { nearby, selection, ..ProposalQuery::alternatives(vertex, mask) };
            let found = graph.proposals_with(&query, work, progress, |certainty, l| {
                if certainty == Certainty::Proved {
                    *best = Some(l.clone());
                }
                watch(certainty, l);
            })?;
            Ok(found.loops)
        };
        let loops = searched(&woven.mask, &mut self.workspace)?;
        // Where strips cover every direction, loops avoid the directions of their spines only.
        if loops.is_empty() { searched(&woven.spine_mask, &mut self.spine_workspace) } else { Ok(loops) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;
    use crate::surface::SurfacePoint;
    use crate::weave::{MeshSource, Options, Session};

    #[test]
    fn proposals_are_cached_until_the_strips_change() {
        let progress = Progress::new();
        let source = MeshSource::Builtin("torus".into());
        let mut session = Session::open(builtin("torus").unwrap(), source, Options::default(), &progress).unwrap();
        let at = SurfacePoint { face: crate::mesh::FaceId(200), weights: [0.8, 0.1, 0.1] };
        let mut handed = Vec::new();
        let first = session.proposals_with(at, &progress, |p| handed.push(p)).unwrap();
        assert!(handed.len() >= 2 && handed.last() == first.first());
        handed.clear();
        assert_eq!(session.proposals_with(at, &progress, |p| handed.push(p)).unwrap(), first);
        assert_eq!(handed, first[..1]);
        session.place(first[0].clone(), &progress).unwrap();
        assert_ne!(session.proposals(at, &progress).unwrap(), first);
    }
}
