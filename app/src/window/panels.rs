//! The panels: bar above, facts and lists at the right, hints below, messages and dialogs over the view.

use egui::{
    Align, Align2, Color32, Frame, Key, KeyboardShortcut, Layout, Margin, Modifiers, RichText, Stroke, Ui, vec2,
};

use super::action::{Action, ViewOption};
use super::icons::{self, Icon};
use super::messages::{Message, Tone};
use super::{PlaitApp, bettering, detail, embedding, theme};
use crate::engine::{LayoutPart, Proposal, Remark, Scene, Source, Strip};
use crate::shading::{self, region_rgb};

const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
const EXPORT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::E);
const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
const REDO_TOO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Y);
const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);

/// All shortcuts and gestures, as the list shows them.
const SHORTCUTS: [(&str, &[(&str, &str)]); 4] = [
    (
        "Weaving",
        &[
            ("Move over the surface", "show the best strip through the point"),
            ("Wheel", "browse alternatives through the same point"),
            ("Click", "place the strip shown"),
            ("S", "place the strip that helps most"),
            ("Click on a node or an arc", "pin it where it is, or let it go"),
            ("I", "try other strips, for a better layout"),
            ("M", "optimise the embedding; again: stop, keep the best"),
            ("Delete", "remove the selected strip"),
            ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
            ("Escape", "cancel what is running; deselect"),
        ],
    ),
    (
        "View",
        &[
            ("Left or middle drag", "orbit"),
            ("Right drag, Shift+middle drag", "pan"),
            ("Ctrl+wheel, wheel beside the model, pinch", "zoom"),
            ("F", "look at the whole model"),
            ("1, 2, 3, 4", "strips, region colours, layout, triangle edges"),
        ],
    ),
    (
        "Files",
        &[
            ("Ctrl+O", "open a mesh or a design; or drop a file on the window"),
            ("Ctrl+S", "save the design"),
            ("Ctrl+E", "export the layout"),
        ],
    ),
    ("Help", &[("?", "this list")]),
];

/// The actions of the keys pressed, unless text is being edited.
pub fn keys(app: &PlaitApp, ctx: &egui::Context) -> Vec<Action> {
    let mut actions = Vec::new();
    if app.dialogs.is_open() {
        return actions;
    }
    let typing = ctx.text_edit_focused();
    ctx.input_mut(|i| {
        // The longer combination first, or the shorter one would take it.
        for (shortcut, action) in [
            (REDO, Action::Redo),
            (REDO_TOO, Action::Redo),
            (UNDO, Action::Undo),
            (OPEN, Action::AskOpen),
            (SAVE, Action::AskSave),
            (EXPORT, Action::AskExport),
            (QUIT, Action::Quit),
        ] {
            // A text field has a history of its own.
            let of_text = typing && matches!(action, Action::Undo | Action::Redo);
            if !of_text && i.consume_shortcut(&shortcut) {
                actions.push(action);
            }
        }
        if typing {
            return;
        }
        let options = [ViewOption::Stripes, ViewOption::Regions, ViewOption::Layout, ViewOption::Wireframe];
        for (key, option) in [Key::Num1, Key::Num2, Key::Num3, Key::Num4].into_iter().zip(options) {
            if i.consume_key(Modifiers::NONE, key) {
                actions.push(Action::Toggle(option));
            }
        }
        if i.consume_key(Modifiers::NONE, Key::S) {
            actions.push(Action::Suggest);
        }
        if i.consume_key(Modifiers::NONE, Key::I) {
            actions.push(Action::Improve);
        }
        if i.consume_key(Modifiers::NONE, Key::M) {
            actions.push(if app.is_bettering() { Action::Stop } else { Action::Optimise });
        }
        if i.consume_key(Modifiers::NONE, Key::F) {
            actions.push(Action::FrameAll);
        }
        if i.events.iter().any(|e| matches!(e, egui::Event::Text(t) if t == "?")) {
            actions.push(Action::Shortcuts(!app.shortcuts_open));
        }
        if i.key_pressed(Key::Escape) {
            actions.push(escape(app));
        }
        let delete = i.key_pressed(Key::Delete) || i.key_pressed(Key::Backspace);
        if let Some(strip) = app.selected.filter(|_| delete) {
            actions.push(Action::Remove(strip));
        }
    });
    actions
}

/// What Escape means now: the topmost thing goes.
fn escape(app: &PlaitApp) -> Action {
    if app.shortcuts_open {
        Action::Shortcuts(false)
    } else if app.about_open {
        Action::About(false)
    } else if app.worker.running().is_some_and(|r| !r.yields) {
        Action::Cancel
    } else {
        Action::Select(None)
    }
}

