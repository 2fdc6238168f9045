//! Seamless maps and the relations between their points.
//!
//! Each triangle has a chart of its own, whose first axis is direction 0 of the cross field there. From the
//! triangle `f` of a half-edge to that `g` of its twin coordinates `w = u + iv` go over as `w_g = i^{-p} w_f + T`,
//! with the field's period jump `p` and a translation that the map itself tells (Campen, section 6.4).

use glam::DVec2;

use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::surface::Metric;
use crate::surface::SurfacePoint;

/// A change of chart: some quarter turns, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Quarter turns counter-clockwise, 0 to 3.
    pub turns: u8,
    /// What is then added.
    pub translation: DVec2,
}

impl Transition {
    /// The change that changes nothing.
    pub const IDENTITY: Self = Self { turns: 0, translation: DVec2::ZERO };

    /// The image of a point.
    pub fn apply(&self, w: DVec2) -> DVec2 {
        turn(w, i32::from(self.turns)) + self.translation
    }

    /// This change followed by `next`.
    pub fn then(&self, next: &Self) -> Self {
        Self { turns: (self.turns + next.turns) % 4, translation: next.apply(self.translation) }
    }

    /// The change back.
    pub fn inverse(&self) -> Self {
        let turns = (4 - self.turns) % 4;
        Self { turns, translation: -turn(self.translation, i32::from(turns)) }
    }
}

/// `w` after `quarters` quarter turns counter-clockwise; exact.
pub fn turn(w: DVec2, quarters: i32) -> DVec2 {
    match quarters.rem_euclid(4) {
        0 => w,
        1 => DVec2::new(-w.y, w.x),
        2 => -w,
        _ => DVec2::new(w.y, -w.x),
    }
}

/// Two points whose coordinate differs by a given amount, seen along a chain of triangles.
///
/// With `τ` the composition of the transitions across `crossed`: `[τ⁻¹(w_to) − w_from]_axis = difference`.
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinateConstraint {
    /// The point the chain starts at; its triangle is the first of the chain.
    pub from: SurfacePoint,
    /// The half-edges crossed, each of the triangle that is left.
    pub crossed: Vec<HalfedgeId>,
    /// The point the chain ends at; its triangle is the last of the chain.
    pub to: SurfacePoint,
    /// The coordinate meant, 0 for u or 1 for v, in the chart of the first triangle.
    pub axis: u8,
    /// By how much it grows from `from` to `to`, in the chart of the first triangle; 0 puts both on one isoline.
    pub difference: f64,
}

/// Coordinates on a surface, one chart per triangle.
#[derive(Debug, Clone)]
pub struct SeamlessMap {
    /// Coordinates of each triangle's corners in the triangle's chart, in lengths on the surface.
    pub uv: Vec<[DVec2; 3]>,
    /// For each edge, from the triangle of [`TriMesh::halfedge`] to that of its twin: `w_twin = i^{-jump} w + T`.
    /// From 0 to 3; 0 on the boundary.
    pub jump: Vec<u8>,
}

impl SeamlessMap {
    /// The change of chart from the triangle of `h` to that of its twin; `None` on the boundary.
    pub fn transition(&self, mesh: &TriMesh, h: HalfedgeId) -> Option<Transition> {
        let t = mesh.twin(h)?;
        let e = mesh.edge(h);
        let p = if mesh.halfedge(e) == h { 4 - self.jump[e.index()] } else { self.jump[e.index()] } % 4;
        // Origin of `h` is target of `t`: averaging both ends keeps the change there and back inverse.
        let corner = |h: HalfedgeId| self.uv[h.index() / 3][h.index() % 3];
        let here = corner(h) + corner(mesh.next(h));
        let there = corner(t) + corner(mesh.next(t));
        Some(Transition { turns: p, translation: 0.5 * (there - turn(here, i32::from(p))) })
    }

    /// The gradients of u and v in a triangle, as vectors in the plane of `metric`'s layout of it.
    pub fn gradients(&self, metric: &Metric, f: FaceId) -> [DVec2; 2] {
        let [a, b, c] = *metric.layout(f);
        let area = (b - a).perp_dot(c - a);
        let hats = [c - b, a - c, b - a].map(|side| side.perp() / area);
        let w = self.uv[f.index()];
        [0, 1].map(|k| hats[0] * w[0][k] + hats[1] * w[1][k] + hats[2] * w[2][k])
    }

    /// Whether the map turns a triangle over or flattens it.
    pub fn is_flipped(&self, f: FaceId) -> bool {
        let [a, b, c] = self.uv[f.index()];
        (b - a).perp_dot(c - a) <= 0.0
    }
}
