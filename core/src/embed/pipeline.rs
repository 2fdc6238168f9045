//! From a rough drawing to the finished embedding: nodes moved, folds removed, arcs traced, patches cut out.

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::collapse::{Collapse, CollapsedChord, ShortChord};
use super::descent::{Optimizer, Settings, Surface};
use super::measures::{Measures, measure_patches};
use super::net::Headings;
use super::solver::State;
use super::trace::{ArcChain, Folds, preview_arcs, trace_arcs};
use super::{EmbeddingError, emerge, headings, map_rectangles};
use crate::layout::{Embedding, PatchMap, QuadLayout, Redrawn};
use crate::mesh::VertexId;
use crate::param::{Fold, FoldReason, Residual, residuals};
use crate::progress::Progress;

/// How far the isolines that complete a partial layout are followed, in square roots of the surface's area: many times
/// around anything, and yet an end.
const LONGEST: f64 = 100.0;

/// A layout to be embedded.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// The layout's structure; without patches where arcs are missing.
    pub layout: &'a QuadLayout,
    /// A rough drawing of it.
    pub drawing: &'a Embedding,
    /// The headings of the arcs' sides in the charts of the regions between them.
    pub headings: &'a [Headings],
    /// Nodes that are to stay where the drawing has them; empty: none.
    pub pinned_nodes: &'a [bool],
    /// Arcs whose ends are to stay where the drawing has them; empty: none. Between its ends an arc is an isoline.
    pub pinned_arcs: &'a [bool],
    /// How to go about it.
    pub settings: Settings,
}

/// The embedding while it is being optimised.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Steps made so far.
    pub step: usize,
    /// The energy of the map.
    pub energy: f64,
    /// Triangles that the map turns over.
    pub flipped: usize,
    /// Where the nodes are.
    pub nodes: Vec<DVec3>,
    /// The arcs as polylines; `None` for those that cannot be followed because of folds.
    pub arcs: Vec<Option<Vec<DVec3>>>,
}

/// Whether to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Go on.
    Continue,
    /// Finish with the best so far.
    Finish,
}

/// A triangle that the map turns over in the end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RemainingFold {
    /// A point in it.
    pub at: [f64; 3],
    /// Why it could not be unfolded.
    pub reason: String,
}

/// What an optimisation has achieved.
#[derive(Debug, Clone, Serialize)]
pub struct EmbeddingReport {
    /// Steps of the nodes.
    pub steps: usize,
    /// Energy of the map over the area of the surface, with the nodes where the drawing had them.
    pub energy_before: f64,
    /// The same in the end.
    pub energy_after: f64,
    /// Triangles turned over at first.
    pub flipped_before: usize,
    /// Triangles turned over when the nodes had come to rest, before folds were removed.
    pub flipped_at_rest: usize,
    /// Those left.
    pub folds: Vec<RemainingFold>,
    /// Chords that were collapsed, in order.
    pub collapsed: Vec<CollapsedChord>,
    /// Chords that were to be collapsed and could not be.
    pub short: Vec<ShortChord>,
    /// Measures of all patches together.
    pub measures: Measures,
}

/// A layout with its optimised embedding.
#[derive(Debug, Clone)]
pub struct Embedded {
    /// The layout; of a partial one, with the arcs and nodes that have emerged after those given.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// Where chords were collapsed, the rough drawing of what was left of the layout.
    pub drawing: Option<Embedding>,
    /// What was achieved.
    pub report: EmbeddingReport,
}

/// Share of the wanted area below which an image is as good as flat.
const FLAT: f64 = 1e-3;

impl State {
    /// Number of triangles that the map turns over, or by more than a right angle away from the field.
    pub fn flipped(&self) -> usize {
        self.folded().iter().filter(|&&f| f).count()
    }

    /// For each triangle whether the map turns it over, or by more than a right angle away from the field.
    pub(super) fn folded(&self) -> Vec<bool> {
        let errors = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        let lengths = |f: usize| self.objective.lengths.get(f).copied().unwrap_or([1.0; 2]);
        let folded = |(f, r): (usize, &Residual)| {
            let [a, b] = lengths(f);
            let (u, v) = (r.u + DVec2::new(a, 0.0), r.v + DVec2::new(0.0, b));
            u.perp_dot(v) <= FLAT * a * b || u.x / a + v.y / b <= 0.0
        };
        errors.iter().enumerate().map(folded).collect()
    }

    /// The energy of least squares of the map.
    fn least_squares(&self) -> f64 {
        let each = residuals(&self.metric, &self.field.angle, &self.solution.map.uv, &self.objective);
        each.iter().map(|r| r.energy).sum()
    }

