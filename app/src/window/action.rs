//! What the panels ask for. Panels are functions of the state that return actions; the window carries them out.

use glam::DVec3;

use crate::distortion::Colours;
use crate::engine::{Detail, LayoutPart, Source, StripId};

/// A wish of the user, from a button, a menu or a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Ask for a file and open it.
    AskOpen,
    /// Open this.
    Open(Source),
    /// Ask for a file and write the design.
    AskSave,
    /// Ask for a folder and write the layout.
    AskExport,
    /// How many quads an export has, about.
    Quads(usize),
    /// Take back.
    Undo,
    /// Make again.
    Redo,
    /// Place the strip that helps most.
    Suggest,
    /// Try other strips, with which the layout follows the shape better.
    Improve,
    /// Select a strip, or none.
    Select(Option<StripId>),
    /// Remove a strip.
    Remove(StripId),
    /// Show or hide a strip.
    SetVisible(StripId, bool),
    /// Choose how much detail is woven with; it is applied later.
    ChooseDetail(Detail),
    /// Weave with the detail chosen.
    ApplyDetail,
    /// Optimise the embedding of the layout.
    Optimise,
    /// Stop what is made better step by step, and keep the best so far.
    Stop,
    /// Pin a part of the layout, or let it go.
    SetPinned(LayoutPart, bool),
    /// Let all parts of the layout go.
    UnpinAll,
    /// What the surface's colours tell.
    Colours(Colours),
    /// Look at the whole model.
    FrameAll,
    /// Look at a place.
    LookAt(DVec3),
    /// Turn a view option on or off.
    Toggle(ViewOption),
    /// Stop what is being done.
    Cancel,
    /// Put away a message.
    Dismiss(u64),
    /// Open or close the list of shortcuts.
    Shortcuts(bool),
    /// Open or close the page about the program.
    About(bool),
    /// End the program.
    Quit,
}

/// A view option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewOption {
    /// The stripe pattern and the spines of placed strips.
    Stripes,
    /// The colours of the regions.
    Regions,
    /// Arcs and nodes of a valid layout.
    Layout,
    /// Edges of the triangles.
    Wireframe,
    /// Whether z points up instead of y.
    ZUp,
}

impl ViewOption {
    /// All, in the order of the menu.
    pub const ALL: [Self; 5] = [Self::Stripes, Self::Regions, Self::Layout, Self::Wireframe, Self::ZUp];

    /// The name in the menu and its key.
    pub fn label(self) -> (&'static str, &'static str) {
        match self {
            Self::Stripes => ("Strips", "1"),
            Self::Regions => ("Region colours", "2"),
            Self::Layout => ("Layout", "3"),
            Self::Wireframe => ("Triangle edges", "4"),
            Self::ZUp => ("Z axis up", ""),
        }
    }
}

/// Which view options are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewOptions {
    /// See [`ViewOption::Stripes`].
    pub stripes: bool,
    /// See [`ViewOption::Regions`].
    pub regions: bool,
    /// See [`ViewOption::Layout`].
    pub layout: bool,
    /// See [`ViewOption::Wireframe`].
    pub wireframe: bool,
    /// See [`ViewOption::ZUp`].
    pub z_up: bool,
}

impl Default for ViewOptions {
    fn default() -> Self {
        Self { stripes: true, regions: true, layout: true, wireframe: false, z_up: false }
    }
}

impl ViewOptions {
    /// The value of one of them.
    pub fn get(&self, option: ViewOption) -> bool {
        match option {
            ViewOption::Stripes => self.stripes,
            ViewOption::Regions => self.regions,
            ViewOption::Layout => self.layout,
            ViewOption::Wireframe => self.wireframe,
            ViewOption::ZUp => self.z_up,
        }
    }

    /// Turns one of them over.
    pub fn toggle(&mut self, option: ViewOption) {
        let value = match option {
            ViewOption::Stripes => &mut self.stripes,
            ViewOption::Regions => &mut self.regions,
            ViewOption::Layout => &mut self.layout,
            ViewOption::Wireframe => &mut self.wireframe,
            ViewOption::ZUp => &mut self.z_up,
        };
        *value = !*value;
    }
}
