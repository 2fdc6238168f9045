//! What the pointer does in the 3D view: proposals under it, clicks, and drags that set, move and turn anchors.

use glam::{DVec3, Vec2};
use plait_core::surface::SurfacePoint;
use plait_core::weave::Anchor;

use super::editing::Editing;
use super::handles;
use super::hover::{Grip, Hover};
use super::state::PlaitApp;
use super::{element_picking, strip_picking};
use crate::engine::{Search, StripId};
use crate::input::{Held, Intent, Under};
use crate::worker::Job;

/// Distance from a placement or a choice of the wheel, in points, within which no new proposals are requested: a small
/// movement of the hand must not lose the choice.
const CALM_RADIUS: f32 = 7.0;

/// Finds what lies under the pointer.
pub fn look_under(app: &mut PlaitApp, at: Vec2) {
    app.hover.point = app.pick(at);
    if app.input.is_grabbing() {
        return;
    }
    app.hover.part = element_picking::pick(app, at);
    app.hover.grip = handles::pick(app, at);
    app.hover.strip =
        if app.editing.is_none() && app.hover.part.is_none() { strip_picking::pick(app, at) } else { None };
}

/// What a drag from here would move.
pub fn under(app: &PlaitApp) -> Under {
    let hover = &app.hover;
    if hover.part.is_some() {
        Under::Part
    } else if hover.grip.is_some() || (hover.point.is_some() && !app.is_optimising()) {
        Under::Surface
    } else if hover.point.is_some() {
        Under::Part
    } else {
        Under::Background
    }
}

/// Does what the user wants.
pub fn carry_out(app: &mut PlaitApp, intent: Intent) {
    match intent {
        Intent::Hover(at) => hover(app, at),
        Intent::Leave => leave(app),
        Intent::Browse(by) => {
            app.hover.browse(by);
            app.hover.calm_at = app.input.position();
        }
        Intent::Click(at, held) => click(app, at, held),
        Intent::Grab(at) => grab(app, at),
        Intent::Drag(at) => drag(app, at),
        Intent::Drop(at) => {
            drag(app, at);
            app.dragged = None;
        }
        Intent::Orbit(delta) => app.camera.orbit(delta),
        Intent::Pan(delta) => app.camera.pan(delta, app.view_size),
        Intent::Zoom(factor, at) => {
            let toward = app.hover.point.zip(app.scene.as_ref()).map(|(p, s)| p.position(&s.design_mesh).as_vec3());
            let toward = toward.unwrap_or_else(|| app.camera.point_at_target_depth(at, app.view_size));
            app.camera.zoom(factor, toward);
        }
    }
}

/// The pointer has left the view. An edited strip stays.
fn leave(app: &mut PlaitApp) {
    if app.editing.is_some() {
        (app.hover.point, app.hover.grip) = (None, None);
        return;
    }
    app.hover = Hover::default();
    app.worker.forget_search();
}

fn hover(app: &mut PlaitApp, at: Vec2) {
    if app.editing.is_some() || app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM_RADIUS) {
        return;
    }
    app.hover.calm_at = None;
    // A click on a part of the layout pins it, and one on a placed strip selects it. During an optimisation a placement
    // would cancel that.
    if app.hover.part.is_some() || app.hover.strip.is_some() || app.is_optimising() {
        app.hover.clear();
        app.worker.forget_search();
        return;
    }
    match app.hover.point {
        Some(_) if app.hover.asked_at == Some(at) => {}
        Some(point) => {
            app.hover.generation = Some(app.worker.search(Search::Point(point)));
            app.hover.asked_at = Some(at);
            app.hover.place_on_arrival = false;
        }
        None => {
            app.hover.clear();
            app.worker.forget_search();
        }
    }
}