/// The panels around the view.
pub fn show(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    let bar = |vertical| Frame::new().fill(theme::BAR).inner_margin(Margin::symmetric(10, vertical));
    egui::Panel::top("menu bar").frame(bar(5)).show(ui, |ui| top_bar(app, ui, actions));
    egui::Panel::bottom("status").frame(bar(5)).show(ui, |ui| status(app, ui));
    // The scroll bar runs between the content and the window's edge.
    let side = Frame::new().fill(theme::PANEL).inner_margin(Margin { left: 16, right: 4, top: 14, bottom: 14 });
    let content = Frame::new().inner_margin(Margin { right: 12, ..Margin::ZERO });
    egui::Panel::right("design").frame(side).default_size(300.0).size_range(250.0..=460.0).show(ui, |ui| {
        match app.scene.as_deref() {
            Some(scene) => {
                egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    content.show(ui, |ui| side_panel(app, scene, ui, actions));
                });
            }
            None => drop(ui.label(RichText::new("No model is open").color(theme::QUIET))),
        }
    });
}

fn top_bar(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.label(RichText::new("Plait").size(18.0).color(theme::ACCENT));
        ui.add_space(6.0);
        menus(app, ui, actions);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            // Buttons, not menus: framed.
            ui.set_style(ui.ctx().global_style());
            quick_buttons(app, ui, actions);
        });
    });
}

fn menus(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    let scene = app.scene.as_deref();
    ui.menu_button("File", |ui| file_menu(app, ui, actions));
    ui.menu_button("Edit", |ui| {
        item(ui, actions, "Undo", "Ctrl+Z", scene.is_some_and(|s| s.can_undo), Action::Undo);
        item(ui, actions, "Redo", "Ctrl+Shift+Z", scene.is_some_and(|s| s.can_redo), Action::Redo);
        ui.separator();
        let remove = app.selected.map(Action::Remove);
        item(ui, actions, "Remove strip", "Delete", remove.is_some(), remove.unwrap_or(Action::Select(None)));
        item(ui, actions, "Suggest a strip", "S", scene.is_some(), Action::Suggest);
        let valid = app.can_optimise();
        item(ui, actions, "Improve the layout", "I", valid, Action::Improve);
        item(ui, actions, "Optimise the embedding", "M", valid, Action::Optimise);
    });
    ui.menu_button("View", |ui| view_menu(app, ui, actions));
    ui.menu_button("Help", |ui| {
        item(ui, actions, "Shortcuts", "?", true, Action::Shortcuts(true));
        item(ui, actions, "About Plait", "", true, Action::About(true));
    });
}

fn file_menu(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    let open = app.scene.is_some();
    item(ui, actions, "Open…", "Ctrl+O", true, Action::AskOpen);
    ui.menu_button("Built-in models", |ui| {
        for model in &app.built_ins {
            let source = Source::BuiltIn(model.name.clone());
            item(ui, actions, &model.name, &model.hint, true, Action::Open(source));
        }
    });
    ui.separator();
    item(ui, actions, "Save design…", "Ctrl+S", open, Action::AskSave);
    item(ui, actions, "Export layout…", "Ctrl+E", open, Action::AskExport);
    ui.separator();
    item(ui, actions, "Quit", "Ctrl+Q", true, Action::Quit);
}

fn view_menu(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.set_width(MENU_WIDTH);
    for option in ViewOption::ALL {
        let (name, key) = option.label();
        let mut on = app.options.get(option);
        ui.horizontal(|ui| {
            if ui.checkbox(&mut on, name).clicked() {
                actions.push(Action::Toggle(option));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.label(RichText::new(key).color(theme::QUIET));
            });
        });
    }
    ui.separator();
    item(ui, actions, "Whole model", "F", app.scene.is_some(), Action::FrameAll);
}

const MENU_WIDTH: f32 = 230.0;

/// An entry of a menu; it closes the menu.
fn item(ui: &mut Ui, actions: &mut Vec<Action>, name: &str, hint: &str, enabled: bool, action: Action) {
    let button = egui::Button::new(name).shortcut_text(hint).min_size(vec2(MENU_WIDTH, 0.0));
    if ui.add_enabled(enabled, button).clicked() {
        actions.push(action);
        ui.close();
    }
}

