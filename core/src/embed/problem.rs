//! The input of an optimisation: surface, layout, initial embedding and settings.

use crate::embed::topology::embedding_topology::ArcHeadings;
use crate::layout::{Embedding, QuadLayout};
use crate::mesh::TriMesh;
use crate::surface::{PrincipalCurvature, SurfaceIndex};

/// The surface a layout is embedded on.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Its mesh, normalised.
    pub mesh: &'a TriMesh,
    /// Spatial index of the mesh, for nearest points.
    pub index: &'a SurfaceIndex,
    /// Principal curvatures at its vertices.
    pub curvature: &'a [PrincipalCurvature],
    /// Whether each edge is sharp.
    pub sharp: &'a [bool],
}

/// Settings of an optimisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest number of node steps: of the least-squares map, and as many again of the injective map.
    pub steps: usize,
    /// Largest number of successive halvings of the step size; an injective map takes at most 2.
    pub halvings: usize,
    /// Anisotropy ρ of the norm: weight of misalignment relative to that of sizing error (section 6.4.3); at least 1.
    pub anisotropy: f64,
    /// Whether target lengths vary over the surface so that the sized field has less curl.
    pub sizing: bool,
    /// Least length of an arc in the map, as a multiple of the mean edge length of the mesh.
    pub spacing: f64,
    /// Length in the map below which chords are collapsed, on a surface of model size 1; `None`: no chord
    /// is, and short ones keep the least length.
    pub collapse: Option<f64>,
    /// Whether chords are collapsed one by one as long as that makes the layout less irregular without raising the
    /// energy.
    pub simplify: bool,
    /// Edge length that all chord lengths are to be multiples of, in the same unit as `collapse`; `None`: lengths are
    /// free.
    pub integer: Option<f64>,
}

impl Default for Settings {
    /// Steps, halvings, anisotropy and sizing as in the thesis (sections 6.4.3 and 6.5.1). With a `spacing` of 1.5 a
    /// patch is wide enough to be resolved by triangles.
    fn default() -> Self {
        Self {
            steps: 25,
            halvings: 5,
            anisotropy: 10.0,
            sizing: true,
            spacing: 1.5,
            collapse: None,
            simplify: false,
            integer: None,
        }
    }
}

/// A layout to be embedded on a surface.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// The structure of the layout; a partial layout, where arcs are missing, has no patches.
    pub layout: &'a QuadLayout,
    /// Its initial embedding.
    pub initial_embedding: &'a Embedding,
    /// The headings of both sides of every arc, in the charts of the regions beside it.
    pub arc_headings: &'a [ArcHeadings],
    /// Whether each node keeps its initial position; empty: none does.
    pub pinned_nodes: &'a [bool],
    /// Whether the two end nodes of each arc keep their initial positions; empty: none does. Between its ends the arc
    /// is an isoline like any other.
    pub pinned_arcs: &'a [bool],
    /// The settings.
    pub settings: Settings,
}

impl Problem<'_> {
    /// Area of the surface.
    pub(in crate::embed) fn area(&self) -> f64 {
        self.surface.mesh.faces().map(|f| self.surface.mesh.face_area(f)).sum()
    }

    /// For each node whether it is pinned, itself or as the end of a pinned arc.
    pub(in crate::embed) fn pinned(&self) -> Vec<bool> {
        let mut pinned = self.pinned_nodes.to_vec();
        pinned.resize(self.layout.nodes.len(), false);
        for (arc, _) in self.layout.arcs.iter().zip(self.pinned_arcs).filter(|pair| *pair.1) {
            arc.nodes.iter().for_each(|&n| pinned[n as usize] = true);
        }
        pinned
    }
}
