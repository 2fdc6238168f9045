//! The renderer: a lit, striped surface with lines and markers over it, through wgpu.
//!
//! The surface is drawn to an offscreen target (4× multisampled colour and depth), and only when the scene, the camera
//! or the size has changed. [`Renderer::paint`] composes backdrop, surface image, lines and markers into a render pass,
//! that of the window or that of [`render_to_png`]. The renderer depends on neither the window nor the engine: it draws
//! [`SceneInput`] values.

mod headless;
mod pipelines;
mod renderer;
mod scene;
mod target;

pub use headless::{Headless, HeadlessError, render_to_png};
pub use renderer::{Frame, Renderer};
pub use scene::{Marker, Polyline, SceneInput, SurfaceMesh, SurfaceStripes, SurfaceVertex, Toggles, ViewUniforms};
