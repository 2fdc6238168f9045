//! `plait render`: renders a design to a PNG file, as the window shows it.

use std::sync::Arc;

use anyhow::Context as _;
use glam::Vec2;
use plait_core::progress::Progress;

use super::arguments::RenderArguments;
use super::input;
use crate::camera::Camera;
use crate::engine::{Opener, Scene};
use crate::render::{Frame, SceneInput, Toggles, render_to_png};
use crate::shading;

/// Opens the design and renders it.
///
/// # Errors
///
/// When the design cannot be opened, there is no graphics driver, or the file cannot be written.
pub fn run(arguments: &RenderArguments, opener: &dyn Opener) -> anyhow::Result<()> {
    let source = input::source(&arguments.design, opener);
    let engine = opener.open(&source, &Progress::new()).with_context(|| format!("cannot open {}", source.name()))?;
    let frame = frame(&engine.scene(), arguments);
    render_to_png(&frame, &arguments.out).with_context(|| format!("cannot render to {}", arguments.out.display()))
}

/// The whole model, with everything that the window shows of it.
fn frame(scene: &Scene, arguments: &RenderArguments) -> Frame {
    let layout = scene.layout.as_deref();
    let overlay = shading::Overlay {
        scene,
        proposal: None,
        selected: None,
        layout,
        part: None,
        handles: &[],
        pointed: None,
        strips: true,
        place: None,
    };
    let (lines, markers) = shading::overlay(&overlay);
    let mut camera = Camera {
        yaw: arguments.yaw.to_radians(),
        pitch: arguments.pitch.clamp(-88.0, 88.0).to_radians(),
        z_up: arguments.z_up,
        ..Camera::default()
    };
    let size = Vec2::new(arguments.size[0] as f32, arguments.size[1] as f32);
    camera.frame(&shading::framing_points(&scene.surface), size);
    Frame {
        scene: SceneInput {
            surface: Arc::new(shading::surface(&scene.surface, None)),
            lines: Arc::new(lines),
            markers: Arc::new(markers),
            ..SceneInput::default()
        },
        view: camera.uniforms(size),
        toggles: Toggles { wireframe: arguments.wireframe, ..Toggles::default() },
        size: arguments.size,
        // Line widths scale with the picture; 900 points is the height of the window.
        pixels_per_point: size.min_element() / 900.0,
    }
}
