//! Drawing: a lit, striped surface with lines and markers over it, through wgpu.
//!
//! The surface goes into an offscreen target (4× multisampled colour and depth) that is redrawn only when the
//! scene, the camera or the size changed; [`Renderer::paint`] then composes backdrop, surface image, lines and
//! markers into whatever pass it is given, the window's or that of [`render_to_png`]. The room knows neither
//! the window nor the engine: it draws [`SceneInput`] values.

mod headless;
mod pipelines;
mod renderer;
mod scene;
mod target;

pub use headless::{Headless, HeadlessError, render_to_png};
pub use renderer::{Frame, Renderer};
pub use scene::{Marker, Polyline, SceneInput, SurfaceMesh, SurfaceVertex, Toggles, ViewUniforms};
