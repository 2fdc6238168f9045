//! `plait embed`: optimises the embedding of a design's layout, or of one from a layout file, and writes it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Instant;

use anyhow::Context as _;
use plait_core::embed::{Next, Settings, Snapshot};
use plait_core::progress::Progress;
use plait_core::weave::{Export, OpenedLayout, Session, Times, initial_layout, write_all};

use super::weave::{explain, export_options, open, say};
use super::{DetailArguments, EmbedArguments, has_extension};

/// Embeds and writes into the folder.
///
/// # Errors
///
/// When the input cannot be read, the layout is not valid or could not be embedded, or a file cannot be written.
pub fn run(arguments: &EmbedArguments) -> anyhow::Result<()> {
    let options = export_options(arguments.size, arguments.refine, Some(settings(arguments)?))?;
    let start = Instant::now();
    let interrupt = Interrupt::listen()?;
    let progress = &*interrupt.progress;
    let mut watch = |snapshot: &Snapshot| {
        if !arguments.quiet {
            let Snapshot { step, flipped, energy, .. } = snapshot;
            let percent = 100.0 * energy;
            say(&format!(
                "step {step}: energy {percent:.1} %, {flipped} folded, {:.1} s",
                start.elapsed().as_secs_f64()
            ));
        }
        interrupt.next()
    };
    let seconds = || Times::from([("open".to_owned(), start.elapsed().as_secs_f64())]);
    let (faces, export) = if has_extension(&arguments.input, "layout") {
        let mut layout = OpenedLayout::read(&arguments.input, progress)?;
        layout.pin(&arguments.pin_nodes, &arguments.pin_arcs)?;
        let written = layout.write_all(&options, &arguments.out, seconds(), progress, &mut watch)?;
        (layout.mesh().mesh.n_faces(), written.context("no layout was written")?)
    } else {
        let mut session = open(&arguments.input, false, &DetailArguments::default(), progress)?;
        pin(&mut session, arguments, progress)?;
        let written = write_all(&session, None, &options, &arguments.out, seconds(), progress, &mut watch)?;
        (session.model().loaded.mesh.n_faces(), written.map_err(|error| explain(&session, error))?)
    };
    let name = arguments.input.file_name().map(Path::new).unwrap_or(&arguments.input);
    say(&format!("{}: {faces} faces, {}, {:.1} s", name.display(), summary(&export), start.elapsed().as_secs_f64()));
    match export.optimised {
        Some(Err(problem)) => anyhow::bail!("the rough drawing was written, since the optimisation failed: {problem}"),
        _ => Ok(()),
    }
}

fn settings(arguments: &EmbedArguments) -> anyhow::Result<Settings> {
    let usual = Settings::default();
    let anisotropy = arguments.anisotropy.unwrap_or(usual.anisotropy);
    anyhow::ensure!(anisotropy.is_finite() && anisotropy >= 1.0, "the anisotropy must be 1 or more, not {anisotropy}");
    let steps = arguments.steps.unwrap_or(usual.steps);
    Ok(Settings { steps, anisotropy, sizing: usual.sizing && !arguments.no_sizing, ..usual })
}

fn pin(session: &mut Session, arguments: &EmbedArguments, progress: &Progress) -> anyhow::Result<()> {
    if arguments.pin_nodes.is_empty() && arguments.pin_arcs.is_empty() {
        return Ok(());
    }
    let drawn = initial_layout(session, progress).map_err(|error| explain(session, error))?;
    let mut parts = drawn.pinned(&session.design().pins);
    parts.pin(&arguments.pin_nodes, &arguments.pin_arcs)?;
    session.set_pins(drawn.pins(&parts));
    Ok(())
}

/// What came of it, in figures.
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
        if !report.collapsed.is_empty() {
            text += &format!(", {} chords collapsed", report.collapsed.len());
        }
    }
    if let Some(Ok(report)) = &export.optimised
        && report.features.all > 0
    {
        text += &format!(", {} of {} feature edges on isolines", report.features.on_isolines, report.features.all);
    }
    let m = export.measures();
    text += &format!(
        ", {} flipped, conformal {:.3}, planar {:.3}, alignment {:.2}°",
        m.flipped, m.conformal, m.planar, m.alignment
    );
    if let (Some(Ok(_)), Some(b)) = (&export.optimised, export.initial.measures) {
        text += &format!(" (drawn: {:.3}, {:.3}, {:.2}°)", b.conformal, b.planar, b.alignment);
    }
    text
}

/// Ctrl-C: once to finish with the best so far, before there is anything or a second time to give up.
struct Interrupt {
    progress: Arc<Progress>,
    state: Arc<AtomicU8>,
}

/// Nothing to keep yet, optimising, asked to finish.
const OPENING: u8 = 0;
const MOVING: u8 = 1;
const FINISHING: u8 = 2;

impl Interrupt {
    fn listen() -> anyhow::Result<Self> {
        let this = Self { progress: Arc::new(Progress::new()), state: Arc::new(AtomicU8::new(OPENING)) };
        let (progress, state) = (Arc::clone(&this.progress), Arc::clone(&this.state));
        ctrlc::set_handler(move || {
            if state.compare_exchange(MOVING, FINISHING, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
                say("plait: finishing with the best so far; Ctrl-C again gives up");
            } else {
                progress.cancel();
            }
        })
        .context("Ctrl-C cannot be listened to")?;
        Ok(this)
    }

    fn next(&self) -> Next {
        let before = self.state.compare_exchange(OPENING, MOVING, Ordering::Relaxed, Ordering::Relaxed);
        if before == Err(FINISHING) { Next::Finish } else { Next::Continue }
    }
}
