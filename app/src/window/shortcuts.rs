//! Keyboard shortcuts, and the window that lists them with the gestures of the pointer.

use egui::{Align2, Key, KeyboardShortcut, Modifiers, RichText, vec2};

use super::action::{Action, ViewOption};
use super::state::PlaitApp;
use super::theme;
use super::widgets::section;

const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
const EXPORT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::E);
const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
const REDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
const REDO_ALTERNATIVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Y);
const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);

/// All shortcuts and gestures, by section, as the list shows them.
const SHORTCUTS: [(&str, &[(&str, &str)]); 5] = [
    (
        "Weaving",
        &[
            ("Move over the surface", "show the best strip through the point"),
            ("Wheel", "show other strips through the point"),
            ("Click", "place the strip shown"),
            ("Drag over the surface", "set an anchor with the direction of the drag, and edit the strip through it"),
            ("Shift+click", "set an anchor, and edit the strip through it"),
            ("Click or double click on a strip, E", "select it; edit it"),
            ("S", "place a suggested strip"),
            ("Click on a node or an arc", "pin or unpin it"),
            ("I", "improve the layout with other strips; M: stop"),
            ("M", "optimise the embedding; again: stop"),
            ("Delete", "remove the selected strip"),
            ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
            ("Escape", "cancel the running operation; deselect"),
        ],
    ),
    (
        "Editing a strip",
        &[
            ("Click, drag elsewhere", "add an anchor, add one with a direction"),
            ("Drag an anchor, one of its ends, the spine", "move it, turn it, move the spine by a new anchor"),
            ("Delete", "remove the selected anchor"),
            ("Wheel", "show other strips through the anchors"),
            ("Click on the spine, Enter", "place the strip"),
            ("Ctrl+Z", "take back the last anchor"),
            ("Escape", "drop the strip; a placed one stays as it was"),
        ],
    ),
    (
        "View",
        &[
            ("Left drag beside the model, middle drag, Alt+drag", "orbit"),
            ("Right drag, Shift+middle drag", "pan"),
            ("Ctrl+wheel, wheel over the background, pinch", "zoom"),
            ("F", "show the whole model"),
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

/// The actions of the keys pressed. While text is edited, keys without Ctrl belong to the text.
pub fn actions(app: &PlaitApp, ctx: &egui::Context) -> Vec<Action> {
    let mut actions = Vec::new();
    if app.dialogs.is_open() {
        return actions;
    }
    let typing = ctx.text_edit_focused();
    ctx.input_mut(|i| {
        // Ctrl+Shift+Z comes before Ctrl+Z, which would consume it.
        for (shortcut, action) in [
            (REDO, Action::Redo),
            (REDO_ALTERNATIVE, Action::Redo),
            (UNDO, Action::Undo),
            (OPEN, Action::AskOpen),
            (SAVE, Action::AskSave),
            (EXPORT, Action::AskExport),
            (QUIT, Action::Quit),
        ] {
            // A text field has its own history.
            let of_text = typing && matches!(action, Action::Undo | Action::Redo);
            if !of_text && i.consume_shortcut(&shortcut) {
                actions.push(action);
            }
        }
        if !typing {
            plain_keys(app, i, &mut actions);
        }
    });
    actions
}

/// The actions of keys without modifiers.
fn plain_keys(app: &PlaitApp, i: &mut egui::InputState, actions: &mut Vec<Action>) {
    let optimise = if app.is_optimising() { Action::Stop } else { Action::Optimise };
    for (key, action) in [
        (Key::Num1, Action::Toggle(ViewOption::Stripes)),
        (Key::Num2, Action::Toggle(ViewOption::Regions)),
        (Key::Num3, Action::Toggle(ViewOption::Layout)),
        (Key::Num4, Action::Toggle(ViewOption::Wireframe)),
        (Key::S, Action::Suggest),
        (Key::I, Action::Improve),
        (Key::M, optimise),
        (Key::F, Action::FrameAll),
    ] {
        if i.consume_key(Modifiers::NONE, key) {
            actions.push(action);
        }
    }
    if i.events.iter().any(|e| matches!(e, egui::Event::Text(t) if t == "?")) {
        actions.push(Action::Shortcuts(!app.shortcuts_open));
    }
    if i.key_pressed(Key::Escape) {
        actions.push(escape(app));
    }
    let delete = i.key_pressed(Key::Delete) || i.key_pressed(Key::Backspace);
    match (&app.editing, app.selected) {
        (Some(editing), _) => {
            actions.extend(editing.selected.filter(|_| delete).map(Action::RemoveAnchor));
            if i.consume_key(Modifiers::NONE, Key::Enter) {
                actions.push(Action::PlaceEdited);
            }
        }
        (None, Some(strip)) if delete => actions.push(Action::Remove(strip)),
        (None, _) => {
            let strip = app.hover.strip.or(app.selected);
            actions.extend(strip.filter(|_| i.consume_key(Modifiers::NONE, Key::E)).map(Action::Edit));
        }
    }
}

/// The action of Escape: closes a window, else drops the edited strip, else cancels the running operation, else deselects.
fn escape(app: &PlaitApp) -> Action {
    if app.shortcuts_open {
        Action::Shortcuts(false)
    } else if app.about_open {
        Action::About(false)
    } else if app.editing.is_some() {
        Action::StopEditing
    } else if app.worker.running().is_some_and(|r| !r.yields) {
        Action::Cancel
    } else {
        Action::Select(None)
    }
}

/// Shows the list of shortcuts.
pub fn show(ctx: &egui::Context, actions: &mut Vec<Action>) {
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
