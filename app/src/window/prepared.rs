//! What was converted for the renderer, to be converted again only when it has changed.

use std::sync::Arc;

use crate::distortion::ColourMode;
use crate::engine::{DisplaySurface, EmbeddingSummary};
use crate::render::{Marker, Polyline, SurfaceMesh};
use crate::shading;

/// The latest surface, lines and markers of the renderer.
#[derive(Default)]
pub struct Prepared {
    surface: Option<(SurfaceInput, Arc<SurfaceMesh>)>,
    lines: Arc<Vec<Polyline>>,
    markers: Arc<Vec<Marker>>,
}

/// The input of a surface: its triangles, and what determines their colours.
pub struct SurfaceInput {
    /// The triangles.
    pub display: Arc<DisplaySurface>,
    /// What the colours show.
    pub colour_mode: ColourMode,
    /// The embedding whose distortion they show.
    pub summary: Option<Arc<EmbeddingSummary>>,
}

impl SurfaceInput {
    fn is(&self, other: &Self) -> bool {
        let summary = |d: &Self| d.summary.as_ref().map(Arc::as_ptr);
        let same_mode = self.colour_mode == other.colour_mode;
        Arc::ptr_eq(&self.display, &other.display) && same_mode && summary(self) == summary(other)
    }
}

impl Prepared {
    /// The surface of this input.
    pub fn surface(&mut self, input: SurfaceInput) -> Arc<SurfaceMesh> {
        match &self.surface {
            Some((held, mesh)) if held.is(&input) => Arc::clone(mesh),
            _ => {
                let tints = input.summary.as_ref().and_then(|s| input.colour_mode.tints(s));
                let mesh = Arc::new(shading::surface(&input.display, tints.as_deref()));
                self.surface = Some((input, Arc::clone(&mesh)));
                mesh
            }
        }
    }

    /// Lines and markers of an overlay. Equal ones keep their `Arc`, so that they are not uploaded again.
    pub fn overlay(&mut self, overlay: &shading::Overlay<'_>) -> (Arc<Vec<Polyline>>, Arc<Vec<Marker>>) {
        let (lines, markers) = shading::overlay(overlay);
        if *self.lines != lines {
            self.lines = Arc::new(lines);
        }
        if *self.markers != markers {
            self.markers = Arc::new(markers);
        }
        (Arc::clone(&self.lines), Arc::clone(&self.markers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_converted_again_only_when_its_input_changes() {
        let display = Arc::new(DisplaySurface::default());
        let input = |colour_mode| SurfaceInput { display: Arc::clone(&display), colour_mode, summary: None };
        let mut prepared = Prepared::default();
        let first = prepared.surface(input(ColourMode::Regions));
        assert!(Arc::ptr_eq(&first, &prepared.surface(input(ColourMode::Regions))));
        assert!(!Arc::ptr_eq(&first, &prepared.surface(input(ColourMode::Conformal))));
    }
}
