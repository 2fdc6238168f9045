//! The phases of an optimisation on one mesh: least squares, then an injective map; in the end arcs and patches are
//! extracted.
//!
//! The least-squares phase comes first: its steps are cheap, and it finds where features can be constrained. The
//! injective phase starts from the least-squares map, with flipped triangles untangled; where that fails it starts from
//! the initial embedding, and where that fails too the least-squares result is returned with its flipped triangles.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::injective::Flipped;
use crate::embed::pipeline::extraction::extract_embedding;
use crate::embed::pipeline::report::{EmbeddingReport, Next, OptimisedEmbedding, Snapshot};
use crate::embed::problem::Problem;
use crate::progress::Progress;

/// The callback that is shown every improvement; its answer may end the optimisation.
pub(super) type Observer<'w> = &'w mut dyn FnMut(&Snapshot) -> Next;

/// A running optimisation, across its phases.
pub(super) struct Phases<'w> {
    observer: Observer<'w>,
    /// The last answer of the observer.
    pub next: Next,
    /// Node steps of all phases.
    steps: usize,
    /// Area of the surface.
    area: f64,
    /// Energy of the first map over the area of the surface; NaN without one.
    energy_before: f64,
    /// Number of flipped triangles of the first map.
    flipped_before: usize,
    /// The energy at the start of the present phase; `None` before its first state is shown.
    phase_energy: Option<f64>,
}

impl<'w> Phases<'w> {
    /// Before the first map.
    pub(super) fn new(problem: &Problem<'_>, observer: Observer<'w>) -> Self {
        Self {
            observer,
            next: Next::Continue,
            steps: 0,
            area: problem.area(),
            energy_before: f64::NAN,
            flipped_before: 0,
            phase_energy: None,
        }
    }

    /// With the first map of an optimiser.
    pub(super) fn begin(problem: &Problem<'_>, optimiser: &Optimiser<'_>, observer: Observer<'w>) -> Self {
        let mut phases = Self::new(problem, observer);
        phases.energy_before = optimiser.state().solution.energy / phases.area;
        phases.flipped_before = optimiser.state().flipped();
        phases.show(optimiser);
        phases
    }

    /// Continues on another mesh after an optimisation with the given report.
    pub(super) fn continued(problem: &Problem<'_>, report: &EmbeddingReport, observer: Observer<'w>) -> Self {
        let EmbeddingReport { steps, energy_before, flipped_before, .. } = *report;
        Self { steps, energy_before, flipped_before, ..Self::new(problem, observer) }
    }

    /// Shows the state to the observer.
    pub(super) fn show(&mut self, optimiser: &Optimiser<'_>) {
        let state = optimiser.state();
        let phase_energy = *self.phase_energy.get_or_insert(state.solution.energy);
        self.next = (self.observer)(&Snapshot::new(state, self.steps, phase_energy));
    }

    /// Moves the nodes until the descent has ended. Progress is reported from the fraction `from` to the fraction `to`.
    pub(super) fn move_nodes(
        &mut self,
        optimiser: &mut Optimiser<'_>,
        (from, to): (f64, f64),
        progress: &Progress,
    ) -> Result<(), EmbeddingError> {
        while self.next == Next::Continue && !optimiser.is_done() && !optimiser.least_squares_failed() {
            progress.report("Moving nodes", from + (to - from) * optimiser.share_done());
            let better = optimiser.step(progress)?;
            self.steps += 1;
            if better {
                self.show(optimiser);
            }
        }
        Ok(())
    }

