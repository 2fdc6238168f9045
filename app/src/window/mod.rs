//! The window: panels around a 3D view.
//!
//! The panels are functions of the state ([`state::PlaitApp`]) that return [`Action`]s. After every frame the window
//! carries these out ([`actions`]) and takes in the replies of the worker ([`replies`]).

mod action;
mod actions;
mod app;
mod detail_panel;
mod dialogs;
mod editing;
mod element_picking;
mod embedding_panel;
mod handles;
mod hover;
mod icons;
mod legend;
mod menu_bar;
mod messages;
mod overlays;
mod panels;
mod pointer;
mod prepared;
mod replies;
mod shortcuts;
mod side_panel;
mod state;
mod status_bar;
mod stoppable;
mod strip_picking;
mod theme;
mod view;
mod widgets;

pub use action::{Action, ViewOption, ViewOptions};
pub use app::run;
pub use state::PlaitApp;
