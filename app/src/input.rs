//! Translates pointer events over the 3D view to intents, by a state machine without a window.
//!
//! A left click acts on what is under the pointer, and so does a left drag over the surface. Left drag beside the model, left
//! drag with Alt and middle drag orbit; right drag or Shift with middle drag pans. The wheel browses proposals over the
//! surface, and zooms over the background or with Ctrl. Positions are in points from the top left corner of the view.

use glam::Vec2;

/// Largest movement of a click, in points; beyond, it is a drag.
const CLICK_SLOP: f32 = 4.0;
/// Points that a touchpad scrolls for one notch of a wheel.
const POINTS_PER_NOTCH: f32 = 40.0;
/// Factor of the camera's distance for one notch.
const ZOOM_PER_NOTCH: f32 = 0.88;

/// A button of the pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Button {
    /// The left one, unless buttons are swapped.
    Primary,
    /// The wheel.
    Middle,
    /// The right one, unless buttons are swapped.
    Secondary,
}

/// Keys held while the pointer acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// Shift.
    pub shift: bool,
    /// Ctrl, or Command on a Mac.
    pub ctrl: bool,
    /// Alt, or Option on a Mac.
    pub alt: bool,
}

/// An event of the pointer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PointerEvent {
    /// It moved to a position.
    Moved(Vec2),
    /// It left the view or the window.
    Gone,
    /// A button was pressed.
    Pressed(Button, Vec2, Held),
    /// A button was released.
    Released(Button, Vec2),
    /// The wheel turned: notches, positive away from the user.
    Wheel(f32, Held),
    /// A touchpad scrolled: points, positive away from the user.
    Scroll(f32, Held),
    /// Two fingers spread (above 1) or closed (below 1).
    Pinch(f32),
}

/// What the pointer is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Under {
    /// No surface.
    Background,
    /// The surface, or something on it that a left drag acts on.
    Surface,
    /// Something that a left drag does not act on: a node or an arc of the layout.
    Part,
}

/// What the user wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Intent {
    /// Show the proposals at a position.
    Hover(Vec2),
    /// Show no proposals.
    Leave,
    /// Show the proposal this many further on.
    Browse(i32),
    /// Act on what is under the pointer; with the keys held when the button went down.
    Click(Vec2, Held),
    /// Grab what is at a position.
    Grab(Vec2),
    /// Drag what was grabbed to a position.
    Drag(Vec2),
    /// Let go of what was grabbed.
    Drop(Vec2),
    /// Rotate the view by a drag.
    Orbit(Vec2),
    /// Move the view by a drag.
    Pan(Vec2),
    /// Zoom in (factor below 1) or out, about a position.
    Zoom(f32, Vec2),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Drag {
    None,
    /// Pressed, and not moved farther than [`CLICK_SLOP`].
    Pending {
        button: Button,
        from: Vec2,
        held: Held,
        moves: Moves,
    },
    Orbit(Button),
    Pan(Button),
    Grab(Button),
}

/// What a drag moves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moves {
    /// The camera around the model.
    Orbit,
    /// The camera sideways.
    Pan,
    /// What is under the pointer.
    Object,
}

/// The state machine.
#[derive(Debug)]
pub struct Input {
    position: Option<Vec2>,
    drag: Drag,
    /// Scrolling that does not make a whole notch yet.
    scrolled: f32,
}

impl Default for Input {
    fn default() -> Self {
        Self { position: None, drag: Drag::None, scrolled: 0.0 }
    }
}

impl Input {
    /// Whether a button is down.
    pub fn is_dragging(&self) -> bool {
        self.drag != Drag::None
    }

    /// The position of the pointer, while it is over the view.
    pub fn position(&self) -> Option<Vec2> {
        self.position
    }

    /// Handles one event; `under` is what the pointer is over.
    pub fn handle(&mut self, event: PointerEvent, under: Under) -> Option<Intent> {
        match event {
            PointerEvent::Moved(to) => self.moved(to),
            PointerEvent::Gone => {
                self.scrolled = 0.0;
                self.position.take().filter(|_| !self.is_dragging()).map(|_| Intent::Leave)
            }
            PointerEvent::Pressed(button, at, held) => {
                self.position = Some(at);
                if self.is_dragging() {
                    return None;
                }
                let moves = match button {
                    Button::Secondary => Moves::Pan,
                    Button::Middle if held.shift => Moves::Pan,
                    Button::Primary if under == Under::Surface && !held.alt => Moves::Object,
                    _ => Moves::Orbit,
                };
                self.drag = Drag::Pending { button, from: at, held, moves };
                None
            }
            PointerEvent::Released(button, at) => self.released(button, at, under),
            PointerEvent::Wheel(notches, held) => self.turned(notches, held, under),
            PointerEvent::Scroll(points, held) => self.turned(points / POINTS_PER_NOTCH, held, under),
            PointerEvent::Pinch(factor) => Some(Intent::Zoom(1.0 / factor.clamp(0.1, 10.0), self.position?)),
        }
    }

