//! The window: state, what each action does, and the layout of panels around the 3D view.

mod action;
mod bettering;
mod detail;
mod dialogs;
mod embedding;
mod icons;
mod messages;
mod panels;
mod parts;
mod theme;
mod view;

use std::sync::Arc;
use std::time::Duration;

use glam::{DVec3, Vec2, Vec3};
use plait_core::surface::SurfacePoint;
use plait_core::weave::Improvement;

pub use action::{Action, ViewOption, ViewOptions};
use dialogs::{Asked, Dialogs};
use messages::{Messages, Tone};
use view::{Hover, Prepared};

use crate::camera::Camera;
use crate::distortion::Colours;
use crate::engine::{
    Detail, EmbeddingStep, EmbeddingSummary, EngineError, ExportOptions, LayoutPart, LayoutPreview, Opener, Refinement,
    RegionColour, Scene, Source, StripId,
};
use crate::input::Input;
use crate::render::Renderer;
use crate::shading;
use crate::weaving::improved;
use crate::worker::{Job, Reply, Running, StoppableWork, Worker};

/// Work that takes longer shows a progress bar.
const SHORT: Duration = Duration::from_millis(500);
/// How often the progress bar moves.
const PROGRESS_TICK: Duration = Duration::from_millis(100);
/// Quads of an export when the user said nothing else.
const DEFAULT_QUADS: usize = 10_000;

/// Opens the window and returns when it was closed.
///
/// # Errors
///
/// When the system gives no window or no graphics device.
pub fn run(opener: Arc<dyn Opener>, source: Option<Source>) -> Result<(), eframe::Error> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Plait")
        .with_app_id("plait")
        .with_inner_size([1440.0, 900.0])
        .with_min_inner_size([720.0, 480.0]);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    eframe::run_native("plait", options, Box::new(move |cc| Ok(Box::new(PlaitApp::new(cc, opener, source)?))))
}

/// The program's window.
pub struct PlaitApp {
    worker: Worker,
    built_ins: Vec<crate::engine::BuiltIn>,
    scene: Option<Arc<Scene>>,
    camera: Camera,
    input: Input,
    hover: Hover,
    prepared: Prepared,
    options: ViewOptions,
    colours: Colours,
    /// The embedding being optimised, as it was last heard of.
    step: Option<EmbeddingStep>,
    /// How much better the strips being tried are, as it was last heard of.
    improvement: Option<Improvement>,
    selected: Option<StripId>,
    /// The detail chosen last, which need not be applied yet.
    detail: Option<Detail>,
    messages: Messages,
    dialogs: Dialogs,
    quads: usize,
    view_size: Vec2,
    view_corner: egui::Pos2,
    frame_pending: bool,
    shortcuts_open: bool,
    about_open: bool,
    title: String,
}

impl PlaitApp {
    /// Makes the window's state and asks the worker to open `source`.
    ///
    /// # Errors
    ///
    /// When there is no graphics device or no thread.
    pub fn new(
        cc: &eframe::CreationContext<'_>,
        opener: Arc<dyn Opener>,
        source: Option<Source>,
    ) -> Result<Self, Box<dyn std::error::Error + Send + Sync>> {
        let gpu = cc.wgpu_render_state.as_ref().ok_or("the window has no graphics device")?;
        let renderer = Renderer::new(&gpu.device, gpu.target_format);
        gpu.renderer.write().callback_resources.insert(renderer);
        theme::apply(&cc.egui_ctx);
        let built_ins = opener.built_ins();
        let ctx = cc.egui_ctx.clone();
        let worker = Worker::start(opener, move || ctx.request_repaint())?;
        let first = built_ins.first().map(|b| Source::BuiltIn(b.name.clone()));
        if let Some(source) = source.or(first) {
            worker.request(Job::Open(source));
        }
        Ok(Self {
            worker,
            built_ins,
            scene: None,
            camera: Camera::default(),
            input: Input::default(),
            hover: Hover::default(),
            prepared: Prepared::default(),
            options: ViewOptions::default(),
            colours: Colours::default(),
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
        })
    }

