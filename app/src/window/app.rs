//! Opens the window, and runs it frame by frame.

use std::sync::Arc;
use std::time::Duration;

use super::state::PlaitApp;
use super::{overlays, panels, shortcuts, theme, view};
use crate::engine::{Opener, Source};
use crate::render::Renderer;
use crate::worker::{Job, Worker};

/// Interval of repaints while a progress bar is shown.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);

/// Opens the window. Returns when it is closed.
///
/// # Errors
///
/// When the system provides no window or no graphics device.
pub fn run(opener: Arc<dyn Opener>, source: Option<Source>) -> Result<(), eframe::Error> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Plait")
        .with_app_id("plait")
        .with_inner_size([1440.0, 900.0])
        .with_min_inner_size([720.0, 480.0]);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    eframe::run_native("plait", options, Box::new(move |cc| Ok(Box::new(PlaitApp::new(cc, opener, source)?))))
}

impl PlaitApp {
    /// Prepares the window, and asks the worker to open `source`, or the first built-in model.
    ///
    /// # Errors
    ///
    /// When there is no graphics device, or no thread can be started.
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
        Ok(Self::with_worker(worker, built_ins))
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
        let mut actions = shortcuts::actions(self, &ctx);
        panels::show(self, ui, &mut actions);
        egui::CentralPanel::no_frame().show(ui, |ui| view::show(self, ui));
        overlays::show(self, &ctx, &mut actions);
        self.dialogs.show(&ctx);
        for action in actions {
            self.act(action, &ctx);
        }
        self.show_title(&ctx);
        if self.worker.running().is_some_and(|r| !r.yields) {
            ctx.request_repaint_after(PROGRESS_INTERVAL);
        }
    }
}
