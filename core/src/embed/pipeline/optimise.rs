//! Optimising the embedding of a layout, with chords collapsed where that is asked for.

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::pipeline::chord_collapse::Collapse;
use crate::embed::pipeline::coarse_to_fine::coarse_to_fine;
use crate::embed::pipeline::phases::Course;
use crate::embed::pipeline::reduced_problem::Shorter;
use crate::embed::problem::{Next, OptimisedEmbedding, Problem, Settings, Snapshot};
use crate::progress::Progress;

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

/// Embeds a layout. `watch` is shown every step that made the embedding better and may ask to finish.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    job: &Problem<'_>,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    if let Some(done) = coarse_to_fine(job, progress, watch)? {
        return Ok(done);
    }
    progress.report("Embedding the layout", 0.0);
    let (mut optimiser, mut course) = match Optimiser::new(job, progress) {
        Ok(optimiser) => {
            let course = Course::begin(job, &optimiser, watch);
            (optimiser, course)
        }
        Err(error) => {
            let mut course = Course::new(job, watch);
            let mut done = course.drawing_unfolded(job, Err(error), progress)?;
            course.enter(&mut done.report);
            return Ok(done);
        }
    };
    course.rest(&mut optimiser, MOVING, progress)?;
    let Settings { collapse, simplify, .. } = job.settings;
    if job.layout.patches.is_empty() || (collapse.is_none() && !simplify) {
        return course.finish(job, optimiser, progress);
    }
    let mut shorter = Shorter::none(job);
    let mut chosen = Collapse::new(job.layout, optimiser.stays());
    let one_by_one = Rule { least: f64::INFINITY, worse: 1.0, most: 1, simpler: true };
    let shortest = collapse.map(|least| Rule { least, worse: WORSE, most: job.layout.chords, simpler: false });
    for mut rule in shortest.into_iter().chain(simplify.then_some(one_by_one)) {
        while course.next == Next::Continue {
            let short = shorter.numbers(optimiser.short_chords(rule.least));
            let before = chosen.done.len();
            let count = chosen.choose(short, rule.most, rule.simpler);
            if count == 0 {
                break;
            }
            let most = rule.worse * optimiser.state().solution.energy;
            let tried = chosen.draw(job, progress).map_err(|error| error.to_string());
            progress.check()?;
            let problem = match tried {
                Ok(redrawn) => {
                    shorter = Shorter::new(job, redrawn);
                    optimiser = Optimiser::new(&shorter.job(job), progress)?;
                    course.rest(&mut optimiser, MOVING, progress)?;
                    let energy = optimiser.state().solution.energy;
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
                optimiser = Optimiser::new(&shorter.job(job), progress)?;
                course.rest(&mut optimiser, MOVING, progress)?;
            } else {
                course.show(&optimiser);
            }
        }
    }
    let mut done = course.finish(&shorter.job(job), optimiser, progress)?;
    (done.report.collapsed, done.report.short) = (chosen.done, chosen.kept);
    done.initial_embedding = shorter.redrawn.map(|r| r.embedding);
    Ok(done)
}