    /// What is shown; `None` until the first model is open.
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_deref()
    }

    /// How many strips are offered under the pointer, and which of them is shown.
    pub fn offered(&self) -> (usize, usize) {
        (self.hover.proposals.len(), self.hover.chosen)
    }

    /// The strip selected in the list.
    pub fn selected(&self) -> Option<StripId> {
        self.selected
    }

    /// The arcs and nodes shown: those of the optimisation on its way, or of the scene.
    pub fn layout(&self) -> Option<&LayoutPreview> {
        let layout = self.scene.as_ref().and_then(|s| s.layout.as_deref());
        self.step.as_ref().map(|s| &s.layout).or(layout)
    }

    /// The part of the layout that a click would pin or let go.
    pub fn pinnable(&self) -> Option<LayoutPart> {
        self.hover.part
    }

    /// What the surface's colours tell now.
    pub fn colours(&self) -> Colours {
        if self.summary().is_some() { self.colours } else { Colours::Regions }
    }

    /// The figures of the optimised embedding that is shown.
    fn summary(&self) -> Option<&Arc<EmbeddingSummary>> {
        self.scene.as_ref().filter(|_| self.step.is_none()).and_then(|s| s.embedding.as_ref())
    }

    /// The work on its way that makes this better step by step.
    fn bettering(&self, what: StoppableWork) -> Option<Running> {
        self.worker.running().filter(|r| r.steps.as_ref().is_some_and(|s| s.of == what))
    }

    /// Whether anything is being made better step by step.
    fn is_bettering(&self) -> bool {
        self.worker.running().is_some_and(|r| r.steps.is_some())
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Where a point of the model appears in the window; `None` behind the viewer.
    pub fn on_screen(&self, point: DVec3) -> Option<egui::Pos2> {
        let at = self.camera.project(point.as_vec3(), self.view_size)?;
        Some(self.view_corner + egui::vec2(at.x, at.y))
    }

    /// Whether the worker has nothing to do and all it answered was taken in by a frame.
    pub fn is_idle(&self) -> bool {
        self.worker.is_idle()
    }

    /// The point of the surface that appears at `at`.
    fn pick(&self, at: Vec2) -> Option<SurfacePoint> {
        let ray = self.camera.ray(at, self.view_size);
        let hit = self.scene.as_ref()?.index.ray(ray.origin.as_dvec3(), ray.direction.as_dvec3());
        hit.map(|(point, _)| point)
    }

    /// The place that the newest message speaks of.
    fn marked_place(&self) -> Option<DVec3> {
        self.messages.place()
    }

    fn frame_all(&mut self) {
        if let Some(scene) = &self.scene {
            self.camera.frame(&shading::framing_points(&scene.surface), self.view_size);
        }
    }

    /// The work that has been going on long enough to be shown.
    fn long_work(&self) -> Option<Running> {
        // What becomes better step by step has its place in the panel.
        self.worker.running().filter(|r| !r.yields && r.steps.is_none() && r.since.elapsed() >= SHORT)
    }

    fn take_replies(&mut self) {
        while let Some(reply) = self.worker.reply() {
            match reply {
                Reply::Opened { source, scene } => self.opened(&source, scene),
                Reply::Changed(scene) => self.changed(scene),
                Reply::Completed(scene) => self.scene = Some(scene),
                Reply::Refitted { scene, improvement, complete } => self.refitted(scene, improvement, complete),
                Reply::Improved(step) => self.step = Some(step),
                Reply::Optimised(scene) => {
                    self.step = None;
                    self.scene = Some(scene);
                }
                Reply::Proposals { generation, proposals, complete } => {
                    if let Some(proposal) = self.hover.arrived(generation, proposals, complete) {
                        self.worker.request(Job::Place(proposal));
                        self.hover.clear();
                    }
                }
                Reply::Saved(path) => self.messages.add(Tone::Done, format!("Saved {}", path.display()), None),
                Reply::Exported(folder, report) => {
                    let text = format!("Exported to {}: {}", folder.display(), report.summary);
                    self.messages.add(Tone::Done, text, None);
                }
                Reply::Failed { label, error } => {
                    // Whatever was on its way did not come to an end.
                    (self.step, self.improvement) = (None, None);
                    self.failed(&label, error);
                }
            }
        }
    }

    fn failed(&mut self, label: &str, error: EngineError) {
        match error {
            EngineError::Cancelled => self.messages.add(Tone::Note, format!("{label}: cancelled"), None),
            EngineError::Failed { message, place } => {
                self.messages.add(Tone::Failed, format!("{label} failed: {message}"), place);
            }
        }
    }

    fn opened(&mut self, source: &Source, scene: Arc<Scene>) {
        self.messages.clear();
        if !scene.model.repairs.is_empty() {
            let text = format!("{} was repaired on opening: {}", source.name(), scene.model.repairs.join("; "));
            self.messages.add(Tone::Note, text, None);
        }
        self.selected = None;
        self.detail = None;
        self.step = None;
        self.colours = Colours::default();
        self.hover = Hover::default();
        self.scene = Some(scene);
        self.camera = Camera { z_up: self.options.z_up, ..Camera::default() };
        self.frame_pending = true;
    }

    fn changed(&mut self, scene: Arc<Scene>) {
        if self.selected.is_some_and(|s| scene.strips.iter().all(|strip| strip.id != s)) {
            self.selected = None;
        }
        // What was offered was compatible with the strips as they were.
        self.hover.clear();
        if scene.embedding.is_none() && self.scene.as_ref().is_some_and(|s| s.embedding.is_some()) {
            let text = "The strips changed: the optimised embedding is gone. Optimise again once the layout is valid.";
            self.messages.add(Tone::Note, text.into(), None);
        }
        self.scene = Some(scene);
    }

    /// Takes in strips that make a better layout.
    fn refitted(&mut self, scene: Arc<Scene>, improvement: Improvement, complete: bool) {
        self.improvement = Some(improvement).filter(|_| !complete);
        if improvement.changes > 0 {
            self.changed(scene);
        }
        if complete {
            let text = format!("Improved: {}", improved(&improvement));
            self.messages.add(Tone::Done, text, None);
        }
    }

    /// Carries out a wish.
    pub fn act(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::AskOpen => self.dialogs.ask(Asked::Open, ctx),
            Action::Open(source) => self.worker.request(Job::Open(source)),
            Action::AskSave => self.ask_with_name(Asked::Save, ctx),
            Action::AskExport => self.ask_export(ctx),
            Action::Quads(quads) => self.quads = quads,
            // What is on its way is taken back first.
            Action::Undo if self.is_bettering() => self.worker.cancel(),
            Action::Undo => self.change(Job::Undo),
            Action::Redo => self.change(Job::Redo),
            Action::Suggest => self.change(Job::Suggest),
            Action::Select(strip) => self.selected = strip,
            Action::Remove(strip) => self.change(Job::Remove(strip)),
            Action::SetVisible(strip, visible) => self.worker.request(Job::SetVisible(strip, visible)),
            Action::ChooseDetail(detail) => self.detail = Some(detail),
            Action::ApplyDetail => {
                if let Some(detail) = self.detail {
                    self.change(Job::SetDetail(detail));
                }
            }
            Action::Improve => self.improve(),
            Action::Optimise => self.optimise(),
            Action::Stop => self.worker.stop(),
            Action::SetPinned(part, pinned) => self.worker.request(Job::SetPinned(part, pinned)),
            Action::UnpinAll => {
                let pinned = self.layout().map(LayoutPreview::pinned).unwrap_or_default();
                pinned.into_iter().for_each(|p| self.worker.request(Job::SetPinned(p, false)));
            }
            Action::Colours(colours) => self.colours = colours,
            Action::FrameAll => self.frame_all(),
            Action::LookAt(place) => self.look_at(place.as_vec3()),
            Action::Toggle(option) => {
                self.options.toggle(option);
                self.camera.z_up = self.options.z_up;
            }
            Action::Cancel => self.worker.cancel(),
            Action::Dismiss(id) => self.messages.dismiss(id),
            Action::Shortcuts(open) => self.shortcuts_open = open,
            Action::About(open) => self.about_open = open,
            Action::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
        }
    }

    fn change(&mut self, job: Job) {
        if self.scene.is_some() {
            self.hover.clear();
            self.worker.request(job);
        }
    }

    /// Whether there is a layout to be made better, and nobody at it.
    fn can_optimise(&self) -> bool {
        self.scene.as_ref().is_some_and(|s| s.exportable) && !self.is_bettering()
    }

    fn improve(&mut self) {
        if self.can_optimise() {
            self.improvement = None;
            self.change(Job::Improve);
        }
    }

    fn optimise(&mut self) {
        if self.can_optimise() {
            self.hover.clear();
            self.worker.request(Job::Optimise);
        }
    }

    fn ask_with_name(&mut self, asked: Asked, ctx: &egui::Context) {
        let Some(scene) = &self.scene else { return };
        self.dialogs.suggested_name = scene.model.name.clone();
        self.dialogs.ask(asked, ctx);
    }

    /// Asks where to, or says at once why there is nothing to export yet.
    fn ask_export(&mut self, ctx: &egui::Context) {
        let Some(scene) = self.scene.as_deref() else { return };
        if scene.exportable {
            self.ask_with_name(Asked::Export, ctx);
            return;
        }
        let urgent: Vec<_> = scene.remarks.iter().filter(|r| r.color == RegionColour::Red).collect();
        let reasons: Vec<_> = urgent.iter().map(|r| r.text.as_str()).collect();
        let text = format!("There is no layout to export yet: {}", reasons.join("; "));
        self.messages.add(Tone::Failed, text, urgent.iter().find_map(|r| r.place));
    }

    /// Turns toward a place, so that the viewer looks at it straight from outside the model's middle.
    fn look_at(&mut self, place: Vec3) {
        let axis = if self.options.z_up { Vec3::new(place.x, place.z, -place.y) } else { place };
        if axis.length() > 1e-4 {
            let d = axis.normalize();
            self.camera.yaw = d.x.atan2(d.z);
            self.camera.pitch = d.y.clamp(-1.0, 1.0).asin().clamp(-1.2, 1.2);
        }
        self.camera.target = place * 0.5;
    }

    fn take_answers(&mut self) {
        for (asked, path) in self.dialogs.answers() {
            match asked {
                Asked::Open => self.worker.request(Job::Open(Source::File(path))),
                Asked::Save => self.worker.request(Job::Save(path)),
                Asked::Export => {
                    let options = ExportOptions { refinement: Refinement::Quads(self.quads) };
                    self.worker.request(Job::Export(path, options));
                }
            }
        }
    }

    fn show_title(&mut self, ctx: &egui::Context) {
        let title = self.scene.as_ref().map_or_else(|| "Plait".into(), |s| format!("Plait – {}", s.model.name));
        if self.title != title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    fn take_dropped_files(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|i| i.raw.dropped_files.first().map(|f| f.path().to_path_buf()));
        if let Some(path) = dropped {
            self.worker.request(Job::Open(Source::File(path)));
        }
    }
}

impl eframe::App for PlaitApp {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.take_replies();
        self.take_answers();
        self.take_dropped_files(&ctx);
        let mut actions = panels::keys(self, &ctx);
        panels::show(self, ui, &mut actions);
        egui::CentralPanel::no_frame().show(ui, |ui| view::show(self, ui));
        panels::over_view(self, &ctx, &mut actions);
        self.dialogs.show(&ctx);
        for action in actions {
            self.act(action, &ctx);
        }
        self.show_title(&ctx);
        if self.worker.running().is_some_and(|r| !r.yields) {
            ctx.request_repaint_after(PROGRESS_TICK);
        }
    }
}
