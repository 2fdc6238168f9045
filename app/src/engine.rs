//! The interface between the window and the library: a trait for what can be done, and plain data for what is shown.
//!
//! Window and worker depend on nothing else, so that they can be tested with a substitute. An [`Opener`] makes an
//! [`Engine`]. The worker thread owns it. The window reads immutable snapshots, the [`Scene`]s.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use plait_core::mesh::TriMesh;
use plait_core::progress::{Cancelled, Progress};
use plait_core::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint};
use plait_core::weave::{Anchor, ElasticEnergy, FaceDistortion, Improvement};
use thiserror::Error;

/// Why an operation of the engine failed. The design is unchanged.
#[derive(Debug, Clone, Error)]
pub enum EngineError {
    /// The operation was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The operation is not possible.
    #[error("{message}")]
    Failed {
        /// What is wrong, for the user.
        message: String,
        /// Where on the model, if the error has a place.
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

/// A model or design to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A built-in model, by name.
    BuiltIn(String),
    /// A mesh or a design.
    File(PathBuf),
}

impl Source {
    /// The name to show.
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
    /// The name to open it by.
    pub name: String,
    /// A few words on its shape.
    pub hint: String,
}

/// Opens engines.
pub trait Opener: Send + Sync {
    /// The built-in models. The first is the default.
    fn built_ins(&self) -> Vec<BuiltIn>;
    /// Reads and prepares a model, or a design with its model.
    ///
    /// # Errors
    ///
    /// When the file is not a valid mesh or design, or the operation was cancelled.
    fn open(&self, source: &Source, progress: &Progress) -> Result<Box<dyn Engine>, EngineError>;
}

/// Identifies a placed strip, for the lifetime of the design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StripId(pub u32);

/// A strip that could be placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Its spine on the mesh that is woven on, the design mesh or its proxy.
    pub curve: SurfaceCurve,
    /// Elastica cost (section 8.2); lower is better.
    pub cost: f64,
    /// Elastic energy before and after relaxation; `None` for a curve that was not found in the elastica graph.
    pub energy: Option<ElasticEnergy>,
    /// The spine on the design mesh. A closed one does not repeat its first point.
    pub polyline: Vec<DVec3>,
    /// The anchors that it passes in order; none for a suggestion.
    pub anchors: Vec<Anchor>,
}

/// What strips are searched for.
#[derive(Debug, Clone, PartialEq)]
pub enum Search {
    /// Strips through a point of [`Scene::design_mesh`].
    Point(SurfacePoint),
    /// Strips through anchors in order; `replaces` is the placed strip that is edited.
    Anchors {
        /// The anchors; at least one.
        anchors: Vec<Anchor>,
        /// The strip that is edited. It does not block directions.
        replaces: Option<StripId>,
    },
}

/// Options of an export.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// Size of the quads.
    pub refinement: Refinement,
}

/// Size of the quads of an export.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refinement {
    /// Target number of quads.
    Quads(usize),
    /// Target edge length, in units of the file.
    EdgeLength(f64),
}

/// The result of an export.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExportReport {
    /// The files written.
    pub files: Vec<PathBuf>,
    /// Size of the layout in words.
    pub summary: String,
}

