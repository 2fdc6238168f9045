//! The program `plait`: window, input, panels, drawing and command line around `plait-core`.

pub mod camera;
pub mod cli;
pub mod distortion;
pub mod engine;
pub mod input;
pub mod render;
pub mod shading;
pub mod weaving;
pub mod window;
pub mod worker;
