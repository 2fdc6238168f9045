//! Seamless maps, their transitions, and constraints on their coordinates.
//!
//! Each triangle has its own chart. The first axis of the chart is direction 0 of the cross field in the triangle. From
//! the triangle `f` of a half-edge to the triangle `g` of its twin, coordinates `w = u + iv` change by the transition
//! `w_g = i^{-p} w_f + T` (Campen, equation 6.2). `p` is the period jump of the field; the map determines the
//! translation `T`.

use glam::DVec2;

use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::surface::Metric;
use crate::surface::SurfacePoint;

/// A transition between two charts: quarter turns, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Quarter turns counter-clockwise, 0 to 3.
    pub turns: u8,
    /// The translation, added after turning.
    pub translation: DVec2,
}

impl Transition {
    /// The identity.
    pub const IDENTITY: Self = Self { turns: 0, translation: DVec2::ZERO };

    /// The image of a point.
    pub fn apply(&self, w: DVec2) -> DVec2 {
        turn(w, i32::from(self.turns)) + self.translation
    }

    /// This transition followed by `next`.
    pub fn then(&self, next: &Self) -> Self {
        Self { turns: (self.turns + next.turns) % 4, translation: next.apply(self.translation) }
    }

    /// The inverse transition.
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

/// A constraint on the difference of one coordinate between two points.
///
/// `[τ⁻¹(w_to) − w_from]_axis = difference`, where `τ` is the composition of the transitions across `crossed` (Campen,
/// equation 6.3, with a right-hand side).
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinateConstraint {
    /// The start point; its triangle is the first of the chain.
    pub from: SurfacePoint,
    /// The half-edges crossed, each in the triangle that the chain leaves.
    pub crossed: Vec<HalfedgeId>,
    /// The end point; its triangle is the last of the chain.
    pub to: SurfacePoint,
    /// The coordinate, 0 for u or 1 for v, in the chart of the first triangle.
    pub axis: u8,
    /// The coordinate of `to` minus that of `from`, in the chart of the first triangle; 0: both lie on one isoline.
    pub difference: f64,
}

/// A seamless map: coordinates of all triangle corners, one chart per triangle.
#[derive(Debug, Clone)]
pub struct SeamlessMap {
    /// Coordinates of each triangle's corners in the triangle's chart, in units of length of the surface.
    pub uv: Vec<[DVec2; 3]>,
    /// Period jump of each edge, from the triangle of [`TriMesh::halfedge`] to that of its twin:
    /// `w_twin = i^{-jump} w + T`. From 0 to 3; 0 on the boundary.
    pub jump: Vec<u8>,
}

impl SeamlessMap {
    /// The transition from the triangle of `h` to that of its twin; `None` on the boundary.
    pub fn transition(&self, mesh: &TriMesh, h: HalfedgeId) -> Option<Transition> {
        let t = mesh.twin(h)?;
        let e = mesh.edge(h);
        let p = if mesh.halfedge(e) == h { 4 - self.jump[e.index()] } else { self.jump[e.index()] } % 4;
        // The origin of `h` is the target of `t`. Averaging both ends makes the transitions of `h` and `t` inverse.
        let corner = |h: HalfedgeId| self.uv[h.index() / 3][h.index() % 3];
        let here = corner(h) + corner(mesh.next(h));
        let there = corner(t) + corner(mesh.next(t));
        Some(Transition { turns: p, translation: 0.5 * (there - turn(here, i32::from(p))) })
    }

    /// The gradients of u and v in a triangle, in the plane of `metric`'s layout of the triangle.
    pub fn gradients(&self, metric: &Metric, f: FaceId) -> [DVec2; 2] {
        let [a, b, c] = *metric.layout(f);
        let area = (b - a).perp_dot(c - a);
        let hats = [c - b, a - c, b - a].map(|side| side.perp() / area);
        let w = self.uv[f.index()];
        [0, 1].map(|k| hats[0] * w[0][k] + hats[1] * w[1][k] + hats[2] * w[2][k])
    }

    /// Whether the map flips a triangle or makes it degenerate.
    pub fn is_flipped(&self, f: FaceId) -> bool {
        let [a, b, c] = self.uv[f.index()];
        (b - a).perp_dot(c - a) <= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transition(turns: u8, x: f64, y: f64) -> Transition {
        Transition { turns, translation: DVec2::new(x, y) }
    }

    #[test]
    fn inverse_undoes_a_transition() {
        for turns in 0..4 {
            let t = transition(turns, 2.0, -3.0);
            assert_eq!(t.then(&t.inverse()), Transition::IDENTITY);
            assert_eq!(t.inverse().then(&t), Transition::IDENTITY);
        }
    }

    #[test]
    fn composition_applies_the_first_transition_first() {
        let (first, second) = (transition(1, 2.0, 0.0), transition(3, 0.0, 5.0));
        let w = DVec2::new(4.0, 7.0);
        assert_eq!(first.then(&second).apply(w), second.apply(first.apply(w)));
        assert_ne!(first.then(&second), second.then(&first));
    }

    #[test]
    fn turns_are_counter_clockwise_with_period_four() {
        let w = DVec2::new(1.0, 2.0);
        assert_eq!(turn(w, 1), DVec2::new(-2.0, 1.0));
        assert_eq!(turn(w, -1), turn(w, 3));
        assert_eq!(turn(w, 2), -w);
        assert_eq!(turn(w, 8), w);
    }

    #[test]
    fn clockwise_and_degenerate_images_are_flipped() {
        let (o, x, y) = (DVec2::ZERO, DVec2::X, DVec2::Y);
        let map = SeamlessMap { uv: vec![[o, x, y], [o, y, x], [o, x, 2.0 * x], [o, o, o]], jump: Vec::new() };
        let flipped: Vec<bool> = (0..4).map(|f| map.is_flipped(FaceId(f))).collect();
        assert_eq!(flipped, [false, true, true, true]);
    }
}
