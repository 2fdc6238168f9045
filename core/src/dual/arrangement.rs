//! The arrangement of dual curves: crossings, segments between them, and regions (Campen, sections 2.1, 5.1).
//!
//! The curves are drawn as edge paths into a refined mesh ([`super::refined`]). A crossing is a vertex with
//! four marked edges, an end is a boundary vertex with one, a segment is a chain of marked edges between
//! such vertices, and a region is a set of triangles joined across unmarked edges. All of it is read off the
//! connectivity of that mesh.

use thiserror::Error;

use super::curve_insertion::CurveInserter;
use super::refined_mesh::{Mark, NONE, NoPath, RefinedMesh, next};
use crate::mesh::{TriMesh, TriMeshError};
use crate::surface::{CurveError, SurfaceCurve};

/// Why curves could not be arranged.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ArrangementError {
    /// A curve does not lie on the mesh.
    #[error("curve {curve}: {source}")]
    Curve {
        /// Index of the curve.
        curve: usize,
        /// What is wrong with it.
        source: CurveError,
    },
    /// A curve could not be drawn.
    #[error("curve {curve} could not be drawn: {source}")]
    Draw {
        /// Index of the curve.
        curve: usize,
        /// Where it failed.
        source: NoPath,
    },
    /// A vertex where other than two curves meet; the drawing rules exclude it.
    #[error("vertex {vertex} has {degree} curve edges")]
    Crossing {
        /// Vertex of the refined mesh.
        vertex: u32,
        /// Number of curve edges there.
        degree: usize,
    },
    /// The refined mesh is no manifold; the drawing rules exclude it.
    #[error("the arrangement is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
}

/// A transversal crossing of two curves (or of one with itself): a patch of the layout.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Vertex of the refined mesh.
    pub vertex: u32,
    /// The four marked outgoing half-edges, counter-clockwise.
    pub spokes: [u32; 4],
}

/// The place where a curve ends on the boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    /// Vertex of the refined mesh.
    pub vertex: u32,
    /// The segment that ends here.
    pub segment: u32,
}

/// A piece of a curve between two crossings or ends: an arc of the layout crosses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// The curve it belongs to.
    pub curve: u32,
    /// Its half-edges in order, in one of the two directions.
    pub halfedges: Vec<u32>,
    /// Whether it is a whole closed curve that nothing crosses.
    pub ring: bool,
}

/// What a side of a region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SideKind {
    /// A segment between crossings or ends, passed in its own direction or against it.
    Segment {
        /// The segment.
        segment: u32,
        /// Whether the region lies to the left of the segment's own direction.
        forward: bool,
    },
    /// A closed curve that nothing crosses.
    Ring {
        /// Its only segment.
        segment: u32,
    },
    /// A stretch of the boundary of the surface, or a whole boundary loop.
    Boundary,
}

/// One side of a region, passed with the region to the left.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// What it is.
    pub kind: SideKind,
    /// Its half-edges in order; all belong to triangles of the region.
    pub halfedges: Vec<u32>,
}

impl Side {
    fn is_segment(&self) -> bool {
        matches!(self.kind, SideKind::Segment { .. })
    }
}

/// A region: a node of the layout once it is a disc.
#[derive(Debug, Clone)]
pub struct Region {
    /// Its triangles in the refined mesh, in increasing order.
    pub faces: Vec<u32>,
    /// Its border cycles.
    pub borders: Vec<Vec<Side>>,
    /// Euler characteristic of the open region; 1 exactly for an open disc.
    pub euler: i64,
}

impl Region {
    /// Whether the open region is a disc.
    pub fn is_disc(&self) -> bool {
        self.euler == 1
    }

    /// Number of corners at crossings: the layout patches that meet at the region's node.
    pub fn corners(&self) -> usize {
        let corners = |border: &Vec<Side>| {
            let n = border.len();
            (0..n).filter(|&i| border[i].is_segment() && border[(i + 1) % n].is_segment()).count()
        };
        self.borders.iter().map(corners).sum()
    }

    /// Number of stretches of the surface's boundary that the region touches.
    pub fn boundary_stretches(&self) -> usize {
        self.borders.iter().flatten().filter(|s| s.kind == SideKind::Boundary).count()
    }
}

