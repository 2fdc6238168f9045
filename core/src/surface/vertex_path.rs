//! A path between two vertices, as the list of mesh edges it crosses.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::curve::{Crossing, CurveError};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};

/// A path between two vertices that passes through no other vertex.
///
/// `start` is the corner opposite to the first half-edge crossed, `end` the corner opposite to the twin of the last. A
/// path without crossings is the mesh edge between its ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VertexPath {
    /// The first vertex.
    pub start: VertexId,
    /// The last vertex.
    pub end: VertexId,
    /// The crossings in order, each on the half-edge of the triangle that the path leaves.
    pub crossings: Vec<Crossing>,
}

impl VertexPath {
    /// Positions from start to end.
    pub fn points(&self, mesh: &TriMesh) -> Vec<DVec3> {
        let mut points = vec![mesh.position(self.start)];
        points.extend(self.crossings.iter().map(|c| c.position(mesh)));
        points.push(mesh.position(self.end));
        points
    }

    /// Length on the mesh, in units of the mesh.
    pub fn length(&self, mesh: &TriMesh) -> f64 {
        self.points(mesh).windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    /// The triangles traversed, in order; none for a path along an edge.
    pub fn faces(&self, mesh: &TriMesh) -> Vec<FaceId> {
        let last = self.crossings.last().and_then(|c| mesh.twin(c.halfedge));
        self.crossings.iter().map(|c| c.halfedge).chain(last).map(|h| mesh.face(h)).collect()
    }

    /// Checks that the path lies on `mesh`: half-edges exist, parameters are inside `(0, 1)`, consecutive crossings are
    /// in one triangle, start and end are opposite to the first and the last crossing.
    ///
    /// # Errors
    ///
    /// The first crossing that violates this; [`CurveError::TooShort`] for a path without crossings whose ends no edge
    /// joins.
    pub fn check(&self, mesh: &TriMesh) -> Result<(), CurveError> {
        let (Some(first), Some(last)) = (self.crossings.first(), self.crossings.last()) else {
            let known = self.start.index() < mesh.n_vertices() && self.end.index() < mesh.n_vertices();
            let joined = known && joined_by_edge(mesh, self.start, self.end, |_| true);
            return if joined { Ok(()) } else { Err(CurveError::TooShort { count: 0 }) };
        };
        let mut entered: Option<HalfedgeId> = None;
        for (crossing, c) in self.crossings.iter().enumerate() {
            if c.halfedge.index() >= mesh.n_halfedges() {
                return Err(CurveError::UnknownHalfedge { crossing });
            }
            if !(c.t > 0.0 && c.t < 1.0) {
                return Err(CurveError::OutsideEdge { crossing });
            }
            if entered.is_some_and(|e| mesh.face(e) != mesh.face(c.halfedge) || e == c.halfedge) {
                return Err(CurveError::Disconnected { crossing });
            }
            entered = Some(mesh.twin(c.halfedge).ok_or(CurveError::Boundary { crossing })?);
        }
        let end = mesh.twin(last.halfedge).map(|h| mesh.opposite(h));
        if mesh.opposite(first.halfedge) != self.start {
            return Err(CurveError::Disconnected { crossing: 0 });
        }
        if end != Some(self.end) {
            return Err(CurveError::Disconnected { crossing: self.crossings.len() - 1 });
        }
        Ok(())
    }
}

/// Whether an edge of a triangle that is `allowed` joins two vertices.
pub(super) fn joined_by_edge(mesh: &TriMesh, a: VertexId, b: VertexId, allowed: impl Fn(FaceId) -> bool) -> bool {
    mesh.outgoing(a).any(|h| (mesh.target(h) == b || mesh.opposite(h) == b) && allowed(mesh.face(h)))
}
