//! The definition of the command line, for clap. The comments on the fields are the texts of `--help`.

pub mod bench;
pub mod options;

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};

use bench::BenchArguments;
use options::{DetailArguments, RefineArguments, SizeArguments};

/// Design quad layouts of surfaces by weaving dual strips.
///
/// Without a command, a window opens on FILE, or on a built-in model.
#[derive(Debug, Parser)]
#[command(name = "plait", version, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// A mesh (OBJ, OFF, PLY, STL), a design (.plait) or the name of a built-in model.
    pub file: Option<PathBuf>,
    /// What to do without a window.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// A command that needs no display.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Print size, topology and repairs of a mesh.
    Info(InfoArguments),
    /// Weave a layout from a script, a design or suggested strips, and export it.
    Weave(WeaveArguments),
    /// Optimise the embedding of a layout and export it.
    Embed(EmbedArguments),
    /// Render a design or a mesh to a PNG file.
    Render(RenderArguments),
    /// Measure run times.
    Bench(BenchArguments),
}

/// Arguments of `plait info`.
#[derive(Debug, clap::Args)]
pub struct InfoArguments {
    /// A mesh file or the name of a built-in model.
    pub mesh: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `plait weave`.
#[derive(Debug, clap::Args)]
pub struct WeaveArguments {
    /// A weave script (.json) or a design (.plait). With --suggest also a mesh or the name of a built-in model.
    pub input: PathBuf,
    /// Place suggested strips until the layout is valid.
    #[arg(long)]
    pub suggest: bool,
    /// With --suggest: place strips until no region has this colour or a more urgent one.
    #[arg(long, value_enum, default_value_t = Until::Red, requires = "suggest")]
    pub until: Until,
    /// Search for strips with a lower objective (alignment error, distortion, patches, irregular nodes), in at most
    /// ROUNDS rounds.
    #[arg(long, value_name = "ROUNDS", num_args = 0..=1)]
    pub improve: Option<Option<usize>>,
    /// The folder to write to. Created if it does not exist.
    #[arg(long)]
    pub out: PathBuf,
    /// Size of the quads.
    #[command(flatten)]
    pub size: SizeArguments,
    /// Changes of the layout in favour of the quad mesh.
    #[command(flatten)]
    pub refine: RefineArguments,
    /// Write the initial embedding, without optimisation.
    #[arg(long, conflicts_with_all = ["integer", "simplify", "collapse"])]
    pub no_optimise: bool,
    /// Proxy, curvature and smoothing.
    #[command(flatten)]
    pub detail: DetailArguments,
}

/// Which regions must be gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Until {
    /// Regions that are not discs or have no corner: the layout is then valid.
    Red,
    /// Also regions with several corners of the shape.
    Orange,
}

/// Arguments of `plait embed`.
#[derive(Debug, clap::Args)]
pub struct EmbedArguments {
    /// A design (.plait), a weave script (.json) or a layout file (.layout).
    pub input: PathBuf,
    /// The folder to write to. Created if it does not exist.
    #[arg(long)]
    pub out: PathBuf,
    /// Size of the quads.
    #[command(flatten)]
    pub size: SizeArguments,
    /// Changes of the layout in favour of the quad mesh.
    #[command(flatten)]
    pub refine: RefineArguments,
    /// Most steps of node positions in each of the two phases. 0: nodes stay where they are.
    #[arg(long)]
    pub steps: Option<usize>,
    /// No sizing field: isolines have uniform spacing over the surface.
    #[arg(long)]
    pub no_sizing: bool,
    /// Weight of alignment errors relative to length errors, at least 1.
    #[arg(long)]
    pub anisotropy: Option<f64>,
    /// Nodes with fixed positions, by their numbers in layout.layout: 0,7,12.
    #[arg(long, value_delimiter = ',')]
    pub pin_nodes: Vec<usize>,
    /// Arcs with fixed ends, by their numbers in layout.layout.
    #[arg(long, value_delimiter = ',')]
    pub pin_arcs: Vec<usize>,
    /// Do not print the steps.
    #[arg(long)]
    pub quiet: bool,
}

