//! The whole window without a display: drawn by a software driver, driven through its widget tree and pointer.

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Modifiers, PointerButton, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use plait_app::engine::Source;
use plait_app::weaving::SessionOpener;
use plait_app::window::PlaitApp;

/// Slow machines draw a frame in a tenth of a second; the work in between must not be cut short.
const PATIENCE: Duration = Duration::from_secs(60);

type Window = Harness<'static, PlaitApp>;

fn open(model: &str) -> Window {
    let source = Source::BuiltIn(model.to_owned());
    let mut window = Harness::builder()
        .with_size(vec2(1100.0, 700.0))
        .with_max_steps(8)
        .wgpu()
        .build_eframe(move |cc| PlaitApp::new(cc, Arc::new(SessionOpener), Some(source)).unwrap());
    wait(&mut window, |app| app.scene().is_some());
    window
}

/// Frames until `done` holds and the worker rests.
fn wait(window: &mut Window, done: impl Fn(&PlaitApp) -> bool) {
    let start = Instant::now();
    loop {
        let rests = window.state().is_idle();
        window.step();
        if rests && done(window.state()) {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "the window did not get there");
        std::thread::sleep(Duration::from_millis(5));
    }
    // Once more, so that what was taken in is laid out.
    window.run_steps(2);
}

fn hover(window: &mut Window, at: egui::Pos2) {
    window.hover_at(at);
    wait(window, |app| app.offered().0 > 0);
}

fn click(window: &mut Window, at: egui::Pos2) {
    for pressed in [true, false] {
        let (pos, button, modifiers) = (at, PointerButton::Primary, Modifiers::NONE);
        window.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
        window.step();
    }
}

fn wheel(window: &mut Window, notches: f32) {
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: vec2(0.0, notches),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    window.step();
}

fn strips(window: &Window) -> usize {
    window.state().scene().map_or(0, |s| s.strips.len())
}

/// The torus as the camera first shows it: on its front.
const FRONT: egui::Pos2 = pos2(400.0, 430.0);

#[test]
fn a_strip_is_offered_browsed_placed_hidden_and_taken_back() {
    let mut window = open("torus");
    window.get_by_label("No strip is placed yet");
    hover(&mut window, FRONT);
    let (count, chosen) = window.state().offered();
    assert_eq!(chosen, 0);
    if count > 1 {
        wheel(&mut window, -1.0);
        assert_eq!(window.state().offered().1, 1);
        wheel(&mut window, 1.0);
        assert_eq!(window.state().offered().1, 0);
    }
    click(&mut window, FRONT);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    window.get_by_label("Hide Strip 1").click();
    wait(&mut window, |app| app.scene().is_some_and(|s| !s.strips[0].visible));
    window.get_by_label("Show Strip 1");

    window.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.is_empty()));
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, egui::Key::Z);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    window.get_by_label("Select Strip 1").click();
    window.run_steps(6);
    assert!(window.state().selected().is_some());
    window.key_press(egui::Key::Delete);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.is_empty()));
}

#[test]
fn suggestions_finish_a_torus_and_the_layout_is_shown() {
    let mut window = open("torus");
    for round in 1..=4 {
        if window.state().scene().unwrap().exportable {
            break;
        }
        window.get_by_label("Suggest a strip").click();
        wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == round));
    }
    wait(&mut window, |app| app.scene().is_some_and(|s| s.layout.is_some()));
    let scene = window.state().scene().unwrap();
    assert!(scene.exportable && scene.summary.starts_with("Ready to export"), "{}", scene.summary);
    assert!(!scene.layout.as_ref().unwrap().arcs.is_empty());
    window.get_by_label("Export layout…");
}

#[test]
fn exporting_too_early_says_why() {
    let mut window = open("torus");
    window.get_by_label("Export").click();
    window.run_steps(6);
    window.get_by_label("There is no layout to export yet: No strip is placed yet");
    window.get_by_label("Dismiss").click();
    window.run_steps(6);
    assert!(window.query_by_label("Dismiss").is_none());
}

#[test]
fn dragging_turns_the_view_and_places_nothing() {
    let mut window = open("torus");
    let before = *window.state().camera();
    window.hover_at(FRONT);
    window.step();
    window.drag_at(FRONT);
    window.step();
    window.hover_at(FRONT + vec2(60.0, 10.0));
    window.step();
    window.drop_at(FRONT + vec2(60.0, 10.0));
    wait(&mut window, |_| true);
    assert_ne!(before.yaw, window.state().camera().yaw);
    assert_eq!(strips(&window), 0);
}

#[test]
fn the_picture_shows_a_lit_surface() {
    let mut window = open("torus");
    let picture = window.render().unwrap();
    // Grey values over the view: a backdrop, light and shadow on the surface.
    let view = picture.enumerate_pixels().filter(|(x, y, _)| (100..700).contains(x) && (100..650).contains(y));
    let mut levels = [0usize; 16];
    view.for_each(|(_, _, p)| levels[usize::from(p[0]) / 16] += 1);
    let used = levels.iter().filter(|&&n| n > 500).count();
    assert!(used >= 5, "grey levels: {levels:?}");
}
