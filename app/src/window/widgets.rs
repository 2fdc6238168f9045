//! Widgets that several panels share.

use egui::{Color32, Frame, Margin, RichText, Stroke, Ui, vec2};
use glam::DVec3;

use super::action::Action;
use super::theme;
use crate::engine::Remark;

/// The heading of a section of the side panel.
pub fn section(ui: &mut Ui, title: &str) {
    ui.add_space(12.0);
    ui.label(RichText::new(title).size(13.0).strong().color(theme::QUIET));
    ui.add_space(1.0);
}

/// A button over the whole width, filled with the accent if `primary`. Returns whether it was clicked.
pub fn wide_button(ui: &mut Ui, text: &str, primary: bool, enabled: bool, hover: &str) -> bool {
    let text = RichText::new(text).color(match (enabled, primary) {
        (true, true) => Color32::WHITE,
        (true, false) => theme::TEXT,
        (false, _) => theme::QUIET,
    });
    let mut button = egui::Button::new(text);
    if primary && enabled {
        button = button.fill(theme::ACCENT).stroke(Stroke::NONE);
    }
    let size = vec2(ui.available_width(), 32.0);
    let response = ui.add_enabled_ui(enabled, |ui| ui.add_sized(size, button)).inner;
    response.on_hover_text(hover).on_disabled_hover_text(hover).clicked()
}

/// A card within the side panel.
pub fn card() -> Frame {
    Frame::new()
        .fill(theme::RAISED)
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(8.0)
        .inner_margin(Margin::symmetric(10, 8))
}

/// A card that floats over the view.
pub fn floating_card(fill: Color32, stroke: Color32) -> Frame {
    Frame::new()
        .fill(fill)
        .stroke(Stroke::new(1.0, stroke))
        .corner_radius(8.0)
        .shadow(egui::Shadow { offset: [0, 3], blur: 12, spread: 0, color: Color32::from_black_alpha(30) })
        .inner_margin(Margin::symmetric(12, 8))
}

/// A remark with a coloured dot. A click shows its place.
pub fn remark_row(remark: &Remark, colour: Color32, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal_top(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(12.0, 18.0), egui::Sense::hover());
        ui.painter().circle_filled(rect.center(), 5.0, colour);
        let label = egui::Label::new(&remark.text).wrap();
        match remark.place {
            None => drop(ui.add(label)),
            Some(place) => show_place_on_click(label, place, ui, actions),
        }
    });
}

/// A text in the colour of links. A click shows its place.
pub fn place_link(text: &str, place: DVec3, ui: &mut Ui, actions: &mut Vec<Action>) {
    let label = egui::Label::new(RichText::new(text).color(theme::ACCENT));
    show_place_on_click(label, place, ui, actions);
}

fn show_place_on_click(label: egui::Label, place: DVec3, ui: &mut Ui, actions: &mut Vec<Action>) {
    let response = ui.add(label.sense(egui::Sense::click()));
    if response.on_hover_cursor(egui::CursorIcon::PointingHand).on_hover_text("Show where").clicked() {
        actions.push(Action::LookAt(place));
    }
}
