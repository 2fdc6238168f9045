//! What a dialog asks for.

/// The purpose of a dialog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// A mesh or design to read.
    Open,
    /// A design to write.
    Save,
    /// A folder to export into.
    Export,
}

impl Asked {
    /// The heading of the dialog.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a mesh or a design",
            Self::Save => "Save the design",
            Self::Export => "Export the layout into a folder",
        }
    }

    /// File name extensions of the files that can be chosen.
    pub(super) fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Open => &["obj", "off", "ply", "stl", "plait"],
            Self::Save => &["plait"],
            Self::Export => &[],
        }
    }

    /// The label of the button that confirms.
    pub(super) fn verb(self) -> &'static str {
        match self {
            Self::Open => "Open",
            Self::Save => "Save",
            Self::Export => "Export",
        }
    }
}
