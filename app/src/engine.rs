//! What the window asks of the engine, and what it is shown: a trait and plain data.
//!
//! The window and the worker know only this. An engine is opened by an [`Opener`], owned by the worker thread and
//! never touched by the window, which reads the immutable [`Scene`] snapshots.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use plait_core::mesh::TriMesh;
use plait_core::progress::{Cancelled, Progress};
use plait_core::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint};
use plait_core::weave::{ElasticEnergy, Improvement};
use thiserror::Error;

/// Why the engine did not do what it was asked.
#[derive(Debug, Clone, Error)]
pub enum EngineError {
    /// Stopped from outside; nothing changed.
    #[error("cancelled")]
    Cancelled,
    /// It could not be done; nothing changed.
    #[error("{message}")]
    Failed {
        /// What is wrong, in the user's words.
        message: String,
        /// Where on the model, if it has a place.
        place: Option<DVec3>,
    },
}

impl EngineError {
    /// A failure without a place.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::Failed { message: message.into(), place: None }
    }
}

impl From<Cancelled> for EngineError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// What to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A built-in model, by name.
    BuiltIn(String),
    /// A mesh or a design.
    File(PathBuf),
}

impl Source {
    /// The name shown for it.
    pub fn name(&self) -> String {
        match self {
            Self::BuiltIn(name) => name.clone(),
            Self::File(path) => {
                path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into())
            }
        }
    }
}

/// A built-in model as the menu lists it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltIn {
    /// What to open it by.
    pub name: String,
    /// A few words on its shape.
    pub hint: String,
}

/// Opens engines.
pub trait Opener: Send + Sync {
    /// The built-in models; the first opens by default.
    fn built_ins(&self) -> Vec<BuiltIn>;
    /// Reads and prepares a model, or a design with its model.
    ///
    /// # Errors
    ///
    /// When the file is not a usable mesh or design, or the work was cancelled.
    fn open(&self, source: &Source, progress: &Progress) -> Result<Box<dyn Engine>, EngineError>;
}

/// Names a placed strip for as long as the design lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StripId(pub u32);

/// A strip that could be placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Its spine on the mesh that the engine weaves on.
    pub curve: SurfaceCurve,
    /// The lower, the better.
    pub cost: f64,
    /// Its elastic energy as it was found and as it is proposed, if it was a loop of the graph.
    pub energy: Option<ElasticEnergy>,
    /// The spine in space; a closed one does not repeat its first point.
    pub polyline: Vec<DVec3>,
}

/// How a finished layout is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// How finely patches are refined into quads.
    pub refinement: Refinement,
}

/// How finely patches are refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refinement {
    /// About so many quads in all.
    Quads(usize),
    /// Quads of about this edge length, in the file's units.
    EdgeLength(f64),
}

/// What an export wrote.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExportReport {
    /// The files, in the order written.
    pub files: Vec<PathBuf>,
    /// The result in a sentence.
    pub summary: String,
}

/// The interactive design of one layout. Every operation either takes place as a whole or changes nothing.
///
/// All `Err` values are [`EngineError::Cancelled`], or a failure that says why.
#[allow(clippy::missing_errors_doc)] // said once, above
pub trait Engine: Send {
    /// The strips through a point of [`Scene::design_mesh`], best first; empty when there are none. A strip that is
    /// found early, but not yet known to be the best, is handed to `first`.
    fn proposals(
        &mut self,
        at: SurfacePoint,
        first: &mut dyn FnMut(Proposal),
        progress: &Progress,
    ) -> Result<Vec<Proposal>, EngineError>;
    /// Places a proposal of this engine.
    fn place(&mut self, proposal: &Proposal, progress: &Progress) -> Result<StripId, EngineError>;
    /// Removes a placed strip.
    fn remove(&mut self, strip: StripId, progress: &Progress) -> Result<(), EngineError>;
    /// Takes back the last change.
    fn undo(&mut self, progress: &Progress) -> Result<(), EngineError>;
    /// Makes the change taken back last again.
    fn redo(&mut self, progress: &Progress) -> Result<(), EngineError>;
    /// Shows or hides a strip; no change of the design.
    fn set_visible(&mut self, strip: StripId, visible: bool) -> Result<(), EngineError>;
    /// The strip that helps most now; not yet placed.
    fn suggest(&mut self, progress: &Progress) -> Result<Proposal, EngineError>;
    /// Tries other strips, with which the layout follows the shape better. Every change for the better is handed to `watch`
    /// with a scene of it, which may break off: the best so far is then kept. One step of the history.
    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError>;
    /// Weaves from now on with so much detail; the strips stay where they are.
    fn set_detail(&mut self, detail: Detail, progress: &Progress) -> Result<(), EngineError>;
    /// Pins a part of the layout where it is, or lets it go; no change of the strips.
    fn set_pinned(&mut self, part: LayoutPart, pinned: bool) -> Result<(), EngineError>;
    /// Optimises the embedding of the layout. Every improvement is handed to `watch`, which may break off: the best so
    /// far is then finished and kept. The result is forgotten when the strips change.
    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError>;
    /// What is to be shown now.
    fn scene(&self) -> Arc<Scene>;
    /// Adds to the scene something that takes long and may come later, such as stripes or the layout; returns whether
    /// the scene changed, and is called until it did not.
    fn complete(&mut self, progress: &Progress) -> Result<bool, EngineError>;
    /// Writes the design.
    fn save(&self, path: &Path) -> Result<(), EngineError>;
    /// Writes the finished layout into a folder; refuses while a region is red.
    fn export(
        &mut self,
        folder: &Path,
        options: &ExportOptions,
        progress: &Progress,
    ) -> Result<ExportReport, EngineError>;
}