/// The interactive design of one layout. An operation that fails changes nothing.
///
/// All errors are [`EngineError::Cancelled`], or a failure with its reason.
#[allow(clippy::missing_errors_doc)] // said once, above
pub trait Engine: Send {
    /// The proposals of a search, best first. `first` is called with a proposal found early, before it is known to be the
    /// best.
    fn proposals(
        &mut self,
        search: &Search,
        first: &mut dyn FnMut(Proposal),
        progress: &Progress,
    ) -> Result<Vec<Proposal>, EngineError>;
    /// Places a proposal of this engine, or puts it in the place of a strip.
    fn place(
        &mut self,
        proposal: &Proposal,
        replaces: Option<StripId>,
        progress: &Progress,
    ) -> Result<StripId, EngineError>;
    /// Removes a placed strip.
    fn remove(&mut self, strip: StripId, progress: &Progress) -> Result<(), EngineError>;
    /// Undoes the last change.
    fn undo(&mut self, progress: &Progress) -> Result<(), EngineError>;
    /// Redoes the change undone last.
    fn redo(&mut self, progress: &Progress) -> Result<(), EngineError>;
    /// Shows or hides a strip; no change of the design.
    fn set_visible(&mut self, strip: StripId, visible: bool) -> Result<(), EngineError>;
    /// The strip that resolves the most urgent problem. It is not placed yet.
    fn suggest(&mut self, progress: &Progress) -> Result<Proposal, EngineError>;
    /// Searches for strips with a lower objective. Every improvement is passed to `watch` with its scene. When `watch`
    /// breaks, the best strips so far are kept. All changes are one step of the history.
    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError>;
    /// Changes smoothing and curvature radius, and prepares the model again. The strips stay where they are.
    fn set_detail(&mut self, detail: Detail, progress: &Progress) -> Result<(), EngineError>;
    /// Pins or unpins a node or an arc of the layout.
    fn set_pinned(&mut self, part: LayoutPart, pinned: bool) -> Result<(), EngineError>;
    /// Optimises the embedding of the layout. Every improvement is passed to `watch`. When `watch` breaks, the best
    /// embedding so far is completed and kept. A change of the strips discards the result.
    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError>;
    /// The present scene.
    fn scene(&self) -> Arc<Scene>;
    /// Computes a part of the scene that was left out because it takes long, such as the layout. To be called until it
    /// returns false: the scene is then complete.
    fn complete(&mut self, progress: &Progress) -> Result<bool, EngineError>;
    /// Writes the design to a file.
    fn save(&self, path: &Path) -> Result<(), EngineError>;
    /// Writes the layout to a folder. Fails while a region is red.
    fn export(
        &mut self,
        folder: &Path,
        options: &ExportOptions,
        progress: &Progress,
    ) -> Result<ExportReport, EngineError>;
}

/// A snapshot of a design.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The model.
    pub model: Arc<ModelFacts>,
    /// The mesh of the design, on which points are picked. Shared by all scenes of a model.
    pub design_mesh: Arc<TriMesh>,
    /// Spatial index of the design mesh.
    pub index: Arc<SurfaceIndex>,
    /// The triangles to draw.
    pub surface: Arc<DisplaySurface>,
    /// Placed strips, in order.
    pub strips: Vec<Strip>,
    /// Problems of the design, most urgent first.
    pub remarks: Vec<Remark>,
    /// Size of the layout, "Ready to export: 14 patches, 16 nodes (8 irregular)"; empty while it is not valid.
    pub summary: String,
    /// Whether the layout is valid.
    pub exportable: bool,
    /// The layout, if it is valid.
    pub layout: Option<Arc<LayoutPreview>>,
    /// Quality of the optimised embedding; `None` while the initial embedding is shown.
    pub embedding: Option<Arc<EmbeddingSummary>>,
    /// Smoothing and curvature radius.
    pub detail: Detail,
    /// Whether there is a change to undo.
    pub can_undo: bool,
    /// Whether there is a change to redo.
    pub can_redo: bool,
}

/// The scale of the features that strips follow. Both lengths are fractions of the model size.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Detail {
    /// Radius of the ball over which curvature is estimated.
    pub curvature_radius: f64,
    /// Smoothing radius of the mesh that is woven on; 0: no smoothing.
    pub smoothing: f64,
}

/// Name, size and repairs of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModelFacts {
    /// Its name.
    pub name: String,
    /// Pairs such as ("Triangles", "13 568").
    pub facts: Vec<(String, String)>,
    /// The repairs made on reading, in words.
    pub repairs: Vec<String>,
}

