//! The mixed-integer option: chord lengths become whole multiples of an edge length (Campen, section 6.7).
//!
//! A layout is refined to quads of edge length `q` by unit squares only if all its nodes lie on the corners of a grid
//! of width `q`. All arcs of a chord have the same length, and rectangles whose sides agree make a map whatever their
//! sizes, so that the integers are one multiple of `q` for each chord, and any positive ones are feasible. They are
//! found greedily (Bommes, Zimmer and Kobbelt, Mixed-Integer Quadrangulation, section 4): chords nearest to a multiple
//! are fixed there, the map is solved for again, and so on. Nodes are optimised before with free lengths, and again
//! afterwards.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::chord_lengths::{FixedLength, chord_lengths};
use crate::progress::Progress;

/// Share of the open chords that is rounded before the map is solved for again, 0 to 1; a smaller share takes more
/// solves. Chosen by hand.
const ROUNDED_SHARE: f64 = 0.25;
/// Factor of the least length where multiples of `q` are compared with it: a multiple that equals the least length is
/// allowed despite rounding errors.
const TOLERANCE: f64 = 0.999;

impl Optimiser<'_> {
    /// Fixes every chord of known length at a whole multiple of `edge` and begins the descent anew.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn round_chord_lengths(&mut self, edge: f64, progress: &Progress) -> Result<(), EmbeddingError> {
        loop {
            let open = self.open_chords(edge);
            if open.is_empty() {
                break;
            }
            for &(_, chord, fixed) in &open[..(ROUNDED_SHARE * open.len() as f64).ceil() as usize] {
                self.chord_lengths.fixed[chord] = Some(fixed);
            }
            tracing::debug!(open = open.len(), energy = self.state.solution.energy, "chord lengths rounded");
            self.state = self.solve(self.state.topology.clone(), progress)?;
        }
        self.restart();
        Ok(())
    }

    /// The chords that are not rounded yet: the distance to the nearest allowed multiple in edge lengths, the chord,
    /// and the length it would be fixed at; sorted by that distance.
    fn open_chords(&self, edge: f64) -> Vec<(f64, usize, FixedLength)> {
        let (topology, map) = (&self.state.topology, &self.state.solution.map);
        let fixed = &self.chord_lengths.fixed;
        let found = chord_lengths(topology, &self.through_arcs, &self.chord_of, map, fixed.len());
        let mut open: Vec<(f64, usize, FixedLength)> = Vec::new();
        for (chord, (found, fixed)) in found.into_iter().zip(fixed).enumerate() {
            if fixed.is_some_and(|h| h.whole) {
                continue;
            }
            let Some((arc, length)) = found else { continue };
            let min_count = f64::from(self.min_quads[chord]).max((TOLERANCE * self.min_length / edge).ceil());
            let count = (length / edge).round().max(min_count);
            let fixed = FixedLength { arc, length: count * edge, whole: true };
            open.push(((length / edge - count).abs(), chord, fixed));
        }
        open.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        open
    }
}