    fn chains(&self) -> Vec<ArcChain<'_>> {
        let chain = |a: &'_ super::NetArc| (a.start, a.end, a.heading);
        self.net
            .arcs
            .iter()
            .map(|a| {
                let (start, end, heading) = chain(a);
                ArcChain { start, crossed: &a.crossed, end, heading }
            })
            .collect()
    }

    fn vertices(&self) -> Vec<VertexId> {
        self.net.nodes.iter().map(|n| n.vertex).collect()
    }

    fn snapshot(&self, step: usize) -> Snapshot {
        let vertices = self.vertices();
        Snapshot {
            step,
            energy: self.solution.energy,
            flipped: self.flipped(),
            arcs: preview_arcs(&self.net.mesh, &self.solution.map, &vertices, &self.chains()),
            nodes: vertices.iter().map(|&v| self.net.mesh.position(v)).collect(),
        }
    }
}

/// Embeds a layout. `watch` is shown every step that made the embedding better and may ask to finish.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    job: &Job<'_>,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<Embedded, EmbeddingError> {
    progress.report("Embedding the layout", 0.0);
    if std::env::var("PL_NOLS").is_ok() {
        return Course::new(job, watch).unfolded(job, Err(EmbeddingError::Folded), progress);
    }
    let (mut optimizer, mut course) = match Optimizer::new(job, progress) {
        Ok(optimizer) => {
            let course = Course::begin(job, &optimizer, watch);
            (optimizer, course)
        }
        Err(error) => return Course::new(job, watch).unfolded(job, Err(error), progress),
    };
    course.rest(&mut optimizer, MOVING, progress)?;
    let Settings { collapse, simplify, .. } = job.settings;
    if job.layout.patches.is_empty() || (collapse.is_none() && !simplify) {
        return course.finish(job, optimizer, progress);
    }
    let mut shorter = Shorter::none(job);
    let mut chosen = Collapse::new(job.layout, optimizer.stays());
    let one_by_one = Rule { least: f64::INFINITY, worse: 1.0, most: 1, simpler: true };
    let shortest = collapse.map(|least| Rule { least, worse: WORSE, most: job.layout.chords, simpler: false });
    for mut rule in shortest.into_iter().chain(simplify.then_some(one_by_one)) {
        while course.next == Next::Continue {
            let short = shorter.numbers(optimizer.short_chords(rule.least));
            let before = chosen.done.len();
            let count = chosen.choose(short, rule.most, rule.simpler);
            if count == 0 {
                break;
            }
            let most = rule.worse * optimizer.state().solution.energy;
            let tried = chosen.draw(job, progress).map_err(|error| error.to_string());
            progress.check()?;
            let problem = match tried {
                Ok(redrawn) => {
                    shorter = Shorter::new(job, redrawn);
                    optimizer = Optimizer::new(&shorter.job(job), progress)?;
                    course.rest(&mut optimizer, MOVING, progress)?;
                    let energy = optimizer.state().solution.energy;
                    tracing::debug!(gone = chosen.done.len(), energy, most, "chords collapsed");
                    (energy > most)
                        .then(|| format!("the energy would be {:.2} of what it is", rule.worse * energy / most))
                }
                Err(problem) => Some(problem),
            };
            if problem.is_some() {
                // Of several only one may be to blame.
                chosen.take_back(before, problem.as_deref().filter(|_| count == 1));
                rule.most = 1;
                shorter = match before {
                    0 => Shorter::none(job),
                    _ => Shorter::new(job, chosen.draw(job, progress)?),
                };
                optimizer = Optimizer::new(&shorter.job(job), progress)?;
                course.rest(&mut optimizer, MOVING, progress)?;
            } else {
                course.show(&optimizer);
            }
        }
    }
    let mut done = course.finish(&shorter.job(job), optimizer, progress)?;
    (done.report.collapsed, done.report.short) = (chosen.done, chosen.kept);
    done.drawing = shorter.redrawn.map(|r| r.embedding);
    Ok(done)
}

/// From where to where moving nodes brings the progress of the whole.
const MOVING: (f64, f64) = (0.05, 0.35);

/// By what factor the energy may grow when arcs are collapsed that are shorter than was asked for.
const WORSE: f64 = 1.5;

/// Which chords are collapsed.
#[derive(Debug, Clone, Copy)]
struct Rule {
    /// Those shorter than this.
    least: f64,
    /// By what factor the energy may grow.
    worse: f64,
    /// How many at once.
    most: usize,
    /// Whether only those without which the layout is less irregular.
    simpler: bool,
}

