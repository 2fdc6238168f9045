//! What `plait weave` and `plait embed` write: export options, the summary line, messages.

use std::io::Write as _;

use anyhow::Context as _;
use plait_core::embed::Settings;
use plait_core::weave::{CollapseLength, Export, ExportOptions, QuadSize, Session, WeaveError};

use super::arguments::options::{RefineArguments, SizeArguments};

/// Prints a line to standard error. Results go to files.
pub(super) fn print_message(line: &str) {
    drop(writeln!(std::io::stderr(), "{line}"));
}

/// The export options of the command line. `embedding: None` exports the initial embedding.
///
/// # Errors
///
/// When a length is not positive.
pub(super) fn export_options(
    size: SizeArguments,
    refine: RefineArguments,
    embedding: Option<Settings>,
) -> anyhow::Result<ExportOptions> {
    let collapse = match refine.collapse {
        None => None,
        Some(None) => Some(CollapseLength::Quad),
        Some(Some(length)) if length.is_finite() && length > 0.0 => Some(CollapseLength::Length(length)),
        Some(Some(length)) => anyhow::bail!("--collapse needs a positive length, not {length}"),
    };
    Ok(ExportOptions {
        size: quad_size(size)?,
        embedding,
        integer: refine.integer,
        simplify: refine.simplify,
        collapse,
    })
}

fn quad_size(arguments: SizeArguments) -> anyhow::Result<QuadSize> {
    Ok(match (arguments.edge_length, arguments.quads) {
        (Some(length), _) if length.is_finite() && length > 0.0 => QuadSize::EdgeLength(length),
        (Some(length), _) => anyhow::bail!("--edge-length must be positive, not {length}"),
        (None, Some(n)) => QuadSize::Count(u32::try_from(n).context("--quads is too large")?),
        (None, None) => ExportOptions::default().size,
    })
}

/// The exported layout in one line: its size, its embedding, its quality.
pub(super) fn summary(export: &Export) -> String {
    let layout = &export.layout;
    let mut text = format!(
        "{} patches, {} nodes ({} irregular), {} quads",
        layout.patches.len(),
        layout.nodes.len(),
        layout.n_irregular(),
        export.quads.quads.len()
    );
    if let Some(Ok(report)) = &export.optimised {
        let (before, after) = (report.energy_before, report.energy_after);
        text += &format!(", energy {before:.4} to {after:.4} in {} steps", report.steps);
        if !report.collapsed_chords.is_empty() {
            text += &format!(", {} chords collapsed", report.collapsed_chords.len());
        }
        if report.features.total > 0 {
            text +=
                &format!(", {} of {} feature edges on isolines", report.features.on_isolines, report.features.total);
        }
    }
    let m = export.measures();
    text += &format!(
        ", {} flipped triangles, conformal distortion {:.3}, planarity error {:.3}, alignment error {:.2}°",
        m.flipped, m.conformal, m.planar, m.alignment
    );
    if let (Some(Ok(_)), Some(b)) = (&export.optimised, export.initial.measures) {
        text += &format!(" (initial embedding: {:.3}, {:.3}, {:.2}°)", b.conformal, b.planar, b.alignment);
    }
    text
}

/// The error, with the findings of every red region.
pub(super) fn explain(session: &Session, error: WeaveError) -> anyhow::Error {
    let mut text = format!("no layout was written: {error}");
    for region in session.woven().red() {
        let report = &session.woven().reports[region as usize];
        let reasons: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
        text += &format!("\n  region {region}: {}", reasons.join("; "));
    }
    anyhow::anyhow!(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_SIZE: SizeArguments = SizeArguments { edge_length: None, quads: None };
    const NO_CHANGE: RefineArguments = RefineArguments { integer: false, simplify: false, collapse: None };

    #[test]
    fn lengths_must_be_positive() {
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let size = SizeArguments { edge_length: Some(length), ..NO_SIZE };
            assert!(export_options(size, NO_CHANGE, None).is_err(), "{length}");
            let refine = RefineArguments { collapse: Some(Some(length)), ..NO_CHANGE };
            assert!(export_options(NO_SIZE, refine, None).is_err(), "{length}");
        }
    }

    #[test]
    fn collapse_without_a_length_is_by_the_edge_of_a_quad() {
        let refine = RefineArguments { collapse: Some(None), ..NO_CHANGE };
        let options = export_options(NO_SIZE, refine, None).unwrap();
        assert!(matches!(options.collapse, Some(CollapseLength::Quad)));
    }
}
