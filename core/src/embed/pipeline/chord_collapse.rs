//! Which chords of a layout are collapsed (Campen, section 6.9).
//!
//! Arcs that want to be shorter than a least length pull the nodes at their ends together: their chord is deleted, and
//! these become one. Shortest chords come first; of chords that meet in a node only one at a time, since the next map has
//! other lengths there. A collapse that makes the map much worse is taken back.

use serde::Serialize;

use crate::embed::problem::Problem;
use crate::layout::{CollapseError, CollapsedLayout, QuadLayout, Reembedded, ReembeddingError, redraw};
use crate::progress::Progress;

/// A chord that was collapsed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CollapsedChord {
    /// Its number in the layout that was given.
    pub chord: u32,
    /// The length of its arcs in the last map that had it.
    pub length: f64,
    /// How many patches it ran through.
    pub patches: usize,
}

/// A chord that is short and stays.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UncollapsedChord {
    /// Its number in the layout that was given.
    pub chord: u32,
    /// The length of its arcs.
    pub length: f64,
    /// Why it could not be collapsed.
    pub reason: String,
}

/// The chords of a layout that are collapsed, and those that are to be and cannot.
#[derive(Debug, Clone)]
pub(in crate::embed) struct Collapse<'a> {
    layout: &'a QuadLayout,
    /// Nodes that stay where they are: no two of them may become one.
    stays: Vec<bool>,
    /// Whether each chord is gone.
    pub gone: Vec<bool>,
    /// Whether each chord was tried in vain.
    refused: Vec<bool>,
    /// Those that are, in order.
    pub done: Vec<CollapsedChord>,
    /// Those that cannot be.
    pub kept: Vec<UncollapsedChord>,
}

impl<'a> Collapse<'a> {
    pub(in crate::embed) fn new(layout: &'a QuadLayout, stays: Vec<bool>) -> Self {
        let none = vec![false; layout.chords];
        Self { layout, stays, gone: none.clone(), refused: none, done: Vec::new(), kept: Vec::new() }
    }

    /// Notes which of these short chords, given by number and length, are to be collapsed now, at most so many, and if
    /// so asked only those that make the layout less irregular; returns how many.
    pub(in crate::embed) fn choose(&mut self, mut short: Vec<(u32, f64)>, most: usize, simpler: bool) -> usize {
        short.retain(|&(chord, _)| !self.gone[chord as usize] && !self.refused[chord as usize]);
        short.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let before = self.done.len();
        let mut irregularity = self.attempt().map_or(usize::MAX, |c| c.layout.irregularity());
        let mut touched = vec![false; self.layout.nodes.len()];
        for (chord, length) in short {
            if self.done.len() == before + most {
                break;
            }
            let ends = || self.layout.arcs.iter().filter(move |a| a.chord == chord).flat_map(|a| a.nodes);
            if ends().any(|n| touched[n as usize]) {
                continue;
            }
            self.gone[chord as usize] = true;
            match self.attempt() {
                Ok(collapsed) if simpler && collapsed.layout.irregularity() >= irregularity => {
                    self.gone[chord as usize] = false;
                }
                Ok(collapsed) => {
                    irregularity = collapsed.layout.irregularity();
                    let mut merged = vec![false; self.layout.nodes.len()];
                    ends().for_each(|n| merged[collapsed.nodes[n as usize] as usize] = true);
                    for (t, &now) in touched.iter_mut().zip(&collapsed.nodes) {
                        *t |= merged[now as usize];
                    }
                    self.done.push(CollapsedChord { chord, length, patches: self.patches(chord) });
                }
                Err(reason) => {
                    self.gone[chord as usize] = false;
                    self.keep(chord, length, reason);
                }
            }
        }
        self.done.len() - before
    }

    /// Takes back the choices after the first `count`; for a `reason` they are not made again.
    pub(in crate::embed) fn take_back(&mut self, count: usize, reason: Option<&str>) {
        for c in self.done.split_off(count) {
            self.gone[c.chord as usize] = false;
            if let Some(reason) = reason {
                self.refused[c.chord as usize] = true;
                self.keep(c.chord, c.length, reason.to_owned());
            }
        }
    }

    fn keep(&mut self, chord: u32, length: f64, reason: String) {
        self.kept.retain(|k| k.chord != chord);
        self.kept.push(UncollapsedChord { chord, length, reason });
    }

    /// What is left, unless the chords cannot be deleted.
    fn attempt(&self) -> Result<CollapsedLayout, String> {
        let collapsed = self.layout.without(&self.gone).map_err(|e: CollapseError| e.to_string())?;
        let mut taken: Vec<Option<usize>> = vec![None; collapsed.layout.nodes.len()];
        for n in (0..self.stays.len()).filter(|&n| self.stays[n]) {
            if let Some(other) = taken[collapsed.nodes[n] as usize].replace(n) {
                return Err(format!("nodes {other} and {n} stay where they are"));
            }
        }
        Ok(collapsed)
    }

    /// What is left, drawn.
    pub(in crate::embed) fn draw(
        &self,
        job: &Problem<'_>,
        progress: &Progress,
    ) -> Result<Reembedded, ReembeddingError> {
        let n_surface = job.surface.mesh.n_vertices();
        redraw(job.layout, job.initial_embedding, &self.gone, |n| self.stays[n], n_surface, progress)
    }

    /// Number of patches that a chord runs through.
    fn patches(&self, chord: u32) -> usize {
        let through = |sides: &[(u32, bool); 4]| sides.iter().any(|s| self.layout.arcs[s.0 as usize].chord == chord);
        self.layout.patches.iter().filter(|p| through(&p.sides)).count()
    }
}
