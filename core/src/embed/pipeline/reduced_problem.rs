//! The problem with the layout that remains after chords were collapsed.

use crate::embed::problem::Problem;
use crate::embed::topology::embedding_topology::{ArcHeadings, arc_headings};
use crate::layout::Reembedded;

/// The layout of a problem after chords were collapsed, with its initial embedding, headings and pins.
pub(super) struct ReducedProblem {
    /// The remaining layout with its initial embedding; `None` if no chord is collapsed.
    pub reembedded: Option<Reembedded>,
    arc_headings: Vec<ArcHeadings>,
    pinned_nodes: Vec<bool>,
    pinned_arcs: Vec<bool>,
}

impl ReducedProblem {
    /// With no chord collapsed.
    pub(super) fn unchanged(problem: &Problem<'_>) -> Self {
        Self {
            reembedded: None,
            arc_headings: problem.arc_headings.to_vec(),
            pinned_nodes: problem.pinned_nodes.to_vec(),
            pinned_arcs: problem.pinned_arcs.to_vec(),
        }
    }

    /// With the layout that remains. Pins carry over to merged nodes and arcs.
    pub(super) fn new(problem: &Problem<'_>, reembedded: Reembedded) -> Self {
        let mut pinned_nodes = vec![false; reembedded.layout.nodes.len()];
        for (&new, _) in reembedded.nodes.iter().zip(problem.pinned_nodes).filter(|pair| *pair.1) {
            pinned_nodes[new as usize] = true;
        }
        let mut pinned_arcs = vec![false; reembedded.layout.arcs.len()];
        for (new, _) in reembedded.arcs.iter().zip(problem.pinned_arcs).filter(|pair| *pair.1) {
            new.iter().for_each(|&a| pinned_arcs[a as usize] = true);
        }
        let arc_headings = arc_headings(&reembedded.layout);
        Self { arc_headings, pinned_nodes, pinned_arcs, reembedded: Some(reembedded) }
    }

    /// The reduced problem; `problem` is the one it was made from.
    pub(super) fn problem<'s>(&'s self, problem: &Problem<'s>) -> Problem<'s> {
        let given = (problem.layout, problem.initial_embedding);
        let (layout, initial_embedding) = self.reembedded.as_ref().map_or(given, |r| (&r.layout, &r.embedding));
        let Self { arc_headings, pinned_nodes, pinned_arcs, .. } = self;
        Problem { layout, initial_embedding, arc_headings, pinned_nodes, pinned_arcs, ..*problem }
    }

    /// Chords of the reduced layout by their indices in the layout of the problem.
    pub(super) fn original_indices(&self, chords: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        let Some(reembedded) = &self.reembedded else { return chords };
        let before = |chord: u32| reembedded.chords.iter().position(|&c| c == Some(chord));
        chords.into_iter().filter_map(|(c, length)| Some((before(c)? as u32, length))).collect()
    }
}
