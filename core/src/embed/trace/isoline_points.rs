//! Traced isolines as sequences of points of the mesh, from which the overlay makes edge paths.

use glam::DVec3;

use crate::embed::trace::isolines::{Isolines, Line, Step, corner_uv, direction};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// A point of an isoline.
#[derive(Debug, Clone, Copy)]
pub(super) enum Point {
    /// A vertex of the mesh.
    Vertex(VertexId),
    /// The crossing of a half-edge of the triangle that is left, its position as a fraction from the origin, and the
    /// isoline in the chart of that triangle.
    Edge(HalfedgeId, f64, Line),
}

impl Point {
    /// The position in space.
    pub fn position(&self, mesh: &TriMesh) -> DVec3 {
        match *self {
            Self::Vertex(v) => mesh.position(v),
            Self::Edge(h, t, _) => mesh.position(mesh.origin(h)) + mesh.vector(h) * t,
        }
    }

    /// The same point of the isoline run through the other way.
    pub fn reversed(&self, mesh: &TriMesh, map: &SeamlessMap) -> Self {
        let Self::Edge(h, t, line) = *self else { return *self };
        let (Some(g), Some(change)) = (mesh.twin(h), map.transition(mesh, h)) else { return *self };
        Self::Edge(g, 1.0 - t, line.in_chart(&change).reversed())
    }
}

/// The points of a traced isoline.
pub(super) fn isoline_points(isolines: &Isolines, steps: &[Step]) -> Vec<Point> {
    let point = |s: &Step| match *s {
        Step::Vertex(corner, _) => Point::Vertex(isolines.mesh.origin(corner)),
        Step::Edge(h, line) => Point::Edge(h, isolines.crossing(h, &line), line),
    };
    steps.iter().map(point).collect()
}

/// Moves the vertices that an isoline passes through onto it, in the map only: the isoline then is exact. The vertices
/// among `steps` must not be nodes.
pub(super) fn snap_vertices(isolines: &Isolines, map: &mut SeamlessMap, steps: &[Step]) {
    for step in steps {
        let Step::Vertex(corner, line) = *step else { continue };
        let off = line.signed_distance(corner_uv(map, corner));
        for (h, shift) in isolines.fan(corner, -off * direction((line.heading + 1) % 4)) {
            map.uv[h.index() / 3][h.index() % 3] += shift;
        }
    }
}

/// The triangle of the first crossing that does not lie strictly inside its edge.
pub(super) fn degenerate_crossing(mesh: &TriMesh, points: &[Point]) -> Option<FaceId> {
    points.iter().find_map(|p| match *p {
        Point::Edge(h, t, _) => (!(t > 0.0 && t < 1.0)).then(|| mesh.face(h)),
        Point::Vertex(_) => None,
    })
}