fn quick_buttons(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    let scene = app.scene.as_deref();
    let mut button = |ui: &mut Ui, name: &str, enabled: bool, action: Action| {
        if ui.add_enabled(enabled, egui::Button::new(name)).clicked() {
            actions.push(action);
        }
    };
    // From right to left.
    button(ui, "Export", scene.is_some(), Action::AskExport);
    button(ui, "Save", scene.is_some(), Action::AskSave);
    button(ui, "Open", true, Action::AskOpen);
    ui.add_space(10.0);
    button(ui, "Redo", scene.is_some_and(|s| s.can_redo), Action::Redo);
    button(ui, "Undo", scene.is_some_and(|s| s.can_undo), Action::Undo);
}

fn side_panel(app: &PlaitApp, scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.add(egui::Label::new(RichText::new(&scene.model.name).heading()).truncate());
    ui.spacing_mut().interact_size.y = 20.0;
    egui::Grid::new("facts").num_columns(2).spacing([18.0, 0.0]).show(ui, |ui| {
        for (name, value) in &scene.model.facts {
            ui.label(RichText::new(name).color(theme::QUIET));
            ui.label(value);
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    detail::show(app, scene, ui, actions);
    section(ui, "What remains");
    what_remains(scene, ui, actions);
    ui.add_space(4.0);
    let useful = !scene.exportable || !scene.remarks.is_empty();
    if wide_button(ui, "Suggest a strip", !scene.exportable, useful, "Places the strip that helps most now (S)") {
        actions.push(Action::Suggest);
    }
    bettering::strips(app, scene, ui, actions);
    section(ui, "Embedding");
    embedding::show(app, scene, ui, actions);
    if scene.exportable {
        section(ui, "Export");
        export_row(app, ui, actions);
    }
    section(ui, &format!("Strips · {}", scene.strips.len()));
    if scene.strips.is_empty() {
        let hint = "Move over the surface, choose with the wheel, place with a click.";
        ui.label(RichText::new(hint).color(theme::QUIET));
    }
    ui.spacing_mut().item_spacing.y = 2.0;
    for (i, strip) in scene.strips.iter().enumerate() {
        strip_row(app, i, strip, ui, actions);
    }
}

/// How many quads, and the button.
fn export_row(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label(RichText::new("Quads, about").color(theme::QUIET));
        let mut quads = app.quads;
        let value = egui::DragValue::new(&mut quads).range(10..=5_000_000).speed(app.quads as f64 * 0.01);
        if ui.add(value).labelled_by(label.id).changed() {
            actions.push(Action::Quads(quads));
        }
    });
    if wide_button(ui, "Export layout…", true, true, "Writes the layout and its quad mesh as OBJ (Ctrl+E)") {
        actions.push(Action::AskExport);
    }
}

/// A button over the whole width; `primary` fills it with the accent. Returns whether it was clicked.
pub fn wide_button(ui: &mut Ui, text: &str, primary: bool, enabled: bool, hover: &str) -> bool {
    let text = RichText::new(text).color(match (enabled, primary) {
        (true, true) => Color32::WHITE,
        (true, false) => theme::TEXT,
        (false, _) => theme::QUIET,
    });
    let mut button = egui::Button::new(text);
    if primary && enabled {
        button = button.fill(theme::ACCENT).stroke(Stroke::NONE);
    }
    let size = vec2(ui.available_width(), 32.0);
    ui.add_enabled_ui(enabled, |ui| ui.add_sized(size, button)).inner.on_hover_text(hover).clicked()
}

fn section(ui: &mut Ui, title: &str) {
    ui.add_space(12.0);
    ui.label(RichText::new(title).size(13.0).strong().color(theme::QUIET));
    ui.add_space(1.0);
}

fn what_remains(scene: &Scene, ui: &mut Ui, actions: &mut Vec<Action>) {
    let rgb = |[r, g, b]: [u8; 3]| Color32::from_rgb(r, g, b);
    let card = Frame::new()
        .fill(theme::RAISED)
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(8.0)
        .inner_margin(Margin::symmetric(12, 9));
    card.show(ui, |ui| {
        ui.set_width(ui.available_width());
        for remark in &scene.remarks {
            remark_row(remark, rgb(region_rgb(remark.color)), ui, actions);
        }
        if !scene.summary.is_empty() {
            let color = if scene.exportable { theme::GOOD } else { theme::TEXT };
            ui.label(RichText::new(&scene.summary).color(color));
        }
    });
}

pub fn remark_row(remark: &Remark, color: Color32, ui: &mut Ui, actions: &mut Vec<Action>) {
    ui.horizontal_top(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(12.0, 18.0), egui::Sense::hover());
        ui.painter().circle_filled(rect.center(), 5.0, color);
        let label = egui::Label::new(&remark.text).wrap();
        match remark.place {
            None => drop(ui.add(label)),
            Some(place) => {
                let link = ui.add(label.sense(egui::Sense::click()));
                if link.on_hover_cursor(egui::CursorIcon::PointingHand).on_hover_text("Show where").clicked() {
                    actions.push(Action::LookAt(place));
                }
            }
        }
    });
}

