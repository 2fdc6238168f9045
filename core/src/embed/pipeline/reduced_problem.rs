//! A job whose layout has lost chords.

use crate::embed::arc_headings;
use crate::embed::problem::Problem;
use crate::embed::topology::embedding_topology::ArcHeadings;
use crate::layout::Reembedded;

/// What is left of a job's layout without the chords that were collapsed.
pub(in crate::embed) struct Shorter {
    /// `None` as long as none was.
    pub redrawn: Option<Reembedded>,
    arc_headings: Vec<ArcHeadings>,
    pinned_nodes: Vec<bool>,
    pinned_arcs: Vec<bool>,
}

impl Shorter {
    pub(in crate::embed) fn none(job: &Problem<'_>) -> Self {
        Self {
            redrawn: None,
            arc_headings: job.arc_headings.to_vec(),
            pinned_nodes: job.pinned_nodes.to_vec(),
            pinned_arcs: job.pinned_arcs.to_vec(),
        }
    }

    pub(in crate::embed) fn new(job: &Problem<'_>, redrawn: Reembedded) -> Self {
        let mut pinned_nodes = vec![false; redrawn.layout.nodes.len()];
        for (&new, _) in redrawn.nodes.iter().zip(job.pinned_nodes).filter(|pair| *pair.1) {
            pinned_nodes[new as usize] = true;
        }
        let mut pinned_arcs = vec![false; redrawn.layout.arcs.len()];
        for (new, _) in redrawn.arcs.iter().zip(job.pinned_arcs).filter(|pair| *pair.1) {
            new.iter().for_each(|&a| pinned_arcs[a as usize] = true);
        }
        Self { arc_headings: arc_headings(&redrawn.layout), pinned_nodes, pinned_arcs, redrawn: Some(redrawn) }
    }

    pub(in crate::embed) fn job<'s>(&'s self, job: &Problem<'s>) -> Problem<'s> {
        let (layout, initial_embedding) =
            self.redrawn.as_ref().map_or((job.layout, job.initial_embedding), |r| (&r.layout, &r.embedding));
        let Self { arc_headings, pinned_nodes, pinned_arcs, .. } = self;
        Problem { layout, initial_embedding, arc_headings, pinned_nodes, pinned_arcs, ..*job }
    }

    /// The same chords, by their numbers in the layout that was given.
    pub(in crate::embed) fn numbers(&self, chords: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        let Some(redrawn) = &self.redrawn else { return chords };
        let before = |chord: u32| redrawn.chords.iter().position(|&c| c == Some(chord));
        chords.into_iter().filter_map(|(c, length)| Some((before(c)? as u32, length))).collect()
    }
}
