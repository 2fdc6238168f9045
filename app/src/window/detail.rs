//! The choice of how much detail is woven with.

use egui::{CollapsingHeader, RichText, Slider, Ui};

use super::action::Action;
use super::panels::wide_button;
use super::{PlaitApp, theme};
use crate::engine::{Detail, Scene};

/// Smoothing and radius that can be chosen, in percent of the model's size: beyond the largest little of any shape is
/// left, and below the smallest radius curvature is that of single triangles.
const SMOOTHING: std::ops::RangeInclusive<f64> = 0.0..=5.0;
const RADIUS: std::ops::RangeInclusive<f64> = 0.5..=10.0;

/// Two sliders and a button, folded away at first: most models need neither.
pub fn show(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    let title = RichText::new("Detail").size(13.0).strong().color(theme::QUIET);
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
        let hint = "Relief smaller than this is smoothed away for weaving. The layout still lies on the model itself.";
        slider(ui, "Ignore relief below", &mut chosen.smoothing, SMOOTHING, hint);
        let hint = "Radius over which the directions of curvature are taken that strips follow.";
        slider(ui, "Take curvature over", &mut chosen.curvature_radius, RADIUS, hint);
        ui.label(RichText::new("of the model's size").size(13.0).color(theme::QUIET));
        let changed = differs(chosen, scene.detail);
        if Some(chosen) != app.detail {
            actions.push(Action::ChooseDetail(chosen));
        }
        if wide_button(ui, "Weave with this detail", false, changed, "Makes the model ready anew; strips stay") {
            actions.push(Action::ApplyDetail);
        }
    });
}

/// Whether two choices differ by more than a slider shows.
fn differs(a: Detail, b: Detail) -> bool {
    let far = |x: f64, y: f64| (x - y).abs() > 1e-4;
    far(a.smoothing, b.smoothing) || far(a.curvature_radius, b.curvature_radius)
}
