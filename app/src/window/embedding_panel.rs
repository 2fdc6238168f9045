//! The section of the side panel about the embedding: optimisation, pins, quality, colours.

use egui::{Align, Color32, Layout, RichText, Ui};

use super::action::Action;
use super::state::PlaitApp;
use super::widgets::{card, place_link, remark_row, wide_button};
use super::{stoppable, theme};
use crate::distortion::{self, ColourMode};
use crate::engine::{EmbeddingSummary, LayoutPart, LayoutPreview, Scene};
use crate::texts::{count, significant};
use crate::worker::StoppableWork;

/// Shows the button or the progress of the optimisation, then the quality of the result.
pub fn show(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    if let Some(running) = app.running_work(StoppableWork::Embedding) {
        let result = app.step.as_ref().map(|s| {
            let flipped = count(s.flipped, "flipped triangle", "flipped triangles");
            format!("Step {} · energy {:.0} % of the start\n{flipped}", s.step, 100.0 * s.energy)
        });
        stoppable::progress(&running, result, ui, actions);
        return;
    }
    let text = if scene.embedding.is_some() { "Optimise again" } else { "Optimise" };
    let hint = if scene.exportable {
        "Moves nodes and arcs to reduce the distortion of the patches and their alignment error (M)"
    } else {
        "Needs a valid layout"
    };
    if wide_button(ui, text, false, app.can_optimise(), hint) {
        actions.push(Action::Optimise);
    }
    if let Some(layout) = app.layout() {
        pins(layout, ui, actions);
    }
    if let Some(summary) = &scene.embedding {
        quality(summary, ui, actions);
        colour_choice(app, ui, actions);
    }
}

/// The number of pinned nodes and arcs.
fn pins(layout: &LayoutPreview, ui: &mut Ui, actions: &mut Vec<Action>) {
    let pinned = layout.pinned();
    if pinned.is_empty() {
        let hint = "Click a node or an arc to pin it.";
        ui.label(RichText::new(hint).size(13.0).color(theme::QUIET));
        return;
    }
    let nodes = pinned.iter().filter(|p| matches!(p, LayoutPart::Node(_))).count();
    let arcs = pinned.len() - nodes;
    let parts = [(nodes, "node", "nodes"), (arcs, "arc", "arcs")];
    let parts: Vec<String> = parts.iter().filter(|p| p.0 > 0).map(|&(n, one, many)| count(n, one, many)).collect();
    ui.horizontal(|ui| {
        ui.label(format!("Pinned: {}", parts.join(", ")));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Unpin all").clicked() {
                actions.push(Action::UnpinAll);
            }
        });
    });
}

fn quality(s: &EmbeddingSummary, ui: &mut Ui, actions: &mut Vec<Action>) {
    card().show(ui, |ui| {
        ui.set_width(ui.available_width());
        egui::Grid::new("embedding").num_columns(2).spacing([10.0, 1.0]).show(ui, |ui| {
            row(ui, "Steps", s.steps.to_string(), "Steps of the node positions");
            let [before, after] = s.energy.map(|e| significant(e, 3));
            row(ui, "Energy", format!("{before} to {after}"), "Energy per area of the surface, before and after");
            let [before, after] = s.flipped;
            let hint = "Triangles that the map flips, before and after";
            row(ui, "Flipped triangles", format!("{before} to {after}"), hint);
            let hint = "E_confor: mean conformal distortion, 2 at best";
            row(ui, "Conformal distortion", format!("{:.3}", s.conformal), hint);
            let hint = "E°: mean angle to the nearest principal direction";
            row(ui, "Alignment error", format!("{:.1}°", s.alignment), hint);
            let hint = "E_planar: deviation of quads along the isolines from planarity, 0 at best";
            row(ui, "Planarity error", significant(s.planar, 3), hint);
            feature_row(s, ui, actions);
            let (aspect, place) = s.aspect;
            name(ui, "Largest aspect ratio", "Longer to shorter side of the most elongated patch");
            place_link(&format!("{aspect:.1}"), place, ui, actions);
        });
        let [r, g, b] = distortion::FLIPPED;
        for remark in &s.flip_remarks {
            remark_row(remark, Color32::from_rgb(r, g, b), ui, actions);
        }
    });
}

fn feature_row(s: &EmbeddingSummary, ui: &mut Ui, actions: &mut Vec<Action>) {
    let (on_isolines, all, first_off) = s.features;
    if all == 0 {
        return;
    }
    name(ui, "Features on isolines", "Sharp edges that coincide with isolines of the map");
    let text = format!("{on_isolines} of {all} edges");
    match first_off {
        None => drop(ui.label(text)),
        Some(place) => place_link(&text, place, ui, actions),
    }
    ui.end_row();
}

/// A value and its name.
fn row(ui: &mut Ui, text: &str, value: String, hover: &str) {
    name(ui, text, hover);
    ui.label(value).on_hover_text(hover);
    ui.end_row();
}

fn name(ui: &mut Ui, text: &str, hover: &str) {
    ui.label(RichText::new(text).color(theme::QUIET)).on_hover_text(hover);
}

/// The choice of what the colours of the surface show.
fn colour_choice(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label(RichText::new("Colour by").color(theme::QUIET));
        let mut chosen = app.colour_mode();
        let choice = egui::ComboBox::from_id_salt("colours").width(ui.available_width()).selected_text(chosen.label());
        let response = choice.show_ui(ui, |ui| {
            for mode in ColourMode::ALL {
                ui.selectable_value(&mut chosen, mode, mode.label());
            }
        });
        response.response.labelled_by(label.id);
        if chosen != app.colour_mode() {
            actions.push(Action::ChooseColours(chosen));
        }
    });
}
