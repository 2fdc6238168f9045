//! The whole window without a display: drawn by a software driver, driven through its widget tree and pointer.

#[path = "window/anchors.rs"]
mod anchors;
#[path = "window/files.rs"]
mod files;
#[path = "support/stand_in.rs"]
mod stand_in;

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Modifiers, PointerButton, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable};
use plait_app::distortion::ColourMode;
use plait_app::engine::{LayoutPart, Opener, Source};
use plait_app::session_engine::SessionOpener;
use plait_app::window::PlaitApp;

/// Slow machines draw a frame in a tenth of a second; the work in between must not be cut short.
const PATIENCE: Duration = Duration::from_secs(60);

type Window = Harness<'static, PlaitApp>;

fn open(model: &str) -> Window {
    open_with(Arc::new(SessionOpener), model)
}

fn open_with(opener: Arc<dyn Opener>, model: &str) -> Window {
    let source = Source::BuiltIn(model.to_owned());
    let mut window = Harness::builder()
        .with_size(vec2(1100.0, 700.0))
        .with_max_steps(8)
        // A quarter of a second, the default, is too long for a double click.
        .with_step_dt(1.0 / 60.0)
        .wgpu()
        .build_eframe(move |cc| PlaitApp::new(cc, opener, Some(source)).unwrap());
    wait(&mut window, |app| app.scene().is_some());
    window
}

/// Runs frames until `done` holds and the worker is idle.
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

fn until_idle(window: &mut Window) {
    wait(window, |app| app.is_idle());
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
fn a_strip_is_offered_browsed_placed_hidden_and_removed() {
    let mut window = open("torus");
    window.get_by_label("No strips placed yet");
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
fn detail_can_be_changed_and_restored_with_strips_placed() {
    let mut window = open("torus");
    hover(&mut window, FRONT);
    click(&mut window, FRONT);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    let length = window.state().scene().unwrap().strips[0].length;
    window.get_by_label("Curvature and smoothing").click();
    window.run_steps(30);
    let apply = "Apply";
    // The end of the slider: the largest radius.
    window.get_by_role_and_label(egui::accesskit::Role::Slider, "Smoothing radius").focus();
    window.run_steps(2);
    for _ in 0..20 {
        window.key_press(egui::Key::ArrowRight);
        window.step();
    }
    window.get_by_label(apply).click();
    wait(&mut window, |app| app.scene().is_some_and(|s| s.detail.smoothing > 0.0));
    let scene = window.state().scene().unwrap();
    assert_eq!(scene.strips.len(), 1);
    assert!((scene.strips[0].length - length).abs() < 1e-9, "the strip stays where it is");
    assert!(scene.can_undo);
    window.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
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
    window.get_by_label("The layout is not valid yet: No strips placed yet");
    window.get_by_label("Dismiss").click();
    window.run_steps(6);
    assert!(window.query_by_label("Dismiss").is_none());
}

#[test]
fn dragging_turns_the_view_and_places_nothing() {
    let mut window = open("torus");
    let before = *window.state().camera();
    // Beside the model.
    let beside = pos2(60.0, 120.0);
    window.hover_at(beside);
    window.step();
    window.drag_at(beside);
    window.step();
    window.hover_at(beside + vec2(60.0, 10.0));
    window.step();
    window.drop_at(beside + vec2(60.0, 10.0));
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

/// Runs frames until `done` holds; the worker may still be busy.
fn until(window: &mut Window, done: impl Fn(&PlaitApp) -> bool) {
    let start = Instant::now();
    while !done(window.state()) {
        assert!(start.elapsed() < PATIENCE, "the window did not get there");
        window.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    window.run_steps(2);
}

/// The stand-in with one strip and its layout.
fn with_layout() -> Window {
    let mut window = open_with(Arc::new(stand_in::StandIn), "stand-in");
    window.key_press(egui::Key::S);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.layout.is_some()));
    window
}

/// How far the first node has come along.
fn first_node(app: &PlaitApp) -> f64 {
    app.layout().map_or(f64::NAN, |l| l.nodes[0].position.x)
}

fn optimise_and_stop(window: &mut Window) {
    window.get_by_label("Optimise").click();
    until(window, |app| first_node(app) > stand_in::moved(3));
    window.get_by_label("Stop").click();
    wait(window, |app| app.scene().is_some_and(|s| s.embedding.is_some()));
}

#[test]
fn only_a_valid_layout_can_be_optimised() {
    let mut window = open_with(Arc::new(stand_in::StandIn), "stand-in");
    assert!(window.get_by_label("Optimise").accesskit_node().is_disabled());
    window.key_press(egui::Key::S);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.exportable));
    assert!(!window.get_by_label("Optimise").accesskit_node().is_disabled());
}

