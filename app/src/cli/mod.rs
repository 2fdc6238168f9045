//! The command line: without a command the window, with one the work is done without a display.

pub mod bench;
pub mod embed;
pub mod info;
pub mod render;
pub mod weave;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context as _;
use clap::{Parser, Subcommand, ValueEnum};
use plait_core::weave::Options;

use crate::engine::{Opener, Source};

/// Design quad layouts of surfaces by weaving dual strips.
///
/// Without a command a window opens on FILE, or on a built-in model.
#[derive(Debug, Parser)]
#[command(name = "plait", version, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// A mesh (OBJ, OFF, PLY, STL), a design (.plait) or the name of a built-in model.
    file: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Say what a mesh is: sizes, topology, repairs.
    Info(InfoArguments),
    /// Weave a layout and write it, from a script or by suggestions.
    Weave(WeaveArguments),
    /// Optimise the embedding of a layout and write it.
    Embed(EmbedArguments),
    /// Draw a design or a mesh into a PNG file.
    Render(RenderArguments),
    /// Time what a designer waits for.
    Bench(bench::BenchArguments),
}

/// Arguments of `plait info`.
#[derive(Debug, clap::Args)]
pub struct InfoArguments {
    /// The mesh, or the name of a built-in model.
    pub mesh: PathBuf,
    /// Write JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `plait weave`.
#[derive(Debug, clap::Args)]
pub struct WeaveArguments {
    /// A weave script (JSON); with --suggest a mesh or the name of a built-in model.
    pub input: PathBuf,
    /// Place suggested strips until the layout is valid.
    #[arg(long)]
    pub suggest: bool,
    /// With --suggest: until no region has this colour or a more urgent one.
    #[arg(long, value_enum, default_value_t = Until::Red, requires = "suggest")]
    pub until: Until,
    /// Try other strips, with which the layout follows the shape better, in so many rounds at most.
    #[arg(long, value_name = "ROUNDS", num_args = 0..=1)]
    pub improve: Option<Option<usize>>,
    /// The folder to write into; made if it does not exist.
    #[arg(long)]
    pub out: PathBuf,
    /// How fine the quads are.
    #[command(flatten)]
    pub size: SizeArguments,
    /// What may change for the sake of the quads.
    #[command(flatten)]
    pub refine: RefineArguments,
    /// Write the layout as it is first drawn, without optimising its embedding.
    #[arg(long, conflicts_with_all = ["integer", "simplify", "collapse"])]
    pub no_optimise: bool,
    /// How much of the shape strips follow.
    #[command(flatten)]
    pub detail: DetailArguments,
}

/// How fine quads.obj is to be.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct SizeArguments {
    /// Edge length of the quads of quads.obj, in the mesh's units.
    #[arg(long, conflicts_with = "quads")]
    pub edge_length: Option<f64>,
    /// About how many quads quads.obj has.
    #[arg(long)]
    pub quads: Option<usize>,
}

/// What of the layout may change for the sake of the quads.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct RefineArguments {
    /// Make patches as wide and high as multiples of a quad's edge, so that quads are squares of one size in the map.
    #[arg(long)]
    pub integer: bool,
    /// Leave out dual strips one by one, as long as the layout becomes less irregular and the embedding no worse.
    #[arg(long)]
    pub simplify: bool,
    /// Collapse arcs that want to be shorter than this, in the mesh's units, with all their dual strip; without a
    /// length, shorter than a quad's edge.
    #[arg(long, value_name = "LENGTH", num_args = 0..=1)]
    pub collapse: Option<Option<f64>>,
}

/// How much of the shape strips follow. What is not given is as usual, or as the design or the script says.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct DetailArguments {
    /// Weave meshes of more than twice as many triangles on a proxy of this many; 0: never.
    #[arg(long, value_name = "TRIANGLES")]
    pub proxy: Option<u32>,
    /// Radius over which curvature is measured, as a fraction of the bounding-box diagonal.
    #[arg(long, value_name = "RADIUS", value_parser = parse_radius)]
    pub curvature_radius: Option<f64>,
    /// Pass over relief smaller than this fraction of the bounding-box diagonal.
    #[arg(long, value_name = "RADIUS", value_parser = parse_radius)]
    pub smoothing: Option<f64>,
}

impl DetailArguments {
    /// The options with what is given here.
    pub fn over(&self, options: Options) -> Options {
        Options {
            proxy: self.proxy.unwrap_or(options.proxy),
            curvature_radius: self.curvature_radius.unwrap_or(options.curvature_radius),
            smoothing: self.smoothing.unwrap_or(options.smoothing),
            ..options
        }
    }
}

fn parse_radius(text: &str) -> Result<f64, String> {
    let radius = text.parse::<f64>().ok().filter(|r| (0.0..=0.5).contains(r));
    radius.ok_or_else(|| "a radius is a number from 0 to 0.5".to_owned())
}

