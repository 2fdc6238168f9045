//! `plait embed`: optimises the embedding of the layout of a design or of a layout file, and exports it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Instant;

use anyhow::Context as _;
use plait_core::embed::{Next, Settings, Snapshot};
use plait_core::progress::Progress;
use plait_core::weave::{OpenedLayout, Session, Times, initial_layout, write_all};

use super::arguments::EmbedArguments;
use super::arguments::options::DetailArguments;
use super::input::{has_extension, open_session};
use super::output::{explain, export_options, print_message, summary};

/// Optimises the embedding and exports the layout to the folder.
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
            print_step(snapshot, start);
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
        let mut session = open_session(&arguments.input, false, &DetailArguments::default(), progress)?;
        pin(&mut session, arguments, progress)?;
        let written = write_all(&session, None, &options, &arguments.out, seconds(), progress, &mut watch)?;
        (session.model().loaded.mesh.n_faces(), written.map_err(|error| explain(&session, error))?)
    };
    let name = arguments.input.file_name().map(Path::new).unwrap_or(&arguments.input).display();
    let elapsed = start.elapsed().as_secs_f64();
    print_message(&format!("{name}: {faces} faces, {}, {elapsed:.1} s", summary(&export)));
    match export.optimised {
        Some(Err(error)) => anyhow::bail!("the optimisation failed, the initial embedding was written: {error}"),
        _ => Ok(()),
    }
}

fn print_step(snapshot: &Snapshot, start: Instant) {
    let Snapshot { step, flipped, energy, .. } = snapshot;
    let (percent, elapsed) = (100.0 * energy, start.elapsed().as_secs_f64());
    print_message(&format!("step {step}: energy {percent:.1} %, {flipped} flipped triangles, {elapsed:.1} s"));
}

fn settings(arguments: &EmbedArguments) -> anyhow::Result<Settings> {
    let defaults = Settings::default();
    let anisotropy = arguments.anisotropy.unwrap_or(defaults.anisotropy);
    anyhow::ensure!(anisotropy.is_finite() && anisotropy >= 1.0, "--anisotropy must be at least 1, not {anisotropy}");
    let steps = arguments.steps.unwrap_or(defaults.steps);
    Ok(Settings { steps, anisotropy, sizing: defaults.sizing && !arguments.no_sizing, ..defaults })
}

/// Adds the pins of the command line to those of the design.
fn pin(session: &mut Session, arguments: &EmbedArguments, progress: &Progress) -> anyhow::Result<()> {
    if arguments.pin_nodes.is_empty() && arguments.pin_arcs.is_empty() {
        return Ok(());
    }
    let initial = initial_layout(session, progress).map_err(|error| explain(session, error))?;
    let mut parts = initial.pinned(&session.design().pins);
    parts.pin(&arguments.pin_nodes, &arguments.pin_arcs)?;
    session.set_pins(initial.pins(&parts));
    Ok(())
}

/// Handling of Ctrl-C. During the optimisation the first one stops with the best embedding so far. Before the
/// optimisation, and when pressed again, it cancels.
struct Interrupt {
    progress: Arc<Progress>,
    state: Arc<AtomicU8>,
}

/// State of [`Interrupt`]: no step of the optimisation was made yet.
const OPENING: u8 = 0;
/// The optimisation runs.
const OPTIMISING: u8 = 1;
/// Ctrl-C was pressed during the optimisation.
const STOPPING: u8 = 2;

impl Interrupt {
    fn listen() -> anyhow::Result<Self> {
        let this = Self { progress: Arc::new(Progress::new()), state: Arc::new(AtomicU8::new(OPENING)) };
        let (progress, state) = (Arc::clone(&this.progress), Arc::clone(&this.state));
        ctrlc::set_handler(move || {
            if state.compare_exchange(OPTIMISING, STOPPING, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
                print_message("plait: stopping with the best embedding so far; Ctrl-C again cancels");
            } else {
                progress.cancel();
            }
        })
        .context("Ctrl-C cannot be handled")?;
        Ok(this)
    }

    /// Whether the optimisation goes on after a step.
    fn next(&self) -> Next {
        let before = self.state.compare_exchange(OPENING, OPTIMISING, Ordering::Relaxed, Ordering::Relaxed);
        if before == Err(STOPPING) { Next::Finish } else { Next::Continue }
    }
}