/// A snapshot of a design, as the window shows it.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The model.
    pub model: Arc<ModelFacts>,
    /// The mesh that is pointed at; the same value as long as the model is the same.
    pub design_mesh: Arc<TriMesh>,
    /// Finds points of the design mesh.
    pub index: Arc<SurfaceIndex>,
    /// What is drawn.
    pub surface: Arc<DisplaySurface>,
    /// Placed strips in order.
    pub strips: Vec<Strip>,
    /// What remains to be done, most urgent first; empty when nothing does.
    pub remarks: Vec<Remark>,
    /// Where the design stands, in one sentence: "Ready to export: 14 patches, 16 nodes (8 irregular)".
    pub summary: String,
    /// Whether the layout is valid and can leave.
    pub exportable: bool,
    /// The layout, once it is valid.
    pub layout: Option<Arc<LayoutPreview>>,
    /// What was optimised, if the layout shown is.
    pub embedding: Option<Arc<EmbeddingSummary>>,
    /// With how much detail is woven.
    pub detail: Detail,
    /// Whether there is a change to take back.
    pub can_undo: bool,
    /// Whether there is one to make again.
    pub can_redo: bool,
}

/// What relief of the surface guides strips. Both are fractions of the model's size, its bounding-box diagonal.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Detail {
    /// Radius of the ball over which curvature is taken.
    pub curvature_radius: f64,
    /// Relief smaller than this is smoothed away for weaving; 0: none is.
    pub smoothing: f64,
}

/// What is known of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModelFacts {
    /// Its name.
    pub name: String,
    /// Pairs such as ("Triangles", "13 568").
    pub facts: Vec<(String, String)>,
    /// What was repaired on reading, in words.
    pub repairs: Vec<String>,
}

/// The triangles to draw, perhaps finer than the design mesh. Arrays per face have one entry for each of `faces`; what
/// does not change with the strips is shared by the snapshots of a large mesh.
#[derive(Debug, Clone, Default)]
pub struct DisplaySurface {
    /// Positions.
    pub positions: Arc<Vec<DVec3>>,
    /// Triangles, counterclockwise from outside.
    pub faces: Arc<Vec<[u32; 3]>>,
    /// Normals at the corners of each face.
    pub normals: Arc<Vec<[DVec3; 3]>>,
    /// The triangle of the design mesh that each face lies in.
    pub base: Arc<Vec<u32>>,
    /// The colour of the region of each face; empty when there are no regions yet.
    pub regions: Vec<RegionColour>,
    /// The stripe pattern of each face along both families; empty when there is no strip map.
    pub stripes: Vec<[Option<Stripes>; 2]>,
}

/// The lines of the stripe pattern that run along one strip through one face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stripes {
    /// At each corner the distance from the strip's spine, positive on its left, counted in lines of the pattern.
    pub at: [f64; 3],
    /// How many lines the strip has on the left and on the right of its spine; it ends with the last of them.
    pub reach: [u8; 2],
}

