//! The arcs of a layout traced as isolines of a seamless map (Campen, section 6.4.2).
//!
//! Arcs become edge paths of a refined mesh. Vertices that they pass through move in the map, not on the surface,
//! by what they were off, so that arcs are isolines exactly.

use glam::DVec3;
use thiserror::Error;

use crate::embed::trace::isolines::{Isolines, Step, direction, exactness, nodes_at};
use crate::embed::trace::overlay::{Meeting, Point, overlay};
use crate::embed::trace::separatrix_matching::{LENGTH, Run, SeparatrixMatching};
use crate::layout::{Embedding, QuadLayout};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, TriMeshError, VertexId};
use crate::param::SeamlessMap;

/// How an arc runs: through which triangles, up to homotopy, and in which direction of the map.
#[derive(Debug, Clone, Copy)]
pub struct ArcChain<'a> {
    /// A corner at the first node, as outgoing half-edge.
    pub start: HalfedgeId,
    /// The half-edges crossed from its triangle to the last, each of the triangle that is left.
    pub crossed: &'a [HalfedgeId],
    /// A corner at the second node in the last triangle.
    pub end: HalfedgeId,
    /// The direction of the map, in the chart of the first triangle, that the arc runs in: 0 is +u, 1 is +v, 2 is −u,
    /// 3 is −v.
    pub heading: u8,
}

/// Why the arcs of a layout could not be traced.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TraceError {
    /// A chain does not join its nodes.
    #[error("the chain of arc {arc} does not join its nodes")]
    Chain {
        /// The arc.
        arc: usize,
    },
    /// The nodes of an arc lie the wrong way round in the map, or one on the other.
    #[error("arc {arc} has a length of {length} in the map")]
    Length {
        /// The arc.
        arc: usize,
        /// Its length.
        length: f64,
    },
    /// The patches around a node do not follow one another.
    #[error("the patches around node {node} do not close up")]
    Order {
        /// The node.
        node: usize,
    },
    /// Not as many isolines go out from a node as it has arcs: the map is folded there.
    #[error("{found} isolines go out from node {node} with {expected} arcs")]
    Node {
        /// The node.
        node: usize,
        /// The isolines.
        found: usize,
        /// The arcs.
        expected: usize,
    },
    /// An arc runs into a triangle that the map turns over.
    #[error("arc {arc} meets a fold at triangle {}", face.0)]
    Fold {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// An arc leaves the surface or finds no way on.
    #[error("arc {arc} is lost at triangle {}", face.0)]
    Lost {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// An arc comes to another node, or after another length, than it should.
    #[error("arc {arc} comes to node {node} after {length} instead of to node {expected_node} after {expected}")]
    Strayed {
        /// The arc.
        arc: usize,
        /// The node it comes to.
        node: usize,
        /// Its length.
        length: f64,
        /// The node it should come to.
        expected_node: usize,
        /// The length it should have.
        expected: f64,
    },
    /// Two arcs meet other than at a node.
    #[error("arcs {} and {} meet in triangle {}", arcs[0], arcs[1], face.0)]
    Crossing {
        /// The arcs.
        arcs: [u32; 2],
        /// The triangle.
        face: FaceId,
    },
    /// An arc of a patch does not have it on its side.
    #[error("patch {patch} does not lie beside its arcs")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// The refined mesh is no manifold.
    #[error("the refined surface is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
}

/// A layout traced in a map.
#[derive(Debug, Clone)]
pub struct TracedLayout {
    /// The layout on the refined surface.
    pub embedding: Embedding,
    /// The refined surface.
    pub mesh: TriMesh,
    /// The map on the refined surface; every triangle has the chart of the one it lies in.
    pub map: SeamlessMap,
}

/// What to do about triangles that the map turns over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlippedTriangles {
    /// An arc that meets one is an error.
    Refuse,
    /// Arcs go through them. They are isolines all the same, which part the surface into the patches as they should
    /// if only they do not meet one another in the fold; its triangles stay turned over in their patch.
    Cross,
}

/// Traces the arcs of `layout` in `map`, whose nodes are the vertices `node_vertex` and whose arcs run like `chains`.
///
/// # Errors
///
/// See [`TraceError`]; a map without folds whose nodes are where the chains say has none.
pub fn trace_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    layout: &QuadLayout,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
    folds: FlippedTriangles,
) -> Result<TracedLayout, TraceError> {
    let node = nodes_at(mesh, node_vertex);
    let lines =
        Isolines { mesh, map, node: &node, exact: exactness(map), through_folds: folds == FlippedTriangles::Cross };
    let marched = SeparatrixMatching::new(&lines, layout, node_vertex, chains)?.arcs()?;
    let mut exact = map.clone();
    for (line, _) in &marched {
        straighten(&lines, &mut exact, &line.steps[1..line.steps.len() - 1]);
    }
    let lines = Isolines { map: &exact, ..lines };
    let mut arcs = Vec::with_capacity(marched.len());
    for (arc, (line, backward)) in marched.iter().enumerate() {
        let mut points = points(&lines, &line.steps);
        if let Some(face) = misplaced(mesh, &points) {
            return Err(TraceError::Lost { arc, face });
        }
        if *backward {
            points.reverse();
            points = points.iter().map(|p| p.reversed(mesh, &exact)).collect();
        }
        arcs.push(points);
    }
    let welded = overlay(mesh, &exact, &arcs, Meeting::Wrong)?;
    let seeds = seeds(layout, &welded.mesh, &welded.paths)?;
    let parameters = welded.paths.iter().map(|p| parameters(&welded.mesh, &welded.map, p)).collect();
    let embedding = Embedding {
        mesh: welded.refined,
        base_face: welded.base_face,
        nodes: node_vertex.iter().map(|v| v.0).collect(),
        arcs: welded.paths,
        arc_parameters: parameters,
        seeds,
    };
    Ok(TracedLayout { embedding, mesh: welded.mesh, map: welded.map })
}

