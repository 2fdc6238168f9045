//! The 3D view: pointer events, the image, drawn by a paint callback, the counter of proposals beside the pointer.

use std::sync::Arc;

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use egui::{Align2, Color32, FontId, PaintCallbackInfo, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, vec2};
use glam::Vec2;

use super::prepared::SurfaceInput;
use super::state::PlaitApp;
use super::{handles, pointer, theme};
use crate::distortion::ColourMode;
use crate::input::{Button, Held, PointerEvent};
use crate::render::{Frame, Renderer, SceneInput, Toggles};
use crate::shading;

/// Shows the view in the rest of `ui`.
pub fn show(app: &mut PlaitApp, ui: &mut Ui) {
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
    app.view_size = Vec2::new(rect.width(), rect.height());
    app.view_corner = rect.min;
    if std::mem::take(&mut app.frame_pending) {
        app.frame_all();
    }
    let inside = response.contains_pointer() || app.input.is_dragging();
    for event in pointer_events(ui, rect, inside) {
        if let Some(at) = event_position(event) {
            pointer::look_under(app, at);
        }
        let under = pointer::under(app);
        let intent = app.input.handle(event, under);
        if let Some(intent) = intent {
            pointer::carry_out(app, intent);
        }
    }
    if response.double_clicked() {
        pointer::double_click(app);
    }
    if app.input.is_dragging() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    } else if response.contains_pointer() && (app.hover.part.is_some() || app.hover.grip.is_some()) {
        ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
    } else if response.contains_pointer() && app.hover.point.is_some() && !app.is_optimising() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
    }
    paint(app, ui, rect);
    proposal_counter(app, ui, rect);
}

/// The pointer events, in points from the corner of `rect`.
fn pointer_events(ui: &Ui, rect: Rect, inside: bool) -> Vec<PointerEvent> {
    let at = |p: Pos2| Vec2::new(p.x - rect.min.x, p.y - rect.min.y);
    let held = |m: &egui::Modifiers| Held { shift: m.shift, ctrl: m.command || m.ctrl, alt: m.alt };
    let mut list = Vec::new();
    ui.input(|i| {
        for event in &i.events {
            match event {
                egui::Event::PointerMoved(p) if inside => list.push(PointerEvent::Moved(at(*p))),
                egui::Event::PointerMoved(_) | egui::Event::PointerGone => list.push(PointerEvent::Gone),
                egui::Event::PointerButton { pos, button, pressed, modifiers } => {
                    let button = match button {
                        egui::PointerButton::Primary => Button::Primary,
                        egui::PointerButton::Middle => Button::Middle,
                        egui::PointerButton::Secondary => Button::Secondary,
                        _ => continue,
                    };
                    match pressed {
                        true if inside => list.push(PointerEvent::Pressed(button, at(*pos), held(modifiers))),
                        true => {}
                        false => list.push(PointerEvent::Released(button, at(*pos))),
                    }
                }
                egui::Event::MouseWheel { unit, delta, modifiers, .. } if inside => {
                    // Some systems scroll horizontally while Shift is held.
                    let amount = if delta.y == 0.0 { delta.x } else { delta.y };
                    list.push(match unit {
                        egui::MouseWheelUnit::Point => PointerEvent::Scroll(amount, held(modifiers)),
                        _ => PointerEvent::Wheel(amount, held(modifiers)),
                    });
                }
                egui::Event::Zoom(factor) if inside => list.push(PointerEvent::Pinch(*factor)),
                _ => {}
            }
        }
    });
    drop_doubled_notches(&mut list);
    list
}

/// Drops the second of two equal notches in one frame. Virtual X servers (VNC, Xvfb) report the press and the release
/// of one wheel click as a notch each. A real wheel that is turned so fast only loses speed.
fn drop_doubled_notches(events: &mut Vec<PointerEvent>) {
    let mut last = None;
    events.retain(|&event| {
        let doubled = matches!(event, PointerEvent::Wheel(n, _) if n.abs() == 1.0) && last == Some(event);
        last = (!doubled).then_some(event);
        !doubled
    });
}

fn event_position(event: PointerEvent) -> Option<Vec2> {
    match event {
        PointerEvent::Moved(at) | PointerEvent::Pressed(_, at, _) | PointerEvent::Released(_, at) => Some(at),
        _ => None,
    }
}

/// Draws one frame of the view within the pass of egui.
struct ViewCallback {
    frame: Frame,
}

