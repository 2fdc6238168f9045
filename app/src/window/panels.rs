//! The panels around the view: menu bar, status bar, side panel.

use egui::{Frame, Margin, RichText, Ui};

use super::action::Action;
use super::state::PlaitApp;
use super::{menu_bar, side_panel, status_bar, theme};

/// Least width of the side panel, in points: enough for all its rows, so that the view keeps its size when rows appear.
const PANEL_WIDTH: f32 = 310.0;

/// Shows all panels.
pub fn show(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    let bar = |vertical| Frame::new().fill(theme::BAR).inner_margin(Margin::symmetric(10, vertical));
    egui::Panel::top("menu bar").frame(bar(5)).show(ui, |ui| menu_bar::show(app, ui, actions));
    egui::Panel::bottom("status").frame(bar(5)).show(ui, |ui| status_bar::show(app, ui));
    // The scroll bar lies between the content and the edge of the window.
    let side = Frame::new().fill(theme::PANEL).inner_margin(Margin { left: 16, right: 4, top: 14, bottom: 14 });
    let content = Frame::new().inner_margin(Margin { right: 12, ..Margin::ZERO });
    egui::Panel::right("design").frame(side).default_size(PANEL_WIDTH).size_range(PANEL_WIDTH..=460.0).show(ui, |ui| {
        match app.scene.as_deref() {
            Some(scene) => {
                egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    content.show(ui, |ui| side_panel::show(app, scene, ui, actions));
                });
            }
            None => drop(ui.label(RichText::new("No model is open").color(theme::QUIET))),
        }
    });
}
