//! The choice of chords to collapse (Campen, section 6.9).
//!
//! Collapsing a chord merges the end nodes of each of its arcs. The thesis constrains its length to zero; here the
//! chord is deleted from the layout. Shortest chords come first. Of chords that meet in a node only one is collapsed at
//! a time, since lengths in the next map differ there. A collapse that is undone because of its energy is not tried
//! again.

use crate::embed::pipeline::report::{CollapsedChord, UncollapsedChord};
use crate::embed::problem::Problem;
use crate::layout::{CollapseError, CollapsedLayout, QuadLayout, Reembedded, ReembeddingError, reembed};
use crate::progress::Progress;

/// The chords of a layout that are collapsed, and those that cannot be.
#[derive(Debug, Clone)]
pub(super) struct ChordCollapse<'a> {
    layout: &'a QuadLayout,
    /// Whether each node cannot move: no two of these may be merged.
    fixed_nodes: Vec<bool>,
    /// Whether each chord is collapsed.
    deleted: Vec<bool>,
    /// Whether the collapse of each chord was undone.
    refused: Vec<bool>,
    /// The collapsed chords, in order.
    pub collapsed: Vec<CollapsedChord>,
    /// The chords that were to be collapsed and remain.
    pub uncollapsed: Vec<UncollapsedChord>,
}

impl<'a> ChordCollapse<'a> {
    /// No chord collapsed.
    pub(super) fn new(layout: &'a QuadLayout, fixed_nodes: Vec<bool>) -> Self {
        let none = vec![false; layout.chords];
        let (collapsed, uncollapsed) = (Vec::new(), Vec::new());
        Self { layout, fixed_nodes, deleted: none.clone(), refused: none, collapsed, uncollapsed }
    }

    /// Collapses at most `most` of the chords `short`, given by index and length; with `only_simpler` only those
    /// without which the layout is less irregular. Returns the number of chords collapsed.
    pub(super) fn choose(&mut self, mut short: Vec<(u32, f64)>, most: usize, only_simpler: bool) -> usize {
        short.retain(|&(chord, _)| !self.deleted[chord as usize] && !self.refused[chord as usize]);
        short.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let before = self.collapsed.len();
        let mut irregularity = self.remaining_layout().map_or(usize::MAX, |c| c.layout.irregularity());
        // Nodes merged in this call.
        let mut touched = vec![false; self.layout.nodes.len()];
        for (chord, length) in short {
            if self.collapsed.len() == before + most {
                break;
            }
            let ends = || self.layout.arcs.iter().filter(move |a| a.chord == chord).flat_map(|a| a.nodes);
            if ends().any(|n| touched[n as usize]) {
                continue;
            }
            self.deleted[chord as usize] = true;
            match self.remaining_layout() {
                Ok(remaining) if only_simpler && remaining.layout.irregularity() >= irregularity => {
                    self.deleted[chord as usize] = false;
                }
                Ok(remaining) => {
                    irregularity = remaining.layout.irregularity();
                    let mut merged = vec![false; self.layout.nodes.len()];
                    ends().for_each(|n| merged[remaining.nodes[n as usize] as usize] = true);
                    for (t, &now) in touched.iter_mut().zip(&remaining.nodes) {
                        *t |= merged[now as usize];
                    }
                    self.collapsed.push(CollapsedChord { chord, length, patches: self.patches_of(chord) });
                }
                Err(reason) => {
                    self.deleted[chord as usize] = false;
                    self.note_uncollapsed(chord, length, reason);
                }
            }
        }
        self.collapsed.len() - before
    }

    /// Undoes all collapses after the first `count`. If a `reason` is given, these chords are not tried again.
    pub(super) fn undo(&mut self, count: usize, reason: Option<&str>) {
        for c in self.collapsed.split_off(count) {
            self.deleted[c.chord as usize] = false;
            if let Some(reason) = reason {
                self.refused[c.chord as usize] = true;
                self.note_uncollapsed(c.chord, c.length, reason.to_owned());
            }
        }
    }

    fn note_uncollapsed(&mut self, chord: u32, length: f64, reason: String) {
        self.uncollapsed.retain(|k| k.chord != chord);
        self.uncollapsed.push(UncollapsedChord { chord, length, reason });
    }

    /// The layout without the collapsed chords, or why these cannot be deleted.
    fn remaining_layout(&self) -> Result<CollapsedLayout, String> {
        let remaining = self.layout.without_chords(&self.deleted).map_err(|e: CollapseError| e.to_string())?;
        let mut taken: Vec<Option<usize>> = vec![None; remaining.layout.nodes.len()];
        for n in (0..self.fixed_nodes.len()).filter(|&n| self.fixed_nodes[n]) {
            if let Some(other) = taken[remaining.nodes[n] as usize].replace(n) {
                return Err(format!("nodes {other} and {n} cannot move"));
            }
        }
        Ok(remaining)
    }

    /// The remaining layout with an initial embedding.
    pub(super) fn reembed(&self, problem: &Problem<'_>, progress: &Progress) -> Result<Reembedded, ReembeddingError> {
        let Problem { surface, layout, initial_embedding, .. } = *problem;
        let fixed = |n: usize| self.fixed_nodes[n];
        reembed(layout, initial_embedding, &self.deleted, fixed, surface.mesh.n_vertices(), progress)
    }

    /// Number of patches that a chord runs through.
    fn patches_of(&self, chord: u32) -> usize {
        let through = |sides: &[(u32, bool); 4]| sides.iter().any(|s| self.layout.arcs[s.0 as usize].chord == chord);
        self.layout.patches.iter().filter(|p| through(&p.sides)).count()
    }
}
