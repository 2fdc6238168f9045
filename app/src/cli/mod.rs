//! The command line. Without a command a window opens; the commands need no display.

pub mod arguments;
pub mod bench;
pub mod embed;
pub mod info;
mod input;
mod output;
pub mod render;
pub mod weave;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context as _;
use clap::Parser as _;

use arguments::{Arguments, Command};

use crate::engine::Opener;

/// Runs the program; errors go to standard error.
pub fn run(arguments: impl IntoIterator<Item = OsString>, opener: Arc<dyn Opener>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // clap reports --help and --version as errors too, with exit code 0.
            drop(error.print());
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let result = match &arguments.command {
        None => window(arguments.file.as_deref(), opener),
        Some(Command::Info(info)) => info::run(info),
        Some(Command::Weave(weave)) => weave::run(weave),
        Some(Command::Embed(embed)) => embed::run(embed),
        Some(Command::Render(render)) => render::run(render, &*opener),
        Some(Command::Bench(bench)) => bench::run(bench),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("plait: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn window(file: Option<&Path>, opener: Arc<dyn Opener>) -> anyhow::Result<()> {
    const HEADLESS: &str =
        "without a display use `plait info`, `plait weave`, `plait embed` or `plait render` (see `plait --help`)";
    if !has_display() {
        anyhow::bail!("there is no display for the window; {HEADLESS}");
    }
    let source = file.map(|f| input::source(f, &*opener));
    crate::window::run(opener, source).with_context(|| format!("the window cannot be opened; {HEADLESS}"))
}

/// Whether the environment names a display. Systems other than X11 and Wayland always have one.
fn has_display() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().any(set)
}
