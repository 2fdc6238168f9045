//! The state of the window, and what can be asked of it.

use std::sync::Arc;
use std::time::Duration;

use glam::{DVec3, Vec2};
use plait_core::surface::SurfacePoint;
use plait_core::weave::{Anchor, Improvement};

use super::action::ViewOptions;
use super::dialogs::Dialogs;
use super::editing::Editing;
use super::hover::{Grip, Hover};
use super::messages::Messages;
use super::prepared::Prepared;
use crate::camera::Camera;
use crate::distortion::ColourMode;
use crate::engine::{BuiltIn, Detail, EmbeddingStep, EmbeddingSummary, LayoutPart, LayoutPreview, Scene, StripId};
use crate::input::Input;
use crate::shading;
use crate::worker::{Running, StoppableWork, Worker};

/// Work that takes longer shows a progress bar.
const PROGRESS_DELAY: Duration = Duration::from_millis(500);
/// Depth behind the surface up to which a point counts as visible, as a fraction of the model size. Nodes, arcs and spines may lie
/// a little below the triangles.
const DEPTH_TOLERANCE: f32 = 0.01;
/// Default target number of quads of an export.
const DEFAULT_QUADS: usize = 10_000;

/// The window of the program.
pub struct PlaitApp {
    pub(super) worker: Worker,
    pub(super) built_ins: Vec<BuiltIn>,
    pub(super) scene: Option<Arc<Scene>>,
    pub(super) camera: Camera,
    pub(super) input: Input,
    pub(super) hover: Hover,
    /// The strip that is edited.
    pub(super) editing: Option<Editing>,
    /// What is dragged.
    pub(super) dragged: Option<Grip>,
    pub(super) prepared: Prepared,
    pub(super) options: ViewOptions,
    /// The colour mode chosen; see [`Self::colour_mode`].
    pub(super) chosen_colours: ColourMode,
    /// The latest step of a running optimisation of the embedding.
    pub(super) step: Option<EmbeddingStep>,
    /// The latest result of a running search for better strips.
    pub(super) improvement: Option<Improvement>,
    pub(super) selected: Option<StripId>,
    /// The detail chosen in the panel, not necessarily applied yet.
    pub(super) detail: Option<Detail>,
    pub(super) messages: Messages,
    pub(super) dialogs: Dialogs,
    /// Target number of quads of an export.
    pub(super) quads: usize,
    /// Size of the 3D view, in points.
    pub(super) view_size: Vec2,
    /// Top left corner of the 3D view in the window, in points.
    pub(super) view_corner: egui::Pos2,
    /// Whether the camera is to frame the model as soon as the size of the view is known.
    pub(super) frame_pending: bool,
    pub(super) shortcuts_open: bool,
    pub(super) about_open: bool,
    pub(super) title: String,
}

impl PlaitApp {
    /// The state before a model is open.
    pub(super) fn with_worker(worker: Worker, built_ins: Vec<BuiltIn>) -> Self {
        Self {
            worker,
            built_ins,
            scene: None,
            camera: Camera::default(),
            input: Input::default(),
            hover: Hover::default(),
            editing: None,
            dragged: None,
            prepared: Prepared::default(),
            options: ViewOptions::default(),
            chosen_colours: ColourMode::default(),
            step: None,
            improvement: None,
            selected: None,
            detail: None,
            messages: Messages::default(),
            dialogs: Dialogs::default(),
            quads: DEFAULT_QUADS,
            view_size: Vec2::new(1.0, 1.0),
            view_corner: egui::Pos2::ZERO,
            frame_pending: false,
            shortcuts_open: false,
            about_open: false,
            title: String::new(),
        }
    }

    /// Uses no dialogs of the system from now on, only those of the program.
    pub fn use_own_dialogs(&mut self) {
        self.dialogs.only_own = true;
    }