    /// From the end of the least-squares descent to the final embedding.
    pub(super) fn finish(
        mut self,
        problem: &Problem<'_>,
        mut optimiser: Optimiser<'_>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let flipped_after_least_squares = optimiser.state().flipped();
        let rounded = problem.settings.integer.is_some();
        let complete = !problem.layout.patches.is_empty();
        // A failed least-squares map is worth finalising only to complete a partial layout or to round lengths.
        let found = if optimiser.least_squares_failed() && complete && !rounded {
            Err(EmbeddingError::NoInjectiveMap)
        } else {
            self.finalise_least_squares(problem, &mut optimiser, progress)
        };
        let has_no_flips = |done: &OptimisedEmbedding| done.report.remaining_flips.is_empty();
        let mut done = match found {
            Err(EmbeddingError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // The least-squares map completes a partial layout. With rounded lengths, nodes that move on would leave
            // the grid.
            Ok(done) if !complete || (rounded && has_no_flips(&done)) => done,
            found => {
                let start = Optimiser::from_map_of(problem, optimiser, progress);
                match (self.injective_phase(problem, start, progress), found) {
                    (Ok(done), _) => done,
                    (Err(EmbeddingError::Cancelled(cancelled)), _) => return Err(cancelled.into()),
                    (Err(_), Ok(done)) if has_no_flips(&done) => done,
                    (Err(error), found) => {
                        tracing::debug!(%error, "no injective map near that of least squares");
                        self.restart_from_initial_embedding(problem, found, progress)?
                    }
                }
            }
        };
        self.complete_report(&mut done.report);
        done.report.flipped_after_least_squares = flipped_after_least_squares;
        Ok(done)
    }

    /// The embedding of the finalised least-squares map, with the flipped triangles that cannot be removed from it.
    fn finalise_least_squares(
        &mut self,
        problem: &Problem<'_>,
        optimiser: &mut Optimiser<'_>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        if let Some(edge) = problem.settings.integer {
            progress.report("Rounding lengths", 0.35);
            optimiser.round_chord_lengths(edge, progress)?;
            self.show(optimiser);
            self.move_nodes(optimiser, (0.35, 0.4), progress)?;
        }
        progress.report("Removing flipped triangles", 0.4);
        finalise(problem, optimiser, progress)
    }

    /// The result of the injective phase from the initial embedding; if it fails, the earlier result `found`.
    pub(super) fn restart_from_initial_embedding(
        &mut self,
        problem: &Problem<'_>,
        found: Result<OptimisedEmbedding, EmbeddingError>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let start = Optimiser::from_initial_embedding(problem, progress);
        self.injective_phase(problem, start, progress).or_else(|error| match error {
            EmbeddingError::Cancelled(_) => Err(error),
            _ => found,
        })
    }

    /// Adds steps, first energy and first flips to a report.
    pub(super) fn complete_report(&self, report: &mut EmbeddingReport) {
        (report.steps, report.energy_before, report.flipped_before) =
            (self.steps, self.energy_before, self.flipped_before);
    }

    /// Moves the nodes with an injective map. Regular nodes are released for that, since badly placed ones would stop
    /// the descent early. Constraining them again in the end may fail; then the nodes move once more from the start of
    /// the phase with all of them constrained, and if that fails too the start itself is the result.
    pub(super) fn injective_phase(
        &mut self,
        problem: &Problem<'_>,
        start: Result<Result<Optimiser<'_>, Flipped>, EmbeddingError>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let mut optimiser = start?.map_err(|_| EmbeddingError::NoInjectiveMap)?;
        self.phase_energy = None;
        self.show(&optimiser);
        let first = optimiser.state().clone();
        optimiser.release_regular_nodes(problem);
        self.move_nodes(&mut optimiser, (0.5, 0.8), progress)?;
        progress.report("Moving nodes", 0.8);
        match finalise(problem, &mut optimiser, progress) {
            Err(error) if !matches!(error, EmbeddingError::Cancelled(_)) => {
                tracing::debug!(%error, "released nodes cannot be constrained: they move constrained");
                optimiser.restart_constrained(first.clone());
                self.show(&optimiser);
            }
            done => return done,
        }
        self.move_nodes(&mut optimiser, (0.8, 0.85), progress)?;
        match finalise(problem, &mut optimiser, progress) {
            Err(error) if !matches!(error, EmbeddingError::Cancelled(_)) => {
                tracing::debug!(%error, "the first map of the phase is the result");
                extract_embedding(problem, (&first, &optimiser.sharp), &[], progress)
            }
            done => done,
        }
    }
}

/// Ends the phase of an optimiser and extracts its embedding.
fn finalise(
    problem: &Problem<'_>,
    optimiser: &mut Optimiser<'_>,
    progress: &Progress,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    let flipped = optimiser.finalise(progress)?;
    extract_embedding(problem, (optimiser.state(), &optimiser.sharp), &flipped, progress)
}
