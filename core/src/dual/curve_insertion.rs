//! Inserting curves into a refined mesh.
//!
//! First each crossing of a curve with a mesh edge becomes a vertex on that edge, at the position among the vertices there
//! that [`super::slot_choice`] chooses. Then consecutive vertices are joined inside their triangle of the original mesh, by a
//! path that crosses an older curve only where it must: where its ends alternate with those of the older curve around the
//! triangle.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::path_insertion::NoPath;
use super::refined_mesh::{Mark, RefinedMesh, prev};
use super::slot_choice::{self, ChordEnd};
use crate::mesh::{EdgeId, HalfedgeId, TriMesh};
use crate::surface::SurfaceCurve;

/// Least distance between neighbouring vertices on an edge, as a fraction of the edge. A vertex closer to a neighbour is
/// placed halfway between its two neighbours instead, which keeps the order and avoids edges of length zero. Chosen by hand.
const GAP: f64 = 1e-6;

/// Inserts curves one after the other into a refinement of a mesh.
#[derive(Debug)]
pub(crate) struct CurveInserter<'m> {
    base: &'m TriMesh,
    /// Vertices inserted on each edge of the original mesh, with their positions along `halfedge(edge)`, increasing.
    on_edge: Vec<Vec<(f64, u32)>>,
    /// The chords of curves in each triangle of the original mesh: two vertices, each with the side of the triangle that it
    /// lies on.
    chords: HashMap<u32, Vec<[(u32, u32); 2]>>,
    /// Position of each inserted vertex along `halfedge(edge)` of its edge.
    position: HashMap<u32, f64>,
    /// The refined mesh.
    pub refined: RefinedMesh,
}

impl<'m> CurveInserter<'m> {
    pub(crate) fn new(base: &'m TriMesh) -> Self {
        Self {
            base,
            on_edge: vec![Vec::new(); base.n_edges()],
            chords: HashMap::new(),
            position: HashMap::new(),
            refined: RefinedMesh::new(base),
        }
    }

    /// Inserts `curve` and marks its edges as curve `index`.
    ///
    /// # Errors
    ///
    /// [`NoPath`] if the curve does not lie on the mesh; check it first.
    pub(crate) fn insert(&mut self, curve: &SurfaceCurve, index: u32) -> Result<(), NoPath> {
        let n = curve.crossings.len();
        let mut vertices = Vec::with_capacity(n);
        let positions = slot_choice::choose(self.base, curve, |h| self.positions_on(h), |f| self.chords_in(f));
        for (c, t) in curve.crossings.iter().zip(positions) {
            vertices.push(self.insert_on_edge(c.halfedge, t)?);
        }
        for i in usize::from(!curve.closed)..n {
            let ends = (vertices[(i + n - 1) % n], vertices[i]);
            let exit = curve.crossings[i].halfedge;
            let face = self.base.face(exit);
            let plane = FacePlane::new(self.base.face_vertices(face).map(|v| self.base.position(v)));
            self.refined.insert_path(
                ends,
                Mark::Curve(index),
                |mesh, f| mesh.base_face(f) == face.0,
                |_| false,
                |mesh, v| plane.project(mesh.positions[v as usize]),
            )?;
            let before = curve.crossings[(i + n - 1) % n].halfedge;
            let entry = if !curve.closed && i == 1 { before } else { self.base.twin(before).unwrap_or(before) };
            self.chords.entry(face.0).or_default().push([(ends.0, entry.0 % 3), (ends.1, exit.0 % 3)]);
        }
        Ok(())
    }

    /// Positions of the vertices along half-edge `h` of the original mesh, increasing.
    fn positions_on(&self, h: HalfedgeId) -> Vec<f64> {
        let edge = self.base.edge(h);
        let positions = self.on_edge[edge.index()].iter().map(|&(t, _)| t);
        if self.base.halfedge(edge) == h { positions.collect() } else { positions.rev().map(|t| 1.0 - t).collect() }
    }