/// The course of an optimisation.
struct Course<'w> {
    watch: &'w mut dyn FnMut(&Snapshot) -> Next,
    next: Next,
    steps: usize,
    area: f64,
    energy_before: f64,
    flipped_before: usize,
}

impl<'w> Course<'w> {
    fn new(job: &Job<'_>, watch: &'w mut dyn FnMut(&Snapshot) -> Next) -> Self {
        let area: f64 = job.surface.mesh.faces().map(|f| job.surface.mesh.face_area(f)).sum();
        Self { watch, next: Next::Continue, steps: 0, area, energy_before: f64::NAN, flipped_before: 0 }
    }

    fn begin(job: &Job<'_>, optimizer: &Optimizer<'_>, watch: &'w mut dyn FnMut(&Snapshot) -> Next) -> Self {
        let mut course = Self::new(job, watch);
        course.energy_before = optimizer.state().solution.energy / course.area;
        course.flipped_before = optimizer.state().flipped();
        course.show(optimizer);
        course
    }

    fn show(&mut self, optimizer: &Optimizer<'_>) {
        self.next = (self.watch)(&optimizer.state().snapshot(self.steps));
    }

    /// Moves the nodes until they rest, which is a part of the whole work.
    fn rest(
        &mut self,
        optimizer: &mut Optimizer<'_>,
        (from, to): (f64, f64),
        progress: &Progress,
    ) -> Result<(), EmbeddingError> {
        while self.next == Next::Continue && !optimizer.is_done() && !optimizer.is_hopeless() {
            progress.report("Moving nodes", from + (to - from) * optimizer.share_done());
            let better = optimizer.step(progress)?;
            self.steps += 1;
            if better {
                self.show(optimizer);
            }
        }
        Ok(())
    }

    /// From nodes at rest to the finished embedding.
    fn finish(
        mut self,
        job: &Job<'_>,
        mut optimizer: Optimizer<'_>,
        progress: &Progress,
    ) -> Result<Embedded, EmbeddingError> {
        let flipped_at_rest = optimizer.state().flipped();
        if optimizer.is_hopeless() && !job.layout.patches.is_empty() && job.settings.integer.is_none() {
            let mut done = self.unfolded(job, Err(EmbeddingError::Folded), progress)?;
            done.report.flipped_at_rest = flipped_at_rest;
            return Ok(done);
        }
        if let Some(edge) = job.settings.integer {
            progress.report("Rounding lengths", 0.35);
            optimizer.round(edge, progress)?;
            self.show(&optimizer);
            self.rest(&mut optimizer, (0.35, 0.4), progress)?;
        }
        progress.report("Removing folds", 0.4);
        let found = optimizer.finish(progress).and_then(|folds| {
            let done = finished(job, optimizer.state(), &folds, self.area, progress)?;
            Ok((done, optimizer))
        });
        let mut done = self.unfolded(job, found, progress)?;
        done.report.flipped_at_rest = flipped_at_rest;
        Ok(done)
    }

