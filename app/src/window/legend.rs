//! The legend of the distortion colours, over the view.

use egui::{Align2, Color32, Mesh, RichText, Stroke, Ui, pos2, vec2};

use super::state::PlaitApp;
use super::theme;
use super::widgets::floating_card;
use crate::distortion::{self, ColourMode};

/// Width of the legend, in points.
const WIDTH: f32 = 250.0;
/// Number of segments of the colour bar.
const SEGMENTS: u32 = 48;

/// Shows the legend, unless the colours show regions.
pub fn show(app: &PlaitApp, ctx: &egui::Context) {
    let mode = app.colour_mode();
    let Some(summary) = app.summary().filter(|_| mode != ColourMode::Regions) else { return };
    let area = egui::Area::new(egui::Id::unique("legend")).anchor(Align2::LEFT_BOTTOM, vec2(14.0, -50.0));
    area.interactable(false).show(ctx, |ui| {
        floating_card(theme::RAISED, theme::LINE).show(ui, |ui| {
            ui.set_width(WIDTH);
            ui.label(RichText::new(mode.label()).strong());
            scale(mode, ui);
            ui.label(RichText::new(mode.meaning()).size(12.0).color(theme::QUIET));
            if summary.triangles.iter().any(|t| t.flipped) {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), egui::Sense::hover());
                    let [r, g, b] = distortion::FLIPPED;
                    ui.painter().rect_filled(rect, 2.0, Color32::from_rgb(r, g, b));
                    ui.label(RichText::new("flipped triangle").size(12.0).color(theme::QUIET));
                });
            }
        });
    });
}

/// The colour bar, with ticks below it.
fn scale(mode: ColourMode, ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(vec2(WIDTH, 32.0), egui::Sense::hover());
    let bar = egui::Rect::from_min_size(rect.min + vec2(4.0, 2.0), vec2(WIDTH - 20.0, 12.0));
    let x = |t: f64| bar.min.x + bar.width() * t as f32;
    let mut mesh = Mesh::default();
    for i in 0..=SEGMENTS {
        let t = f64::from(i) / f64::from(SEGMENTS);
        let [r, g, b] = distortion::scale_colour(t);
        for y in [bar.min.y, bar.max.y] {
            mesh.colored_vertex(pos2(x(t), y), Color32::from_rgb(r, g, b));
        }
    }
    for i in 0..SEGMENTS {
        let k = 2 * i;
        mesh.add_triangle(k, k + 1, k + 2);
        mesh.add_triangle(k + 1, k + 3, k + 2);
    }
    ui.painter().add(mesh);
    ui.painter().rect_stroke(bar, 0.0, Stroke::new(1.0, theme::LINE), egui::StrokeKind::Outside);
    for &(t, text) in mode.ticks() {
        let foot = pos2(x(t), bar.max.y);
        ui.painter().line_segment([foot, foot + vec2(0.0, 3.0)], Stroke::new(1.0, theme::QUIET));
        let align = if t == 0.0 { Align2::LEFT_TOP } else { Align2::CENTER_TOP };
        let at = foot + vec2(if t == 0.0 { -4.0 } else { 0.0 }, 3.0);
        ui.painter().text(at, align, text, egui::FontId::proportional(12.0), theme::TEXT);
    }
}
