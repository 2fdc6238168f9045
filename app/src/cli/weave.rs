//! `plait weave`: replays a script, or places suggestions, and writes the layout.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::Context as _;
use plait_core::embed::{Next, Settings, Snapshot};
use plait_core::progress::Progress;
use plait_core::weave::{
    CollapseLength, Design, ExportOptions, Goal, IMPROVEMENT_ROUNDS, Improvement, MeshRole, MeshSource, Options,
    QuadSize, Script, Session, WeaveError, replay, write_all,
};

use super::embed::summary;
use super::{DetailArguments, RefineArguments, SizeArguments, Until, WeaveArguments, has_extension};
use crate::weaving::improved;

/// Weaves and writes into the folder.
///
/// # Errors
///
/// When the input cannot be read, the layout is not valid in the end, or a file cannot be written.
pub fn run(arguments: &WeaveArguments) -> anyhow::Result<()> {
    let progress = Progress::new();
    let start = Instant::now();
    let mut session = open(&arguments.input, arguments.suggest, &arguments.detail, &progress)?;
    let opened = start.elapsed().as_secs_f64();
    if arguments.suggest {
        let goal = match arguments.until {
            Until::Red => Goal::Valid,
            Until::Orange => Goal::Separated,
        };
        if let Some(stuck) = session.weave_to(goal, &progress)? {
            say(&format!("plait: stopped early: {stuck}"));
        }
    }
    let woven = start.elapsed().as_secs_f64();
    if let Some(rounds) = arguments.improve {
        improve(&mut session, rounds.unwrap_or(IMPROVEMENT_ROUNDS), &progress)?;
    }
    let improved = start.elapsed().as_secs_f64();
    let mut seconds = BTreeMap::from([("open".to_owned(), opened), ("weave".to_owned(), woven - opened)]);
    if arguments.improve.is_some() {
        seconds.insert("improve".to_owned(), improved - woven);
    }
    let embedding = ExportOptions::default().embedding.filter(|_| !arguments.no_optimise);
    let options = export_options(arguments.size, arguments.refine, embedding)?;
    let mut watch = |_: &Snapshot| Next::Continue;
    let export = write_all(&session, None, &options, &arguments.out, seconds, &progress, &mut watch)?
        .map_err(|error| explain(&session, error))?;
    say(&format!(
        "{}: {} strips, {}, {:.1} s",
        session.model().loaded.name,
        session.design().strips.len(),
        summary(&export),
        start.elapsed().as_secs_f64(),
    ));
    if export.mesh_role == MeshRole::Proxy {
        say("plait: the layout is embedded on the proxy, and its quads are carried to the mesh");
    }
    if let Some(Err(problem)) = export.optimised {
        say(&format!("plait: the rough drawing was written, since the optimisation failed: {problem}"));
    }
    Ok(())
}

/// Tries other strips, and says what came of it.
fn improve(session: &mut Session, rounds: usize, progress: &Progress) -> anyhow::Result<()> {
    let mut watch = |_: &Session, _: &Improvement| ControlFlow::Continue(());
    let improvement = session.improve(rounds, progress, &mut watch).map_err(|error| explain(session, error))?;
    say(&format!("plait: {}", improved(&improvement)));
    Ok(())
}

/// What is to be written.
pub(super) fn export_options(
    size: SizeArguments,
    refine: RefineArguments,
    embedding: Option<Settings>,
) -> anyhow::Result<ExportOptions> {
    let collapse = match refine.collapse {
        None => None,
        Some(None) => Some(CollapseLength::Quad),
        Some(Some(length)) if length.is_finite() && length > 0.0 => Some(CollapseLength::Length(length)),
        Some(Some(length)) => anyhow::bail!("the length to collapse must be positive, not {length}"),
    };
    Ok(ExportOptions {
        size: quad_size(size)?,
        embedding,
        integer: refine.integer,
        simplify: refine.simplify,
        collapse,
    })
}

/// How fine the quads are to be.
fn quad_size(arguments: SizeArguments) -> anyhow::Result<QuadSize> {
    Ok(match (arguments.edge_length, arguments.quads) {
        (Some(length), _) if length.is_finite() && length > 0.0 => QuadSize::EdgeLength(length),
        (Some(length), _) => anyhow::bail!("the edge length must be positive, not {length}"),
        (None, Some(n)) => QuadSize::Count(u32::try_from(n).context("that many quads do not fit into memory")?),
        (None, None) => ExportOptions::default().size,
    })
}

/// A session on a script replayed, a saved design, or (to place suggestions on) a bare mesh.
pub(super) fn open(
    input: &Path,
    suggest: bool,
    detail: &DetailArguments,
    progress: &Progress,
) -> anyhow::Result<Session> {
    let session = opened(input, suggest, detail, progress)?;
    if let Some(proxy) = &session.model().proxy {
        let (all, n) = (session.model().loaded.mesh.n_faces(), proxy.mesh().n_faces());
        say(&format!("plait: {all} triangles, woven on a proxy of {n}"));
    }
    Ok(session)
}

fn opened(input: &Path, suggest: bool, detail: &DetailArguments, progress: &Progress) -> anyhow::Result<Session> {
    let folder = input.parent().unwrap_or(Path::new(""));
    if has_extension(input, "json") {
        let mut script = Script::read(input)?;
        script.options = detail.over(script.options);
        return Ok(replay(&script, folder, progress)?);
    }
    if has_extension(input, "plait") {
        let mut design = Design::read(input)?;
        design.options = detail.over(design.options);
        let loaded = design.mesh.load(folder)?;
        return Ok(Session::resume(loaded, design, progress)?);
    }
    if !suggest {
        anyhow::bail!("{} is no weave script (.json) or design (.plait); a mesh needs --suggest", input.display());
    }
    let source = MeshSource::from_name(&input.to_string_lossy());
    let loaded = source.load(Path::new("")).with_context(|| input.display().to_string())?;
    let source = match source {
        MeshSource::File(path) => MeshSource::File(path.canonicalize().unwrap_or(path)),
        builtin @ MeshSource::Builtin(_) => builtin,
    };
    Ok(Session::open(loaded, source, detail.over(Options::default()), progress)?)
}

/// Why there is no layout, region by region where that is the reason.
pub(super) fn explain(session: &Session, error: WeaveError) -> anyhow::Error {
    let mut text = format!("no layout was written: {error}");
    for region in session.woven().red() {
        let report = &session.woven().reports[region as usize];
        let reasons: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
        text += &format!("\n  region {region}: {}", reasons.join("; "));
    }
    anyhow::anyhow!(text)
}

/// Writes a line for the user; what the program makes goes to files.
pub(super) fn say(line: &str) {
    drop(writeln!(std::io::stderr(), "{line}"));
}
