//! The side panel: facts of the model, problems of the design, embedding, export, list of strips.

use egui::{Align, Color32, Layout, RichText, Ui, vec2};

use super::action::Action;
use super::icons::{self, Icon};
use super::state::PlaitApp;
use super::widgets::{card, remark_row, section, wide_button};
use super::{detail_panel, embedding_panel, stoppable, theme};
use crate::engine::{Scene, Strip};
use crate::palette::strip_rgb;
use crate::shading::region_rgb;
use crate::texts::significant;

/// Colour of the mark of a hidden strip.
const HIDDEN_STRIP: Color32 = Color32::from_rgb(0xc2, 0xc8, 0xd2);

/// Shows the panel.
pub fn show(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.add(egui::Label::new(RichText::new(&scene.model.name).heading()).truncate());
    ui.spacing_mut().interact_size.y = 20.0;
    egui::Grid::new("facts").num_columns(2).spacing([18.0, 0.0]).show(ui, |ui| {
        for (name, value) in &scene.model.facts {
            ui.label(RichText::new(name).color(theme::QUIET));
            ui.label(value);
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    detail_panel::show(app, scene, ui, actions);
    section(ui, "Layout");
    problems(scene, ui, actions);
    ui.add_space(4.0);
    let useful = !scene.exportable || !scene.remarks.is_empty();
    let hint = "Places the strip that resolves the most urgent problem (S)";
    if wide_button(ui, "Suggest a strip", !scene.exportable, useful, hint) {
        actions.push(Action::Suggest);
    }
    stoppable::improve_button(app, scene, ui, actions);
    section(ui, "Embedding");
    embedding_panel::show(app, scene, ui, actions);
    if scene.exportable {
        section(ui, "Export");
        export(app, ui, actions);
    }
    section(ui, &format!("Strips · {}", scene.strips.len()));
    if scene.strips.is_empty() {
        let hint = "Point at the surface. Wheel: other strips. Click: place the strip. Drag: set its direction.";
        ui.label(RichText::new(hint).color(theme::QUIET));
    }
    ui.spacing_mut().item_spacing.y = 2.0;
    for (i, strip) in scene.strips.iter().enumerate() {
        strip_row(app, i, strip, ui, actions);
    }
}

/// The problems of the design, and its summary when it is valid.
fn problems(scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    let rgb = |[r, g, b]: [u8; 3]| Color32::from_rgb(r, g, b);
    card().show(ui, |ui| {
        ui.set_width(ui.available_width());
        for remark in &scene.remarks {
            remark_row(remark, rgb(region_rgb(remark.colour)), ui, actions);
        }
        if !scene.summary.is_empty() {
            let colour = if scene.exportable { theme::GOOD } else { theme::TEXT };
            ui.label(RichText::new(&scene.summary).color(colour));
        }
    });
}

/// The target number of quads, and the export button.
fn export(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let hint = "Approximate number of quads in quads.obj";
        let label = ui.label(RichText::new("Target number of quads").color(theme::QUIET)).on_hover_text(hint);
        let mut quads = app.quads;
        let value = egui::DragValue::new(&mut quads).range(10..=5_000_000).speed(app.quads as f64 * 0.01);
        if ui.add(value).labelled_by(label.id).on_hover_text(hint).changed() {
            actions.push(Action::Quads(quads));
        }
    });
    if wide_button(ui, "Export layout…", true, true, "Writes the layout and its quad mesh as OBJ (Ctrl+E)") {
        actions.push(Action::AskExport);
    }
}

fn strip_row(app: &PlaitApp, index: usize, strip: &Strip, ui: &mut Ui, actions: &mut Vec<Action>) {
    let selected = app.selected == Some(strip.id);
    let name = format!("Strip {}", index + 1);
    // The whole row takes clicks, except where a button lies on it.
    let (rect, row) = ui.allocate_exact_size(vec2(ui.available_width(), 28.0), egui::Sense::click());
    let label = format!("Select {name}");
    row.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, selected, &label));
    let fill = match (selected, row.hovered()) {
        (true, _) => theme::ACCENT_WASH,
        (false, true) => Color32::from_black_alpha(8),
        (false, false) => Color32::TRANSPARENT,
    };
    ui.painter().rect_filled(rect, 6.0, fill);
    if row.clicked() {
        actions.push(Action::Select((!selected).then_some(strip.id)));
    }
    let layout = Layout::left_to_right(Align::Center);
    let inside = egui::UiBuilder::new().max_rect(rect.shrink2(vec2(8.0, 0.0))).layout(layout);
    ui.scope_builder(inside, |ui| strip_cells(&name, selected, strip, ui, actions));
}

fn strip_cells(name: &str, selected: bool, strip: &Strip, ui: &mut Ui, actions: &mut Vec<Action>) {
    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 18.0), egui::Sense::hover());
    let [r, g, b] = strip_rgb(strip.id);
    let colour = if strip.visible { Color32::from_rgb(r, g, b) } else { HIDDEN_STRIP };
    let height = if selected { 10.0 } else { 6.0 };
    ui.painter().rect_filled(rect.shrink2(vec2(0.0, 0.5 * (18.0 - height))), 2.5, colour);
    ui.label(RichText::new(name).color(if strip.visible { theme::TEXT } else { theme::QUIET }));
    let kind = if strip.closed { "" } else { ", open" };
    let length = RichText::new(format!("{}{kind}", significant(strip.length, 4))).color(theme::QUIET);
    ui.label(length).on_hover_text("Length in units of the file");
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        if icons::button(ui, Icon::Cross, &format!("Remove {name}")).clicked() {
            actions.push(Action::Remove(strip.id));
        }
        let (icon, verb) = if strip.visible { (Icon::Eye, "Hide") } else { (Icon::EyeClosed, "Show") };
        if icons::button(ui, icon, &format!("{verb} {name}")).clicked() {
            actions.push(Action::SetVisible(strip.id, !strip.visible));
        }
    });
}
