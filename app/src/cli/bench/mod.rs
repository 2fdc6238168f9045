//! `plait bench`: how long a designer waits, on any mesh, with figures that anyone can repeat.
//!
//! Points are drawn uniformly by area with a fixed seed, so that two runs ask for the same. Stages are those that
//! the work itself reports, so that the figures follow the program wherever it goes. Every report carries the facts
//! of the machine and two yardsticks from the same run, by which figures of different machines can be compared.

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
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use clap::{Args, Subcommand};
use plait_core::progress::Progress;
use plait_core::weave::{Options, Session};

use super::DetailArguments;

use input::Input;
use report::Report;

/// Arguments of `plait bench`.
#[derive(Debug, Args)]
pub struct BenchArguments {
    #[command(subcommand)]
    command: BenchCommand,
}

#[derive(Debug, Subcommand)]
enum BenchCommand {
    /// Time reading a mesh and making it ready, stage by stage.
    Open(RunArguments),
    /// Time proposals at seeded points: a loop shown, proved best, alternatives.
    Hover(RunArguments),
    /// Time what follows the placement of a strip, stage by stage.
    Strips(RunArguments),
    /// Time the embedding of a layout woven by suggestions, stage by stage.
    Embed(RunArguments),
    /// All of these in one run.
    All(RunArguments),
    /// Write reports as one Markdown table.
    Table(TableArguments),
    /// Draw cost against size from reports into an SVG file.
    Plot(PlotArguments),
}

/// Arguments of what measures.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// The mesh, or the name of a built-in model.
    mesh: PathBuf,
    /// Number of points at which proposals are timed.
    #[arg(long, default_value_t = 200)]
    points: usize,
    /// Seed of the points.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Numbers of strips placed when proposals are timed; the most of them is what `strips` places.
    #[arg(long, value_delimiter = ',', default_value = "0,4,8")]
    strips: Vec<usize>,
    /// Cut every triangle in four so many times beforehand.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=8))]
    subdivide: u32,
    /// How often what is timed as a whole is repeated.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Seconds after which a series of measurements goes no further.
    #[arg(long, default_value_t = 120.0, value_parser = seconds)]
    limit: f64,
    /// Number of threads; without, one per core.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Of hovering, time the search alone and leave out what the window adds to it.
    #[arg(long)]
    search_only: bool,
    /// Of all of it, leave out embedding.
    #[arg(long)]
    no_embed: bool,
    /// Leave out the yardsticks.
    #[arg(long)]
    no_reference: bool,
    /// How much of the shape strips follow.
    #[command(flatten)]
    detail: DetailArguments,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

/// Arguments of `plait bench table`.
#[derive(Debug, Args)]
struct TableArguments {
    /// Reports written with --json.
    #[arg(required = true)]
    reports: Vec<PathBuf>,
}

/// Arguments of `plait bench plot`.
#[derive(Debug, Args)]
struct PlotArguments {
    /// Reports written with --json.
    #[arg(required = true)]
    reports: Vec<PathBuf>,
    /// The SVG file to write.
    #[arg(long)]
    out: PathBuf,
}

impl RunArguments {
    fn limit(&self) -> Duration {
        Duration::from_secs_f64(self.limit)
    }

    fn most_strips(&self) -> usize {
        self.strips.iter().copied().max().unwrap_or(0)
    }
}

/// Which measurements are made.
#[derive(Debug, Clone, Copy, Default)]
struct Parts {
    open: bool,
    hover: bool,
    strips: bool,
    embed: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|s| (0.0..1e6).contains(s));
    value.ok_or_else(|| "a number of seconds".to_owned())
}

/// Measures and writes the figures to standard output.
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
            std::fs::write(&plot.out, picture).with_context(|| plot.out.display().to_string())
        }
    }
}

fn measure(arguments: &RunArguments, parts: Parts) -> anyhow::Result<()> {
    let threads = arguments.threads.map_or(0, usize::from);
    // All work is done inside the pool: with one thread there is then just this one.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().context("no threads")?;
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
            // Beside other figures it is no reason to lose these.
            Err(error) if parts.hover => eprintln!("plait: nothing was embedded: {error:#}"),
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

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        bench: BenchArguments,
    }

    fn parse(line: &str) -> Result<BenchCommand, clap::Error> {
        Line::try_parse_from(line.split(' ')).map(|l| l.bench.command)
    }

    #[test]
    fn arguments_are_checked() {
        let Ok(BenchCommand::Hover(run)) = parse("bench hover torus --strips 2,0 --points 3") else {
            panic!("not hover")
        };
        assert_eq!((run.most_strips(), run.points, run.seed), (2, 3, 1));
        for line in [
            "bench",
            "bench hover",
            "bench fly torus",
            "bench hover torus --threads 0",
            "bench hover torus --subdivide 9",
            "bench hover torus --points -1",
            "bench open torus --limit nan",
            "bench open torus --repeats 0",
            "bench plot a.json",
            "bench table",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }

    #[test]
    fn every_part_gives_its_rows() {
        let line = "bench all torus --points 2 --strips 0,1 --repeats 1 --threads 1 --no-embed";
        let Ok(BenchCommand::All(run)) = parse(line) else { panic!("not all") };
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
    fn subdividing_makes_four_of_each_triangle() {
        let input = Input::new("sleeve".as_ref(), 1).unwrap();
        let loaded = input.load(&Progress::new()).unwrap();
        assert_eq!((loaded.name.as_str(), loaded.mesh.n_faces()), ("sleeve", 4 * 4914));
        assert!(Input::new("no-such-mesh.obj".as_ref(), 0).is_err());
    }
}