/// The triangles to draw, a refinement of the design mesh. Arrays per face have one entry for each of `faces`. Arrays
/// that do not depend on the strips are shared between scenes where possible.
#[derive(Debug, Clone, Default)]
pub struct DisplaySurface {
    /// Positions.
    pub positions: Arc<Vec<DVec3>>,
    /// Triangles, counter-clockwise seen from outside.
    pub faces: Arc<Vec<[u32; 3]>>,
    /// Normals at the corners of each face.
    pub normals: Arc<Vec<[DVec3; 3]>>,
    /// The triangle of the design mesh that each face lies in.
    pub base: Arc<Vec<u32>>,
    /// The colour of the region of each face; empty without strips.
    pub regions: Vec<RegionColour>,
    /// The stripe pattern of each face along both families of isolines; empty without a strip map.
    pub stripes: Vec<[Option<Stripes>; 2]>,
}

/// The stripe pattern of one strip on one face: lines parallel to the spine. Lengths are those of the scene, in which the
/// bounding box of the model has a diagonal of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stripes {
    /// The strip, which determines the colour.
    pub strip: StripId,
    /// At each corner the signed distance to the spine, positive on the left.
    pub at: [f64; 3],
    /// By how much the distance exceeds its linear interpolation, for each side of the face from corner `i` to `i + 1`: the
    /// distance at barycentric coordinates `w` is `Σ w_i at_i + 2 Σ w_i w_{i+1} bulge_i`. 0 for straight lines.
    pub bulge: [f64; 3],
    /// The width of the strip on this side of the spine. The pattern fades towards this distance.
    pub reach: f64,
    /// Strength of the pattern at each corner, 0 to 1: it fades where the strip is cut off or its map is distorted.
    pub strength: [f64; 3],
}

impl Stripes {
    /// Distance and strength at barycentric coordinates `w`.
    pub fn sample(&self, w: [f64; 3]) -> (f64, f64) {
        let sum = |values: [f64; 3]| (0..3).map(|i| w[i] * values[i]).sum::<f64>();
        let bulge: f64 = (0..3).map(|i| 2.0 * w[i] * w[(i + 1) % 3] * self.bulge[i]).sum();
        (sum(self.at) + bulge, sum(self.strength).clamp(0.0, 1.0))
    }
}

/// How urgent the problem of a region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum RegionColour {
    /// No problem.
    #[default]
    None,
    /// The valence of its node does not match its curvature.
    Yellow,
    /// It contains several corners of the shape, or its node has valence 2.
    Orange,
    /// It is not a disc, or has too few corners: the layout is not valid.
    Red,
}

/// A placed strip.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Its identifier.
    pub id: StripId,
    /// The spine on the design mesh. A closed one does not repeat its first point.
    pub polyline: Vec<DVec3>,
    /// Whether the spine is closed.
    pub closed: bool,
    /// Length of the spine, in units of the file.
    pub length: f64,
    /// Elastica cost of the loop as it was found.
    pub cost: f64,
    /// Whether it is shown.
    pub visible: bool,
    /// The anchors that it was placed through; none if it was not placed by hand.
    pub anchors: Vec<Anchor>,
}

/// A problem of the design or the embedding.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// How urgent it is.
    pub colour: RegionColour,
    /// The problem in words: "3 regions have several borders".
    pub text: String,
    /// The place of the first occurrence.
    pub place: Option<DVec3>,
}

/// A node or an arc of a layout, by its index in [`LayoutPreview`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LayoutPart {
    /// A node.
    Node(usize),
    /// An arc.
    Arc(usize),
}

/// Nodes and arcs of a layout in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayoutPreview {
    /// Arcs, each from node to node.
    pub arcs: Vec<LayoutArc>,
    /// Nodes.
    pub nodes: Vec<LayoutNode>,
}

impl LayoutPreview {
    /// Whether a node or an arc is pinned; `None` if there is no such part.
    pub fn is_pinned(&self, part: LayoutPart) -> Option<bool> {
        match part {
            LayoutPart::Node(i) => self.nodes.get(i).map(|n| n.pinned),
            LayoutPart::Arc(i) => self.arcs.get(i).map(|a| a.pinned),
        }
    }

