//! Work that makes something better step by step: its progress, and what ends it.

use egui::{RichText, Ui, vec2};

use super::action::Action;
use super::panels::wide_button;
use super::{PlaitApp, theme};
use crate::engine::Scene;
use crate::worker::{Running, Steps, StoppableWork};

/// The button that tries other strips, or the progress of that.
pub fn strips(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    if let Some(running) = app.bettering(StoppableWork::Strips) {
        let so_far = app.improvement.map(|i| {
            let (now, before) = (i.after, i.before);
            format!(
                "Misfit {:.1}, before {:.1}\n{:.1}° off, {} patches · before {:.1}°, {}",
                now.objective, before.objective, now.alignment, now.patches, before.alignment, before.patches
            )
        });
        ui.add_space(4.0);
        in_progress(&running, so_far, ui, actions);
        return;
    }
    let hint = if scene.exportable {
        "Tries other strips, with which patches follow the shape better and are fewer (I)"
    } else {
        "Tries other strips, once the layout is valid"
    };
    if wide_button(ui, "Improve the layout", false, app.can_optimise(), hint) {
        actions.push(Action::Improve);
    }
}

/// What is being done, how far it is, what it has come to so far, and the buttons that end it.
pub fn in_progress(running: &Running, so_far: Option<String>, ui: &mut Ui, actions: &mut Vec<Action>) {
    let (stage, fraction) = running.progress.state();
    let stopping = running.steps.as_ref().is_some_and(Steps::is_stopped);
    let stage = if stopping { "Finishing the best so far" } else { stage.as_str() };
    ui.label(if stage.is_empty() { &running.label } else { stage });
    ui.add(egui::ProgressBar::new(fraction as f32).desired_height(6.0).fill(theme::ACCENT));
    let can_stop = so_far.is_some() && !stopping;
    ui.label(RichText::new(so_far.unwrap_or_else(|| "Nothing better yet".into())).color(theme::QUIET));
    ui.horizontal(|ui| {
        let stop = egui::Button::new("Stop").min_size(vec2(0.5 * (ui.available_width() - 8.0), 32.0));
        if ui.add_enabled(can_stop, stop).on_hover_text("Keeps the best so far").clicked() {
            actions.push(Action::Stop);
        }
        let cancel = egui::Button::new("Cancel").min_size(vec2(ui.available_width(), 32.0));
        if ui.add(cancel).on_hover_text("Drops what was done (Escape)").clicked() {
            actions.push(Action::Cancel);
        }
    });
}
