//! The course of an optimisation: nodes move, folds go, arcs are traced and patches cut out.
//!
//! Least squares come first: their steps are cheap and find where features can be held. What they end with, untangled if it
//! folds, is where maps that never fold go on from; where it cannot be untangled these start from the drawing.

use crate::embed::EmbeddingError;
use crate::embed::map_rectangles;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::quality::measure_patches;
use crate::embed::parameterise::solve::Folded;
use crate::embed::parameterise::state::State;
use crate::embed::problem::{EmbeddingReport, Next, OptimisedEmbedding, Problem, RemainingFlip, Settings, Snapshot};
use crate::embed::trace::arcs::{FlippedTriangles, trace_arcs};
use crate::embed::trace::completion::complete_layout;
use crate::mesh::FaceId;
use crate::param::{FlipReason, FlippedTriangle};
use crate::progress::Progress;

/// How far the isolines that complete a partial layout are followed, in square roots of the surface's area: many times
/// around anything, and yet an end.
const LONGEST: f64 = 100.0;

/// The course of an optimisation.
pub(in crate::embed) struct Course<'w> {
    watch: &'w mut dyn FnMut(&Snapshot) -> Next,
    pub next: Next,
    steps: usize,
    area: f64,
    energy_before: f64,
    flipped_before: usize,
    /// The energy with which the present phase began.
    first: Option<f64>,
}

impl<'w> Course<'w> {
    pub(in crate::embed) fn new(job: &Problem<'_>, watch: &'w mut dyn FnMut(&Snapshot) -> Next) -> Self {
        let area: f64 = job.surface.mesh.faces().map(|f| job.surface.mesh.face_area(f)).sum();
        Self { watch, next: Next::Continue, steps: 0, area, energy_before: f64::NAN, flipped_before: 0, first: None }
    }

    pub(in crate::embed) fn begin(
        job: &Problem<'_>,
        optimiser: &Optimiser<'_>,
        watch: &'w mut dyn FnMut(&Snapshot) -> Next,
    ) -> Self {
        let mut course = Self::new(job, watch);
        course.energy_before = optimiser.state().solution.energy / course.area;
        course.flipped_before = optimiser.state().flipped();
        course.show(optimiser);
        course
    }

    /// The course that goes on on another mesh.
    pub(in crate::embed) fn going_on(
        job: &Problem<'_>,
        report: &EmbeddingReport,
        watch: &'w mut dyn FnMut(&Snapshot) -> Next,
    ) -> Self {
        let EmbeddingReport { steps, energy_before, flipped_before, .. } = *report;
        Self { steps, energy_before, flipped_before, ..Self::new(job, watch) }
    }

    pub(in crate::embed) fn show(&mut self, optimiser: &Optimiser<'_>) {
        let state = optimiser.state();
        let first = *self.first.get_or_insert(state.solution.energy);
        self.next = (self.watch)(&state.snapshot(self.steps, first));
    }

    /// Moves the nodes until they rest, which is a part of the whole work.
    pub(in crate::embed) fn rest(
        &mut self,
        optimiser: &mut Optimiser<'_>,
        (from, to): (f64, f64),
        progress: &Progress,
    ) -> Result<(), EmbeddingError> {
        while self.next == Next::Continue && !optimiser.is_done() && !optimiser.is_hopeless() {
            progress.report("Moving nodes", from + (to - from) * optimiser.share_done());
            let better = optimiser.step(progress)?;
            self.steps += 1;
            if better {
                self.show(optimiser);
            }
        }
        Ok(())
    }

    /// From nodes at rest to the finished embedding.
    pub(in crate::embed) fn finish(
        mut self,
        job: &Problem<'_>,
        mut optimiser: Optimiser<'_>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let flipped_at_rest = optimiser.state().flipped();
        let Settings { integer, .. } = job.settings;
        let complete = !job.layout.patches.is_empty();
        let found = if optimiser.is_hopeless() && complete && integer.is_none() {
            Err(EmbeddingError::Folded)
        } else {
            self.least_squares(job, &mut optimiser, progress)
        };
        let is_whole = |done: &OptimisedEmbedding| done.report.folds.is_empty();
        let mut done = match found {
            Err(EmbeddingError::Cancelled(cancelled)) => return Err(cancelled.into()),
            // Nodes that move on would leave the grid.
            Ok(done) if !complete || (integer.is_some() && is_whole(&done)) => done,
            found => {
                let start = Optimiser::from_map(job, optimiser.into_parts(), progress);
                match (self.without_folds(job, start, progress), found) {
                    (Ok(done), _) => done,
                    (Err(EmbeddingError::Cancelled(cancelled)), _) => return Err(cancelled.into()),
                    (Err(_), Ok(done)) if is_whole(&done) => done,
                    (Err(error), found) => {
                        tracing::debug!(%error, "no map without folds near that of least squares");
                        self.drawing_unfolded(job, found, progress)?
                    }
                }
            }
        };
        self.enter(&mut done.report);
        done.report.flipped_at_rest = flipped_at_rest;
        Ok(done)
    }

