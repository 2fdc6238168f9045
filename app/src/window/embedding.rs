//! The panel of the optimised embedding, and the legend of its colours.

use egui::{Align, Align2, Color32, Frame, Layout, Margin, Mesh, RichText, Stroke, Ui, pos2, vec2};
use glam::DVec3;

use super::action::Action;
use super::panels::{remark_row, wide_button};
use super::{PlaitApp, bettering, theme};
use crate::distortion::{self, Colours};
use crate::engine::{EmbeddingSummary, LayoutPart, LayoutPreview, Scene};
use crate::worker::StoppableWork;

/// The button, or the progress of the work; then what was achieved.
pub fn show(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    if let Some(running) = app.bettering(StoppableWork::Embedding) {
        let so_far = app.step.as_ref().map(|s| {
            let folds = if s.flipped == 1 { "fold" } else { "folds" };
            format!("Step {} · energy {:.0} % · {} {folds}", s.step, 100.0 * s.energy, s.flipped)
        });
        bettering::in_progress(&running, so_far, ui, actions);
        return;
    }
    let again = scene.embedding.is_some();
    let text = if again { "Optimise again" } else { "Optimise" };
    let hint = if scene.exportable {
        "Moves nodes and arcs so that patches follow the shape with little distortion and without folds (M)"
    } else {
        "Moves nodes and arcs, once the layout is valid"
    };
    if wide_button(ui, text, false, app.can_optimise(), hint) {
        actions.push(Action::Optimise);
    }
    pins(app.layout(), ui, actions);
    if let Some(summary) = &scene.embedding {
        figures(summary, ui, actions);
        colours(app, ui, actions);
    }
}

/// How many parts are pinned.
fn pins(layout: Option<&LayoutPreview>, ui: &mut Ui, actions: &mut Vec<Action>) {
    let pinned = layout.map(LayoutPreview::pinned).unwrap_or_default();
    if layout.is_none() {
        return;
    }
    if pinned.is_empty() {
        let hint = "Click on nodes and arcs to pin them where they are.";
        ui.label(RichText::new(hint).size(13.0).color(theme::QUIET));
        return;
    }
    let nodes = pinned.iter().filter(|p| matches!(p, LayoutPart::Node(_))).count();
    let count = |n: usize, one: &str| match n {
        0 => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{n} {one}s")),
    };
    let parts: Vec<String> = [count(nodes, "node"), count(pinned.len() - nodes, "arc")].into_iter().flatten().collect();
    ui.horizontal(|ui| {
        ui.label(format!("Pinned: {}", parts.join(", ")));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Unpin all").clicked() {
                actions.push(Action::UnpinAll);
            }
        });
    });
}

fn figures(s: &EmbeddingSummary, ui: &mut Ui, actions: &mut Vec<Action>) {
    let card = Frame::new()
        .fill(theme::RAISED)
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(8.0)
        .inner_margin(Margin::symmetric(10, 8));
    card.show(ui, |ui| {
        ui.set_width(ui.available_width());
        egui::Grid::new("embedding").num_columns(2).spacing([10.0, 1.0]).show(ui, |ui| {
            row(ui, "Steps", s.steps.to_string(), "Steps of the nodes");
            let [before, after] = s.energy.map(significant);
            row(
                ui,
                "Energy",
                format!("{before} to {after}"),
                "What is minimised, over the surface's area, before and after",
            );
            let [before, after] = s.flipped;
            row(ui, "Folds", format!("{before} to {after}"), "Triangles the map turns over, before and after");
            row(
                ui,
                "Conformal",
                format!("{:.3}", s.conformal),
                "E_confor, mean conformal distortion: 2 where angles are kept",
            );
            row(
                ui,
                "Alignment",
                format!("{:.1}° off", s.alignment),
                "E°: mean angle to the nearest principal direction",
            );
            row(ui, "Planarity", significant(s.planar), "E_planar: 0 where quads along the isolines are flat");
            let (on, all, off) = s.features;
            if all > 0 {
                let hover = "Sharp edges that lie on isolines exactly";
                match off {
                    None => row(ui, "Features", format!("all {all} edges on isolines"), hover),
                    Some(place) => {
                        ui.label(RichText::new("Features").color(theme::QUIET)).on_hover_text(hover);
                        link(&format!("{} of {all} edges off isolines", all - on), place, ui, actions);
                        ui.end_row();
                    }
                }
            }
            ui.label(RichText::new("Aspect").color(theme::QUIET))
                .on_hover_text("Of the most oblong patch: longer to shorter side");
            let (aspect, place) = s.aspect;
            link(&format!("{aspect:.1} to 1 at worst"), place, ui, actions);
        });
        let [r, g, b] = distortion::FOLDED;
        for fold in &s.folds {
            remark_row(fold, Color32::from_rgb(r, g, b), ui, actions);
        }
    });
}

