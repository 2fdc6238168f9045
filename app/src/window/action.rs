//! The actions that panels and keys return, and the options of the view.

use glam::DVec3;

use crate::distortion::ColourMode;
use crate::engine::{Detail, LayoutPart, Source, StripId};

/// An action of the user, by a button, a menu or a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Ask for a file, and open it.
    AskOpen,
    /// Open a model or a design.
    Open(Source),
    /// Ask for a file, and write the design.
    AskSave,
    /// Ask for a folder, and export the layout.
    AskExport,
    /// Set the target number of quads of an export.
    Quads(usize),
    /// Undo the last change, or discard the running search or optimisation.
    Undo,
    /// Redo the change undone last.
    Redo,
    /// Place the strip that resolves the most urgent problem.
    Suggest,
    /// Search for strips with a lower objective.
    Improve,
    /// Select a strip, or none.
    Select(Option<StripId>),
    /// Remove a strip.
    Remove(StripId),
    /// Edit a placed strip through its anchors.
    Edit(StripId),
    /// Place the strip that is edited.
    PlaceEdited,
    /// Drop the strip that is edited.
    StopEditing,
    /// Remove an anchor of the strip that is edited.
    RemoveAnchor(usize),
    /// Show or hide a strip.
    SetVisible(StripId, bool),
    /// Choose smoothing and curvature radius, without applying them.
    ChooseDetail(Detail),
    /// Apply the chosen smoothing and curvature radius.
    ApplyDetail,
    /// Optimise the embedding of the layout.
    Optimise,
    /// Stop the running search or optimisation, and keep its best result.
    Stop,
    /// Pin or unpin a node or an arc.
    SetPinned(LayoutPart, bool),
    /// Unpin all nodes and arcs.
    UnpinAll,
    /// Choose what the colours of the surface show.
    ChooseColours(ColourMode),
    /// Show the whole model.
    FrameAll,
    /// Look at a place.
    LookAt(DVec3),
    /// Turn a view option on or off.
    Toggle(ViewOption),
    /// Cancel the running operation.
    Cancel,
    /// Dismiss a message.
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
    /// The colours of regions with problems.
    Regions,
    /// Nodes and arcs of a valid layout.
    Layout,
    /// Edges of the triangles.
    Wireframe,
    /// Whether z points up instead of y.
    ZUp,
}

impl ViewOption {
    /// All options, in the order of the menu.
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

    /// Turns one of them on or off.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toggling_an_option_changes_no_other() {
        for option in ViewOption::ALL {
            let mut options = ViewOptions::default();
            options.toggle(option);
            for other in ViewOption::ALL {
                assert_eq!(options.get(other) != ViewOptions::default().get(other), other == option, "{other:?}");
            }
        }
    }
}
