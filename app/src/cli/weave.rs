//! `plait weave`: replays a script or places suggested strips, and exports the layout.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

use plait_core::embed::{Next, Snapshot};
use plait_core::progress::Progress;
use plait_core::weave::{ExportOptions, Goal, IMPROVEMENT_ROUNDS, Improvement, MeshRole, Session, write_all};

use super::arguments::{Until, WeaveArguments};
use super::input::open_session;
use super::output::{explain, export_options, print_message, summary};
use crate::texts;

/// Weaves a layout and exports it to the folder.
///
/// # Errors
///
/// When the input cannot be read, the layout is not valid at the end, or a file cannot be written.
pub fn run(arguments: &WeaveArguments) -> anyhow::Result<()> {
    let progress = Progress::new();
    let start = Instant::now();
    let mut session = open_session(&arguments.input, arguments.suggest, &arguments.detail, &progress)?;
    let opened = start.elapsed().as_secs_f64();
    if arguments.suggest {
        let goal = match arguments.until {
            Until::Red => Goal::Valid,
            Until::Orange => Goal::Separated,
        };
        if let Some(reason) = session.weave_to(goal, &progress)? {
            print_message(&format!("plait: stopped early: {reason}"));
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
    print_message(&format!(
        "{}: {} strips, {}, {:.1} s",
        session.model().loaded.name,
        session.design().strips.len(),
        summary(&export),
        start.elapsed().as_secs_f64(),
    ));
    if export.mesh_role == MeshRole::Proxy {
        print_message("plait: the layout is embedded on the proxy; its quads are mapped to the mesh");
    }
    if let Some(Err(error)) = export.optimised {
        print_message(&format!("plait: the optimisation failed, the initial embedding was written: {error}"));
    }
    Ok(())
}

/// Searches for strips with a lower objective, and prints the result.
fn improve(session: &mut Session, rounds: usize, progress: &Progress) -> anyhow::Result<()> {
    let mut watch = |_: &Session, _: &Improvement| ControlFlow::Continue(());
    let improvement = session.improve(rounds, progress, &mut watch).map_err(|error| explain(session, error))?;
    print_message(&format!("plait: {}", texts::improvement(&improvement)));
    Ok(())
}