    fn moved(&mut self, to: Vec2) -> Option<Intent> {
        let from = self.position.replace(to);
        match self.drag {
            Drag::None => Some(Intent::Hover(to)),
            Drag::Pending { from, .. } if from.distance(to) <= CLICK_SLOP => None,
            Drag::Pending { button, from, moves, .. } => {
                let (drag, intent) = match moves {
                    Moves::Pan => (Drag::Pan(button), Intent::Pan(to - from)),
                    Moves::Orbit => (Drag::Orbit(button), Intent::Orbit(to - from)),
                    Moves::Object => (Drag::Grab(button), Intent::Grab(from)),
                };
                self.drag = drag;
                Some(intent)
            }
            Drag::Grab(_) => Some(Intent::Drag(to)),
            Drag::Orbit(_) => Some(Intent::Orbit(to - from.unwrap_or(to))),
            Drag::Pan(_) => Some(Intent::Pan(to - from.unwrap_or(to))),
        }
    }

    fn released(&mut self, button: Button, at: Vec2, under: Under) -> Option<Intent> {
        let (pressed, intent) = match self.drag {
            Drag::None => return None,
            Drag::Pending { button: Button::Primary, held, .. } if under != Under::Background => {
                (Button::Primary, Intent::Click(at, held))
            }
            Drag::Grab(button) => (button, Intent::Drop(at)),
            Drag::Pending { button, .. } | Drag::Orbit(button) | Drag::Pan(button) => (button, Intent::Hover(at)),
        };
        if pressed != button {
            return None;
        }
        self.drag = Drag::None;
        Some(intent)
    }

    /// Whether something is grabbed.
    pub fn is_grabbing(&self) -> bool {
        matches!(self.drag, Drag::Grab(_))
    }

    /// Ends a grab; the button that is still down does nothing more.
    pub fn let_go(&mut self) {
        if let Drag::Grab(button) = self.drag {
            self.drag = Drag::Pan(button);
        }
    }

