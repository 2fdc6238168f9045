//! Small icon buttons, painted as strokes, so that they need no font.

use std::f32::consts::{PI, TAU};

use egui::{Color32, Painter, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

use super::theme;

/// An icon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Icon {
    /// Visible.
    Eye,
    /// Hidden.
    EyeClosed,
    /// Delete or dismiss.
    Cross,
}

/// A button of 22 points without a frame. `label` is its tooltip, and its name for screen readers.
pub fn button(ui: &mut Ui, icon: Icon, label: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(22.0), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, label));
    if response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 5.0, Color32::from_black_alpha(16));
    }
    let colour = match (response.hovered(), icon) {
        (true, _) => theme::TEXT,
        (false, Icon::EyeClosed) => Color32::from_rgb(0xb5, 0xb3, 0xae),
        (false, _) => theme::QUIET,
    };
    paint(ui.painter(), rect, icon, colour);
    response.on_hover_text(label)
}

fn paint(painter: &Painter, rect: Rect, icon: Icon, colour: Color32) {
    let c = rect.center();
    let stroke = Stroke::new(1.4, colour);
    match icon {
        Icon::Eye | Icon::EyeClosed => {
            painter.add(egui::Shape::closed_line(eye(c), stroke));
            if icon == Icon::Eye {
                painter.circle_filled(c, 2.1, colour);
            } else {
                painter.line_segment([c + vec2(-5.5, 5.0), c + vec2(5.5, -5.0)], stroke);
            }
        }
        Icon::Cross => {
            let d = 3.8;
            painter.line_segment([c - vec2(d, d), c + vec2(d, d)], stroke);
            painter.line_segment([c + vec2(-d, d), c + vec2(d, -d)], stroke);
        }
    }
}

/// The outline of an eye: two shallow arcs.
fn eye(c: Pos2) -> Vec<Pos2> {
    let arc = |i: usize| {
        let t = i as f32 / 24.0 * TAU;
        let lid = if t < PI { -1.0 } else { 1.0 };
        pos2(c.x - 7.0 * t.cos(), c.y + lid * 4.2 * t.sin().abs())
    };
    (0..24).map(arc).collect()
}
