//! Saving and exporting through the dialogs of the program: no file is replaced unasked, and no file of another kind at all.

use std::path::Path;

use egui::{Modifiers, pos2};
use egui_kittest::kittest::Queryable as _;

use super::{FRONT, Window, click, hover, open, strips, until_idle, wait};

/// A window on a torus, without dialogs of the system.
fn window() -> Window {
    let mut window = open("torus");
    window.state_mut().use_own_dialogs();
    window
}

fn place_strip(window: &mut Window) {
    let before = strips(window);
    hover(window, FRONT);
    click(window, FRONT);
    wait(window, |app| app.scene().is_some_and(|s| s.strips.len() == before + 1));
    // Away from the surface, so that keys are not followed by another search.
    window.hover_at(pos2(5.0, 690.0));
    window.run_steps(2);
}

/// Opens the dialog of a shortcut, and types a name instead of the one suggested.
fn type_name(window: &mut Window, key: egui::Key, name: &Path) {
    window.key_press_modifiers(Modifiers::COMMAND, key);
    window.run_steps(4);
    window.get_by_label("Name").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, egui::Key::A);
    window.run_steps(2);
    window.event(egui::Event::Text(name.display().to_string()));
    window.run_steps(2);
    window.key_press(egui::Key::Enter);
    window.run_steps(4);
}

/// Two clicks within the time of a double click: a frame of the test is longer.
fn double_click(window: &mut Window, pos: egui::Pos2) {
    window.hover_at(pos);
    window.run_steps(60);
    for pressed in [true, false, true, false] {
        let (button, modifiers) = (egui::PointerButton::Primary, Modifiers::NONE);
        window.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
    }
    window.run_steps(4);
}

fn shows(window: &Window, text: &str) -> bool {
    window.query_by_label_contains(text).is_some()
}

#[test]
fn a_design_is_saved_beside_a_mesh_of_that_name() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("bunny.obj");
    std::fs::write(&mesh, "v 0 0 0\n").unwrap();
    let mut window = window();
    type_name(&mut window, egui::Key::S, &mesh);
    until_idle(&mut window);
    assert!(shows(&window, "Saved "));
    assert_eq!(std::fs::read_to_string(&mesh).unwrap(), "v 0 0 0\n");
    let saved = folder.path().join("bunny.obj.plait");
    plait_core::weave::Design::read(&saved).unwrap();
}

#[test]
fn a_design_is_replaced_only_after_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.plait");
    let mut window = window();
    type_name(&mut window, egui::Key::S, &folder.path().join("a"));
    until_idle(&mut window);
    let first = std::fs::read_to_string(&path).unwrap();
    place_strip(&mut window);

    // Enter and Escape keep the file and lead back to the name.
    for key in [egui::Key::Enter, egui::Key::Escape] {
        type_name(&mut window, egui::Key::S, &path);
        assert!(shows(&window, "Replace a.plait?"));
        window.key_press(key);
        window.run_steps(6);
        assert!(!shows(&window, "Replace a.plait?"));
        window.get_by_label("Name");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), first);
        window.get_by_role_and_label(egui::accesskit::Role::Button, "Cancel").click();
        window.run_steps(4);
        assert!(window.query_by_label("Name").is_none());
    }

    type_name(&mut window, egui::Key::S, &path);
    window.get_by_label("Replace").click();
    window.run_steps(4);
    until_idle(&mut window);
    assert_eq!(plait_core::weave::Design::read(&path).unwrap().strips.len(), 1);
}

#[test]
fn a_file_that_is_no_design_is_kept_whatever_its_name_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.plait");
    std::fs::write(&path, "to do").unwrap();
    let mut window = window();
    type_name(&mut window, egui::Key::S, &path);
    window.get_by_label("Replace").click();
    window.run_steps(4);
    until_idle(&mut window);
    assert!(shows(&window, "notes.plait is no Plait design"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "to do");
}

#[test]
fn an_export_replaces_its_own_files_after_a_question_and_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let quads = out.join("quads.obj");
    let mut window = window();
    for round in 1..=4 {
        if window.state().scene().unwrap().exportable {
            break;
        }
        window.key_press(egui::Key::S);
        wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == round));
    }
    type_name(&mut window, egui::Key::E, &out);
    until_idle(&mut window);
    assert!(shows(&window, "Exported to"));
    let first = std::fs::read_to_string(&quads).unwrap();
    assert!(first.starts_with("# Plait: "));

    type_name(&mut window, egui::Key::E, &out);
    assert!(shows(&window, "Replace 6 files?"));
    window.get_by_label("Replace").click();
    window.run_steps(4);
    until_idle(&mut window);
    assert_eq!(std::fs::read_to_string(&quads).unwrap(), first);

    std::fs::write(&quads, "v 0 0 0\n").unwrap();
    type_name(&mut window, egui::Key::E, &out);
    window.get_by_label("Replace").click();
    window.run_steps(4);
    until_idle(&mut window);
    assert!(shows(&window, "quads.obj is no mesh written by Plait"));
    assert_eq!(std::fs::read_to_string(&quads).unwrap(), "v 0 0 0\n");
}

#[test]
fn a_double_click_opens_a_folder_and_no_file_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(inner.join("a.plait"), "to do").unwrap();
    std::fs::write(folder.path().join("bunny.obj"), "v 0 0 0\n").unwrap();
    let mut window = window();
    // A folder that is typed is entered.
    type_name(&mut window, egui::Key::S, folder.path());
    assert!(window.query_by_label("bunny.obj").is_none(), "a mesh is offered to be replaced");
    let at = window.get_by_label("inner/").rect().center();
    double_click(&mut window, at);
    // The file is now where the folder was, and nothing is asked.
    window.get_by_label("a.plait");
    assert!(!shows(&window, "Replace"));
    let at = window.get_by_label("a.plait").rect().center();
    double_click(&mut window, at);
    assert!(shows(&window, "Replace a.plait?"));
    assert_eq!(std::fs::read_to_string(inner.join("a.plait")).unwrap(), "to do");
}