impl CallbackTrait for ViewCallback {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(renderer) = resources.get_mut::<Renderer>() {
            renderer.prepare(device, queue, encoder, &self.frame);
        }
        Vec::new()
    }

    fn paint(&self, _info: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, resources: &CallbackResources) {
        if let Some(renderer) = resources.get::<Renderer>() {
            renderer.paint(pass);
        }
    }
}

fn paint(app: &mut PlaitApp, ui: &Ui, rect: Rect) {
    let pixels_per_point = ui.ctx().pixels_per_point();
    let screen = ui.ctx().content_rect().size() * pixels_per_point;
    let info = PaintCallbackInfo {
        viewport: rect,
        clip_rect: rect,
        pixels_per_point,
        screen_size_px: [screen.x.round() as u32, screen.y.round() as u32],
    };
    let viewport = info.viewport_in_pixels();
    let size = [viewport.width_px.max(1) as u32, viewport.height_px.max(1) as u32];
    // Stripes would change the colours of the scale.
    let scale = app.colour_mode() != ColourMode::Regions;
    let toggles = Toggles {
        stripes: app.options.stripes && !scale,
        wireframe: app.options.wireframe,
        tint: app.options.regions || scale,
    };
    let view = app.camera.uniforms(Vec2::new(size[0] as f32, size[1] as f32));
    let frame = Frame { scene: scene_input(app), view, toggles, size, pixels_per_point };
    ui.painter().add(Callback::new_paint_callback(rect, ViewCallback { frame }));
}

fn scene_input(app: &mut PlaitApp) -> SceneInput {
    let Some(scene) = app.scene.clone() else { return SceneInput::default() };
    let (colour_mode, summary) = (app.colour_mode(), app.summary().cloned());
    let input = SurfaceInput { display: Arc::clone(&scene.surface), colour_mode, summary };
    let mut prepared = std::mem::take(&mut app.prepared);
    let surface = prepared.surface(input);
    let overlay = shading::Overlay {
        scene: &scene,
        proposal: app.hover.shown(),
        selected: app.selected,
        layout: app.layout().filter(|_| app.options.layout),
        part: app.hover.part,
        handles: &handles::of(app),
        pointed: app.hover.strip,
        strips: app.options.stripes && colour_mode == ColourMode::Regions,
        place: app.messages.place(),
    };
    let (lines, markers) = prepared.overlay(&overlay);
    app.prepared = prepared;
    SceneInput { surface, lines, markers, ..SceneInput::default() }
}

/// Shows "2 of 9" beside the pointer, or why no strip passes the anchors.
fn proposal_counter(app: &PlaitApp, ui: &Ui, rect: Rect) {
    let resting = !app.input.is_dragging() || app.input.is_grabbing();
    let Some(at) = app.input.position().filter(|_| resting) else { return };
    let count = app.hover.proposals.len();
    let problem = app.editing.as_ref().and_then(|e| e.problem.clone());
    let (text, colour) = match problem {
        Some(problem) => (problem, theme::BAD),
        None if app.hover.shown().is_none() => return,
        None => {
            let green = Color32::from_rgb(shading::PROPOSED[0], shading::PROPOSED[1], shading::PROPOSED[2]);
            (format!("{} of {count}", app.hover.chosen + 1), green)
        }
    };
    let painter = ui.painter().with_clip_rect(rect);
    let galley = painter.layout_no_wrap(text, FontId::proportional(13.0), Color32::WHITE);
    let anchor = rect.min + vec2(at.x + 18.0, at.y + 16.0);
    let size = galley.size() + vec2(16.0, 8.0);
    let corner = anchor.min(rect.max - size - vec2(4.0, 4.0));
    let label = Rect::from_min_size(corner, size);
    painter.rect(label, 9.0, colour, Stroke::new(1.0, theme::RAISED), StrokeKind::Outside);
    painter.galley(Align2::CENTER_CENTER.align_size_within_rect(galley.size(), label).min, galley, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Held = Held { shift: false, ctrl: false, alt: false };

    #[test]
    fn a_notch_reported_twice_in_a_frame_counts_once() {
        let (down, up) = (PointerEvent::Wheel(-1.0, FREE), PointerEvent::Wheel(1.0, FREE));
        let mut events = vec![down, down, up];
        drop_doubled_notches(&mut events);
        assert_eq!(events, [down, up]);
    }

    #[test]
    fn scrolling_of_a_touchpad_is_never_dropped() {
        let mut events = vec![PointerEvent::Scroll(3.0, FREE); 2];
        drop_doubled_notches(&mut events);
        assert_eq!(events.len(), 2);
    }
}
