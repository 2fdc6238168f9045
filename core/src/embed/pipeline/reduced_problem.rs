//! A job whose layout has lost chords.

use crate::embed::headings;
use crate::embed::problem::Job;
use crate::embed::topology::embedding_topology::Headings;
use crate::layout::Redrawn;

/// What is left of a job's layout without the chords that were collapsed.
pub(in crate::embed) struct Shorter {
    /// `None` as long as none was.
    pub redrawn: Option<Redrawn>,
    headings: Vec<Headings>,
    pinned_nodes: Vec<bool>,
    pinned_arcs: Vec<bool>,
}

impl Shorter {
    pub(in crate::embed) fn none(job: &Job<'_>) -> Self {
        Self {
            redrawn: None,
            headings: job.headings.to_vec(),
            pinned_nodes: job.pinned_nodes.to_vec(),
            pinned_arcs: job.pinned_arcs.to_vec(),
        }
    }

    pub(in crate::embed) fn new(job: &Job<'_>, redrawn: Redrawn) -> Self {
        let mut pinned_nodes = vec![false; redrawn.layout.nodes.len()];
        for (&new, _) in redrawn.nodes.iter().zip(job.pinned_nodes).filter(|pair| *pair.1) {
            pinned_nodes[new as usize] = true;
        }
        let mut pinned_arcs = vec![false; redrawn.layout.arcs.len()];
        for (new, _) in redrawn.arcs.iter().zip(job.pinned_arcs).filter(|pair| *pair.1) {
            new.iter().for_each(|&a| pinned_arcs[a as usize] = true);
        }
        Self { headings: headings(&redrawn.layout), pinned_nodes, pinned_arcs, redrawn: Some(redrawn) }
    }

    pub(in crate::embed) fn job<'s>(&'s self, job: &Job<'s>) -> Job<'s> {
        let (layout, drawing) = self.redrawn.as_ref().map_or((job.layout, job.drawing), |r| (&r.layout, &r.embedding));
        let Self { headings, pinned_nodes, pinned_arcs, .. } = self;
        Job { layout, drawing, headings, pinned_nodes, pinned_arcs, ..*job }
    }

    /// The same chords, by their numbers in the layout that was given.
    pub(in crate::embed) fn numbers(&self, chords: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        let Some(redrawn) = &self.redrawn else { return chords };
        let before = |chord: u32| redrawn.chords.iter().position(|&c| c == Some(chord));
        chords.into_iter().filter_map(|(c, length)| Some((before(c)? as u32, length))).collect()
    }
}
