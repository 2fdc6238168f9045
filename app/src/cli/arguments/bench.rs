//! Arguments of `plait bench`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};

use super::options::DetailArguments;

/// Arguments of `plait bench`.
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// What to measure or to draw.
    #[command(subcommand)]
    pub command: BenchCommand,
}

/// What to measure or to draw.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Time reading a mesh and preparing the model, by stage.
    Open(RunArguments),
    /// Time proposals at random points: first loop, best loop, all alternatives.
    Hover(RunArguments),
    /// Time the update after the placement of a strip, by stage.
    Strips(RunArguments),
    /// Time the embedding of a layout of suggested strips, by stage.
    Embed(RunArguments),
    /// Run all four benchmarks.
    All(RunArguments),
    /// Print reports as a Markdown table.
    Table(TableArguments),
    /// Plot times against mesh size from reports, as SVG.
    Plot(PlotArguments),
}

/// Arguments of the commands that measure.
#[derive(Debug, Args)]
pub struct RunArguments {
    /// A mesh file or the name of a built-in model.
    pub mesh: PathBuf,
    /// Number of points at which proposals are timed.
    #[arg(long, default_value_t = 200)]
    pub points: usize,
    /// Seed of the random points.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Numbers of placed strips at which proposals are timed. `strips` places the largest of them.
    #[arg(long, value_delimiter = ',', default_value = "0,4,8")]
    pub strips: Vec<usize>,
    /// Number of 1-to-4 subdivisions applied to the mesh first.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=8))]
    pub subdivide: u32,
    /// Number of repetitions of measurements that do not depend on points.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeats: u32,
    /// Time limit of each series of measurements, in seconds.
    #[arg(long, default_value_t = 120.0, value_parser = parse_seconds)]
    pub limit: f64,
    /// Number of threads. Default: one per core.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// `hover`: time the search only, not what the window adds to it.
    #[arg(long)]
    pub search_only: bool,
    /// `all`: leave out the embedding.
    #[arg(long)]
    pub no_embed: bool,
    /// Leave out the reference measurements.
    #[arg(long)]
    pub no_reference: bool,
    /// Proxy, curvature and smoothing.
    #[command(flatten)]
    pub detail: DetailArguments,
    /// Write the report as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `plait bench table`.
#[derive(Debug, Args)]
pub struct TableArguments {
    /// Reports written with --json.
    #[arg(required = true)]
    pub reports: Vec<PathBuf>,
}

/// Arguments of `plait bench plot`.
#[derive(Debug, Args)]
pub struct PlotArguments {
    /// Reports written with --json.
    #[arg(required = true)]
    pub reports: Vec<PathBuf>,
    /// The SVG file to write.
    #[arg(long)]
    pub out: PathBuf,
}

impl RunArguments {
    /// Time limit of one series of measurements.
    pub fn limit(&self) -> Duration {
        Duration::from_secs_f64(self.limit)
    }

    /// The largest number of strips asked for; 0 if none is.
    pub fn most_strips(&self) -> usize {
        self.strips.iter().copied().max().unwrap_or(0)
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|s| (0.0..1e6).contains(s));
    value.ok_or_else(|| "a number of seconds, less than a million".to_owned())
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
}