    /// The pinned nodes, followed by the pinned arcs.
    pub fn pinned(&self) -> Vec<LayoutPart> {
        let nodes = (0..self.nodes.len()).map(LayoutPart::Node);
        let parts = nodes.chain((0..self.arcs.len()).map(LayoutPart::Arc));
        parts.filter(|&p| self.is_pinned(p) == Some(true)).collect()
    }
}

/// An arc of the layout.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayoutArc {
    /// Points from one node to the other.
    pub points: Vec<DVec3>,
    /// Whether the points are an approximation: flipped triangles prevent isoline tracing.
    pub approximate: bool,
    /// Whether it is pinned.
    pub pinned: bool,
}

/// A node of the layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayoutNode {
    /// Position.
    pub position: DVec3,
    /// Number of incident arc ends.
    pub valence: u32,
    /// Whether the valence differs from 4, on the boundary from 3.
    pub irregular: bool,
    /// Whether it is pinned.
    pub pinned: bool,
}

/// A step of the optimisation of an embedding.
#[derive(Debug, Clone)]
pub struct EmbeddingStep {
    /// Number of steps so far.
    pub step: usize,
    /// Energy relative to the start of the phase: first least squares, then locally injective maps.
    pub energy: f64,
    /// Number of flipped triangles.
    pub flipped: usize,
    /// The layout after this step.
    pub layout: LayoutPreview,
}

/// Quality of an optimised embedding.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmbeddingSummary {
    /// Number of steps.
    pub steps: usize,
    /// Energy divided by the area of the surface, before and after.
    pub energy: [f64; 2],
    /// Number of flipped triangles, before and after.
    pub flipped: [usize; 2],
    /// Mean conformal distortion of the patch maps; 2 at best.
    pub conformal: f64,
    /// Mean angle between isolines and principal directions, in degrees.
    pub alignment: f64,
    /// Deviation of quads along isolines from planarity; 0 at best.
    pub planar: f64,
    /// The largest aspect ratio of a patch, and the centre of that patch.
    pub aspect: (f64, DVec3),
    /// Number of feature edges on isolines, number of all, and the midpoint of the first that is not on an isoline.
    pub features: (usize, usize, Option<DVec3>),
    /// Remaining flipped triangles, by reason.
    pub flip_remarks: Vec<Remark>,
    /// Distortion of each triangle of the design mesh.
    pub triangles: Vec<FaceDistortion>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bulge_of_a_side_is_the_excess_in_its_middle_twice() {
        let stripes = Stripes {
            strip: StripId(0),
            at: [0.1, 0.3, 0.0],
            bulge: [0.02, 0.0, 0.0],
            reach: 1.0,
            strength: [1.0, 0.5, 0.0],
        };
        let (distance, strength) = stripes.sample([0.5, 0.5, 0.0]);
        assert!((distance - 0.21).abs() < 1e-12 && strength == 0.75);
        assert_eq!(stripes.sample([0.0, 0.0, 1.0]), (0.0, 0.0));
    }

    #[test]
    fn a_file_is_named_without_its_folder() {
        assert_eq!(Source::File("some/folder/bunny.obj".into()).name(), "bunny.obj");
        assert_eq!(Source::BuiltIn("torus".into()).name(), "torus");
    }

    #[test]
    fn pinned_nodes_come_before_pinned_arcs() {
        let node = |pinned| LayoutNode { position: DVec3::ZERO, valence: 4, irregular: false, pinned };
        let arc = |pinned| LayoutArc { pinned, ..LayoutArc::default() };
        let layout = LayoutPreview { arcs: vec![arc(true), arc(false)], nodes: vec![node(false), node(true)] };
        assert_eq!(layout.pinned(), [LayoutPart::Node(1), LayoutPart::Arc(0)]);
    }

    #[test]
    fn a_part_that_does_not_exist_is_neither_pinned_nor_not() {
        let layout = LayoutPreview::default();
        assert_eq!((layout.is_pinned(LayoutPart::Node(0)), layout.is_pinned(LayoutPart::Arc(3))), (None, None));
    }
}
