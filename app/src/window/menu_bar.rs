//! The menu bar, with buttons for the most frequent commands.

use egui::{Align, Layout, RichText, Ui, vec2};

use super::action::{Action, ViewOption};
use super::state::PlaitApp;
use super::theme;
use crate::engine::Source;

/// Width of a menu, in points.
const MENU_WIDTH: f32 = 230.0;

/// Shows the bar.
pub fn show(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.label(RichText::new("Plait").size(18.0).color(theme::ACCENT));
        ui.add_space(6.0);
        menus(app, ui, actions);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            // The style of the menu bar has no button frames.
            ui.set_style(ui.ctx().global_style());
            buttons(app, ui, actions);
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
    item(ui, actions, "Show whole model", "F", app.scene.is_some(), Action::FrameAll);
}

/// A menu entry. A click closes the menu.
fn item(ui: &mut Ui, actions: &mut Vec<Action>, name: &str, hint: &str, enabled: bool, action: Action) {
    let button = egui::Button::new(name).shortcut_text(hint).min_size(vec2(MENU_WIDTH, 0.0));
    if ui.add_enabled(enabled, button).clicked() {
        actions.push(action);
        ui.close();
    }
}

fn buttons(app: &PlaitApp, ui: &mut Ui, actions: &mut Vec<Action>) {
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
