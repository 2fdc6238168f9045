//! Positions of the nodes and arcs of a layout file on the mesh, and their checks.

use std::collections::HashMap;

use super::error::{MAX_VALENCE, PartialEmbeddingError};
use super::format::{FileNode, LayoutFile, PathPoint};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Crossing;

/// Largest difference of the sum of a node's weights from 1; weights written with ten digits satisfy it.
const WEIGHT_SUM: f64 = 1e-9;

/// Position of a point on the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    Vertex(VertexId),
    /// With the fraction along the half-edge [`TriMesh::halfedge`].
    Edge(EdgeId, f64),
    Inside(FaceId),
}

/// A point of an arc: a node or a point of its path.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArcPoint {
    pub place: Place,
    /// For a crossing: the triangle that the arc leaves and the one it enters.
    pub faces: Option<[FaceId; 2]>,
    /// Its vertex in the refined mesh, once inserted.
    pub vertex: u32,
}

/// The position of a node.
pub(super) fn node_place(
    base: &TriMesh,
    node: u32,
    FileNode { at, valence, .. }: &FileNode,
) -> Result<Place, PartialEmbeddingError> {
    if at.face.index() >= base.n_faces() {
        return Err(PartialEmbeddingError::UnknownFace { node, face: at.face });
    }
    let sum: f64 = at.weights.iter().sum();
    let fits = at.weights.iter().all(|w| (0.0..=1.0).contains(w)) && (sum - 1.0).abs() <= WEIGHT_SUM;
    if !fits {
        return Err(PartialEmbeddingError::Weights { node });
    }
    if !(1..=MAX_VALENCE).contains(valence) {
        return Err(PartialEmbeddingError::Valence { node, valence: *valence });
    }
    let [h0, h1, h2] = base.face_halfedges(at.face);
    Ok(match at.weights.map(|w| w > 0.0) {
        [true, true, true] => Place::Inside(at.face),
        [true, true, false] => on_edge(base, h0, at.weights[1] / sum),
        [false, true, true] => on_edge(base, h1, at.weights[2] / sum),
        [true, false, true] => on_edge(base, h2, at.weights[0] / sum),
        [first, second, _] => Place::Vertex(base.origin(if first {
            h0
        } else if second {
            h1
        } else {
            h2
        })),
    })
}

fn on_edge(base: &TriMesh, h: HalfedgeId, t: f64) -> Place {
    let e = base.edge(h);
    Place::Edge(e, if base.halfedge(e) == h { t } else { 1.0 - t })
}

impl Place {
    fn is_boundary(self, base: &TriMesh) -> bool {
        match self {
            Self::Vertex(v) => base.is_boundary_vertex(v),
            Self::Edge(e, _) => base.is_boundary_edge(e),
            Self::Inside(_) => false,
        }
    }

    /// The triangles that contain the point.
    pub(super) fn faces(self, base: &TriMesh) -> Vec<FaceId> {
        match self {
            Self::Vertex(v) => base.outgoing(v).map(|h| base.face(h)).collect(),
            Self::Edge(e, _) => {
                let h = base.halfedge(e);
                [Some(h), base.twin(h)].into_iter().flatten().map(|h| base.face(h)).collect()
            }
            Self::Inside(f) => vec![f],
        }
    }

    /// Whether the point lies on an edge, ends included.
    pub(super) fn is_on(self, base: &TriMesh, e: EdgeId) -> bool {
        match self {
            Self::Vertex(v) => base.edge_vertices(e).contains(&v),
            Self::Edge(own, _) => own == e,
            Self::Inside(_) => false,
        }
    }

    /// An edge that contains this and another point.
    pub(super) fn common_edge(self, base: &TriMesh, other: Self) -> Option<EdgeId> {
        let edges = match self {
            Self::Vertex(v) => base.outgoing(v).flat_map(|h| [base.edge(h), base.edge(base.prev(h))]).collect(),
            Self::Edge(e, _) => vec![e],
            Self::Inside(_) => Vec::new(),
        };
        edges.into_iter().find(|&e| other.is_on(base, e))
    }
}

/// Checks that nodes and slots of all arc ends exist and that no slot is taken twice.
pub(super) fn check_slots(file: &LayoutFile, base: &TriMesh, places: &[Place]) -> Result<(), PartialEmbeddingError> {
    let mut taken = HashMap::new();
    for (arc, a) in file.arcs.iter().enumerate() {
        let arc = arc as u32;
        for end in a.ends {
            let (node, slot) = (end.node, end.slot);
            let Some(place) = places.get(node as usize) else {
                return Err(PartialEmbeddingError::UnknownNode { arc, node, count: places.len() });
            };
            let last = file.nodes[node as usize].valence - u32::from(!place.is_boundary(base));
            if slot > last {
                return Err(PartialEmbeddingError::UnknownSlot { arc, node, slot, last });
            }
            if let Some(other) = taken.insert((node, slot), arc) {
                return Err(PartialEmbeddingError::SlotTaken { node, slot, arcs: [other, arc] });
            }
        }
    }
    Ok(())
}

/// The nodes of arc `a` in the order in which it runs along the boundary with the surface to the left; `None` unless
/// its slots are those of a boundary arc.
pub(super) fn along_boundary(file: &LayoutFile, base: &TriMesh, places: &[Place], a: usize) -> Option<[u32; 2]> {
    let [p, q] = file.arcs[a].ends;
    let outer = |node: u32| places[node as usize].is_boundary(base).then(|| file.nodes[node as usize].valence);
    let (last_p, last_q) = (outer(p.node)?, outer(q.node)?);
    match (p.slot, q.slot) {
        (0, slot) if slot == last_q => Some([p.node, q.node]),
        (slot, 0) if slot == last_p => Some([q.node, p.node]),
        _ => None,
    }
}

/// The points of an arc, both nodes included.
pub(super) fn arc_points(
    file: &LayoutFile,
    base: &TriMesh,
    places: &[Place],
    a: usize,
) -> Result<Vec<ArcPoint>, PartialEmbeddingError> {
    let arc = &file.arcs[a];
    let at_node = |i: usize| ArcPoint { place: places[arc.ends[i].node as usize], faces: None, vertex: u32::MAX };
    let mut list = vec![at_node(0)];
    for (point, path_point) in arc.path.iter().enumerate() {
        let wrong = |reason| PartialEmbeddingError::PathPoint { arc: a as u32, point, reason };
        list.push(match *path_point {
            PathPoint::Vertex { vertex } if vertex.index() >= base.n_vertices() => {
                return Err(wrong("the mesh has no such vertex"));
            }
            PathPoint::Vertex { vertex } => ArcPoint { place: Place::Vertex(vertex), faces: None, vertex: u32::MAX },
            PathPoint::Crossing(c) => crossing_point(base, c).map_err(wrong)?,
        });
    }
    list.push(at_node(1));
    Ok(list)
}

fn crossing_point(base: &TriMesh, Crossing { halfedge: h, t }: Crossing) -> Result<ArcPoint, &'static str> {
    if h.index() >= base.n_halfedges() {
        return Err("the mesh has no such half-edge");
    }
    let Some(twin) = base.twin(h) else { return Err("an arc cannot cross the boundary") };
    let place = on_edge(base, h, t);
    let inner = |t: f64| t > 0.0 && t < 1.0;
    if !(inner(t) && matches!(place, Place::Edge(_, s) if inner(s))) {
        return Err("t is not strictly between 0 and 1");
    }
    Ok(ArcPoint { place, faces: Some([base.face(h), base.face(twin)]), vertex: u32::MAX })
}