fn strip_row(app: &PlaitApp, index: usize, strip: &Strip, ui: &mut Ui, actions: &mut Vec<Action>) {
    let selected = app.selected == Some(strip.id);
    let name = format!("Strip {}", index + 1);
    // The row takes clicks wherever no button on it does.
    let (rect, row) = ui.allocate_exact_size(vec2(ui.available_width(), 28.0), egui::Sense::click());
    let label = format!("Select {name}");
    row.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, selected, &label));
    let fill = match (selected, row.hovered()) {
        (true, _) => theme::ACCENT_WASH,
        (false, true) => Color32::from_black_alpha(8),
        (false, false) => Color32::TRANSPARENT,
    };
    ui.painter().rect_filled(rect, 6.0, fill);
    if row.clicked() {
        actions.push(Action::Select((!selected).then_some(strip.id)));
    }
    let layout = Layout::left_to_right(Align::Center);
    let inside = egui::UiBuilder::new().max_rect(rect.shrink2(vec2(8.0, 0.0))).layout(layout);
    ui.scope_builder(inside, |ui| strip_cells(&name, selected, strip, ui, actions));
}

fn strip_cells(name: &str, selected: bool, strip: &Strip, ui: &mut Ui, actions: &mut Vec<Action>) {
    let (rect, _) = ui.allocate_exact_size(vec2(18.0, 18.0), egui::Sense::hover());
    let [r, g, b, _] = if selected { shading::SELECTED } else { shading::PLACED };
    let color = if strip.visible { Color32::from_rgb(r, g, b) } else { Color32::from_rgb(0xc2, 0xc8, 0xd2) };
    ui.painter().rect_filled(rect.shrink2(vec2(0.0, 6.5)), 2.5, color);
    ui.label(RichText::new(name).color(if strip.visible { theme::TEXT } else { theme::QUIET }));
    let kind = if strip.closed { "" } else { ", open" };
    ui.label(RichText::new(format!("{}{kind}", significant(strip.length))).color(theme::QUIET));
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        if icons::button(ui, Icon::Cross, &format!("Remove {name}")).clicked() {
            actions.push(Action::Remove(strip.id));
        }
        let (icon, verb) = if strip.visible { (Icon::Eye, "Hide") } else { (Icon::EyeClosed, "Show") };
        if icons::button(ui, icon, &format!("{verb} {name}")).clicked() {
            actions.push(Action::SetVisible(strip.id, !strip.visible));
        }
    });
}

/// A length with four significant digits.
fn significant(length: f64) -> String {
    let digits = (3.0 - length.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{length:.digits$}")
}

fn status(app: &PlaitApp, ui: &mut Ui) {
    let pinned = |part| app.layout().and_then(|l| l.is_pinned(part)) == Some(true);
    let hint = if app.scene.is_none() {
        "Drop a mesh on the window, or open one with Ctrl+O"
    } else if app.is_bettering() {
        "Stop keeps the best so far · Escape drops it · Drag: orbit"
    } else if app.input.is_dragging() {
        "Left or middle drag: orbit · Right drag: pan"
    } else if let Some(part) = app.hover.part {
        match (part, pinned(part)) {
            (LayoutPart::Node(_), false) => "Click: pin this node, so that optimising leaves it where it is",
            (LayoutPart::Node(_), true) => "Click: let this node go again",
            (LayoutPart::Arc(_), false) => "Click: pin this arc, so that optimising leaves it where it is",
            (LayoutPart::Arc(_), true) => "Click: let this arc go again",
        }
    } else if app.hover.proposals.len() > 1 {
        "Click: place this strip · Wheel: other strips through this point · Drag: orbit"
    } else if app.hover.shown().is_some() {
        "Click: place this strip · Drag: orbit"
    } else {
        "Point at the surface to see the best strip through it · Drag: orbit · Right drag: pan · Wheel: zoom"
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(hint).size(13.0).color(theme::QUIET));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let figures = app.hover.shown().map(proposal_figures);
            let text = figures.unwrap_or_else(|| "? shows the shortcuts".into());
            ui.label(RichText::new(text).size(13.0).color(theme::QUIET));
        });
    });
}

