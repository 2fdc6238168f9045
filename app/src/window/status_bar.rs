//! The status bar: what the pointer can do now, and the cost of the proposal shown.

use egui::{Align, Layout, RichText, Ui};

use super::hover::Grip;
use super::state::PlaitApp;
use super::theme;
use crate::engine::{LayoutPart, Proposal};

/// Shows the bar.
pub fn show(app: &PlaitApp, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(hint(app)).size(13.0).color(theme::QUIET));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let text = app.hover.shown().map_or_else(|| "?: shortcuts".into(), proposal_cost);
            ui.label(RichText::new(text).size(13.0).color(theme::QUIET));
        });
    });
}

fn hint(app: &PlaitApp) -> &'static str {
    let pinned = |part| app.layout().and_then(|l| l.is_pinned(part)) == Some(true);
    if app.scene.is_none() {
        "Drop a mesh on the window, or open one with Ctrl+O"
    } else if app.is_optimising() {
        "Stop: keep the best result · Escape: discard it · Drag: orbit"
    } else if app.editing.is_some() {
        editing_hint(app)
    } else if app.input.is_dragging() {
        "Middle drag, left drag beside the model: orbit · Right drag: pan"
    } else if let Some(part) = app.hover.part {
        match (part, pinned(part)) {
            (LayoutPart::Node(_), false) => "Click: pin this node; the optimisation does not move it",
            (LayoutPart::Node(_), true) => "Click: unpin this node",
            (LayoutPart::Arc(_), false) => "Click: pin this arc; the optimisation does not move its ends",
            (LayoutPart::Arc(_), true) => "Click: unpin this arc",
        }
    } else if app.hover.strip.is_some() {
        "Click: select this strip · Double click or E: edit it"
    } else if app.hover.proposals.len() > 1 {
        "Click: place this strip · Wheel: other strips through this point · Drag: set its direction · Shift+click: set an anchor"
    } else if app.hover.shown().is_some() {
        "Click: place this strip · Drag: set its direction · Shift+click: set an anchor"
    } else {
        "Point at the surface to see the best strip through it · Drag beside the model: orbit · Right drag: pan · Wheel: zoom"
    }
}

/// What the pointer can do while a strip is edited.
fn editing_hint(app: &PlaitApp) -> &'static str {
    match app.hover.grip.filter(|_| !app.input.is_grabbing()) {
        _ if app.input.is_grabbing() => "Let go to keep editing · Enter: place the strip · Escape: drop it",
        Some(Grip::Anchor(_)) => "Drag: move this anchor · Click, Delete: remove it · Enter: place the strip",
        Some(Grip::Tip(..)) => "Drag: turn the direction of this anchor · Enter: place the strip",
        Some(Grip::Spine(_)) => "Click: place this strip · Drag: move it by a new anchor · Wheel: other strips",
        None => "Click: add an anchor · Drag: add one with a direction · Enter: place the strip · Escape: drop it",
    }
}

/// Elastica cost of a proposal, and its elastic energy before and after relaxation.
fn proposal_cost(proposal: &Proposal) -> String {
    let cost = format!("Elastica cost {:.2}", proposal.cost);
    match proposal.energy {
        Some(e) => format!("{cost} · elastic energy {:.2}, relaxed {:.2}", e.found, e.relaxed),
        None => cost,
    }
}
