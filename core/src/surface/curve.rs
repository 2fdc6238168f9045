//! Curves on the surface, as the list of mesh edges they cross.
//!
//! A curve crosses edges strictly between their ends and never passes through a vertex; inside a triangle it is the
//! straight segment between two crossings. The order of crossings along edges alone determines how two curves
//! intersect, so topology never depends on a floating-point intersection of segments.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::point::SurfacePoint;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};

/// Where a curve crosses a mesh edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// The half-edge crossed, in the triangle that the curve *leaves*. At the start of an open curve it is the boundary
    /// half-edge of the triangle that the curve enters.
    pub halfedge: HalfedgeId,
    /// Parameter on the half-edge, from its origin (0) to its target (1), strictly between both.
    pub t: f64,
}

impl Crossing {
    /// Position in space, in units of the mesh.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        mesh.position(mesh.origin(self.halfedge)).lerp(mesh.position(mesh.target(self.halfedge)), self.t)
    }
}

/// A curve on a triangle mesh: closed, or open from boundary to boundary.
///
/// `crossings[i].halfedge` belongs to the triangle traversed between crossings `i − 1` and `i` (cyclically for a closed
/// curve). The first and the last crossing of an open curve are boundary half-edges, and no others are.
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
    /// The mesh has no such half-edge.
    #[error("crossing {crossing} is on a half-edge that the mesh does not have")]
    UnknownHalfedge {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// The parameter is not strictly between 0 and 1.
    #[error("crossing {crossing} is not strictly between the ends of its edge")]
    OutsideEdge {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// Two consecutive crossings are not on two different edges of one triangle.
    #[error("crossing {crossing} and the one before it are not on two edges of one triangle")]
    Disconnected {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// An inner crossing is on the boundary, or an end of an open curve is not.
    #[error(
        "crossing {crossing} is on the boundary but is not an end of an open curve, or is an end but not on the boundary"
    )]
    Boundary {
        /// Position in the list of crossings.
        crossing: usize,
    },
    /// Fewer crossings than a curve needs: a closed one has at least 3, an open one 2.
    #[error("the curve has only {count} crossings")]
    TooShort {
        /// Number of crossings.
        count: usize,
    },
}

impl SurfaceCurve {
    /// Position of crossing `i` in space.
    pub fn point(&self, mesh: &TriMesh, i: usize) -> DVec3 {
        self.crossings[i].position(mesh)
    }

    /// Crossing `i` as a point of the triangle of its half-edge.
    pub fn surface_point(&self, mesh: &TriMesh, i: usize) -> SurfacePoint {
        let Crossing { halfedge, t } = self.crossings[i];
        let mut weights = [0.0; 3];
        let corner = halfedge.index() % 3;
        (weights[corner], weights[(corner + 1) % 3]) = (1.0 - t, t);
        SurfacePoint { face: mesh.face(halfedge), weights }
    }

    /// Positions of all crossings; the first is not repeated at the end of a closed curve.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        (0..self.crossings.len()).map(|i| self.point(mesh, i)).collect()
    }

    /// Length on the mesh, in units of the mesh.
    pub fn length(&self, mesh: &TriMesh) -> f64 {
        let points = self.points(mesh);
        let open: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        match (self.closed, points.first(), points.last()) {
            (true, Some(first), Some(last)) => open + last.distance(*first),
            _ => open,
        }
    }

    /// The triangle traversed before crossing `i`; `None` at the start of an open curve.
    pub fn face_before(&self, mesh: &TriMesh, i: usize) -> Option<FaceId> {
        (self.closed || i > 0).then(|| mesh.face(self.crossings[i].halfedge))
    }

    /// Checks that the curve lies on `mesh`: half-edges exist, parameters are inside `(0, 1)`, consecutive crossings
    /// are in one triangle, and exactly the ends of an open curve are on the boundary.
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
    fn an_open_curve_across_a_square_is_valid() {
        let m = square();
        // From the bottom side over the diagonal to the top side.
        let c = SurfaceCurve { crossings: vec![crossing(0, 0.5), crossing(2, 0.5), crossing(4, 0.5)], closed: false };
        assert_eq!(c.check(&m), Ok(()));
        assert!((c.length(&m) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_invalid_crossing_is_reported_with_its_index() {
        let m = square();
        let check = |list: &[Crossing]| SurfaceCurve { crossings: list.to_vec(), closed: false }.check(&m).unwrap_err();
        assert_eq!(check(&[crossing(0, 0.5)]), CurveError::TooShort { count: 1 });
        assert_eq!(check(&[crossing(0, 1.0), crossing(1, 0.5)]), CurveError::OutsideEdge { crossing: 0 });
        assert_eq!(check(&[crossing(0, 0.5), crossing(2, 0.5)]), CurveError::Boundary { crossing: 1 });
        assert_eq!(check(&[crossing(0, 0.5), crossing(4, 0.5)]), CurveError::Disconnected { crossing: 1 });
    }
}