/// The arrangement of a list of curves on a mesh.
#[derive(Debug, Clone)]
pub struct Arrangement {
    /// The mesh with all curves as edge paths.
    pub refined: RefinedMesh,
    /// All crossings, by vertex.
    pub crossings: Vec<Crossing>,
    /// All ends on the boundary, by vertex.
    pub ends: Vec<End>,
    /// All segments.
    pub segments: Vec<Segment>,
    /// All regions, by their first triangle.
    pub regions: Vec<Region>,
    /// Region of each triangle of the refined mesh.
    pub region_of_face: Vec<u32>,
    /// Segment of each half-edge of the refined mesh and whether it runs forward; none where unmarked.
    segment_of: Vec<Option<(u32, bool)>>,
    n_base_vertices: usize,
}

impl Arrangement {
    /// Arranges `curves` on `base`. Every segment and every stretch of boundary has an inner vertex.
    ///
    /// # Errors
    ///
    /// A curve that does not lie on the mesh, or (never seen) a violated promise of the drawing.
    pub fn new<'c>(
        base: &TriMesh,
        curves: impl IntoIterator<Item = &'c SurfaceCurve>,
    ) -> Result<Self, ArrangementError> {
        Self::unsubdivided(base, curves)?.complete()
    }

    /// The arrangement of curves that are drawn already, as marked edges of a mesh that has all vertices of the surface
    /// before others.
    ///
    /// # Errors
    ///
    /// When the marked edges are not those of curves that cross transversally.
    pub(crate) fn from_marked_mesh(refined: RefinedMesh, n_base_vertices: usize) -> Result<Self, ArrangementError> {
        Self::read(refined, n_base_vertices)?.complete()
    }

    /// As [`Self::new`], but a segment or stretch may be a single edge: enough to assess, not to embed.
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
            inserter.insert(curve, i as u32).map_err(|source| ArrangementError::Draw { curve: i, source })?;
        }
        Self::read(inserter.refined, base.n_vertices())
    }

    fn complete(self) -> Result<Self, ArrangementError> {
        match self.with_inner_vertices() {
            Some(refined) => Self::read(refined, self.n_base_vertices),
            None => Ok(self),
        }
    }

    /// The refined mesh with the segments and boundary stretches split that are single edges, if there are
    /// any: afterwards every one has an inner vertex.
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

    /// Reads the arrangement off a mesh with marked edges.
    fn read(refined: RefinedMesh, n_base_vertices: usize) -> Result<Self, ArrangementError> {
        let (crossings, ends) = meetings(&refined)?;
        let mut this = Self {
            segment_of: vec![None; 3 * refined.n_faces()],
            region_of_face: vec![NONE; refined.n_faces()],
            refined,
            crossings,
            ends,
            segments: Vec::new(),
            regions: Vec::new(),
            n_base_vertices,
        };
        this.find_segments();
        this.find_regions();
        Ok(this)
    }

    /// Segment that runs along a half-edge of the refined mesh and whether in its direction.
    pub fn segment_at(&self, h: u32) -> Option<(u32, bool)> {
        self.segment_of[h as usize]
    }

    /// The half-edges of a curve in order, in one of its two directions: from end to end, or once around.
    pub fn curve_halfedges(&self, curve: u32) -> Vec<u32> {
        let refined = &self.refined;
        let of_curve = |h: &u32| refined.mark(*h) == Mark::Curve(curve);
        let end = self.ends.iter().find_map(|e| refined.outgoing(e.vertex).into_iter().find(of_curve));
        let inner = || self.segments.iter().find(|s| s.curve == curve).and_then(|s| s.halfedges.first().copied());
        let Some(first) = end.or_else(inner) else { return Vec::new() };
        let mut curve_halfedges = vec![first];
        let mut h = first;
        while let Some(onward) = self.straight_on(h).filter(|&g| g != first) {
            curve_halfedges.push(onward);
            h = onward;
        }
        curve_halfedges
    }

    /// The half-edge in which a curve goes on after another of its half-edges; `None` at its end.
    fn straight_on(&self, h: u32) -> Option<u32> {
        let (v, back) = (self.refined.target(h), self.refined.twin(h));
        if let Some(i) = self.crossing_index(v) {
            let spokes = self.crossings[i].spokes;
            let from = spokes.iter().position(|&g| Some(g) == back)?;
            return Some(spokes[(from + 2) % 4]);
        }
        let marked = |g: &u32| self.refined.mark(*g) != Mark::Free && Some(*g) != back;
        self.refined.outgoing(v).into_iter().find(marked)
    }

    /// Number of vertices of the mesh before refinement; they come first in the refined mesh.
    pub fn n_base_vertices(&self) -> usize {
        self.n_base_vertices
    }

    /// The region to the left of a half-edge of the refined mesh.
    pub fn region_left_of(&self, h: u32) -> u32 {
        self.region_of_face[(h / 3) as usize]
    }

    fn find_segments(&mut self) {
        let starts: Vec<u32> = {
            let at_crossings = self.crossings.iter().flat_map(|c| c.spokes);
            let at_ends = self.ends.iter().filter_map(|e| {
                self.refined.outgoing(e.vertex).into_iter().find(|&h| self.refined.mark(h) != Mark::Free)
            });
            at_crossings.chain(at_ends).collect()
        };
        for h in starts {
            if self.segment_of[h as usize].is_none() {
                self.trace_segment(h, false);
            }
        }
        for h in 0..3 * self.refined.n_faces() as u32 {
            if self.refined.mark(h) != Mark::Free && self.segment_of[h as usize].is_none() {
                self.trace_segment(h, true);
            }
        }
        for end in &mut self.ends {
            let spoke = self.refined.outgoing(end.vertex).into_iter().find_map(|h| self.segment_of[h as usize]);
            end.segment = spoke.map_or(NONE, |(s, _)| s);
        }
    }

    /// Follows marked edges from `first` to the next crossing or end, or once around.
    fn trace_segment(&mut self, first: u32, ring: bool) {
        let id = self.segments.len() as u32;
        let Mark::Curve(curve) = self.refined.mark(first) else { return };
        let mut halfedges = vec![first];
        let mut h = first;
        loop {
            self.segment_of[h as usize] = Some((id, true));
            if let Some(t) = self.refined.twin(h) {
                self.segment_of[t as usize] = Some((id, false));
            }
            let v = self.refined.target(h);
            let marked: Vec<u32> =
                self.refined.outgoing(v).into_iter().filter(|&g| self.refined.mark(g) != Mark::Free).collect();
            let back = self.refined.twin(h);
            let onward = marked.iter().copied().find(|&g| Some(g) != back);
            match onward {
                Some(g) if marked.len() == 2 && g != first => {
                    halfedges.push(g);
                    h = g;
                }
                _ => break,
            }
        }
        self.segments.push(Segment { curve, halfedges, ring });
    }

    fn find_regions(&mut self) {
        let mut scratch = Scratch {
            on_border: vec![false; self.refined.n_vertices()],
            counted: vec![false; self.refined.n_vertices()],
            traced: vec![false; 3 * self.refined.n_faces()],
        };
        for seed in 0..self.refined.n_faces() as u32 {
            if self.region_of_face[seed as usize] != NONE {
                continue;
            }
            let id = self.regions.len() as u32;
            let mut faces = vec![seed];
            self.region_of_face[seed as usize] = id;
            let mut i = 0;
            while i < faces.len() {
                for h in 3 * faces[i]..3 * faces[i] + 3 {
                    let Some(t) = self.refined.twin(h) else { continue };
                    if self.refined.mark(h) == Mark::Free && self.region_of_face[(t / 3) as usize] == NONE {
                        self.region_of_face[(t / 3) as usize] = id;
                        faces.push(t / 3);
                    }
                }
                i += 1;
            }
            faces.sort_unstable();
            let region = self.describe_region(faces, &mut scratch);
            self.regions.push(region);
        }
    }

    fn describe_region(&self, faces: Vec<u32>, scratch: &mut Scratch) -> Region {
        let inner = |h: u32| self.refined.mark(h) == Mark::Free && !self.refined.is_boundary(h);
        let halfedges = || faces.iter().flat_map(|f| 3 * f..3 * f + 3);
        let mut inner_halfedges = 0i64;
        let mut borders = Vec::new();
        for h in halfedges() {
            if inner(h) {
                inner_halfedges += 1;
                continue;
            }
            // Every fan of the region at a vertex on its border is bounded by border half-edges.
            scratch.on_border[self.refined.origin(h) as usize] = true;
            scratch.on_border[self.refined.target(h) as usize] = true;
            if !scratch.traced[h as usize] {
                let cycle = self.border_from(h);
                for &g in &cycle {
                    scratch.traced[g as usize] = true;
                }
                borders.push(self.split_border(&cycle));
            }
        }
        let mut inner_vertices = 0;
        for h in halfedges() {
            let v = self.refined.origin(h) as usize;
            if !scratch.on_border[v] && !scratch.counted[v] {
                scratch.counted[v] = true;
                inner_vertices += 1;
            }
        }
        let euler = faces.len() as i64 - inner_halfedges / 2 + inner_vertices;
        Region { faces, borders, euler }
    }

    /// The border half-edges that follow `start`, with the region to the left.
    fn border_from(&self, start: u32) -> Vec<u32> {
        let mut cycle = vec![start];
        let mut h = start;
        loop {
            h = next(h);
            while self.refined.mark(h) == Mark::Free {
                match self.refined.twin(h) {
                    Some(t) => h = next(t),
                    None => break,
                }
            }
            if h == start {
                return cycle;
            }
            cycle.push(h);
        }
    }

    /// Cuts a border cycle where its segment changes.
    fn split_border(&self, cycle: &[u32]) -> Vec<Side> {
        let n = cycle.len();
        // A corner lies between two half-edges where a crossing or an end is passed.
        let cut = |i: usize| {
            let (h, g) = (cycle[(i + n - 1) % n], cycle[i]);
            match (self.segment_of[h as usize], self.segment_of[g as usize]) {
                (None, None) => false,
                (Some(_), Some(_)) => self.crossing_at(self.refined.origin(g)),
                _ => true,
            }
        };
        let kind = |h: u32| match self.segment_of[h as usize] {
            None => SideKind::Boundary,
            Some((segment, _)) if self.segments[segment as usize].ring => SideKind::Ring { segment },
            Some((segment, forward)) => SideKind::Segment { segment, forward },
        };
        let Some(first) = (0..n).find(|&i| cut(i)) else {
            return vec![Side { kind: kind(cycle[0]), halfedges: cycle.to_vec() }];
        };
        let mut sides: Vec<Side> = Vec::new();
        for k in 0..n {
            let i = (first + k) % n;
            if cut(i) {
                sides.push(Side { kind: kind(cycle[i]), halfedges: Vec::new() });
            }
            if let Some(side) = sides.last_mut() {
                side.halfedges.push(cycle[i]);
            }
        }
        sides
    }

    fn crossing_at(&self, v: u32) -> bool {
        self.crossings.binary_search_by_key(&v, |c| c.vertex).is_ok()
    }

    /// Index of the crossing at vertex `v`.
    pub fn crossing_index(&self, v: u32) -> Option<usize> {
        self.crossings.binary_search_by_key(&v, |c| c.vertex).ok()
    }
}