    fn turned(&mut self, notches: f32, held: Held, under: Under) -> Option<Intent> {
        let at = self.position?;
        if held.ctrl || under == Under::Background || self.is_dragging() {
            self.scrolled = 0.0;
            return Some(Intent::Zoom(ZOOM_PER_NOTCH.powf(notches.clamp(-8.0, 8.0)), at));
        }
        // Scrolling down goes to the next alternative, as in a list.
        self.scrolled -= notches;
        let whole = self.scrolled.trunc();
        self.scrolled -= whole;
        (whole != 0.0).then_some(Intent::Browse(whole as i32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: Vec2 = Vec2::new(100.0, 100.0);
    const FREE: Held = Held { shift: false, ctrl: false, alt: false };

    fn at_rest() -> Input {
        let mut input = Input::default();
        assert_eq!(input.handle(PointerEvent::Moved(HERE), Under::Surface), Some(Intent::Hover(HERE)));
        input
    }

    fn drag(button: Button, held: Held) -> [Option<Intent>; 4] {
        let mut input = at_rest();
        let there = HERE + Vec2::new(10.0, 0.0);
        [
            input.handle(PointerEvent::Pressed(button, HERE, held), Under::Surface),
            input.handle(PointerEvent::Moved(there), Under::Surface),
            input.handle(PointerEvent::Moved(there + Vec2::Y), Under::Surface),
            input.handle(PointerEvent::Released(button, there + Vec2::Y), Under::Surface),
        ]
    }

    #[test]
    fn a_steady_click_acts_on_what_is_under_the_pointer() {
        let shift = Held { shift: true, ..FREE };
        for (over, held) in
            [(Under::Surface, FREE), (Under::Surface, shift), (Under::Background, FREE), (Under::Part, FREE)]
        {
            let mut input = at_rest();
            assert_eq!(input.handle(PointerEvent::Pressed(Button::Primary, HERE, held), over), None);
            let near = HERE + Vec2::new(2.0, 1.0);
            assert_eq!(input.handle(PointerEvent::Moved(near), over), None);
            let expected = if over == Under::Background { Intent::Hover(near) } else { Intent::Click(near, held) };
            assert_eq!(input.handle(PointerEvent::Released(Button::Primary, near), over), Some(expected));
            assert!(!input.is_dragging());
        }
    }

    #[test]
    fn middle_right_and_alt_drags_orbit_or_pan() {
        let delta = Vec2::new(10.0, 0.0);
        let end = Some(Intent::Hover(HERE + delta + Vec2::Y));
        let orbit = [None, Some(Intent::Orbit(delta)), Some(Intent::Orbit(Vec2::Y)), end];
        let pan = [None, Some(Intent::Pan(delta)), Some(Intent::Pan(Vec2::Y)), end];
        assert_eq!(drag(Button::Primary, Held { alt: true, ..FREE }), orbit);
        assert_eq!(drag(Button::Middle, FREE), orbit);
        assert_eq!(drag(Button::Middle, Held { shift: true, ..FREE }), pan);
        assert_eq!(drag(Button::Secondary, FREE), pan);
    }

    #[test]
    fn a_left_drag_over_the_surface_grabs_and_beside_it_orbits() {
        let there = HERE + Vec2::new(10.0, 0.0);
        let end = there + Vec2::Y;
        let expected = [None, Some(Intent::Grab(HERE)), Some(Intent::Drag(end)), Some(Intent::Drop(end))];
        assert_eq!(drag(Button::Primary, FREE), expected);
        for over in [Under::Background, Under::Part] {
            let mut input = at_rest();
            input.handle(PointerEvent::Pressed(Button::Primary, HERE, FREE), over);
            // What comes under the pointer during a drag does not matter.
            let moved = input.handle(PointerEvent::Moved(there), Under::Surface);
            assert_eq!(moved, Some(Intent::Orbit(there - HERE)));
        }
    }

    #[test]
    fn what_was_let_go_is_not_dropped() {
        let mut input = at_rest();
        input.handle(PointerEvent::Pressed(Button::Primary, HERE, FREE), Under::Surface);
        input.handle(PointerEvent::Moved(HERE * 2.0), Under::Surface);
        assert!(input.is_grabbing());
        input.let_go();
        let released = input.handle(PointerEvent::Released(Button::Primary, HERE * 2.0), Under::Surface);
        assert_eq!(released, Some(Intent::Hover(HERE * 2.0)));
    }

    #[test]
    fn the_wheel_browses_over_the_surface_and_zooms_elsewhere() {
        let mut input = at_rest();
        assert_eq!(input.handle(PointerEvent::Wheel(-1.0, FREE), Under::Surface), Some(Intent::Browse(1)));
        assert_eq!(input.handle(PointerEvent::Wheel(2.0, FREE), Under::Surface), Some(Intent::Browse(-2)));
        let ctrl = Held { ctrl: true, ..FREE };
        for (held, over) in [(ctrl, Under::Surface), (FREE, Under::Background)] {
            let zoom = input.handle(PointerEvent::Wheel(1.0, held), over);
            assert!(matches!(zoom, Some(Intent::Zoom(f, at)) if f < 1.0 && at == HERE), "{zoom:?}");
        }
    }

    #[test]
    fn a_touchpad_browses_one_notch_at_a_time() {
        let mut input = at_rest();
        let scroll = PointerEvent::Scroll(-POINTS_PER_NOTCH * 0.4, FREE);
        assert_eq!(input.handle(scroll, Under::Surface), None);
        assert_eq!(input.handle(scroll, Under::Surface), None);
        assert_eq!(input.handle(scroll, Under::Surface), Some(Intent::Browse(1)));
        assert_eq!(input.handle(scroll, Under::Surface), None);
    }

    #[test]
    fn another_button_does_not_end_a_drag() {
        let mut input = at_rest();
        input.handle(PointerEvent::Pressed(Button::Middle, HERE, FREE), Under::Surface);
        input.handle(PointerEvent::Moved(HERE * 2.0), Under::Surface);
        assert_eq!(input.handle(PointerEvent::Pressed(Button::Primary, HERE * 2.0, FREE), Under::Surface), None);
        assert_eq!(input.handle(PointerEvent::Released(Button::Primary, HERE * 2.0), Under::Surface), None);
        assert!(input.is_dragging());
    }

    #[test]
    fn leaving_hides_the_proposal_but_not_during_a_drag() {
        let mut input = at_rest();
        assert_eq!(input.handle(PointerEvent::Gone, Under::Background), Some(Intent::Leave));
        assert_eq!(input.handle(PointerEvent::Wheel(1.0, FREE), Under::Background), None);
        let mut input = at_rest();
        input.handle(PointerEvent::Pressed(Button::Primary, HERE, FREE), Under::Surface);
        assert_eq!(input.handle(PointerEvent::Gone, Under::Background), None);
    }
}
