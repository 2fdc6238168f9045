//! Strips through anchors: set, moved, turned, taken back and placed by pointer and keys.

use egui::{Modifiers, PointerButton, Pos2, pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use plait_app::engine::{Strip, StripId};

use super::{FRONT, Window, click, hover, open, strips, until_idle, wait, wheel};

fn button(window: &mut Window, pos: Pos2, button: PointerButton, pressed: bool, modifiers: Modifiers) {
    window.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
    window.step();
}

/// A drag with the left button, in steps; what is between is searched for live.
fn drag(window: &mut Window, from: Pos2, to: Pos2) {
    window.hover_at(from);
    window.step();
    button(window, from, PointerButton::Primary, true, Modifiers::NONE);
    for k in 1..=5 {
        window.hover_at(from + (to - from) * (k as f32 / 5.0));
        window.step();
    }
    button(window, to, PointerButton::Primary, false, Modifiers::NONE);
    until_idle(window);
}

fn shift_click(window: &mut Window, at: Pos2) {
    window.hover_at(at);
    window.step();
    for pressed in [true, false] {
        button(window, at, PointerButton::Primary, pressed, Modifiers::SHIFT);
    }
    until_idle(window);
}

fn key(window: &mut Window, key: egui::Key) {
    window.key_press(key);
    until_idle(window);
}

fn anchors(window: &Window) -> usize {
    window.state().anchors().map_or(0, <[_]>::len)
}

fn strip(window: &Window, i: usize) -> Strip {
    window.state().scene().unwrap().strips[i].clone()
}

/// The smallest angle, in degrees, at which a strip passes the point of the screen, to a direction on the screen.
fn angle_on_screen(window: &Window, strip: &Strip, at: Pos2, along: egui::Vec2) -> f32 {
    let app = window.state();
    let n = strip.polyline.len();
    let on_screen: Vec<Pos2> = strip.polyline.iter().filter_map(|&p| app.on_screen(p)).collect();
    assert_eq!(on_screen.len(), n);
    let i = (0..n).min_by(|&i, &j| on_screen[i].distance(at).total_cmp(&on_screen[j].distance(at))).unwrap();
    let away = |step: usize| (1..n).map(|k| on_screen[(i + k * step) % n]).find(|q| q.distance(on_screen[i]) > 12.0);
    let tangent = (away(1).unwrap() - away(n - 1).unwrap()).normalized();
    tangent.dot(along.normalized()).abs().min(1.0).acos().to_degrees()
}

/// A point of a strip that is seen, as far as possible from `from`.
fn far_point(window: &Window, strip: &Strip, from: Pos2) -> Pos2 {
    let app = window.state();
    let seen = strip.polyline.iter().filter_map(|&p| app.on_screen(p).filter(|q| q.y > FRONT.y - 40.0));
    seen.max_by(|a, b| a.distance(from).total_cmp(&b.distance(from))).unwrap()
}

#[test]
fn a_drag_sets_the_direction_of_a_strip_and_enter_places_it() {
    let mut window = open("torus");
    for (i, along) in [vec2(60.0, 0.0), vec2(6.0, 60.0)].into_iter().enumerate() {
        drag(&mut window, FRONT, FRONT + along);
        assert_eq!(anchors(&window), 1);
        assert_eq!(strips(&window), i, "a drag alone places nothing");
        key(&mut window, egui::Key::Enter);
        assert_eq!((anchors(&window), strips(&window)), (0, i + 1));
        let placed = strip(&window, i);
        let angle = angle_on_screen(&window, &placed, FRONT, along);
        assert!(angle < 12.0, "{along:?}: {angle}°");
        assert!(placed.anchors.len() == 1 && placed.anchors[0].direction.is_some());
    }
}

#[test]
fn anchors_are_added_taken_back_and_the_strip_is_dropped() {
    let mut window = open("torus");
    shift_click(&mut window, FRONT);
    assert_eq!(anchors(&window), 1);
    let there = FRONT + vec2(-90.0, 8.0);
    click(&mut window, there);
    until_idle(&mut window);
    drag(&mut window, FRONT + vec2(90.0, 6.0), FRONT + vec2(130.0, 2.0));
    assert_eq!(anchors(&window), 3);
    assert!(window.state().anchors().unwrap()[2].direction.is_some());
    for left in [2, 1, 0] {
        window.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
        until_idle(&mut window);
        assert_eq!(anchors(&window), left);
    }
    shift_click(&mut window, FRONT);
    key(&mut window, egui::Key::Escape);
    assert_eq!((anchors(&window), strips(&window)), (0, 0));
    assert!(window.state().anchors().is_none());
}

#[test]
fn anchors_and_the_spine_are_dragged_and_anchors_are_removed() {
    let mut window = open("torus");
    drag(&mut window, FRONT, FRONT + vec2(60.0, 0.0));
    let before = window.state().anchors().unwrap().to_vec();
    // The anchor itself.
    drag(&mut window, FRONT, FRONT + vec2(0.0, -12.0));
    let moved = window.state().anchors().unwrap().to_vec();
    assert!(moved.len() == 1 && moved[0].at != before[0].at && moved[0].direction.is_some());
    // The spine, dragged at another place.
    let proposal = window.state().shown().unwrap().clone();
    let spine = Strip {
        id: StripId(0),
        polyline: proposal,
        closed: true,
        length: 0.0,
        cost: 0.0,
        visible: true,
        anchors: Vec::new(),
    };
    let grabbed = far_point(&window, &spine, FRONT);
    drag(&mut window, grabbed, grabbed + vec2(0.0, 14.0));
    assert_eq!(anchors(&window), 2);
    // It is selected, and can be removed.
    key(&mut window, egui::Key::Delete);
    assert_eq!(window.state().anchors().unwrap(), moved);
}

#[test]
fn a_placed_strip_is_selected_edited_and_replaced_as_one_step() {
    let mut window = open("torus");
    hover(&mut window, FRONT);
    click(&mut window, FRONT);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    let placed = strip(&window, 0);
    let on_it = far_point(&window, &placed, pos2(0.0, 0.0));
    window.hover_at(on_it);
    until_idle(&mut window);
    assert_eq!(window.state().offered().0, 0, "nothing is proposed over a placed strip");
    click(&mut window, on_it);
    until_idle(&mut window);
    assert_eq!(window.state().selected(), Some(placed.id));
    assert_eq!(strips(&window), 1);
    // Escape leaves it as it was.
    key(&mut window, egui::Key::E);
    assert_eq!(window.state().anchors().unwrap(), placed.anchors);
    key(&mut window, egui::Key::Escape);
    assert_eq!(strip(&window, 0), placed);

    key(&mut window, egui::Key::E);
    drag(&mut window, FRONT, FRONT + vec2(30.0, -10.0));
    key(&mut window, egui::Key::Enter);
    let replaced = strip(&window, 0);
    assert!(replaced.id == placed.id && replaced.polyline != placed.polyline && strips(&window) == 1);
    window.key_press_modifiers(Modifiers::COMMAND, egui::Key::Z);
    until_idle(&mut window);
    assert_eq!(strip(&window, 0), placed);
}

#[test]
fn an_alternative_that_was_placed_is_shown_when_it_is_edited() {
    let mut window = open("creature");
    let at = pos2(420.0, 360.0);
    hover(&mut window, at);
    until_idle(&mut window);
    wheel(&mut window, -1.0);
    assert_eq!(window.state().offered().1, 1);
    let spine = window.state().shown().unwrap().clone();
    click(&mut window, at);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    let id = strip(&window, 0).id;
    window.get_by_label("Select Strip 1").click();
    window.run_steps(4);
    assert_eq!(window.state().selected(), Some(id));
    key(&mut window, egui::Key::E);
    assert_eq!(window.state().shown(), Some(&spine));
    // Once an anchor is added, the best strip through the anchors is shown.
    assert!(window.state().offered().1 > 0);
    click(&mut window, at + vec2(40.0, 10.0));
    until_idle(&mut window);
    assert_eq!(window.state().offered().1, 0);
}

#[test]
fn a_double_click_edits_a_strip() {
    let mut window = open("torus");
    hover(&mut window, FRONT);
    click(&mut window, FRONT);
    wait(&mut window, |app| app.scene().is_some_and(|s| s.strips.len() == 1));
    let on_it = far_point(&window, &strip(&window, 0), pos2(0.0, 0.0));
    window.hover_at(on_it);
    window.run_steps(60);
    click(&mut window, on_it);
    click(&mut window, on_it);
    until_idle(&mut window);
    assert_eq!(anchors(&window), 1);
    window.get_by_label_contains("Escape: drop it");
}
