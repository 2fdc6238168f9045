//! Groups of options that several commands share.

use plait_core::weave::Options;

/// Size of the quads of `quads.obj`.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct SizeArguments {
    /// Edge length of the quads in quads.obj, in units of the mesh.
    #[arg(long, conflicts_with = "quads")]
    pub edge_length: Option<f64>,
    /// Target number of quads in quads.obj.
    #[arg(long)]
    pub quads: Option<usize>,
}

/// Changes of the layout in favour of the quad mesh.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct RefineArguments {
    /// Round the sides of all patches to multiples of the edge length: square quads of equal size in parameter space.
    #[arg(long)]
    pub integer: bool,
    /// Remove chords one by one while that makes the layout more regular and the embedding no worse.
    #[arg(long)]
    pub simplify: bool,
    /// Collapse chords whose arcs are shorter in the map than LENGTH, in units of the mesh. Without LENGTH: shorter
    /// than the edge of a quad.
    #[arg(long, value_name = "LENGTH", num_args = 0..=1)]
    pub collapse: Option<Option<f64>>,
}

/// Proxy, curvature and smoothing. An option that is not given keeps its default, or the value of the design or script.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct DetailArguments {
    /// Weave meshes with more than twice this many triangles on a proxy of this many triangles. 0: no proxy.
    #[arg(long, value_name = "TRIANGLES")]
    pub proxy: Option<u32>,
    /// Radius of curvature estimation, as a fraction of the model size.
    #[arg(long, value_name = "RADIUS", value_parser = parse_radius)]
    pub curvature_radius: Option<f64>,
    /// Smoothing radius of the mesh that is woven on, as a fraction of the model size. 0: no smoothing.
    #[arg(long, value_name = "RADIUS", value_parser = parse_radius)]
    pub smoothing: Option<f64>,
}

impl DetailArguments {
    /// `options`, with the values given here in place of its own.
    pub fn over(&self, options: Options) -> Options {
        Options {
            proxy: self.proxy.unwrap_or(options.proxy),
            curvature_radius: self.curvature_radius.unwrap_or(options.curvature_radius),
            smoothing: self.smoothing.unwrap_or(options.smoothing),
            ..options
        }
    }
}

/// A fraction of the model size; half of it is the radius of the whole model.
fn parse_radius(text: &str) -> Result<f64, String> {
    let radius = text.parse::<f64>().ok().filter(|r| (0.0..=0.5).contains(r));
    radius.ok_or_else(|| "a radius is a number from 0 to 0.5".to_owned())
}