/// How urgent a region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum RegionColour {
    /// Nothing to remark.
    #[default]
    None,
    /// Its valence does not fit its curvature.
    Yellow,
    /// It has several corners.
    Orange,
    /// It is not a disc.
    Red,
}

/// A placed strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Its name.
    pub id: StripId,
    /// The spine; a closed one does not repeat its first point.
    pub polyline: Vec<DVec3>,
    /// Whether it closes.
    pub closed: bool,
    /// Length of the spine, in the file's units.
    pub length: f64,
    /// Whether it is shown.
    pub visible: bool,
}

/// Something that remains to be done.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// How urgent.
    pub color: RegionColour,
    /// In words: "3 regions are not discs".
    pub text: String,
    /// Where the first of them is.
    pub place: Option<DVec3>,
}

/// A part of a layout that can be pinned, by its place in [`LayoutPreview`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LayoutPart {
    /// A node.
    Node(usize),
    /// An arc.
    Arc(usize),
}

/// The layout in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayoutPreview {
    /// Arcs, each from node to node.
    pub arcs: Vec<LayoutArc>,
    /// Nodes.
    pub nodes: Vec<LayoutNode>,
}

impl LayoutPreview {
    /// Whether a part is pinned; `None` where there is no such part.
    pub fn is_pinned(&self, part: LayoutPart) -> Option<bool> {
        match part {
            LayoutPart::Node(i) => self.nodes.get(i).map(|n| n.pinned),
            LayoutPart::Arc(i) => self.arcs.get(i).map(|a| a.pinned),
        }
    }

    /// The pinned nodes, then the pinned arcs.
    pub fn pinned(&self) -> Vec<LayoutPart> {
        let nodes = (0..self.nodes.len()).map(LayoutPart::Node);
        let parts = nodes.chain((0..self.arcs.len()).map(LayoutPart::Arc));
        parts.filter(|&p| self.is_pinned(p) == Some(true)).collect()
    }
}

/// An arc of the layout.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayoutArc {
    /// From node to node.
    pub points: Vec<DVec3>,
    /// Whether it only shows about where it will be, while the map has folds in its way.
    pub sketched: bool,
    /// Whether it is to stay where it is.
    pub pinned: bool,
}

/// A node of the layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayoutNode {
    /// Where.
    pub position: DVec3,
    /// Number of arcs that end there.
    pub valence: u32,
    /// Whether the valence is other than 4 inside, 3 on the boundary.
    pub irregular: bool,
    /// Whether it is to stay where it is.
    pub pinned: bool,
}

/// An embedding on its way.
#[derive(Debug, Clone)]
pub struct EmbeddingStep {
    /// Steps made so far.
    pub step: usize,
    /// The energy as a fraction of that with which its phase began: least squares, then maps without folds.
    pub energy: f64,
    /// Triangles that the map turns over.
    pub flipped: usize,
    /// The layout as it is now.
    pub layout: LayoutPreview,
}

/// An optimised embedding in figures.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmbeddingSummary {
    /// Steps made.
    pub steps: usize,
    /// Energy over the area of the surface, at the start and in the end.
    pub energy: [f64; 2],
    /// Triangles turned over at the start and in the end.
    pub flipped: [usize; 2],
    /// Mean conformal distortion of the patches' maps, 2 at best.
    pub conformal: f64,
    /// Mean deviation of the patches' isolines from principal directions, in degrees.
    pub alignment: f64,
    /// How far quads along the isolines are from flat, 0 at best.
    pub planar: f64,
    /// Longer over shorter side of the most oblong patch, and its middle.
    pub aspect: (f64, DVec3),
    /// Sharp edges on isolines, sharp edges in all, and the middle of the first that is not on one.
    pub features: (usize, usize, Option<DVec3>),
    /// What could not be unfolded, in words.
    pub folds: Vec<Remark>,
    /// What the maps do to each triangle of the design mesh.
    pub triangles: Vec<TriangleDistortion>,
}

/// What the maps of the patches do to one triangle of the design mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleDistortion {
    /// Mean conformal distortion, 2 at best.
    pub conformal: f64,
    /// Mean deviation from principal directions, in degrees, 0 to 45.
    pub deviation: f64,
    /// How pronounced the principal directions are, from 0 (not at all) to 1.
    pub anisotropy: f64,
    /// Whether some part of it is turned over.
    pub flipped: bool,
}