/// Marks that describing all regions shares: a vertex off all borders belongs to one region only.
struct Scratch {
    on_border: Vec<bool>,
    counted: Vec<bool>,
    traced: Vec<bool>,
}

/// All vertices where curves cross or end.
fn meetings(refined: &RefinedMesh) -> Result<(Vec<Crossing>, Vec<End>), ArrangementError> {
    let (mut crossings, mut ends) = (Vec::new(), Vec::new());
    let mut degree = vec![0u8; refined.n_vertices()];
    let mut at_boundary = vec![false; refined.n_vertices()];
    for h in 0..3 * refined.n_faces() as u32 {
        if refined.mark(h) != Mark::Free {
            let d = &mut degree[refined.origin(h) as usize];
            *d = d.saturating_add(1);
        }
        if refined.is_boundary(h) {
            at_boundary[refined.origin(h) as usize] = true;
        }
    }
    for v in 0..refined.n_vertices() as u32 {
        match (degree[v as usize], at_boundary[v as usize]) {
            (0, _) | (2, false) => {}
            (1, true) => ends.push(End { vertex: v, segment: NONE }),
            (4, false) => {
                let marked: Vec<u32> =
                    refined.outgoing(v).into_iter().filter(|&h| refined.mark(h) != Mark::Free).collect();
                crossings.push(Crossing { vertex: v, spokes: [marked[0], marked[1], marked[2], marked[3]] });
            }
            (d, _) => return Err(ArrangementError::Crossing { vertex: v, degree: d.into() }),
        }
    }
    Ok((crossings, ends))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{column, row, square, torus};

    fn checked(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Arrangement {
        let a = Arrangement::new(mesh, curves).unwrap();
        let refined = a.refined.to_mesh().unwrap();
        assert_eq!(refined.euler_characteristic(), mesh.euler_characteristic());
        // The regions partition the surface: open cells of all dimensions add up to χ.
        let open: i64 = a.regions.iter().map(|r| r.euler).sum();
        let arcs = a.segments.iter().filter(|s| !s.ring).count() as i64;
        if mesh.vertices().all(|v| !mesh.is_boundary_vertex(v)) {
            assert_eq!(open - arcs + a.crossings.len() as i64, mesh.euler_characteristic());
        }
        a
    }

    #[test]
    fn a_torus_needs_two_loops() {
        let mesh = torus(12, 8);
        let none = checked(&mesh, &[]);
        assert_eq!((none.regions.len(), none.regions[0].euler), (1, 0));

        let one = checked(&mesh, &[row(12, 3, true, 0.4)]);
        assert_eq!((one.regions.len(), one.crossings.len()), (1, 0));
        assert_eq!(one.regions[0].borders.len(), 2);
        assert_eq!(one.regions[0].corners(), 0);

        let two = checked(&mesh, &[row(12, 3, true, 0.4), column(12, 8, 5, true, 0.7)]);
        assert_eq!((two.regions.len(), two.crossings.len(), two.segments.len()), (1, 1, 2));
        assert!(two.regions[0].is_disc());
        assert_eq!(two.regions[0].corners(), 4);
    }

    #[test]
    fn equal_places_on_an_edge_keep_their_order() {
        let mesh = torus(12, 8);
        let parallel = [row(12, 3, true, 0.4), row(12, 3, true, 0.4), row(12, 3, true, 0.4)];
        let a = checked(&mesh, &parallel);
        assert_eq!((a.regions.len(), a.crossings.len()), (3, 0));
    }

    #[test]
    fn many_curves_cross_once_each() {
        let mesh = torus(10, 10);
        let mut curves = Vec::new();
        for k in 0..6 {
            curves.push(row(10, 4, true, 0.1 + 0.13 * f64::from(k)));
            curves.push(column(10, 10, 4, true, 0.15 + 0.13 * f64::from(k)));
        }
        let a = checked(&mesh, &curves);
        assert_eq!((a.crossings.len(), a.regions.len()), (36, 36));
        assert!(a.regions.iter().all(|r| r.is_disc() && r.corners() == 4));
    }

    #[test]
    fn open_curves_end_on_the_boundary() {
        let mesh = square(6);
        let a = checked(&mesh, &[row(6, 2, false, 0.5), column(6, 6, 3, false, 0.5)]);
        assert_eq!((a.crossings.len(), a.ends.len(), a.segments.len(), a.regions.len()), (1, 4, 4, 4));
        for r in &a.regions {
            assert!(r.is_disc());
            assert_eq!((r.corners(), r.boundary_stretches()), (1, 1));
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config::with_cases(24))]

        /// Rows and columns of a torus in any order, at any places: each pair crosses once, and the regions are
        /// the cells of a grid.
        #[test]
        fn rows_and_columns_make_a_grid(
            curves in proptest::collection::vec((proptest::bool::ANY, 0u32..8, 0.001f64..0.999), 2..9)
        ) {
            let mesh = torus(8, 8);
            let rows = curves.iter().filter(|c| c.0).count();
            let columns = curves.len() - rows;
            let list: Vec<SurfaceCurve> = curves
                .iter()
                .map(|&(is_row, at, t)| if is_row { row(8, at, true, t) } else { column(8, 8, at, true, t) })
                .collect();
            let a = checked(&mesh, &list);
            proptest::prop_assert_eq!(a.crossings.len(), rows * columns);
            if rows > 0 && columns > 0 {
                proptest::prop_assert_eq!(a.regions.len(), rows * columns);
                proptest::prop_assert!(a.regions.iter().all(|r| r.is_disc() && r.corners() == 4));
            }
        }
    }
}
