//! The input of an export: a layout with its initial embedding, and the options.

use crate::embed::{ArcHeadings, Next, Settings, Snapshot, Surface};
use crate::mesh::{Normalisation, TriMesh};
use crate::proxy::Proxy;
use crate::weave::embedding::{InitialLayout, PinnedElements};

/// The size of the quads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum QuadSize {
    /// Edge length, in units of the file.
    EdgeLength(f64),
    /// Approximate number of quads.
    Count(u32),
}

/// The arc length below which chords are collapsed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CollapseLength {
    /// The edge length of the quads.
    Quad,
    /// A length, in units of the file.
    Length(f64),
}

/// How a layout is embedded and refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// The size of the quads.
    pub size: QuadSize,
    /// Settings of the optimisation; `None`: the initial embedding is written.
    pub embedding: Option<Settings>,
    /// Whether the sides of patches are integer multiples of the quads' edge length.
    pub integer: bool,
    /// Whether chords are removed that make the layout more irregular and the embedding no better.
    pub simplify: bool,
    /// The length below which arcs are collapsed, if any are.
    pub collapse: Option<CollapseLength>,
}

impl Default for ExportOptions {
    fn default() -> Self {
        // With 6000 quads the distance to the surface is well below half a percent of the model size.
        Self {
            size: QuadSize::Count(6000),
            embedding: Some(Settings::default()),
            integer: false,
            simplify: false,
            collapse: None,
        }
    }
}

/// Called after every step of an optimisation that lowered the objective; returns whether to continue.
pub type Watch<'a> = &'a mut dyn FnMut(&Snapshot) -> Next;

/// A layout with its initial embedding, from a session or a layout file.
#[derive(Debug, Clone, Copy)]
pub struct EmbeddingInput<'a> {
    /// The surface that the layout is embedded on.
    pub surface: Surface<'a>,
    /// If the surface is a proxy: its maps, and the design mesh, which the quads are projected to.
    pub proxy: Option<(&'a Proxy, &'a TriMesh)>,
    /// The transformation between the normalised surface and the file.
    pub units: Normalisation,
    /// The layout with its initial embedding; without patches if arcs are missing.
    pub initial: &'a InitialLayout,
    /// Headings of the arcs' sides in the charts of the regions between them.
    pub arc_headings: &'a [ArcHeadings],
    /// Nodes and arcs that keep their positions.
    pub pinned: &'a PinnedElements,
}

impl EmbeddingInput<'_> {
    /// The wanted edge length of quads on the normalised surface, before patches are mapped.
    pub(super) fn edge_length(&self, size: QuadSize) -> f64 {
        let mesh = self.surface.mesh;
        match size {
            QuadSize::EdgeLength(length) => length / self.units.scale,
            QuadSize::Count(n) => (mesh.faces().map(|f| mesh.face_area(f)).sum::<f64>() / f64::from(n.max(1))).sqrt(),
        }
    }
}