#[test]
fn an_optimisation_is_watched_stopped_and_kept() {
    let mut window = with_layout();
    window.get_by_label("Optimise").click();
    until(&mut window, |app| first_node(app) > stand_in::moved(0));
    // The scene still holds the layout before the optimisation; the view shows the latest step.
    assert_eq!(window.state().scene().unwrap().layout.as_ref().unwrap().nodes[0].position.x, stand_in::moved(0));
    assert!(window.query_by_label("Optimise").is_none());
    window.get_by_label_contains("3 flipped triangles");
    until(&mut window, |app| first_node(app) > stand_in::moved(5));
    window.get_by_label("Stop").click();
    wait(&mut window, |app| app.scene().is_some_and(|s| s.embedding.is_some()));
    assert!(first_node(window.state()) > stand_in::moved(5));
    window.get_by_label("0.500 to 0.250");
    window.get_by_label("3 to 0");
    window.get_by_label("7.5°");
    window.get_by_label("Optimise again");
}

#[test]
fn escape_undo_and_edits_discard_a_running_optimisation() {
    let keys = [(egui::Key::Escape, Modifiers::NONE, 1), (egui::Key::Z, Modifiers::COMMAND, 1)];
    for (key, modifiers, strips) in keys.into_iter().chain([(egui::Key::S, Modifiers::NONE, 2)]) {
        let mut window = with_layout();
        window.get_by_label("Optimise").click();
        until(&mut window, |app| first_node(app) > stand_in::moved(2));
        window.key_press_modifiers(modifiers, key);
        wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == strips));
        let app = window.state();
        assert!(app.scene().unwrap().embedding.is_none() && first_node(app) == stand_in::moved(0), "{key:?}");
        window.get_by_label("Optimising the embedding: cancelled");
    }
}

#[test]
fn a_layout_is_improved_watched_stopped_and_kept() {
    let mut window = with_layout();
    window.get_by_label("Improve the layout").click();
    // The strips change while it goes on.
    until(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() > 2));
    window.get_by_label_contains("(before 10.0°)");
    assert!(window.query_by_label("Improve the layout").is_none());
    window.get_by_label("Stop").click();
    wait(&mut window, |app| app.is_idle());
    let strips = window.state().scene().unwrap().strips.len();
    assert!((3..10).contains(&strips), "{strips}");
    window.get_by_label_contains("Layout improved: alignment error");
    window.get_by_label("Improve the layout");
}

#[test]
fn escape_discards_an_improvement() {
    let mut window = with_layout();
    window.key_press(egui::Key::I);
    until(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() > 2));
    window.key_press(egui::Key::Escape);
    wait(&mut window, |app| app.is_idle() && app.scene().is_some_and(|s| s.strips.len() == 1));
    window.get_by_label("Improving the layout: cancelled");
}

#[test]
fn a_change_of_the_strips_discards_the_optimised_embedding_with_a_message() {
    let mut window = with_layout();
    optimise_and_stop(&mut window);
    window.key_press(egui::Key::S);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 2));
    assert!(window.state().scene().unwrap().embedding.is_none());
    window.get_by_label_contains("The optimised embedding was discarded");
    window.get_by_label("Optimise");
}

