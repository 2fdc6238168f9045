//! The search for better strips and the optimisation of the embedding: progress, and the buttons that end them.

use egui::{RichText, Ui, vec2};

use super::action::Action;
use super::state::PlaitApp;
use super::theme;
use super::widgets::wide_button;
use crate::engine::Scene;
use crate::worker::{Running, StopFlag, StoppableWork};

/// The button that starts the search for better strips, or the progress of the search.
pub fn improve_button(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    if let Some(running) = app.running_work(StoppableWork::Strips) {
        let result = app.improvement.map(|i| {
            let (now, before) = (i.after, i.before);
            format!(
                "Objective {:.1} (before {:.1})\nAlignment error {:.1}° (before {:.1}°)\n{} patches (before {})",
                now.objective, before.objective, now.alignment, before.alignment, now.patches, before.patches
            )
        });
        ui.add_space(4.0);
        progress(&running, result, ui, actions);
        return;
    }
    let hint = if scene.exportable {
        "Searches for strips with a lower objective: alignment error, distortion, number of patches, \
         irregular nodes (I)"
    } else {
        "Needs a valid layout"
    };
    if wide_button(ui, "Improve the layout", false, app.can_optimise(), hint) {
        actions.push(Action::Improve);
    }
}

/// Progress of running work, its best `result` so far, and the buttons Stop and Cancel.
pub fn progress(running: &Running, result: Option<String>, ui: &mut Ui, actions: &mut Vec<Action>) {
    let (stage, fraction) = running.progress.state();
    let stopping = running.stoppable.as_ref().is_some_and(StopFlag::is_stopped);
    let stage = if stopping { "Stopping" } else { stage.as_str() };
    ui.label(if stage.is_empty() { &running.label } else { stage });
    ui.add(egui::ProgressBar::new(fraction as f32).desired_height(6.0).fill(theme::ACCENT));
    let can_stop = result.is_some() && !stopping;
    ui.label(RichText::new(result.unwrap_or_else(|| "No result yet".into())).color(theme::QUIET));
    ui.horizontal(|ui| {
        let stop = egui::Button::new("Stop").min_size(vec2(0.5 * (ui.available_width() - 8.0), 32.0));
        if ui.add_enabled(can_stop, stop).on_hover_text("Stops, and keeps the best result so far").clicked() {
            actions.push(Action::Stop);
        }
        let cancel = egui::Button::new("Cancel").min_size(vec2(ui.available_width(), 32.0));
        if ui.add(cancel).on_hover_text("Stops, and discards the result (Escape)").clicked() {
            actions.push(Action::Cancel);
        }
    });
}
