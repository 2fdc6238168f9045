//! What the window asks of the engine, and what it is shown: a trait and plain data.
//!
//! The window and the worker know only this. An engine is opened by an [`Opener`], owned by the worker thread and
//! never touched by the window, which reads the immutable [`Scene`] snapshots.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use plait_core::mesh::TriMesh;
use plait_core::progress::{Cancelled, Progress};
use plait_core::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint};
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
    /// Its spine on the design mesh.
    pub curve: SurfaceCurve,
    /// The lower, the better.
    pub cost: f64,
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
    pub remains: Vec<Remark>,
    /// Where the design stands, in one sentence: "Ready to export: 14 patches, 16 nodes (8 irregular)".
    pub summary: String,
    /// Whether the layout is valid and can leave.
    pub exportable: bool,
    /// The layout, once it is valid.
    pub layout: Option<Arc<LayoutPreview>>,
    /// Whether there is a change to take back.
    pub can_undo: bool,
    /// Whether there is one to make again.
    pub can_redo: bool,
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

/// The triangles to draw, perhaps finer than the design mesh. Arrays per face have one entry for each of `faces`.
#[derive(Debug, Clone, Default)]
pub struct DisplaySurface {
    /// Positions.
    pub positions: Vec<DVec3>,
    /// Triangles, counterclockwise from outside.
    pub faces: Vec<[u32; 3]>,
    /// Normals at the corners of each face.
    pub normals: Vec<[DVec3; 3]>,
    /// The colour of the region of each face; empty when there are no regions yet.
    pub regions: Vec<RegionColor>,
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
pub enum RegionColor {
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
    pub color: RegionColor,
    /// In words: "3 regions are not discs".
    pub text: String,
    /// Where the first of them is.
    pub place: Option<DVec3>,
}

/// The layout in space.
#[derive(Debug, Clone, Default)]
pub struct LayoutPreview {
    /// Arcs, each from node to node.
    pub arcs: Vec<Vec<DVec3>>,
    /// Nodes with their valence and whether they lie on the boundary.
    pub nodes: Vec<LayoutNode>,
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
}
