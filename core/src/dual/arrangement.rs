//! The arrangement of dual curves: crossings, segments between them, and regions (Campen, sections 2.1, 5.1).
//!
//! The curves are inserted into a refined mesh as paths of marked edges ([`super::path_insertion`]). A crossing is a vertex
//! with four marked edges, an end is a boundary vertex with one, a segment is a chain of marked edges between such vertices,
//! and a region is a set of triangles joined across unmarked edges. All of them follow from the connectivity of that mesh.

use super::crossings::{Crossing, End, crossing_index, crossings_and_ends, marked_outgoing};
use super::curve_insertion::CurveInserter;
use super::error::ArrangementError;
use super::refined_mesh::{Mark, NONE, RefinedMesh};
use super::regions::{Region, Regions, SideKind};
use super::segments::{Segment, Segments};
use crate::mesh::TriMesh;
use crate::surface::SurfaceCurve;

/// The arrangement of a list of curves on a mesh.
#[derive(Debug, Clone)]
pub struct Arrangement {
    /// The mesh with all curves as paths of edges.
    pub refined: RefinedMesh,
    /// All crossings, sorted by vertex.
    pub crossings: Vec<Crossing>,
    /// All ends on the boundary, sorted by vertex.
    pub ends: Vec<End>,
    /// All segments.
    pub segments: Vec<Segment>,
    /// All regions, sorted by their first triangle.
    pub regions: Vec<Region>,
    /// Region of each triangle of the refined mesh.
    pub region_of_face: Vec<u32>,
    /// Segment of each half-edge of the refined mesh and whether it runs in the segment's direction; `None` where unmarked.
    segment_of: Vec<Option<(u32, bool)>>,
    n_base_vertices: usize,
}

impl Arrangement {
    /// Arranges `curves` on `base`. Each segment and each stretch of boundary between ends has an inner vertex.
    ///
    /// # Errors
    ///
    /// [`ArrangementError::Curve`] if a curve does not lie on the mesh. The others mean a defect of curve insertion.
    pub fn new<'c>(
        base: &TriMesh,
        curves: impl IntoIterator<Item = &'c SurfaceCurve>,
    ) -> Result<Self, ArrangementError> {
        Self::unsubdivided(base, curves)?.subdivided()
    }

    /// The arrangement of the marked edges of a mesh, whose first `n_base_vertices` vertices are those of the surface. Each
    /// segment and each stretch of boundary gets an inner vertex.
    ///
    /// # Errors
    ///
    /// [`ArrangementError::Degree`] if the marked edges are not curves that cross transversally.
    pub(crate) fn from_marked_mesh(refined: RefinedMesh, n_base_vertices: usize) -> Result<Self, ArrangementError> {
        Self::read(refined, n_base_vertices)?.subdivided()
    }

    /// As [`Self::new`], but a segment or a stretch of boundary may be a single edge. That suffices to assess regions, not to
    /// embed a layout.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn unsubdivided<'c>(
        base: &TriMesh,
        curves: impl IntoIterator<Item = &'c SurfaceCurve>,
    ) -> Result<Self, ArrangementError> {
        let mut inserter = CurveInserter::new(base);
        for (i, curve) in curves.into_iter().enumerate() {
            curve.check(base).map_err(|source| ArrangementError::Curve { curve: i, source })?;
            inserter.insert(curve, i as u32).map_err(|source| ArrangementError::Insertion { curve: i, source })?;
        }
        Self::read(inserter.refined, base.n_vertices())
    }

    /// The arrangement in which each segment and each stretch of boundary has an inner vertex.
    fn subdivided(self) -> Result<Self, ArrangementError> {
        match self.with_inner_vertices() {
            Some(refined) => Self::read(refined, self.n_base_vertices),
            None => Ok(self),
        }
    }

    /// The refined mesh in which segments and boundary stretches of a single edge are split; `None` if there are none.
    fn with_inner_vertices(&self) -> Option<RefinedMesh> {
        let single = |halfedges: &[u32]| match *halfedges {
            [h] => Some((self.refined.origin(h), self.refined.target(h))),
            _ => None,
        };
        let stretches = self.regions.iter().flat_map(|r| &r.borders).flatten();
        let stretches = stretches.filter(|s| s.kind == SideKind::Boundary).map(|s| &s.halfedges);
        let segments = self.segments.iter().map(|s| &s.halfedges);
        let short: Vec<(u32, u32)> = segments.chain(stretches).filter_map(|list| single(list)).collect();
        if short.is_empty() {
            return None;
        }
        let mut refined = self.refined.clone();
        for (a, b) in short {
            if let Some(h) = refined.find(a, b) {
                refined.split_edge(h, 0.5);
            }
        }
        Some(refined)
    }

    /// Reads the arrangement from a mesh with marked edges.
    fn read(refined: RefinedMesh, n_base_vertices: usize) -> Result<Self, ArrangementError> {
        let (crossings, mut ends) = crossings_and_ends(&refined)?;
        let segments = Segments::find(&refined, &crossings, &ends);
        for end in &mut ends {
            let segment = refined.outgoing(end.vertex).into_iter().find_map(|h| segments.at[h as usize]);
            end.segment = segment.map_or(NONE, |(s, _)| s);
        }
        let Regions { regions, of_face } = Regions::find(&refined, &crossings, &segments);
        let Segments { segments, at: segment_of } = segments;
        Ok(Self { refined, crossings, ends, segments, regions, region_of_face: of_face, segment_of, n_base_vertices })
    }

    /// The segment along a half-edge of the refined mesh, and whether it runs in the segment's direction.
    pub fn segment_at(&self, h: u32) -> Option<(u32, bool)> {
        self.segment_of[h as usize]
    }

    /// The half-edges of a curve in order, in one of its two directions: from end to end, or once around. Empty if there is
    /// no such curve.
    pub fn curve_halfedges(&self, curve: u32) -> Vec<u32> {
        let refined = &self.refined;
        let of_curve = |h: &u32| refined.mark(*h) == Mark::Curve(curve);
        let end = self.ends.iter().find_map(|e| refined.outgoing(e.vertex).into_iter().find(of_curve));
        let inner = || self.segments.iter().find(|s| s.curve == curve).and_then(|s| s.halfedges.first().copied());
        let Some(first) = end.or_else(inner) else { return Vec::new() };
        let mut halfedges = vec![first];
        let mut h = first;
        while let Some(onward) = self.straight_on(h).filter(|&g| g != first) {
            halfedges.push(onward);
            h = onward;
        }
        halfedges
    }

    /// The half-edge of the same curve after half-edge `h`, straight across crossings; `None` at its end.
    fn straight_on(&self, h: u32) -> Option<u32> {
        let (v, back) = (self.refined.target(h), self.refined.twin(h));
        if let Some(i) = self.crossing_index(v) {
            let spokes = self.crossings[i].spokes;
            let from = spokes.iter().position(|&g| Some(g) == back)?;
            return Some(spokes[(from + 2) % 4]);
        }
        marked_outgoing(&self.refined, v).find(|g| Some(*g) != back)
    }

    /// Number of vertices of the mesh before refinement; they come first in the refined mesh.
    pub fn n_base_vertices(&self) -> usize {
        self.n_base_vertices
    }

    /// The region to the left of a half-edge of the refined mesh.
    pub fn region_left_of(&self, h: u32) -> u32 {
        self.region_of_face[(h / 3) as usize]
    }

    /// Index of the crossing at vertex `v`.
    pub fn crossing_index(&self, v: u32) -> Option<usize> {
        crossing_index(&self.crossings, v)
    }
}
