//! What floats over the view: messages, progress bar, legend, shortcuts, the page about the program.

use egui::{Align, Align2, Layout, RichText, vec2};

use super::action::Action;
use super::icons::{self, Icon};
use super::messages::{Message, Tone};
use super::state::PlaitApp;
use super::widgets::floating_card;
use super::{legend, shortcuts, theme};

/// Shows everything over the view.
pub fn show(app: &mut PlaitApp, ctx: &egui::Context, actions: &mut Vec<Action>) {
    let (messages, next) = app.messages.current();
    if let Some(next) = next {
        ctx.request_repaint_after(next);
    }
    show_messages(&messages, ctx, actions);
    progress(app, ctx, actions);
    legend::show(app, ctx);
    if app.shortcuts_open {
        shortcuts::show(ctx, actions);
    }
    if app.about_open {
        about(ctx, actions);
    }
}

fn show_messages(messages: &[Message], ctx: &egui::Context, actions: &mut Vec<Action>) {
    if messages.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("messages")).anchor(Align2::LEFT_TOP, vec2(14.0, 52.0));
    area.show(ctx, |ui| {
        for message in messages {
            let colour = match message.tone {
                Tone::Done => theme::GOOD,
                Tone::Note => theme::QUIET,
                Tone::Failed => theme::BAD,
            };
            floating_card(theme::RAISED, colour).show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.scope(|ui| {
                        ui.set_max_width(430.0);
                        ui.add(egui::Label::new(RichText::new(&message.text).color(colour)).wrap());
                    });
                    if let Some(place) = message.place
                        && ui.button("Show where").clicked()
                    {
                        actions.push(Action::LookAt(place));
                    }
                    if icons::button(ui, Icon::Cross, "Dismiss").clicked() {
                        actions.push(Action::Dismiss(message.id));
                    }
                });
            });
            ui.add_space(4.0);
        }
    });
}

fn progress(app: &PlaitApp, ctx: &egui::Context, actions: &mut Vec<Action>) {
    let Some(running) = app.long_work() else { return };
    let (stage, fraction) = running.progress.state();
    let area = egui::Area::new(egui::Id::unique("progress")).anchor(Align2::CENTER_BOTTOM, vec2(-150.0, -52.0));
    area.show(ctx, |ui| {
        floating_card(theme::RAISED, theme::LINE).show(ui, |ui| {
            ui.set_width(420.0);
            ui.horizontal(|ui| {
                ui.label(&running.label);
                ui.label(RichText::new(stage).color(theme::QUIET));
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if ui.button("Cancel").on_hover_text("Escape").clicked() {
                        actions.push(Action::Cancel);
                    }
                });
            });
            ui.add(egui::ProgressBar::new(fraction as f32).desired_height(6.0).fill(theme::ACCENT));
        });
    });
}

fn about(ctx: &egui::Context, actions: &mut Vec<Action>) {
    let mut open = true;
    egui::Window::new("About Plait")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            ui.set_width(400.0);
            ui.label(RichText::new(concat!("Plait ", env!("CARGO_PKG_VERSION"))).heading());
            ui.label("Design of quad layouts by weaving dual strips.");
            ui.add_space(6.0);
            let method = "Method: M. Campen, Quad Layouts – Generation and Optimization of Conforming \
                          Quadrilateral Surface Partitions, RWTH Aachen.";
            ui.label(RichText::new(method).color(theme::QUIET));
            ui.add_space(6.0);
            let licence = "Free software under the MIT licence or the Apache License 2.0, at your choice.";
            ui.label(RichText::new(licence).color(theme::QUIET));
        });
    if !open {
        actions.push(Action::About(false));
    }
}
