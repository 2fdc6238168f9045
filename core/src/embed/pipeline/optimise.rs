//! Optimisation on one mesh: the phases, and chord collapse where it is asked for (Campen, section 6.9).
//!
//! Short chords are collapsed after the least-squares descent: the layout without them is embedded and its nodes are
//! moved anew. If the energy rises too much, or the remaining layout cannot be embedded, the collapse is undone.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::pipeline::chord_collapse::ChordCollapse;
use crate::embed::pipeline::phases::{Observer, Phases};
use crate::embed::pipeline::reduced_problem::ReducedProblem;
use crate::embed::pipeline::report::{Next, OptimisedEmbedding};
use crate::embed::problem::{Problem, Settings};
use crate::progress::Progress;

/// Fractions of the whole optimisation at which the least-squares descent is reported to begin and end, 0 to 1.
const DESCENT_FRACTIONS: (f64, f64) = (0.05, 0.35);
/// Largest factor by which the energy may grow when chords below the asked length are collapsed: without a bound a
/// collapse could distort the whole map. Chosen by hand.
const ENERGY_GROWTH: f64 = 1.5;

/// Which chords are collapsed.
#[derive(Debug, Clone, Copy)]
struct CollapseRule {
    /// Length in the map below which a chord is collapsed.
    below: f64,
    /// Largest factor by which the energy may grow.
    energy_growth: f64,
    /// Largest number of chords collapsed at once.
    at_once: usize,
    /// Whether only chords are collapsed without which the layout is less irregular.
    only_simpler: bool,
}

/// Embeds a layout on the mesh of the problem. `observer` is shown every improvement and may ask to finish.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub(super) fn optimise_on_mesh(
    problem: &Problem<'_>,
    progress: &Progress,
    observer: Observer<'_>,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    progress.report("Embedding the layout", 0.0);
    let mut optimiser = match Optimiser::new(problem, progress) {
        Ok(optimiser) => optimiser,
        // The injective phase from the initial embedding works on another mesh, cut along the arcs, and may succeed.
        Err(error) => {
            let mut phases = Phases::new(problem, observer);
            let mut done = phases.restart_from_initial_embedding(problem, Err(error), progress)?;
            phases.complete_report(&mut done.report);
            return Ok(done);
        }
    };
    let mut phases = Phases::begin(problem, &optimiser, observer);
    phases.move_nodes(&mut optimiser, DESCENT_FRACTIONS, progress)?;
    let Settings { collapse, simplify, .. } = problem.settings;
    if problem.layout.patches.is_empty() || (collapse.is_none() && !simplify) {
        phases.finish(problem, optimiser, progress)
    } else {
        finish_with_collapse(problem, optimiser, phases, progress)
    }
}

/// Collapses chords as the settings ask for, then finishes the optimisation.
fn finish_with_collapse(
    problem: &Problem<'_>,
    optimiser: Optimiser<'_>,
    mut phases: Phases<'_>,
    progress: &Progress,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    let mut collapse = ChordCollapse::new(problem.layout, optimiser.fixed_nodes());
    let mut reduced = ReducedProblem::unchanged(problem);
    // Declared after the problem that later optimisers borrow.
    let mut optimiser = optimiser;
    for mut rule in collapse_rules(problem) {
        while phases.next == Next::Continue {
            let short = reduced.original_indices(optimiser.short_chords(rule.below));
            let before = collapse.collapsed.len();
            let count = collapse.choose(short, rule.at_once, rule.only_simpler);
            if count == 0 {
                break;
            }
            let limit = rule.energy_growth * optimiser.state().solution.energy;
            let tried = collapse.reembed(problem, progress).map_err(|error| error.to_string());
            progress.check()?;
            let failure = match tried {
                Ok(reembedded) => {
                    reduced = ReducedProblem::new(problem, reembedded);
                    optimiser = moved_optimiser(&reduced.problem(problem), &mut phases, progress)?;
                    let energy = optimiser.state().solution.energy;
                    tracing::debug!(collapsed = collapse.collapsed.len(), energy, limit, "chords collapsed");
                    (energy > limit).then(|| {
                        format!("the energy would grow by a factor of {:.2}", rule.energy_growth * energy / limit)
                    })
                }
                Err(failure) => Some(failure),
            };
            if failure.is_some() {
                // Of several chords only one may be to blame: none is excluded, and from now on they are tried one by
                // one.
                collapse.undo(before, failure.as_deref().filter(|_| count == 1));
                rule.at_once = 1;
                reduced = match before {
                    0 => ReducedProblem::unchanged(problem),
                    _ => ReducedProblem::new(problem, collapse.reembed(problem, progress)?),
                };
                optimiser = moved_optimiser(&reduced.problem(problem), &mut phases, progress)?;
            } else {
                phases.show(&optimiser);
            }
        }
    }
    let mut done = phases.finish(&reduced.problem(problem), optimiser, progress)?;
    (done.report.collapsed_chords, done.report.uncollapsed_chords) = (collapse.collapsed, collapse.uncollapsed);
    done.initial_embedding = reduced.reembedded.map(|r| r.embedding);
    Ok(done)
}

/// The rules of the settings: first chords below the asked length, then chords one by one to simplify the layout.
fn collapse_rules(problem: &Problem<'_>) -> impl Iterator<Item = CollapseRule> + use<> {
    let Settings { collapse, simplify, .. } = problem.settings;
    let at_once = problem.layout.chords;
    let short =
        collapse.map(|below| CollapseRule { below, energy_growth: ENERGY_GROWTH, at_once, only_simpler: false });
    let simplifying = CollapseRule { below: f64::INFINITY, energy_growth: 1.0, at_once: 1, only_simpler: true };
    short.into_iter().chain(simplify.then_some(simplifying))
}

/// A new optimiser after its least-squares descent.
fn moved_optimiser<'a>(
    problem: &Problem<'a>,
    phases: &mut Phases<'_>,
    progress: &Progress,
) -> Result<Optimiser<'a>, EmbeddingError> {
    let mut optimiser = Optimiser::new(problem, progress)?;
    phases.move_nodes(&mut optimiser, DESCENT_FRACTIONS, progress)?;
    Ok(optimiser)
}
