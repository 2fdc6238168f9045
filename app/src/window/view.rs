//! The 3D view: pointer events, the image, drawn by a paint callback, the counter of proposals beside the pointer.

use std::sync::Arc;

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use egui::{Align2, Color32, FontId, PaintCallbackInfo, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, vec2};
use glam::Vec2;

use super::hover::Hover;
use super::prepared::SurfaceInput;
use super::state::PlaitApp;
use super::{element_picking, theme};
use crate::distortion::ColourMode;
use crate::input::{Button, Held, Intent, PointerEvent, Under};
use crate::render::{Frame, Renderer, SceneInput, Toggles};
use crate::shading;
use crate::worker::Job;

/// Distance from a placement or a choice of the wheel, in points, within which no new proposals are requested: a small
/// movement of the hand must not lose the choice.
const CALM_RADIUS: f32 = 7.0;

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
            app.hover.point = app.pick(at);
            app.hover.part = element_picking::pick(app, at);
        }
        let under = match (app.hover.part, app.hover.point) {
            (Some(_), _) => Under::Part,
            (None, Some(_)) => Under::Surface,
            (None, None) => Under::Background,
        };
        let intent = app.input.handle(event, under);
        if let Some(intent) = intent {
            carry_out(app, intent);
        }
    }
    if app.input.is_dragging() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
    } else if response.contains_pointer() && app.hover.part.is_some() {
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
    let held = |m: &egui::Modifiers| Held { shift: m.shift, ctrl: m.command || m.ctrl };
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

fn carry_out(app: &mut PlaitApp, intent: Intent) {
    match intent {
        Intent::Hover(at) => hover(app, at),
        Intent::Leave => {
            app.hover = Hover::default();
            app.worker.forget_hover();
        }
        Intent::Browse(by) => {
            app.hover.browse(by);
            app.hover.calm_at = app.input.position();
        }
        Intent::Place(at) => place(app, at),
        Intent::Pin(_) => pin(app),
        Intent::Orbit(delta) => app.camera.orbit(delta),
        Intent::Pan(delta) => app.camera.pan(delta, app.view_size),
        Intent::Zoom(factor, at) => {
            let toward = app.hover.point.zip(app.scene.as_ref()).map(|(p, s)| p.position(&s.design_mesh).as_vec3());
            let toward = toward.unwrap_or_else(|| app.camera.point_at_target_depth(at, app.view_size));
            app.camera.zoom(factor, toward);
        }
    }
}

fn hover(app: &mut PlaitApp, at: Vec2) {
    if app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM_RADIUS) {
        return;
    }
    app.hover.calm_at = None;
    // Over a node or an arc a click pins it. During an optimisation a placement would cancel that.
    if app.hover.part.is_some() || app.is_optimising() {
        app.hover.clear();
        app.worker.forget_hover();
        return;
    }
    match app.hover.point {
        Some(_) if app.hover.asked_at == Some(at) => {}
        Some(point) => {
            app.hover.generation = Some(app.worker.hover(point));
            app.hover.asked_at = Some(at);
            app.hover.place_on_arrival = false;
        }
        None => {
            app.hover.clear();
            app.worker.forget_hover();
        }
    }
}

/// Pins or unpins the node or arc under the pointer.
fn pin(app: &mut PlaitApp) {
    let pinned = |part| app.layout().and_then(|l| l.is_pinned(part)).map(|pinned| (part, pinned));
    if let Some((part, pinned)) = app.hover.part.and_then(pinned) {
        app.worker.request(Job::SetPinned(part, !pinned));
    }
}

fn place(app: &mut PlaitApp, at: Vec2) {
    if app.is_optimising() {
        return;
    }
    let calm_here = app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM_RADIUS);
    match app.hover.shown().cloned() {
        Some(proposal) if app.hover.generation.is_none() => {
            app.hover.clear();
            app.worker.request(Job::Place(proposal));
            app.hover.calm_at = Some(at);
        }
        _ if app.hover.generation.is_some() => app.hover.place_on_arrival = true,
        // After a placement at this position nothing is shown: request the next proposals.
        _ => {
            if calm_here {
                app.hover.calm_at = None;
            }
            hover(app, at);
        }
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
        strips: app.options.stripes && colour_mode == ColourMode::Regions,
        place: app.messages.place(),
    };
    let (lines, markers) = prepared.overlay(&overlay);
    app.prepared = prepared;
    SceneInput { surface, lines, markers, ..SceneInput::default() }
}

/// Shows "2 of 9" beside the pointer.
fn proposal_counter(app: &PlaitApp, ui: &Ui, rect: Rect) {
    let Some(at) = app.input.position().filter(|_| !app.input.is_dragging()) else { return };
    let count = app.hover.proposals.len();
    if count < 2 || app.hover.shown().is_none() {
        return;
    }
    let text = format!("{} of {count}", app.hover.chosen + 1);
    let painter = ui.painter().with_clip_rect(rect);
    let galley = painter.layout_no_wrap(text, FontId::proportional(13.0), Color32::WHITE);
    let anchor = rect.min + vec2(at.x + 18.0, at.y + 16.0);
    let size = galley.size() + vec2(16.0, 8.0);
    let corner = anchor.min(rect.max - size - vec2(4.0, 4.0));
    let label = Rect::from_min_size(corner, size);
    let green = Color32::from_rgb(shading::PROPOSED[0], shading::PROPOSED[1], shading::PROPOSED[2]);
    painter.rect(label, 9.0, green, Stroke::new(1.0, theme::RAISED), StrokeKind::Outside);
    painter.galley(Align2::CENTER_CENTER.align_size_within_rect(galley.size(), label).min, galley, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Held = Held { shift: false, ctrl: false };

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