    /// The chords in a triangle of the original mesh.
    fn chords_in(&self, f: u32) -> Vec<(ChordEnd, ChordEnd)> {
        let end = |(v, side): (u32, u32)| {
            let h = HalfedgeId(3 * f + side);
            let along = self.position[&v];
            (side, if self.base.halfedge(self.base.edge(h)) == h { along } else { 1.0 - along })
        };
        self.chords.get(&f).into_iter().flatten().map(|&[a, b]| (end(a), end(b))).collect()
    }

    /// A new vertex at fraction `t` of half-edge `h` of the original mesh.
    fn insert_on_edge(&mut self, h: HalfedgeId, t: f64) -> Result<u32, NoPath> {
        let edge: EdgeId = self.base.edge(h);
        let along = if self.base.halfedge(edge) == h { t } else { 1.0 - t };
        let [from, to] = self.base.edge_vertices(edge);
        let list = &self.on_edge[edge.index()];
        let slot = list.partition_point(|&(s, _)| s < along);
        let (low, before) = if slot == 0 { (0.0, from.0) } else { list[slot - 1] };
        let (high, after) = list.get(slot).copied().unwrap_or((1.0, to.0));
        let at = if along - low < GAP || high - along < GAP { 0.5 * (low + high) } else { along };
        let sub = self.sub_edge(before, after, edge).ok_or(NoPath { from: before, to: after })?;
        // In space the vertex stays a hundredth of the edge away from its neighbours, so that no edge has length zero.
        let fraction = ((at - low) / (high - low)).clamp(0.01, 0.99);
        let fraction = if self.refined.origin(sub) == before { fraction } else { 1.0 - fraction };
        let x = self.refined.split_edge(sub, fraction);
        self.on_edge[edge.index()].insert(slot, (at, x));
        self.position.insert(x, at);
        Ok(x)
    }

    /// The half-edge between two neighbouring vertices on an edge of the original mesh.
    ///
    /// In very coarse meshes two edges may share both ends, so the original edge is checked.
    fn sub_edge(&self, a: u32, b: u32, edge: EdgeId) -> Option<u32> {
        let lies_on = |h: u32| self.refined.base_halfedge(h).is_some_and(|g| self.base.edge(HalfedgeId(g)) == edge);
        let spokes = self.refined.outgoing(a);
        spokes.iter().copied().find(|&h| self.refined.target(h) == b && lies_on(h)).or_else(|| {
            let last = prev(*spokes.last()?);
            (self.refined.origin(last) == b && lies_on(last)).then_some(last)
        })
    }
}

/// Orthogonal coordinates in the plane of a triangle.
struct FacePlane {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
}

impl FacePlane {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let x = (b - a).normalize_or(DVec3::X);
        let normal = (b - a).cross(c - a);
        Self { origin: a, x, y: normal.cross(x).normalize_or(x.any_orthonormal_vector()) }
    }

    fn project(&self, p: DVec3) -> DVec2 {
        DVec2::new((p - self.origin).dot(self.x), (p - self.origin).dot(self.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, torus};

    #[test]
    fn vertices_on_an_edge_keep_apart_at_equal_parameters() {
        let mesh = torus(8, 6);
        let mut inserter = CurveInserter::new(&mesh);
        for index in 0..5 {
            inserter.insert(&row(8, 2, true, 0.5), index).unwrap();
        }
        for list in &inserter.on_edge {
            let positions: Vec<f64> = list.iter().map(|&(t, _)| t).collect();
            assert!(positions.is_empty() || positions.len() == 5);
            assert!(positions.is_sorted_by(|a, b| a + GAP < *b), "{positions:?}");
        }
    }

    #[test]
    fn coordinates_in_a_triangle_keep_lengths() {
        let corners = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 2.0, 4.0), DVec3::new(1.0, 5.0, 3.0)];
        let plane = FacePlane::new(corners);
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            assert!((plane.project(a).distance(plane.project(b)) - a.distance(b)).abs() < 1e-12);
        }
        // A degenerate triangle has coordinates too.
        let flat = FacePlane::new([corners[0]; 3]);
        assert_eq!(flat.project(corners[0]), DVec2::ZERO);
    }
}