/// What the strip under the pointer costs, and what smoothing it came to.
fn proposal_figures(proposal: &Proposal) -> String {
    match proposal.energy {
        Some(e) => format!("Cost {:.2} · length and bending {:.2}, smoothed {:.2}", proposal.cost, e.found, e.relaxed),
        None => format!("Cost {:.2}", proposal.cost),
    }
}

/// Messages, progress and dialogs over the view.
pub fn over_view(app: &mut PlaitApp, ctx: &egui::Context, actions: &mut Vec<Action>) {
    let (messages, next) = app.messages.current();
    if let Some(next) = next {
        ctx.request_repaint_after(next);
    }
    show_messages(&messages, ctx, actions);
    progress(app, ctx, actions);
    embedding::legend(app, ctx);
    if app.shortcuts_open {
        shortcuts(ctx, actions);
    }
    if app.about_open {
        about(ctx, actions);
    }
}

pub fn floating(fill: Color32, stroke: Color32) -> Frame {
    Frame::new()
        .fill(fill)
        .stroke(Stroke::new(1.0, stroke))
        .corner_radius(8.0)
        .shadow(egui::Shadow { offset: [0, 3], blur: 12, spread: 0, color: Color32::from_black_alpha(30) })
        .inner_margin(Margin::symmetric(12, 8))
}

fn show_messages(messages: &[Message], ctx: &egui::Context, actions: &mut Vec<Action>) {
    if messages.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("messages")).anchor(Align2::LEFT_TOP, vec2(14.0, 52.0));
    area.show(ctx, |ui| {
        for message in messages {
            let color = match message.tone {
                Tone::Done => theme::GOOD,
                Tone::Note => theme::QUIET,
                Tone::Failed => theme::BAD,
            };
            floating(theme::RAISED, color).show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.scope(|ui| {
                        ui.set_max_width(430.0);
                        ui.add(egui::Label::new(RichText::new(&message.text).color(color)).wrap());
                    });
                    if let Some(place) = message.place
                        && ui.button("Show where").clicked()
                    {
                        actions.push(Action::LookAt(place));
                    }
                    if icons::button(ui, Icon::Cross, "Dismiss").clicked() {
                        actions.push(Action::Dismiss(message.id));
                    }
                });
            });
            ui.add_space(4.0);
        }
    });
}

fn progress(app: &PlaitApp, ctx: &egui::Context, actions: &mut Vec<Action>) {
    let Some(running) = app.long_work() else { return };
    let (stage, fraction) = running.progress.state();
    let area = egui::Area::new(egui::Id::unique("progress")).anchor(Align2::CENTER_BOTTOM, vec2(-150.0, -52.0));
    area.show(ctx, |ui| {
        floating(theme::RAISED, theme::LINE).show(ui, |ui| {
            ui.set_width(420.0);
            ui.horizontal(|ui| {
                ui.label(&running.label);
                ui.label(RichText::new(stage).color(theme::QUIET));
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if ui.button("Cancel").on_hover_text("Escape").clicked() {
                        actions.push(Action::Cancel);
                    }
                });
            });
            ui.add(egui::ProgressBar::new(fraction as f32).desired_height(6.0).fill(theme::ACCENT));
        });
    });
}

fn shortcuts(ctx: &egui::Context, actions: &mut Vec<Action>) {
    let mut open = true;
    egui::Window::new("Shortcuts")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            for (title, rows) in SHORTCUTS {
                section(ui, title);
                egui::Grid::new(title).num_columns(2).min_col_width(250.0).spacing([18.0, 4.0]).show(ui, |ui| {
                    for (keys, effect) in rows {
                        ui.label(*keys);
                        ui.label(RichText::new(*effect).color(theme::QUIET));
                        ui.end_row();
                    }
                });
            }
        });
    if !open {
        actions.push(Action::Shortcuts(false));
    }
}

fn about(ctx: &egui::Context, actions: &mut Vec<Action>) {
    let mut open = true;
    egui::Window::new("About Plait")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(ctx, |ui| {
            ui.set_width(400.0);
            ui.label(RichText::new(concat!("Plait ", env!("CARGO_PKG_VERSION"))).heading());
            ui.label("Quad layouts of surfaces, woven from dual strips.");
            ui.add_space(6.0);
            let method = "The method is M. Campen's: Quad Layouts – Generation and Optimization of Conforming \
                          Quadrilateral Surface Partitions, RWTH Aachen.";
            ui.label(RichText::new(method).color(theme::QUIET));
            ui.add_space(6.0);
            let licence = "Free software under the MIT licence or the Apache License 2.0, at your choice.";
            ui.label(RichText::new(licence).color(theme::QUIET));
        });
    if !open {
        actions.push(Action::About(false));
    }
}
