//! Sliders for smoothing and curvature radius.

use egui::{CollapsingHeader, RichText, Slider, Ui};

use super::action::Action;
use super::state::PlaitApp;
use super::theme;
use super::widgets::wide_button;
use crate::engine::{Detail, Scene};

/// Range of the smoothing radius, in percent of the model size. More leaves little of any shape.
const SMOOTHING: std::ops::RangeInclusive<f64> = 0.0..=5.0;
/// Range of the curvature radius, in percent of the model size. With less, curvature is that of single
/// triangles; more leaves little of any shape.
const CURVATURE_RADIUS: std::ops::RangeInclusive<f64> = 0.5..=10.0;
/// Difference below which two values are equal, as a fraction of the model size: less than a slider shows.
const TOLERANCE: f64 = 1e-4;

/// Shows the sliders and the button that applies them, collapsed at first since most models need no change.
pub fn show(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    let title = RichText::new("Curvature and smoothing").size(13.0).strong().color(theme::QUIET);
    CollapsingHeader::new(title).id_salt("detail").show_unindented(ui, |ui| {
        let mut chosen = app.detail.unwrap_or(scene.detail);
        let slider = |ui: &mut Ui, name: &str, value: &mut f64, range, hint: &str| {
            let mut percent = 100.0 * *value;
            let label = ui.label(name).on_hover_text(hint);
            ui.spacing_mut().slider_width = ui.available_width() - 66.0;
            let slider = Slider::new(&mut percent, range).suffix(" %").fixed_decimals(1).trailing_fill(true);
            if ui.add(slider).labelled_by(label.id).on_hover_text(hint).changed() {
                *value = 0.01 * percent;
            }
        };
        let hint = "Radius of curvature estimation, in percent of the model size. \
                    Strips follow the principal directions at this scale.";
        slider(ui, "Curvature radius", &mut chosen.curvature_radius, CURVATURE_RADIUS, hint);
        let hint = "Smoothing radius of the surface that is woven on, in percent of the model size. \
                    Strips ignore smaller features. The layout still lies on the original surface.";
        slider(ui, "Smoothing radius", &mut chosen.smoothing, SMOOTHING, hint);
        ui.label(RichText::new("in % of the model size").size(13.0).color(theme::QUIET));
        let changed = differs(chosen, scene.detail);
        if Some(chosen) != app.detail {
            actions.push(Action::ChooseDetail(chosen));
        }
        let hint = "Recomputes curvature and proposals. Placed strips stay where they are.";
        if wide_button(ui, "Apply", false, changed, hint) {
            actions.push(Action::ApplyDetail);
        }
    });
}

fn differs(a: Detail, b: Detail) -> bool {
    let far = |x: f64, y: f64| (x - y).abs() > TOLERANCE;
    far(a.smoothing, b.smoothing) || far(a.curvature_radius, b.curvature_radius)
}
