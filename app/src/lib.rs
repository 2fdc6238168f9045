//! The program `plait`: window, input, panels, drawing and command line around `plait-core`.

pub mod camera;
pub mod input;
pub mod picker;
pub mod render;
