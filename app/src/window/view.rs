//! The 3D view: events to intents, the picture through one paint callback, the chip beside the pointer.

use std::sync::Arc;

use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use egui::{Align2, Color32, FontId, PaintCallbackInfo, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, vec2};
use glam::Vec2;
use plait_core::surface::SurfacePoint;

use super::{PlaitApp, parts, theme};
use crate::distortion::Colours;
use crate::engine::{DisplaySurface, EmbeddingSummary, LayoutPart, Proposal};
use crate::input::{Button, Held, Intent, PointerEvent, Under};
use crate::render::{Frame, Marker, Polyline, Renderer, SceneInput, SurfaceMesh, Toggles};
use crate::shading;
use crate::worker::Job;

/// After a placement or a choice among alternatives the pointer may move so far, in points, before the strips under
/// it are looked for anew: a trembling hand must not lose what was chosen.
const CALM: f32 = 7.0;

/// What is shown under the pointer.
#[derive(Debug, Default)]
pub struct Hover {
    /// The surface point under the pointer, found anew whenever the pointer or the view moved.
    pub point: Option<SurfacePoint>,
    /// The node or arc under the pointer, if it can be pinned.
    pub part: Option<LayoutPart>,
    /// The request that was sent last, while the user wants an answer.
    generation: Option<u64>,
    /// Strips through the point, best first.
    pub proposals: Vec<Proposal>,
    /// Which of them is shown.
    pub chosen: usize,
    /// Where the pointer was when something was placed or chosen.
    calm_at: Option<Vec2>,
    /// A click came before the answer: place the best when it arrives.
    place_on_arrival: bool,
    /// Where the last request was made.
    asked_at: Option<Vec2>,
}

impl Hover {
    /// The strip that a click would place.
    pub fn shown(&self) -> Option<&Proposal> {
        self.proposals.get(self.chosen)
    }

    /// Takes in an answer, final or early; returns what is to be placed at once.
    pub fn arrived(&mut self, generation: u64, proposals: Vec<Proposal>, complete: bool) -> Option<Proposal> {
        if self.generation != Some(generation) {
            return None;
        }
        self.proposals = proposals;
        self.chosen = 0;
        if !complete {
            return None;
        }
        self.generation = None;
        let place = std::mem::take(&mut self.place_on_arrival);
        self.proposals.first().filter(|_| place).cloned()
    }

    /// Shows nothing and wants nothing.
    pub fn clear(&mut self) {
        *self = Self { calm_at: self.calm_at, point: self.point, part: self.part, ..Self::default() };
    }

    /// Moves the choice among the alternatives, ending at the first and the last.
    pub fn browse(&mut self, by: i32) {
        let last = self.proposals.len().saturating_sub(1);
        self.chosen = self.chosen.saturating_add_signed(by as isize).min(last);
    }
}

/// What was last made for the renderer, to be made anew only when it changed.
#[derive(Default)]
pub struct Prepared {
    surface: Option<(Drawn, Arc<SurfaceMesh>)>,
    lines: Arc<Vec<Polyline>>,
    markers: Arc<Vec<Marker>>,
}

/// What a surface was made of: its triangles, and what gives them their colours.
struct Drawn {
    display: Arc<DisplaySurface>,
    colours: Colours,
    summary: Option<Arc<EmbeddingSummary>>,
}

impl Drawn {
    fn is(&self, other: &Self) -> bool {
        let of = |d: &Self| d.summary.as_ref().map(Arc::as_ptr);
        Arc::ptr_eq(&self.display, &other.display) && self.colours == other.colours && of(self) == of(other)
    }
}

impl Prepared {
    fn surface(&mut self, drawn: Drawn) -> Arc<SurfaceMesh> {
        match &self.surface {
            Some((held, mesh)) if held.is(&drawn) => Arc::clone(mesh),
            _ => {
                let tints = drawn.summary.as_ref().and_then(|s| drawn.colours.tints(s));
                let mesh = Arc::new(shading::surface(&drawn.display, tints.as_deref()));
                self.surface = Some((drawn, Arc::clone(&mesh)));
                mesh
            }
        }
    }