/// Arguments of `plait render`.
#[derive(Debug, clap::Args)]
pub struct RenderArguments {
    /// A design, a mesh or the name of a built-in model.
    pub design: PathBuf,
    /// The PNG file to write.
    #[arg(long)]
    pub out: PathBuf,
    /// Width and height in pixels.
    #[arg(long, default_value = "1600x1200", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Rotation of the camera about the up axis, in degrees.
    #[arg(long, default_value_t = 34.0, allow_negative_numbers = true)]
    pub yaw: f32,
    /// Elevation of the camera above the horizon, in degrees.
    #[arg(long, default_value_t = 20.0, allow_negative_numbers = true)]
    pub pitch: f32,
    /// The z axis of the model points up, instead of y.
    #[arg(long)]
    pub z_up: bool,
    /// Show the triangle edges.
    #[arg(long)]
    pub wireframe: bool,
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("a size is written as WIDTHxHEIGHT")?;
    let side = |s: &str| s.parse::<u32>().ok().filter(|n| (16..=8192).contains(n));
    match (side(width), side(height)) {
        (Some(w), Some(h)) => Ok([w, h]),
        _ => Err("width and height are whole numbers from 16 to 8192".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use plait_core::weave::Options;

    fn parse(line: &str) -> Result<Arguments, clap::Error> {
        Arguments::try_parse_from(line.split(' '))
    }

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    fn weave(line: &str) -> WeaveArguments {
        match parse(line).unwrap().command {
            Some(Command::Weave(weave)) => weave,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_file_without_a_command_opens_the_window() {
        let arguments = parse("plait bunny.obj").unwrap();
        assert!(arguments.file == Some("bunny.obj".into()) && arguments.command.is_none());
        assert!(matches!(parse("plait info bunny.obj --json").unwrap().command, Some(Command::Info(i)) if i.json));
    }

    #[test]
    fn the_goal_of_suggestions_is_read() {
        let weave = weave("plait weave cube --suggest --until orange --out x --quads 500");
        assert_eq!((weave.until, weave.size.quads), (Until::Orange, Some(500)));
    }

    #[test]
    fn options_that_are_not_given_keep_their_values() {
        let detail = weave("plait weave cube --suggest --out x --proxy 9000 --smoothing 0.02").detail;
        let defaults = Options::default();
        assert_eq!(detail.over(defaults), Options { proxy: 9000, smoothing: 0.02, ..defaults });
    }

    #[test]
    fn the_number_of_rounds_may_be_left_out() {
        for (text, rounds) in [("", None), ("--improve", Some(None)), ("--improve 7", Some(Some(7)))] {
            let line = format!("plait weave cube --suggest --out x {text}");
            assert_eq!(weave(line.trim_end()).improve, rounds);
        }
    }

    #[test]
    fn pins_are_lists_of_numbers() {
        let embed = parse("plait embed a.layout --out x --pin-nodes 1,2 --edge-length 0.1 --steps 3").unwrap();
        let Some(Command::Embed(embed)) = embed.command else { panic!("not embed") };
        assert_eq!((embed.pin_nodes, embed.size.edge_length, embed.steps), (vec![1, 2], Some(0.1), Some(3)));
    }

    #[test]
    fn contradictory_arguments_are_refused() {
        assert!(parse("plait weave a --out x --edge-length 1 --quads 5").is_err());
        assert!(parse("plait weave a --out x --until orange").is_err());
        assert!(parse("plait embed a --out x --pin-nodes 1,b").is_err());
        assert!(parse("plait weave a --out x --curvature-radius 3").is_err());
    }

    #[test]
    fn sizes_of_pictures_have_bounds() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        for text in ["10x10", "640", "640x9000", "axb"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