#[test]
fn clicks_on_nodes_and_arcs_pin_and_unpin_them() {
    let mut window = with_layout();
    let layout = window.state().layout().unwrap().clone();
    let middle = layout.arcs[0].points[10];
    let arc = [(LayoutPart::Arc(0), middle, "Pinned: 1 arc")];
    let nodes = [(LayoutPart::Node(1), layout.nodes[1].position, "Pinned: 1 node")];
    for (part, place, text) in nodes.into_iter().chain(arc) {
        let at = window.state().on_screen(place).unwrap();
        window.hover_at(at);
        wait(&mut window, |app| app.pinnable() == Some(part));
        // What a click would do is clear: no strip is offered.
        assert_eq!(window.state().offered().0, 0);
        click(&mut window, at);
        wait(&mut window, |app| app.layout().and_then(|l| l.is_pinned(part)) == Some(true));
        window.get_by_label(text);
        click(&mut window, at);
        wait(&mut window, |app| app.layout().is_some_and(|l| l.pinned().is_empty()));
    }
    assert_eq!(strips(&window), 1);
    let at = window.state().on_screen(middle).unwrap();
    click(&mut window, at);
    wait(&mut window, |app| app.layout().is_some_and(|l| l.pinned().len() == 1));
    window.get_by_label("Unpin all").click();
    wait(&mut window, |app| app.layout().is_some_and(|l| l.pinned().is_empty()));
}

#[test]
fn the_surface_takes_the_colours_that_are_chosen() {
    let mut window = with_layout();
    assert!(window.query_by_label("Colour by").is_none());
    optimise_and_stop(&mut window);
    let plain = window.render().unwrap();
    window.get_by_role(egui::accesskit::Role::ComboBox).click();
    window.run_steps(4);
    window.get_by_role_and_label(egui::accesskit::Role::Button, "Alignment error").click();
    window.run_steps(6);
    assert_eq!(window.state().colour_mode(), ColourMode::Alignment);
    window.get_by_label_contains("Angle to the nearest principal");
    let picture = window.render().unwrap();
    // Half of the triangles are at the dark red end of the scale, none was before.
    let is_red = |p: &&image::Rgba<u8>| i32::from(p[0]) > i32::from(p[1].max(p[2])) + 25;
    let red = |p: &image::RgbaImage| p.pixels().filter(is_red).count();
    assert!(red(&picture) > red(&plain) + 5000, "{} {}", red(&picture), red(&plain));
    window.key_press(egui::Key::S);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 2));
    assert_eq!(window.state().colour_mode(), ColourMode::Regions);
}

#[test]
fn the_window_optimises_the_layout_of_a_cube() {
    let mut window = open("rounded-cube");
    for round in 1..=3 {
        window.key_press(egui::Key::S);
        wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == round));
    }
    wait(&mut window, |app| app.scene().is_some_and(|s| s.layout.is_some()));
    let initial = window.state().layout().unwrap().clone();
    window.get_by_label("Optimise").click();
    wait(&mut window, |app| app.scene().is_some_and(|s| s.embedding.is_some()));
    let scene = window.state().scene().unwrap();
    let (summary, layout) = (scene.embedding.as_ref().unwrap(), window.state().layout().unwrap());
    assert!(summary.energy[1] < summary.energy[0] && summary.flipped[1] == 0, "{:?}", summary.energy);
    assert!(summary.conformal < 2.05 && summary.alignment < 5.0, "{} {}", summary.conformal, summary.alignment);
    assert_eq!(summary.triangles.len(), scene.design_mesh.n_faces());
    assert_eq!((layout.nodes.len(), layout.arcs.len()), (8, 12));
    assert_ne!(layout.nodes, initial.nodes);
}