/// A figure and its name.
fn row(ui: &mut Ui, name: &str, value: String, hover: &str) {
    ui.label(RichText::new(name).color(theme::QUIET)).on_hover_text(hover);
    ui.label(value).on_hover_text(hover);
    ui.end_row();
}

/// Words that lead to a place.
fn link(text: &str, place: DVec3, ui: &mut Ui, actions: &mut Vec<Action>) {
    let words = RichText::new(text).color(theme::ACCENT);
    let link = ui.add(egui::Label::new(words).sense(egui::Sense::click()));
    if link.on_hover_cursor(egui::CursorIcon::PointingHand).on_hover_text("Show where").clicked() {
        actions.push(Action::LookAt(place));
    }
}

/// What the surface's colours tell.
fn colours(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label(RichText::new("Colours").color(theme::QUIET));
        let mut chosen = app.colours();
        let choice = egui::ComboBox::from_id_salt("colours").width(ui.available_width()).selected_text(chosen.label());
        let response = choice.show_ui(ui, |ui| {
            for colours in Colours::ALL {
                ui.selectable_value(&mut chosen, colours, colours.label());
            }
        });
        response.response.labelled_by(label.id);
        if chosen != app.colours() {
            actions.push(Action::Colours(chosen));
        }
    });
}

/// The scale of the colours, over the view.
pub fn legend(app: &PlaitApp, ctx: &egui::Context) {
    let colours = app.colours();
    let Some(summary) = app.summary().filter(|_| colours != Colours::Regions) else { return };
    let area = egui::Area::new(egui::Id::unique("legend")).anchor(Align2::LEFT_BOTTOM, vec2(14.0, -50.0));
    area.interactable(false).show(ctx, |ui| {
        super::panels::floating(theme::RAISED, theme::LINE).show(ui, |ui| {
            ui.set_width(LEGEND_WIDTH);
            ui.label(RichText::new(colours.label()).strong());
            scale(colours, ui);
            ui.label(RichText::new(colours.meaning()).size(12.0).color(theme::QUIET));
            if summary.triangles.iter().any(|t| t.flipped) {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
                    let [r, g, b] = distortion::FOLDED;
                    ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
                    ui.label(RichText::new("folded").size(12.0).color(theme::QUIET));
                });
            }
        });
    });
}

const LEGEND_WIDTH: f32 = 250.0;

/// A bar in the colours of the scale with its numbers below.
fn scale(colours: Colours, ui: &mut Ui) {
    const STEPS: u32 = 48;
    let (rect, _) = ui.allocate_exact_size(vec2(LEGEND_WIDTH, 32.0), egui::Sense::hover());
    let bar = egui::Rect::from_min_size(rect.min + vec2(4.0, 2.0), vec2(LEGEND_WIDTH - 20.0, 12.0));
    let x = |t: f64| bar.min.x + bar.width() * t as f32;
    let mut mesh = Mesh::default();
    for i in 0..=STEPS {
        let t = f64::from(i) / f64::from(STEPS);
        let [r, g, b] = distortion::color(t);
        for y in [bar.min.y, bar.max.y] {
            mesh.colored_vertex(pos2(x(t), y), Color32::from_rgb(r, g, b));
        }
    }
    for i in 0..STEPS {
        let k = 2 * i;
        mesh.add_triangle(k, k + 1, k + 2);
        mesh.add_triangle(k + 1, k + 3, k + 2);
    }
    ui.painter().add(mesh);
    ui.painter().rect_stroke(bar, 0.0, Stroke::new(1.0, theme::LINE), egui::StrokeKind::Outside);
    for &(t, text) in colours.ticks() {
        let foot = pos2(x(t), bar.max.y);
        ui.painter().line_segment([foot, foot + vec2(0.0, 3.0)], Stroke::new(1.0, theme::QUIET));
        let align = if t == 0.0 { Align2::LEFT_TOP } else { Align2::CENTER_TOP };
        let at = foot + vec2(if t == 0.0 { -4.0 } else { 0.0 }, 3.0);
        ui.painter().text(at, align, text, egui::FontId::proportional(12.0), theme::TEXT);
    }
}

/// Three significant digits.
fn significant(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$}")
}