    /// The embedding that least squares lead to, with the folds that cannot be removed from it.
    fn least_squares(
        &mut self,
        job: &Problem<'_>,
        optimiser: &mut Optimiser<'_>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        if let Some(edge) = job.settings.integer {
            progress.report("Rounding lengths", 0.35);
            optimiser.round(edge, progress)?;
            self.show(optimiser);
            self.rest(optimiser, (0.35, 0.4), progress)?;
        }
        progress.report("Removing folds", 0.4);
        let folds = optimiser.finish(progress)?;
        finished(job, (optimiser.state(), &optimiser.sharp), &folds, self.area, progress)
    }

    /// The embedding without folds that the drawing leads to; if there is none, what was found before.
    pub(in crate::embed) fn drawing_unfolded(
        &mut self,
        job: &Problem<'_>,
        found: Result<OptimisedEmbedding, EmbeddingError>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let start = Optimiser::from_drawing(job, progress);
        self.without_folds(job, start, progress).or_else(|error| match error {
            EmbeddingError::Cancelled(_) => Err(error),
            _ => found,
        })
    }

    /// Enters into a report what happened on the way.
    pub(in crate::embed) fn enter(&self, report: &mut EmbeddingReport) {
        (report.steps, report.energy_before, report.flipped_before) =
            (self.steps, self.energy_before, self.flipped_before);
    }

    /// Moves the nodes with a map that never folds.
    pub(in crate::embed) fn without_folds(
        &mut self,
        job: &Problem<'_>,
        start: Result<Result<Optimiser<'_>, Folded>, EmbeddingError>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let mut optimiser = start?.map_err(|_| EmbeddingError::Folded)?;
        self.first = None;
        self.show(&optimiser);
        let safe = optimiser.state().clone();
        optimiser.release(job);
        self.rest(&mut optimiser, (0.5, 0.8), progress)?;
        progress.report("Moving nodes", 0.8);
        match self.held(job, &mut optimiser, progress) {
            Err(error) if !matches!(error, EmbeddingError::Cancelled(_)) => {
                tracing::debug!(%error, "nodes that were released cannot be held: they move held");
                optimiser.begin_held(safe.clone());
                self.show(&optimiser);
            }
            done => return done,
        }
        self.rest(&mut optimiser, (0.8, 0.85), progress)?;
        match self.held(job, &mut optimiser, progress) {
            Err(error) if !matches!(error, EmbeddingError::Cancelled(_)) => {
                tracing::debug!(%error, "nodes stay where they were");
                finished(job, (&safe, &optimiser.sharp), &[], self.area, progress)
            }
            done => done,
        }
    }

    /// The embedding with all nodes held on their isolines.
    fn held(
        &self,
        job: &Problem<'_>,
        optimiser: &mut Optimiser<'_>,
        progress: &Progress,
    ) -> Result<OptimisedEmbedding, EmbeddingError> {
        let folds = optimiser.finish(progress)?;
        finished(job, (optimiser.state(), &optimiser.sharp), &folds, self.area, progress)
    }
}

/// Arcs and patches of a map that is done. The report lacks what happened before.
fn finished(
    job: &Problem<'_>,
    (state, sharp): (&State, &[bool]),
    folds: &[FlippedTriangle],
    area: f64,
    progress: &Progress,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    progress.report("Tracing arcs", 0.9);
    let strict = if folds.is_empty() { FlippedTriangles::Refuse } else { FlippedTriangles::Cross };
    let (mesh, map) = (&state.net.mesh, &state.solution.map);
    let (layout, traced) = if job.layout.patches.is_empty() {
        let emerged = complete_layout(mesh, map, &state.vertices(), LONGEST * area.sqrt())?;
        (emerged.layout, emerged.traced)
    } else {
        (job.layout.clone(), trace_arcs(mesh, map, job.layout, &state.vertices(), &state.chains(), strict)?)
    };
    progress.report("Cutting out patches", 0.95);
    let mut maps = map_rectangles(&layout, &traced, progress)?;
    let bending = crate::surface::face_curvature(job.surface.mesh, job.surface.curvature, |_| true);
    let mut embedding = traced.embedding;
    // Triangles of the working mesh lie in triangles of the surface.
    let base = |f: &mut u32| *f = state.net.base_face[*f as usize].0;
    embedding.base_face.iter_mut().for_each(base);
    maps.iter_mut().flat_map(|m| &mut m.base_face).for_each(base);
    let (measures, _, _) = measure_patches(&maps, &bending);
    let place = |f: u32| {
        let corners = mesh.face_vertices(FaceId(f)).map(|v| mesh.position(v));
        ((corners[0] + corners[1] + corners[2]) / 3.0).to_array()
    };
    let reason = |r: FlipReason| match r {
        FlipReason::HighValence { quarters, triangles, .. } => {
            format!("{triangles} triangles cannot span the {quarters} quarter turns around their node")
        }
        FlipReason::Fixed => "the constraints leave it no choice".to_owned(),
        FlipReason::NotResolved => "no map without this fold was found".to_owned(),
    };
    let report = EmbeddingReport {
        steps: 0,
        energy_before: 0.0,
        energy_after: state.least_squares() / area,
        flipped_before: 0,
        flipped_at_rest: 0,
        folds: folds.iter().map(|f| RemainingFlip { at: place(f.triangle), reason: reason(f.reason) }).collect(),
        collapsed: Vec::new(),
        short: Vec::new(),
        features: state.features(sharp),
        measures,
    };
    Ok(OptimisedEmbedding { layout, embedding, maps, initial_embedding: None, report })
}