/// The arcs as polylines, each by itself and as far as a map that need not be free of folds lets them be traced;
/// `None` for those that do not come to their node.
pub fn preview_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
) -> Vec<Option<Vec<DVec3>>> {
    let node = nodes_at(mesh, node_vertex);
    let lines = Isolines { mesh, map, node: &node, exact: exactness(map), through_folds: true };
    let trace = |from: HalfedgeId, heading: u8, to: HalfedgeId, length: f64| -> Option<Vec<DVec3>> {
        let slots = lines.slots(mesh.origin(from));
        lines.matching(&slots, from, heading).into_iter().find_map(|i| {
            let marched = lines.march(slots[i], length * (1.0 + LENGTH) + lines.exact).ok()?;
            let Step::Vertex(end, _) = *marched.steps.last()? else { return None };
            let right = mesh.origin(end) == mesh.origin(to) && (marched.length - length).abs() <= CLOSE * length;
            right.then(|| points(&lines, &marched.steps).iter().map(|p| p.position(mesh)).collect())
        })
    };
    let both = |chain: &ArcChain| {
        let run = Run::new(mesh, map, chain).filter(|r| r.length > 0.0)?;
        trace(chain.start, chain.heading, chain.end, run.length).or_else(|| {
            let mut back = trace(chain.end, run.back, chain.start, run.length)?;
            back.reverse();
            Some(back)
        })
    };
    chains.iter().map(both).collect()
}

/// How far, relative to its length, a previewed arc may end from where it should.
const CLOSE: f64 = 1e-3;

/// Moves the vertices among the points of a line, which are no nodes, onto it in the map.
pub(in crate::embed) fn straighten(lines: &Isolines, map: &mut SeamlessMap, steps: &[Step]) {
    for step in steps {
        let Step::Vertex(corner, line) = *step else { continue };
        let off = line.off(map.uv[corner.index() / 3][corner.index() % 3]);
        for (h, shift) in lines.fan(corner, -off * direction((line.heading + 1) % 4)) {
            map.uv[h.index() / 3][h.index() % 3] += shift;
        }
    }
}

pub(in crate::embed) fn points(lines: &Isolines, steps: &[Step]) -> Vec<Point> {
    let point = |s: &Step| match *s {
        Step::Vertex(corner, _) => Point::Vertex(lines.mesh.origin(corner)),
        Step::Edge(h, line) => Point::Edge(h, lines.crossing(h, &line), line),
    };
    steps.iter().map(point).collect()
}

/// The triangle of a crossing that is not inside its edge.
pub(in crate::embed) fn misplaced(mesh: &TriMesh, points: &[Point]) -> Option<FaceId> {
    points.iter().find_map(|p| match *p {
        Point::Edge(h, t, _) => (!(t > 0.0 && t < 1.0)).then(|| mesh.face(h)),
        Point::Vertex(_) => None,
    })
}

/// A face of each patch: that to the left of its first side.
pub(in crate::embed) fn seeds(layout: &QuadLayout, mesh: &TriMesh, paths: &[Vec<u32>]) -> Result<Vec<u32>, TraceError> {
    let seed = |(patch, p): (usize, &crate::layout::Patch)| {
        let (arc, forward) = p.sides[0];
        let path = &paths[arc as usize];
        let n = path.len();
        let (from, to) = if forward { (path[0], path[1]) } else { (path[n - 1], path[n - 2]) };
        let h = mesh.outgoing(VertexId(from)).find(|&h| mesh.target(h) == VertexId(to));
        h.map(|h| mesh.face(h).0).ok_or(TraceError::Patch { patch })
    };
    layout.patches.iter().enumerate().map(seed).collect()
}

/// Length in the map along a path of edges, up to each of its vertices.
pub(in crate::embed) fn parameters(mesh: &TriMesh, map: &SeamlessMap, path: &[u32]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in path.windows(2) {
        let joins = |h: HalfedgeId| mesh.target(h) == VertexId(w[1]);
        let ahead = mesh.outgoing(VertexId(w[0])).find(|&h| joins(h));
        let back = || mesh.outgoing(VertexId(w[1])).find(|&h| mesh.target(h) == VertexId(w[0]));
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        let step = ahead.or_else(back).map_or(0.0, |h| at(h).distance(at(mesh.next(h))));
        along.push(along[along.len() - 1] + step);
    }
    along
}
