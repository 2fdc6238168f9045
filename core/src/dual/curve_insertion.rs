//! Drawing curves into a refined mesh.
//!
//! First every crossing of a curve becomes a vertex on its mesh edge, in the slot among the vertices there that
//! [`super::slots`] chooses. Then consecutive ones are joined inside their triangle of the original mesh, by
//! a path that meets older curves only where it must: where the ends alternate with theirs around the
//! triangle.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::refined_mesh::{Mark, NoPath, RefinedMesh, prev};
use super::slot_choice::{self, ChordEnd};
use crate::mesh::{EdgeId, HalfedgeId, TriMesh};
use crate::surface::SurfaceCurve;

/// Smallest gap between neighbouring vertices on an edge, as a fraction of the edge: below it a new vertex
/// is put half way between its neighbours, which keeps the order and avoids vanishing edges.
const GAP: f64 = 1e-6;

/// Draws curves one after the other into a refinement of one mesh.
#[derive(Debug)]
pub(crate) struct CurveInserter<'m> {
    base: &'m TriMesh,
    /// Vertices inserted on each edge of the original mesh, with their place along `halfedge(edge)`.
    on_edge: Vec<Vec<(f64, u32)>>,
    /// The chords that curves have drawn in each triangle of the original mesh, as pairs of vertices with
    /// the side of the triangle each lies on.
    chords: HashMap<u32, Vec<[(u32, u32); 2]>>,
    /// Place of each inserted vertex along the half-edge of its edge.
    place: HashMap<u32, f64>,
    /// The refined mesh.
    pub refined: RefinedMesh,
}

impl<'m> CurveInserter<'m> {
    pub(crate) fn new(base: &'m TriMesh) -> Self {
        Self {
            base,
            on_edge: vec![Vec::new(); base.n_edges()],
            chords: HashMap::new(),
            place: HashMap::new(),
            refined: RefinedMesh::new(base),
        }
    }

    /// Draws `curve` and marks its edges as curve `index`.
    ///
    /// # Errors
    ///
    /// [`NoPath`] if the curve does not lie on the mesh; check it first.
    pub(crate) fn insert(&mut self, curve: &SurfaceCurve, index: u32) -> Result<(), NoPath> {
        let n = curve.crossings.len();
        let mut vertices = Vec::with_capacity(n);
        let places = slot_choice::choose(self.base, curve, |h| self.taken(h), |f| self.chords_in(f));
        for (c, t) in curve.crossings.iter().zip(places) {
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

    /// Places of the vertices along half-edge `h` of the original mesh, increasing.
    fn taken(&self, h: HalfedgeId) -> Vec<f64> {
        let edge = self.base.edge(h);
        let places = self.on_edge[edge.index()].iter().map(|&(t, _)| t);
        if self.base.halfedge(edge) == h { places.collect() } else { places.rev().map(|t| 1.0 - t).collect() }
    }

    /// The chords drawn in a triangle of the original mesh.
    fn chords_in(&self, f: u32) -> Vec<(ChordEnd, ChordEnd)> {
        let end = |(v, side): (u32, u32)| {
            let h = HalfedgeId(3 * f + side);
            let along = self.place[&v];
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
        let place = list.partition_point(|&(s, _)| s < along);
        let (low, before) = if place == 0 { (0.0, from.0) } else { list[place - 1] };
        let (high, after) = list.get(place).copied().unwrap_or((1.0, to.0));
        let at = if along - low < GAP || high - along < GAP { 0.5 * (low + high) } else { along };
        let sub = self.sub_edge(before, after, edge).ok_or(NoPath { from: before, to: after })?;
        let fraction = ((at - low) / (high - low)).clamp(0.01, 0.99);
        let fraction = if self.refined.origin(sub) == before { fraction } else { 1.0 - fraction };
        let x = self.refined.split_edge(sub, fraction);
        self.on_edge[edge.index()].insert(place, (at, x));
        self.place.insert(x, at);
        Ok(x)
    }

    /// The half-edge between two neighbouring vertices on an edge of the original mesh.
    ///
    /// Two vertices may be joined by another edge too (in meshes so coarse that two edges share both ends),
    /// so the edge is checked.
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
