//! From a layout with its initial embedding to quads: optimised, mapped patch by patch, refined.
//!
//! If the optimisation fails or does not lower the distortion, the initial embedding with harmonic patch maps is used
//! instead, and the result contains the reason.

use std::time::Instant;

use crate::embed::{self, EmbeddingError, EmbeddingReport, Measures, OptimisedEmbedding, Problem, Settings};
use crate::layout::{Embedding, PatchMap, QuadLayout, map_patches};
use crate::progress::Progress;
use crate::quad::{Spacing, adaptive_spacing, integer_grid_counts};
use crate::surface::second_fundamental_form;
use crate::weave::embedding::InitialLayout;
use crate::weave::error::WeaveError;
use crate::weave::export::input::{CollapseLength, EmbeddingInput, ExportOptions, QuadSize, Watch};
use crate::weave::export::quads::quads;
use crate::weave::export::result::{Export, InitialState, Times};

/// Embeds a layout, or takes the given optimised embedding, and refines it to quads.
///
/// # Errors
///
/// When cancelled; [`WeaveError::Incomplete`] or the error of the optimisation for a layout with missing arcs, which only an
/// optimised map completes; or when the patches of the initial embedding cannot be mapped.
pub fn embed_and_refine(
    input: &EmbeddingInput<'_>,
    optimised: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    let mut seconds = Times::new();
    let start = Instant::now();
    let given = optimised.is_some();
    let result = match optimised {
        Some(embedding) => Some(Ok(embedding.clone())),
        None => optimise(input, options, progress, watch),
    };
    progress.check()?;
    seconds.insert("embed".to_owned(), start.elapsed().as_secs_f64());
    progress.report("Mapping patches", 0.95);
    let start = Instant::now();
    let mapped = MappedLayout::choose(input, result, given, progress)?;
    let spacing = mapped.spacing(input, options, given, progress)?;
    let MappedLayout { layout, embedding, maps, optimised, initial } = mapped;
    let done = matches!(optimised, Some(Ok(_)));
    let quads = quads(input, (&layout, &embedding, &maps), done, &spacing, progress)?;
    seconds.insert("refine".to_owned(), start.elapsed().as_secs_f64());
    progress.report("Done", 1.0);
    Ok(Export { layout, embedding, mesh_role: input.initial.mesh_role, maps, quads, optimised, initial, seconds })
}

/// The optimised embedding, or why there is none; `None` if the options ask for none.
fn optimise(
    input: &EmbeddingInput<'_>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Option<Result<OptimisedEmbedding, EmbeddingError>> {
    let settings = options.embedding?;
    let edge = input.edge_length(options.size);
    let settings = Settings {
        integer: options.integer.then_some(edge),
        simplify: options.simplify,
        collapse: options.collapse.map(|shortest| match shortest {
            CollapseLength::Quad => edge,
            CollapseLength::Length(length) => length / input.units.scale,
        }),
        ..settings
    };
    let problem = Problem {
        surface: input.surface,
        layout: &input.initial.layout,
        initial_embedding: &input.initial.embedding,
        arc_headings: input.arc_headings,
        pinned_nodes: &input.pinned.nodes,
        pinned_arcs: &input.pinned.arcs,
        settings,
    };
    Some(embed::optimise_embedding(&problem, progress, watch))
}

/// An embedded layout with the maps of its patches.
struct MappedLayout {
    layout: QuadLayout,
    embedding: Embedding,
    maps: Vec<PatchMap>,
    /// The report of the optimisation, or why the initial embedding was chosen; `None` without an optimisation.
    optimised: Option<Result<EmbeddingReport, String>>,
    initial: InitialState,
}

impl MappedLayout {
    /// The optimised embedding with its maps, or the initial one with harmonic patch maps if there is no optimised one or
    /// its distortion is no lower. A `given` optimised embedding is taken in any case.
    fn choose(
        input: &EmbeddingInput<'_>,
        optimised: Option<Result<OptimisedEmbedding, EmbeddingError>>,
        given: bool,
        progress: &Progress,
    ) -> Result<Self, WeaveError> {
        let InitialLayout { layout, embedding: initial_embedding, .. } = input.initial;
        // A layout without patches lacks arcs.
        let harmonic = (!layout.patches.is_empty()).then(|| map_patches(layout, initial_embedding, progress));
        progress.check()?;
        let harmonic_maps = harmonic.as_ref().and_then(|maps| maps.as_deref().ok());
        let mut initial = InitialState::new(initial_embedding, harmonic_maps, &input.surface);
        let found = optimised.as_ref().and_then(|o| o.as_ref().ok()).filter(|_| !given);
        let rejection = found.and_then(|e| no_better(&e.report, initial.measures.as_ref()));
        let (layout, embedding, maps, optimised) = match (optimised, harmonic) {
            (Some(Ok(_)), Some(Ok(maps))) if rejection.is_some() => {
                (layout.clone(), initial_embedding.clone(), maps, rejection.map(Err))
            }
            (Some(Ok(e)), _) => {
                // Without its collapsed chords the layout has another initial embedding.
                initial.initial_embedding = e.initial_embedding.unwrap_or(initial.initial_embedding);
                (e.layout, e.embedding, e.maps, Some(Ok(e.report)))
            }
            (Some(Err(error)), None) => return Err(error.into()),
            (None, None) => return Err(WeaveError::Incomplete),
            (failed, Some(maps)) => {
                let failure = failed.and_then(Result::err).map(|error| Err(error.to_string()));
                (layout.clone(), initial_embedding.clone(), maps?, failure)
            }
        };
        Ok(Self { layout, embedding, maps, optimised, initial })
    }

    /// The spacing of isolines: uniform in an integer-grid map, else adapted to the curvature and the resampling error.
    fn spacing(
        &self,
        input: &EmbeddingInput<'_>,
        options: &ExportOptions,
        given: bool,
        progress: &Progress,
    ) -> Result<Spacing, WeaveError> {
        let Self { layout, embedding, maps, .. } = self;
        let edge = input.edge_length(options.size);
        if matches!(self.optimised, Some(Ok(_))) && options.integer && !given {
            let (counts, off) = integer_grid_counts(layout, maps, edge);
            tracing::debug!(off, "sides of patches rounded to integers");
            return Ok(Spacing::even(layout, &counts));
        }
        let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
        let number = match options.size {
            QuadSize::EdgeLength(_) => area / (edge * edge),
            QuadSize::Count(n) => f64::from(n),
        };
        let normal_curvature =
            |base: u32, along| second_fundamental_form(&self.initial.face_curvature[base as usize], along, along).abs();
        let spacing = Spacing::curvature_adapted(layout, maps, normal_curvature, number);
        Ok(adaptive_spacing(spacing, (layout, embedding, maps), input.surface.mesh, progress)?)
    }
}

/// Why an optimised embedding is no better than the initial one, if so.
fn no_better(report: &EmbeddingReport, initial: Option<&Measures>) -> Option<String> {
    let (before, after) = (initial?.conformal, report.measures.conformal);
    (after >= before).then(|| {
        format!(
            "the conformal distortion of the optimised map, {after:.2}, is no lower than that of the initial embedding, \
             {before:.2}"
        )
    })
}