fn click(app: &mut PlaitApp, at: Vec2, held: Held) {
    if app.is_optimising() {
        return;
    }
    if let Some(editing) = &mut app.editing {
        match (app.hover.grip, app.hover.point) {
            (Some(Grip::Anchor(i) | Grip::Tip(i, _)), _) => editing.selected = Some(i),
            (Some(Grip::Spine(_)), _) => app.place_edited(),
            (None, Some(point)) => {
                editing.begin_change();
                editing.add(Anchor::point(point));
                app.search_edited();
            }
            (None, None) => {}
        }
    } else if app.hover.part.is_some() {
        pin(app);
    } else if let Some(strip) = app.hover.strip {
        app.selected = Some(strip);
    } else if held.shift {
        if let Some(point) = app.hover.point {
            app.edit(Editing::new(Anchor::point(point)));
        }
    } else {
        place(app, at);
    }
}

/// A double click on a placed strip edits it.
pub fn double_click(app: &mut PlaitApp) {
    if let Some(strip) = app.hover.strip.filter(|_| app.editing.is_none() && !app.is_optimising()) {
        app.edit_strip(strip, app.hover.point);
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
    let calm_here = app.hover.calm_at.is_some_and(|c| c.distance(at) < CALM_RADIUS);
    match app.hover.shown().cloned() {
        Some(proposal) if app.hover.generation.is_none() => {
            app.hover.clear();
            app.worker.request(Job::Place(proposal, None));
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

/// Begins to drag: an anchor is moved or turned, the spine gets a new anchor, or a directional anchor is set.
fn grab(app: &mut PlaitApp, at: Vec2) {
    let grip = app.hover.grip;
    let point = app.pick(at);
    let spine = app.hover.shown().map(|p| p.polyline.clone()).unwrap_or_default();
    let Some(scene) = app.scene.clone() else { return };
    let position = |a: &Anchor| a.at.position(&scene.design_mesh);
    let dragged = match (&mut app.editing, grip) {
        (Some(editing), Some(Grip::Anchor(i))) => {
            editing.begin_change();
            editing.selected = Some(i);
            Some(Grip::Anchor(i))
        }
        (Some(editing), Some(Grip::Tip(i, sign))) => {
            editing.begin_change();
            editing.selected = Some(i);
            Some(Grip::Tip(i, sign))
        }
        (Some(editing), Some(Grip::Spine(p))) => {
            editing.begin_change();
            let index = editing.index_along(&spine, position(&Anchor::point(p)), position);
            editing.insert(index, Anchor::point(p));
            Some(Grip::Anchor(index))
        }
        (Some(editing), None) => point.map(|p| {
            editing.begin_change();
            editing.add(Anchor::point(p));
            Grip::Tip(editing.anchors().len() - 1, 1.0)
        }),
        (None, _) => point.map(|p| {
            app.edit(Editing::new(Anchor::point(p)));
            Grip::Tip(0, 1.0)
        }),
    };
    app.dragged = dragged;
}

fn drag(app: &mut PlaitApp, at: Vec2) {
    let (Some(grip), Some(scene)) = (app.dragged, app.scene.clone()) else { return };
    let mesh = &scene.design_mesh;
    let point = app.pick(at);
    let Some(editing) = &mut app.editing else { return };
    let changed = match grip {
        Grip::Anchor(i) => point.zip(editing.anchors().get(i).copied()).map(|(at, old)| (i, Anchor { at, ..old })),
        Grip::Tip(i, sign) => editing.anchors().get(i).copied().and_then(|old| {
            let ray = app.camera.ray(at, app.view_size);
            let centre = old.at.position(mesh);
            let normal = mesh.face_normal(old.at.face);
            let (origin, along) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
            let direction = direction_towards(origin, along, centre, normal)? * f64::from(sign);
            Some((i, Anchor { direction: Some(direction), ..old }))
        }),
        Grip::Spine(_) => None,
    };
    if let Some((i, anchor)) = changed
        && editing.anchors().get(i) != Some(&anchor)
    {
        editing.set(i, anchor);
        app.search_edited();
    }
}

/// The unit vector from a point to where a ray meets the tangent plane there; `None` if it does not.
fn direction_towards(origin: DVec3, along: DVec3, point: DVec3, normal: DVec3) -> Option<DVec3> {
    let slope = along.dot(normal);
    let t = (point - origin).dot(normal) / slope;
    (slope.abs() > 1e-3 && t > 0.0).then(|| origin + along * t - point)?.try_normalize()
}

impl PlaitApp {
    /// Begins to edit a strip.
    pub(super) fn edit(&mut self, editing: Editing) {
        self.hover.clear();
        self.editing = Some(editing);
        self.search_edited();
    }

    /// Edits a placed strip. One without anchors gets one at `at`, or in its middle.
    pub(super) fn edit_strip(&mut self, strip: StripId, at: Option<SurfacePoint>) {
        let Some(scene) = &self.scene else { return };
        let Some(placed) = scene.strips.iter().find(|s| s.id == strip) else { return };
        let (mut anchors, cost) = (placed.anchors.clone(), placed.cost);
        if anchors.is_empty() {
            let middle = || placed.polyline.get(placed.polyline.len() / 2).map(|&p| scene.index.nearest(p));
            anchors.extend(at.or_else(middle).map(Anchor::point));
        }
        if !anchors.is_empty() {
            self.selected = Some(strip);
            self.edit(Editing::of_strip(strip, anchors, cost));
        }
    }

    /// Searches for strips through the anchors. The last ones stay until the next arrive.
    pub(super) fn search_edited(&mut self) {
        if let Some(editing) = &mut self.editing {
            editing.problem = None;
            (self.hover.placeable, self.hover.place_on_arrival) = (false, false);
            self.hover.generation = Some(self.worker.search(editing.search()));
        }
    }

    /// Places the strip that is edited, or as soon as it is found.
    pub(super) fn place_edited(&mut self) {
        let Some(editing) = &self.editing else { return };
        if !self.hover.placeable {
            self.hover.place_on_arrival = self.hover.generation.is_some();
        } else if let (Some(proposal), None) = (self.hover.shown().cloned(), &editing.problem) {
            let replaces = editing.replaces();
            self.stop_editing();
            self.worker.request(Job::Place(proposal, replaces));
            self.hover.calm_at = self.input.position();
        }
    }

    /// Drops the strip that is edited; a placed one stays as it was.
    pub(super) fn stop_editing(&mut self) {
        self.editing = None;
        self.dragged = None;
        self.input.let_go();
        self.hover.clear();
        self.worker.forget_search();
    }

    /// Takes back the last change of the anchors; without one, drops the strip that is edited.
    pub(super) fn take_back_anchor(&mut self) {
        let Some(editing) = &mut self.editing else { return };
        self.dragged = None;
        self.input.let_go();
        if editing.take_back() { self.search_edited() } else { self.stop_editing() }
    }

    /// Removes an anchor; with the last one the strip that is edited is dropped.
    pub(super) fn remove_anchor(&mut self, index: usize) {
        let Some(editing) = &mut self.editing else { return };
        if editing.remove(index) { self.search_edited() } else { self.stop_editing() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_leads_to_the_pointer_in_the_tangent_plane() {
        let origin = DVec3::new(3.0, 4.0, 5.0);
        let direction = direction_towards(origin, -DVec3::Z, DVec3::ZERO, DVec3::Z).unwrap();
        assert!(direction.distance(DVec3::new(0.6, 0.8, 0.0)) < 1e-12);
        // The ray is parallel to the plane, leads away from it, or meets the point itself.
        assert_eq!(direction_towards(origin, DVec3::X, DVec3::ZERO, DVec3::Z), None);
        assert_eq!(direction_towards(origin, DVec3::Z, DVec3::ZERO, DVec3::Z), None);
        assert_eq!(direction_towards(DVec3::Z, -DVec3::Z, DVec3::ZERO, DVec3::Z), None);
    }
}
