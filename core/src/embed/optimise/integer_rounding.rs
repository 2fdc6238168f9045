//! Chords at whole multiples of an edge length: the mixed-integer option (Campen, section 6.7).
//!
//! A layout is refined to quads of edge length `q` by unit squares only if all its chords are as long as multiples of `q`,
//! and its nodes lie on the corners of the grid. Every chord has one length, so these multiples are the integers to be
//! found, one for each chord; any will do, since rectangles that agree along their sides make a map. They are found
//! greedily (Bommes, Zimmer and Kobbelt, Mixed-Integer Quadrangulation, section 4): those nearest to a multiple are put
//! there, the map is solved for again, and so on. Nodes have come to rest before, and move again afterwards.

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::chord_lengths::{Held, lengths};
use crate::progress::Progress;

/// Share of the chords left that is rounded before the map is solved for anew: at first those that hardly change.
const SHARE: f64 = 0.25;

impl Optimiser<'_> {
    /// Holds every chord at a whole multiple of `edge` that the map tells the length of, and lets the nodes step anew.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn round(&mut self, edge: f64, progress: &Progress) -> Result<(), EmbeddingError> {
        loop {
            let open = self.open_chords(edge);
            if open.is_empty() {
                break;
            }
            for &(_, chord, held) in &open[..(SHARE * open.len() as f64).ceil() as usize] {
                self.spacing.held[chord] = Some(held);
            }
            tracing::debug!(open = open.len(), energy = self.state.solution.energy, "chords rounded");
            self.state = self.solve(self.state.net.clone(), progress)?;
        }
        self.restart();
        Ok(())
    }

    /// The chords that are not rounded yet with what they would be held at, those first that are nearest to it.
    fn open_chords(&self, edge: f64) -> Vec<(f64, usize, Held)> {
        let (net, map) = (&self.state.net, &self.state.solution.map);
        let found = lengths(net, &self.through_arcs, &self.chord_of, map, self.spacing.held.len());
        let mut open: Vec<(f64, usize, Held)> = Vec::new();
        for (chord, (found, held)) in found.into_iter().zip(&self.spacing.held).enumerate() {
            if held.is_some_and(|h| h.whole) {
                continue;
            }
            let Some((arc, length)) = found else { continue };
            let fewest = f64::from(self.fewest[chord]).max((0.999 * self.least / edge).ceil());
            let count = (length / edge).round().max(fewest);
            let held = Held { arc, length: count * edge, whole: true };
            open.push(((length / edge - count).abs(), chord, held));
        }
        open.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        open
    }
}
