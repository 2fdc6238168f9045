//! Regions of an arrangement: the parts of the surface between its curves.

use super::crossings::{Crossing, crossing_index};
use super::refined_mesh::{Mark, NONE, RefinedMesh, next};
use super::segments::Segments;

/// What a side of a region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SideKind {
    /// A segment between crossings or ends.
    Segment {
        /// The segment.
        segment: u32,
        /// Whether the region is to the left of the segment's own direction.
        forward: bool,
    },
    /// A closed curve that no curve crosses.
    Ring {
        /// Its only segment.
        segment: u32,
    },
    /// A stretch of the boundary of the surface between two ends of curves, or a whole boundary loop.
    Boundary,
}

/// One side of a region, traversed with the region to the left.
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// Whether it is a segment, a ring or a stretch of boundary.
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

    /// Number of stretches of the surface's boundary on the borders of the region.
    pub fn boundary_stretches(&self) -> usize {
        self.borders.iter().flatten().filter(|s| s.kind == SideKind::Boundary).count()
    }
}

/// The regions of the marked edges of a mesh: the sets of triangles joined across unmarked edges, by their first triangle.
pub(super) struct Regions {
    pub(super) regions: Vec<Region>,
    /// Region of each face.
    pub(super) of_face: Vec<u32>,
}

impl Regions {
    pub(super) fn find(refined: &RefinedMesh, crossings: &[Crossing], segments: &Segments) -> Self {
        let mut tracer = RegionTracer {
            refined,
            crossings,
            segments,
            on_border: vec![false; refined.n_vertices()],
            counted: vec![false; refined.n_vertices()],
            traced: vec![false; 3 * refined.n_faces()],
        };
        let mut this = Self { regions: Vec::new(), of_face: vec![NONE; refined.n_faces()] };
        for seed in 0..refined.n_faces() as u32 {
            if this.of_face[seed as usize] == NONE {
                let faces = this.flood(refined, seed);
                this.regions.push(tracer.describe(faces));
            }
        }
        this
    }

    /// Marks the triangles of the next region, from `seed` on, and returns them in increasing order.
    fn flood(&mut self, refined: &RefinedMesh, seed: u32) -> Vec<u32> {
        let id = self.regions.len() as u32;
        let mut faces = vec![seed];
        self.of_face[seed as usize] = id;
        let mut i = 0;
        while i < faces.len() {
            for h in 3 * faces[i]..3 * faces[i] + 3 {
                let Some(t) = refined.twin(h) else { continue };
                if refined.mark(h) == Mark::Free && self.of_face[(t / 3) as usize] == NONE {
                    self.of_face[(t / 3) as usize] = id;
                    faces.push(t / 3);
                }
            }
            i += 1;
        }
        faces.sort_unstable();
        faces
    }
}

/// Describes regions one after the other. Its flags are for all of them: a vertex on no border belongs to one region only.
struct RegionTracer<'a> {
    refined: &'a RefinedMesh,
    crossings: &'a [Crossing],
    segments: &'a Segments,
    /// Per vertex: whether it is on a border.
    on_border: Vec<bool>,
    /// Per vertex: whether it is counted as an inner vertex.
    counted: Vec<bool>,
    /// Per half-edge: whether it belongs to a border cycle found.
    traced: Vec<bool>,
}

impl RegionTracer<'_> {
    fn describe(&mut self, faces: Vec<u32>) -> Region {
        let halfedges = || faces.iter().flat_map(|f| 3 * f..3 * f + 3);
        let mut inner_halfedges = 0i64;
        let mut borders = Vec::new();
        for h in halfedges() {
            if self.refined.mark(h) == Mark::Free && !self.refined.is_boundary(h) {
                inner_halfedges += 1;
                continue;
            }
            // Each fan of the region at a border vertex ends with border half-edges, so this finds all border vertices.
            self.on_border[self.refined.origin(h) as usize] = true;
            self.on_border[self.refined.target(h) as usize] = true;
            if !self.traced[h as usize] {
                let cycle = self.border_from(h);
                for &g in &cycle {
                    self.traced[g as usize] = true;
                }
                borders.push(self.split_border(&cycle));
            }
        }
        let mut inner_vertices = 0;
        for h in halfedges() {
            let v = self.refined.origin(h) as usize;
            if !self.on_border[v] && !self.counted[v] {
                self.counted[v] = true;
                inner_vertices += 1;
            }
        }
        let euler = faces.len() as i64 - inner_halfedges / 2 + inner_vertices;
        Region { faces, borders, euler }
    }

    /// The border cycle of the half-edge `start`, with the region to the left.
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

    /// Splits a border cycle into sides, at crossings and ends.
    fn split_border(&self, cycle: &[u32]) -> Vec<Side> {
        let n = cycle.len();
        let at = |h: u32| self.segments.at[h as usize];
        let begins_side = |i: usize| {
            let (h, g) = (cycle[(i + n - 1) % n], cycle[i]);
            match (at(h), at(g)) {
                (None, None) => false,
                (Some(_), Some(_)) => crossing_index(self.crossings, self.refined.origin(g)).is_some(),
                _ => true,
            }
        };
        let kind = |h: u32| match at(h) {
            None => SideKind::Boundary,
            Some((segment, _)) if self.segments.segments[segment as usize].ring => SideKind::Ring { segment },
            Some((segment, forward)) => SideKind::Segment { segment, forward },
        };
        let Some(first) = (0..n).find(|&i| begins_side(i)) else {
            return vec![Side { kind: kind(cycle[0]), halfedges: cycle.to_vec() }];
        };
        let mut sides: Vec<Side> = Vec::new();
        for k in 0..n {
            let i = (first + k) % n;
            if begins_side(i) {
                sides.push(Side { kind: kind(cycle[i]), halfedges: Vec::new() });
            }
            if let Some(side) = sides.last_mut() {
                side.halfedges.push(cycle[i]);
            }
        }
        sides
    }
}