/// Arguments of `plait embed`.
#[derive(Debug, clap::Args)]
pub struct EmbedArguments {
    /// A design (.plait), a weave script (.json) or a layout file (.layout).
    pub input: PathBuf,
    /// The folder to write into; made if it does not exist.
    #[arg(long)]
    pub out: PathBuf,
    /// How fine the quads are.
    #[command(flatten)]
    pub size: SizeArguments,
    /// What may change for the sake of the quads.
    #[command(flatten)]
    pub refine: RefineArguments,
    /// Most steps of the nodes in each of the two phases.
    #[arg(long)]
    pub steps: Option<usize>,
    /// Keep lengths even over the surface.
    #[arg(long)]
    pub no_sizing: bool,
    /// By how much an error of direction counts more than one of length, from 1.
    #[arg(long)]
    pub anisotropy: Option<f64>,
    /// Nodes that stay where they are drawn, by their numbers in layout.layout: 0,7,12.
    #[arg(long, value_delimiter = ',')]
    pub pin_nodes: Vec<usize>,
    /// Arcs that stay where they are drawn.
    #[arg(long, value_delimiter = ',')]
    pub pin_arcs: Vec<usize>,
    /// Say nothing of the single steps.
    #[arg(long)]
    pub quiet: bool,
}

/// Which regions must be gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Until {
    /// No region is other than a disc.
    Red,
    /// Nor has any several corners.
    Orange,
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
    /// Turn of the camera about the up axis, in degrees.
    #[arg(long, default_value_t = 34.0, allow_negative_numbers = true)]
    pub yaw: f32,
    /// Height of the camera over the horizon, in degrees.
    #[arg(long, default_value_t = 20.0, allow_negative_numbers = true)]
    pub pitch: f32,
    /// The model's z axis points up instead of y.
    #[arg(long)]
    pub z_up: bool,
    /// Draw the edges of the triangles.
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

/// Whether a path ends in `.extension`.
pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// What a path names: a file, or a built-in model where there is no such file.
pub fn source(path: &Path, opener: &dyn Opener) -> Source {
    let name = path.to_string_lossy();
    let known = |n: &str| n.eq_ignore_ascii_case(&name);
    match opener.built_ins().into_iter().find(|b| known(&b.name)) {
        Some(built_in) if !path.exists() => Source::BuiltIn(built_in.name),
        _ => Source::File(path.to_path_buf()),
    }
}

/// Runs the program; errors go to standard error.
pub fn run(arguments: impl IntoIterator<Item = OsString>, opener: Arc<dyn Opener>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors.
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
    let source = file.map(|f| source(f, &*opener));
    crate::window::run(opener, source).with_context(|| format!("the window cannot be opened; {HEADLESS}"))
}

/// Whether a window system is named; other systems than Unix always have one.
fn has_display() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().any(set)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parse(line: &str) -> Result<Arguments, clap::Error> {
        Arguments::try_parse_from(line.split(' '))
    }

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn a_file_and_commands_are_told_apart() {
        assert_eq!(parse("plait bunny.obj").unwrap().file, Some("bunny.obj".into()));
        assert!(matches!(parse("plait info bunny.obj --json").unwrap().command, Some(Command::Info(i)) if i.json));
        let weave = parse("plait weave cube --suggest --until orange --out x --quads 500").unwrap();
        let Some(Command::Weave(weave)) = weave.command else { panic!("not weave") };
        assert_eq!((weave.until, weave.size.quads), (Until::Orange, Some(500)));
        let detail = parse("plait weave cube --suggest --out x --proxy 9000 --smoothing 0.02").unwrap();
        let Some(Command::Weave(WeaveArguments { detail, .. })) = detail.command else { panic!("not weave") };
        let usual = Options::default();
        assert_eq!(detail.over(usual), Options { proxy: 9000, smoothing: 0.02, ..usual });
        for (text, rounds) in [("--improve --out x", None), ("--improve 7 --out x", Some(7))] {
            let weave = parse(&format!("plait weave cube --suggest {text}")).unwrap();
            let Some(Command::Weave(weave)) = weave.command else { panic!("not weave") };
            assert_eq!(weave.improve, Some(rounds));
        }
        let embed = parse("plait embed a.layout --out x --pin-nodes 1,2 --edge-length 0.1 --steps 3").unwrap();
        let Some(Command::Embed(embed)) = embed.command else { panic!("not embed") };
        assert_eq!((embed.pin_nodes, embed.size.edge_length, embed.steps), (vec![1, 2], Some(0.1), Some(3)));
    }

    #[test]
    fn contradictions_are_refused() {
        assert!(parse("plait weave a --out x --edge-length 1 --quads 5").is_err());
        assert!(parse("plait weave a --out x --until orange").is_err());
        assert!(parse("plait embed a --out x --pin-nodes 1,b").is_err());
        assert!(parse("plait weave a --out x --curvature-radius 3").is_err());
        assert!(parse("plait render a --out x.png --size 10x10").is_err());
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
    }
}