    /// From what least squares have led to, if anything, to the embedding without folds.
    fn unfolded(
        mut self,
        job: &Job<'_>,
        found: Result<(Embedded, Optimizer<'_>), EmbeddingError>,
        progress: &Progress,
    ) -> Result<Embedded, EmbeddingError> {
        let complete = !job.layout.patches.is_empty();
        let mut done = match found {
            Err(EmbeddingError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Ok((done, _)) if !complete => done,
            // Nodes that move on would leave the grid.
            Ok((done, _)) if job.settings.integer.is_some() && done.report.folds.is_empty() => done,
            Ok((done, optimizer)) if done.report.folds.is_empty() => {
                let start = Optimizer::from_map(job, optimizer.into_parts(), progress);
                self.without_folds(job, start, progress).or_else(|error| match error {
                    EmbeddingError::Cancelled(_) => Err(error),
                    _ => Ok(done),
                })?
            }
            found => {
                let start = Optimizer::from_drawing(job, progress);
                self.without_folds(job, start, progress).or_else(|error| match error {
                    EmbeddingError::Cancelled(_) => Err(error),
                    _ => Ok(found?.0),
                })?
            }
        };
        let report = &mut done.report;
        (report.steps, report.energy_before, report.flipped_before) =
            (self.steps, self.energy_before, self.flipped_before);
        Ok(done)
    }

    /// Moves the nodes with a map that never folds.
    fn without_folds(
        &mut self,
        job: &Job<'_>,
        start: Result<Option<Optimizer<'_>>, EmbeddingError>,
        progress: &Progress,
    ) -> Result<Embedded, EmbeddingError> {
        let mut optimizer = start?.ok_or(EmbeddingError::Folded)?;
        self.show(&optimizer);
        let safe = optimizer.state().clone();
        optimizer.release(job);
        self.rest(&mut optimizer, (0.5, 0.85), progress)?;
        progress.report("Moving nodes", 0.85);
        let moved = optimizer.finish(progress).and_then(|folds| {
            finished(job, optimizer.state(), &folds, self.area, progress)
        });
        match moved {
            Err(error) if !matches!(error, EmbeddingError::Cancelled(_)) => {
                tracing::debug!(%error, "nodes stay where they were");
                finished(job, &safe, &[], self.area, progress)
            }
            done => done,
        }
    }
}

/// What is left of a job's layout without the chords that were collapsed.
struct Shorter {
    /// `None` as long as none was.
    redrawn: Option<Redrawn>,
    headings: Vec<Headings>,
    pinned_nodes: Vec<bool>,
    pinned_arcs: Vec<bool>,
}

impl Shorter {
    fn none(job: &Job<'_>) -> Self {
        Self {
            redrawn: None,
            headings: job.headings.to_vec(),
            pinned_nodes: job.pinned_nodes.to_vec(),
            pinned_arcs: job.pinned_arcs.to_vec(),
        }
    }

    fn new(job: &Job<'_>, redrawn: Redrawn) -> Self {
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

    fn job<'s>(&'s self, job: &Job<'s>) -> Job<'s> {
        let (layout, drawing) = self.redrawn.as_ref().map_or((job.layout, job.drawing), |r| (&r.layout, &r.embedding));
        let Self { headings, pinned_nodes, pinned_arcs, .. } = self;
        Job { layout, drawing, headings, pinned_nodes, pinned_arcs, ..*job }
    }

    /// The same chords, by their numbers in the layout that was given.
    fn numbers(&self, chords: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
        let Some(redrawn) = &self.redrawn else { return chords };
        let before = |chord: u32| redrawn.chords.iter().position(|&c| c == Some(chord));
        chords.into_iter().filter_map(|(c, length)| Some((before(c)? as u32, length))).collect()
    }
}

/// Arcs and patches of a map that is done. The report lacks what happened before.
fn finished(
    job: &Job<'_>,
    state: &State,
    folds: &[Fold],
    area: f64,
    progress: &Progress,
) -> Result<Embedded, EmbeddingError> {
    progress.report("Tracing arcs", 0.9);
    let strict = if folds.is_empty() { Folds::Refuse } else { Folds::Cross };
    let (mesh, map) = (&state.net.mesh, &state.solution.map);
    let (layout, traced) = if job.layout.patches.is_empty() {
        let emerged = emerge(mesh, map, &state.vertices(), LONGEST * area.sqrt())?;
        (emerged.layout, emerged.traced)
    } else {
        (job.layout.clone(), trace_arcs(mesh, map, job.layout, &state.vertices(), &state.chains(), strict)?)
    };
    progress.report("Cutting out patches", 0.95);
    let mut maps = map_rectangles(&layout, &traced, progress)?;
    let bending = super::face_curvature(job.surface.mesh, job.surface.curvature, |_| true);
    let mut embedding = traced.embedding;
    // Triangles of the working mesh lie in triangles of the surface.
    let base = |f: &mut u32| *f = state.net.base_face[*f as usize].0;
    embedding.base_face.iter_mut().for_each(base);
    maps.iter_mut().flat_map(|m| &mut m.base_face).for_each(base);
    let (measures, _, _) = measure_patches(&maps, &bending);
    let place = |f: u32| {
        let corners = mesh.face_vertices(crate::mesh::FaceId(f)).map(|v| mesh.position(v));
        ((corners[0] + corners[1] + corners[2]) / 3.0).to_array()
    };
    let reason = |r: FoldReason| match r {
        FoldReason::HighValence { quarters, triangles, .. } => {
            format!("{triangles} triangles cannot span the {quarters} quarter turns around their node")
        }
        FoldReason::Fixed => "the constraints leave it no choice".to_owned(),
        FoldReason::NotResolved => "no map without this fold was found".to_owned(),
    };
    let report = EmbeddingReport {
        steps: 0,
        energy_before: 0.0,
        energy_after: state.least_squares() / area,
        flipped_before: 0,
        flipped_at_rest: 0,
        folds: folds.iter().map(|f| RemainingFold { at: place(f.triangle), reason: reason(f.reason) }).collect(),
        collapsed: Vec::new(),
        short: Vec::new(),
        measures,
    };
    Ok(Embedded { layout, embedding, maps, drawing: None, report })
}
