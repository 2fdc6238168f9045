//! Curves on the surface, as the list of mesh edges they cross.
//!
//! A curve never passes through a vertex: it crosses edges strictly between their ends, and inside a triangle
//! it is the straight segment from the crossing where it enters to the crossing where it leaves. What two
//! curves do to each other follows from the order of their crossings along the edges alone, so that no
//! floating-point intersection ever decides topology.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::SurfacePoint;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};

/// The place where a curve crosses a mesh edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// The half-edge crossed, seen from the triangle that the curve *leaves* here. At the start of an open
    /// curve no triangle is left: there it is the boundary half-edge of the triangle entered.
    pub halfedge: HalfedgeId,
    /// Where on the half-edge, from its origin (0) to its target (1), strictly between both.
    pub t: f64,
}

/// A curve on a triangle mesh: closed, or open from boundary to boundary.
///
/// `crossings[i].halfedge` belongs to the triangle traversed between crossing `i − 1` and crossing `i`
/// (cyclically for a closed curve). An open curve has a boundary half-edge as its first and as its last
/// crossing and nowhere else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceCurve {
    /// The crossings in order.
    pub crossings: Vec<Crossing>,
    /// Whether the last crossing is followed by the first.
    pub closed: bool,
}

/// Why a list of crossings is not a curve on a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CurveError {
    /// A half-edge that the mesh does not have.
    #[error("crossing {crossing} names a half-edge that the mesh does not have")]
    UnknownHalfedge {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// A parameter that is not strictly between 0 and 1.
    #[error("crossing {crossing} is not strictly inside its edge")]
    OutsideEdge {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// Two crossings in a row that are not on one triangle, or on one edge.
    #[error("crossing {crossing} does not follow from the one before")]
    Disconnected {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// A closed curve that touches the boundary, or an open one that does not end there.
    #[error("crossing {crossing} meets the boundary where it should not, or misses it where it should")]
    Boundary {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// Fewer crossings than any curve has.
    #[error("a curve of only {count} crossings")]
    TooShort {
        /// Number of crossings.
        count: usize,
    },
}

impl SurfaceCurve {
    /// The point on the mesh at crossing `i`.
    pub fn point(&self, mesh: &TriMesh, i: usize) -> DVec3 {
        let c = self.crossings[i];
        mesh.position(mesh.origin(c.halfedge)).lerp(mesh.position(mesh.target(c.halfedge)), c.t)
    }

    /// Crossing `i` as a point of the triangle left there.
    pub fn surface_point(&self, mesh: &TriMesh, i: usize) -> SurfacePoint {
        let Crossing { halfedge, t } = self.crossings[i];
        let mut weights = [0.0; 3];
        let corner = halfedge.index() % 3;
        (weights[corner], weights[(corner + 1) % 3]) = (1.0 - t, t);
        SurfacePoint { face: mesh.face(halfedge), weights }
    }

    /// The points at all crossings; a closed curve does not repeat its first.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        (0..self.crossings.len()).map(|i| self.point(mesh, i)).collect()
    }

    /// Length on the mesh.
    pub fn length(&self, mesh: &TriMesh) -> f64 {
        let points = self.points(mesh);
        let open: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        match (self.closed, points.first(), points.last()) {
            (true, Some(first), Some(last)) => open + last.distance(*first),
            _ => open,
        }
    }

    /// The triangle traversed just before crossing `i`; `None` at the start of an open curve.
    pub fn face_before(&self, mesh: &TriMesh, i: usize) -> Option<FaceId> {
        (self.closed || i > 0).then(|| mesh.face(self.crossings[i].halfedge))
    }

    /// Checks that the curve lies on `mesh`: known edges, inner parameters, consecutive crossings in one
    /// triangle, ends on the boundary just where the curve is open.
    ///
    /// # Errors
    ///
    /// The first crossing that violates this.
    pub fn check(&self, mesh: &TriMesh) -> Result<(), CurveError> {
        let n = self.crossings.len();
        if n < if self.closed { 3 } else { 2 } {
            return Err(CurveError::TooShort { count: n });
        }
        for (crossing, c) in self.crossings.iter().enumerate() {
            if c.halfedge.index() >= mesh.n_halfedges() {
                return Err(CurveError::UnknownHalfedge { crossing });
            }
            if !(c.t > 0.0 && c.t < 1.0) {
                return Err(CurveError::OutsideEdge { crossing });
            }
            let end = !self.closed && (crossing == 0 || crossing == n - 1);
            if mesh.twin(c.halfedge).is_none() != end {
                return Err(CurveError::Boundary { crossing });
            }
        }
        for i in usize::from(!self.closed)..n {
            let before = self.crossings[(i + n - 1) % n].halfedge;
            let entered = if !self.closed && i == 1 { Some(before) } else { mesh.twin(before) };
            let here = self.crossings[i].halfedge;
            if entered.is_none_or(|e| mesh.face(e) != mesh.face(here) || e == here) {
                return Err(CurveError::Disconnected { crossing: i });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles sharing the diagonal 0-2 of a square.
    fn square() -> TriMesh {
        let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    fn crossing(h: u32, t: f64) -> Crossing {
        Crossing { halfedge: HalfedgeId(h), t }
    }

    #[test]
    fn a_curve_across_a_square() {
        let m = square();
        // From the bottom side over the diagonal to the top side.
        let c = SurfaceCurve { crossings: vec![crossing(0, 0.5), crossing(2, 0.5), crossing(4, 0.5)], closed: false };
        assert_eq!(c.check(&m), Ok(()));
        assert!((c.length(&m) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn wrong_curves_are_named() {
        let m = square();
        let check = |list: &[Crossing]| SurfaceCurve { crossings: list.to_vec(), closed: false }.check(&m).unwrap_err();
        assert_eq!(check(&[crossing(0, 0.5)]), CurveError::TooShort { count: 1 });
        assert_eq!(check(&[crossing(0, 1.0), crossing(1, 0.5)]), CurveError::OutsideEdge { crossing: 0 });
        assert_eq!(check(&[crossing(0, 0.5), crossing(2, 0.5)]), CurveError::Boundary { crossing: 1 });
        assert_eq!(check(&[crossing(0, 0.5), crossing(4, 0.5)]), CurveError::Disconnected { crossing: 1 });
    }
}