    /// The scene shown; `None` until the first model is open.
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_deref()
    }

    /// Number of proposals under the pointer, and the index of the one shown.
    pub fn offered(&self) -> (usize, usize) {
        (self.hover.proposals.len(), self.hover.chosen)
    }

    /// The spine of the proposal shown, on the design mesh.
    pub fn shown(&self) -> Option<&Vec<DVec3>> {
        self.hover.shown().map(|p| &p.polyline)
    }

    /// The anchors of the strip that is edited, in order; `None` while none is.
    pub fn anchors(&self) -> Option<&[Anchor]> {
        self.editing.as_ref().map(Editing::anchors)
    }

    /// The strip selected in the list.
    pub fn selected(&self) -> Option<StripId> {
        self.selected
    }

    /// The nodes and arcs shown: of the running optimisation, or else of the scene.
    pub fn layout(&self) -> Option<&LayoutPreview> {
        let layout = self.scene.as_ref().and_then(|s| s.layout.as_deref());
        self.step.as_ref().map(|s| &s.layout).or(layout)
    }

    /// The node or arc that a click would pin or unpin.
    pub fn pinnable(&self) -> Option<LayoutPart> {
        self.hover.part
    }

    /// What the colours of the surface show: the mode chosen, if there is an optimised embedding.
    pub fn colour_mode(&self) -> ColourMode {
        if self.summary().is_some() { self.chosen_colours } else { ColourMode::Regions }
    }

    /// The quality of the optimised embedding, if it is shown.
    pub(super) fn summary(&self) -> Option<&Arc<EmbeddingSummary>> {
        self.scene.as_ref().filter(|_| self.step.is_none()).and_then(|s| s.embedding.as_ref())
    }

    /// The running work of this kind.
    pub(super) fn running_work(&self, work: StoppableWork) -> Option<Running> {
        self.worker.running().filter(|r| r.stoppable.as_ref().is_some_and(|s| s.work == work))
    }

    /// Whether a search for better strips or an optimisation of the embedding runs.
    pub(super) fn is_optimising(&self) -> bool {
        self.worker.running().is_some_and(|r| r.stoppable.is_some())
    }

    /// Whether there is a valid layout, and no search or optimisation runs.
    pub(super) fn can_optimise(&self) -> bool {
        self.scene.as_ref().is_some_and(|s| s.exportable) && !self.is_optimising()
    }

    /// The running work that is shown by the progress bar over the view. Stoppable work is shown in the side panel.
    pub(super) fn long_work(&self) -> Option<Running> {
        self.worker.running().filter(|r| !r.yields && r.stoppable.is_none() && r.since.elapsed() >= PROGRESS_DELAY)
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Where a point of the model appears in the window; `None` behind the eye.
    pub fn on_screen(&self, point: DVec3) -> Option<egui::Pos2> {
        let at = self.camera.project(point.as_vec3(), self.view_size)?;
        Some(self.view_corner + egui::vec2(at.x, at.y))
    }

    /// Whether the worker is idle. Its replies are taken in by the next frame.
    pub fn is_idle(&self) -> bool {
        self.worker.is_idle()
    }

    /// The surface point that appears at `at` in the view.
    pub(super) fn pick(&self, at: Vec2) -> Option<SurfacePoint> {
        let ray = self.camera.ray(at, self.view_size);
        let hit = self.scene.as_ref()?.index.ray(ray.origin.as_dvec3(), ray.direction.as_dvec3());
        hit.map(|(point, _)| point)
    }

    /// Whether a point is not hidden by the surface.
    pub(super) fn sees(&self, p: DVec3) -> bool {
        let Some(scene) = &self.scene else { return false };
        let Some(at) = self.camera.project(p.as_vec3(), self.view_size) else { return false };
        let ray = self.camera.ray(at, self.view_size);
        let distance = p.as_vec3().distance(ray.origin);
        match scene.index.ray(ray.origin.as_dvec3(), ray.direction.as_dvec3()) {
            Some((hit, _)) => {
                hit.position(&scene.design_mesh).as_vec3().distance(ray.origin) > distance - DEPTH_TOLERANCE
            }
            // The ray misses the surface at a silhouette.
            None => true,
        }
    }

    /// Moves the camera to show the whole model.
    pub(super) fn frame_all(&mut self) {
        if let Some(scene) = &self.scene {
            self.camera.frame(&shading::framing_points(&scene.surface), self.view_size);
        }
    }
}