    fn overlay(&mut self, overlay: Option<&shading::Overlay<'_>>) -> (Arc<Vec<Polyline>>, Arc<Vec<Marker>>) {
        let (lines, markers) = overlay.map(shading::overlay).unwrap_or_default();
        if *self.lines != lines {
            self.lines = Arc::new(lines);
        }
        if *self.markers != markers {
            self.markers = Arc::new(markers);
        }
        (Arc::clone(&self.lines), Arc::clone(&self.markers))
    }
}

/// The view fills what is left of `ui`.
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
            app.hover.part = parts::under(app, at);
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
    } else if response.contains_pointer() && app.hover.point.is_some() && !app.is_bettering() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Crosshair);
    }
    paint(app, ui, rect);
    chip(app, ui, rect);
}

/// The pointer's events in points from the corner of `rect`.
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
                    // With Shift some systems turn the wheel sideways.
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

/// Virtual X servers (VNC, Xvfb) report the press and the release of a wheel's click as a notch each. Of two equal
/// notches in a row within one frame the second goes; a real wheel turned that fast only loses some speed.
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
    if app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM) {
        return;
    }
    app.hover.calm_at = None;
    // Over an arc a click would not place; during an optimisation it would drop that.
    if app.hover.part.is_some() || app.is_bettering() {
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

/// Pins what is under the pointer, or lets it go.
fn pin(app: &mut PlaitApp) {
    let pinned = |part| app.layout().and_then(|l| l.is_pinned(part)).map(|pinned| (part, pinned));
    if let Some((part, pinned)) = app.hover.part.and_then(pinned) {
        app.worker.request(Job::SetPinned(part, !pinned));
    }
}

fn place(app: &mut PlaitApp, at: Vec2) {
    if app.is_bettering() {
        return;
    }
    let calm_here = app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM);
    match app.hover.shown().cloned() {
        Some(proposal) if app.hover.generation.is_none() => {
            app.hover.clear();
            app.worker.request(Job::Place(proposal));
            app.hover.calm_at = Some(at);
        }
        _ if app.hover.generation.is_some() => app.hover.place_on_arrival = true,
        // Something was placed here just now, so nothing is shown: ask for the next.
        _ => {
            if calm_here {
                app.hover.calm_at = None;
            }
            hover(app, at);
        }
    }
}

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
    // Colours that are read by a scale must not be mixed with a pattern.
    let scale = app.colours() != Colours::Regions;
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
    let (colours, summary) = (app.colours(), app.summary().cloned());
    let drawn = Drawn { display: Arc::clone(&scene.surface), colours, summary };
    let mut prepared = std::mem::take(&mut app.prepared);
    let surface = prepared.surface(drawn);
    let overlay = shading::Overlay {
        scene: &scene,
        proposal: app.hover.shown(),
        selected: app.selected,
        layout: app.layout().filter(|_| app.options.layout),
        part: app.hover.part,
        strips: app.options.stripes && colours == Colours::Regions,
        place: app.marked_place(),
    };
    let (lines, markers) = prepared.overlay(Some(&overlay));
    app.prepared = prepared;
    SceneInput { surface, lines, markers }
}

/// "2 of 9" beside the pointer.
fn chip(app: &PlaitApp, ui: &Ui, rect: Rect) {
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
    let chip = Rect::from_min_size(corner, size);
    let green = Color32::from_rgb(shading::PROPOSED[0], shading::PROPOSED[1], shading::PROPOSED[2]);
    painter.rect(chip, 9.0, green, Stroke::new(1.0, theme::RAISED), StrokeKind::Outside);
    painter.galley(Align2::CENTER_CENTER.align_size_within_rect(galley.size(), chip).min, galley, Color32::WHITE);
}
