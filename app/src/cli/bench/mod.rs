//! `plait bench`: run times of everything a designer waits for, on any mesh.
//!
//! Points are sampled uniformly by area with a fixed seed, so that runs can be repeated. The stages are those reported
//! to [`Progress`]. Every report describes the machine, and holds two reference measurements of the same run (a
//! Dijkstra search, a factorisation), by which reports of different machines can be compared.

mod embed;
mod hover;
mod input;
mod machine;
mod open;
mod plot;
mod points;
mod reference;
mod report;
mod strips;
mod table;

use std::io::Write as _;

use anyhow::Context as _;
use plait_core::output::{self, FileKind};
use plait_core::progress::Progress;
use plait_core::weave::{Options, Session};

use input::Input;
use report::Report;

use super::arguments::bench::{BenchArguments, BenchCommand, RunArguments};

/// Which measurements are made.
#[derive(Debug, Clone, Copy, Default)]
struct Parts {
    open: bool,
    hover: bool,
    strips: bool,
    embed: bool,
}

/// Runs the measurements and prints the report.
///
/// # Errors
///
/// When the mesh or a report cannot be read, or the work on it fails.
pub fn run(arguments: &BenchArguments) -> anyhow::Result<()> {
    let none = Parts::default();
    match &arguments.command {
        BenchCommand::Open(run) => measure(run, Parts { open: true, ..none }),
        BenchCommand::Hover(run) => measure(run, Parts { hover: true, ..none }),
        BenchCommand::Strips(run) => measure(run, Parts { strips: true, ..none }),
        BenchCommand::Embed(run) => measure(run, Parts { embed: true, ..none }),
        BenchCommand::All(run) => measure(run, Parts { open: true, hover: true, strips: true, embed: !run.no_embed }),
        BenchCommand::Table(table) => write(&table::markdown(&Report::read_all(&table.reports)?)),
        BenchCommand::Plot(plot) => {
            let picture = plot::svg(&Report::read_all(&plot.reports)?)?;
            Ok(output::write(&plot.out, FileKind::Svg, |out| out.write_all(picture.as_bytes()))?)
        }
    }
}

fn measure(arguments: &RunArguments, parts: Parts) -> anyhow::Result<()> {
    let threads = arguments.threads.map_or(0, usize::from);
    // All work runs inside the pool, so that --threads 1 uses one thread in all.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("the threads cannot be started")?;
    let report = pool.install(|| measured(arguments, parts))?;
    let text = if arguments.json { serde_json::to_string_pretty(&report)? + "\n" } else { table::text(&report) };
    write(&text)
}

fn measured(arguments: &RunArguments, parts: Parts) -> anyhow::Result<Report> {
    let progress = Progress::new();
    let input = Input::new(&arguments.mesh, arguments.subdivide)?;
    let mut report = Report::new(arguments.seed);
    if parts.open {
        open::measure(&input, arguments, &mut report)?;
    }
    let loaded = input.load(&progress)?;
    let options = arguments.detail.over(Options::default());
    let session = || Session::open(loaded.clone(), input.source(), options, &progress);
    let mut woven = session()?;
    report.describe(woven.model(), arguments.subdivide);
    if parts.hover {
        hover::measure(&mut woven, arguments, &mut report)?;
    }
    if parts.strips {
        if parts.hover {
            woven = session()?;
        }
        strips::measure(&mut woven, arguments, &mut report)?;
    }
    if parts.embed {
        if parts.hover || parts.strips {
            woven = session()?;
        }
        match embed::measure(&mut woven, arguments, &mut report) {
            // The other measurements of the run are kept.
            Err(error) if parts.hover => eprintln!("plait: the embedding was not measured: {error:#}"),
            other => other?,
        }
    }
    if !arguments.no_reference {
        reference::measure(woven.model(), arguments, &mut report)?;
    }
    report.peak_memory = machine::peak_memory();
    Ok(report)
}

fn write(text: &str) -> anyhow::Result<()> {
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    fn arguments(line: &str) -> RunArguments {
        #[derive(Debug, Parser)]
        struct Line {
            #[command(flatten)]
            run: RunArguments,
        }
        Line::try_parse_from(line.split(' ')).unwrap().run
    }

    #[test]
    fn every_measurement_has_its_rows() {
        let line = "all torus --points 2 --strips 0,1 --repeats 1 --threads 1 --no-embed";
        let run = arguments(line);
        let parts = Parts { open: true, hover: true, strips: true, embed: false };
        let report = measured(&run, parts).unwrap();
        let wanted = [
            (open::GROUP, open::READY, 1),
            (&hover::group(0), hover::PROVED, 2),
            (&hover::group(1), hover::ALTERNATIVES, 2),
            (strips::GROUP, strips::PLACED, 1),
            (reference::GROUP, reference::DIJKSTRA, 1),
            (reference::GROUP, reference::FACTORED, 1),
        ];
        for (group, what, count) in wanted {
            let row = report.row(group, what).unwrap_or_else(|| panic!("no {what}"));
            assert!(row.count == count && 0.0 < row.median && row.median <= row.worst, "{row:?}");
        }
        assert_eq!((report.mesh.triangles, report.mesh.genus), (6828, 1));
        assert!(report.graph.states > 0 && report.graph.steps > report.graph.states && report.graph.bytes > 0);
    }

    #[test]
    fn subdivision_makes_four_triangles_of_each() {
        let input = Input::new("sleeve".as_ref(), 1).unwrap();
        let loaded = input.load(&Progress::new()).unwrap();
        assert_eq!((loaded.name.as_str(), loaded.mesh.n_faces()), ("sleeve", 4 * 4914));
        assert!(Input::new("no-such-mesh.obj".as_ref(), 0).is_err());
    }
}
