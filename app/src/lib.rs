//! The program `plait`: the window and the command line of `plait-core`.

pub mod camera;
pub mod cli;
pub mod distortion;
pub mod engine;
pub mod input;
pub mod palette;
pub mod render;
pub mod session_engine;
pub mod shading;
pub mod texts;
pub mod window;
pub mod worker;
