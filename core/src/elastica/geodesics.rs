//! The geodesics of the graph `g`: between which vertices, their lengths, directions and alignment costs.
//!
//! Each vertex unfolds the triangles of its `k`-ring and keeps the shortest straight geodesic to each vertex of larger
//! index. So each geodesic is computed once, and its numbers are the same from both ends.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::alignment_cost::AlignmentCost;
use super::unfold::{Corners, EdgeCrossing, UnfoldedGeodesic, Unfolding};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Largest number of geodesics kept per vertex, besides its mesh edges; the shortest are kept. A regular 4-ring has about
/// 60, a 5-ring 90, irregular ones up to twice as many. Vertices beyond the limit have many sliver triangles, where
/// thousands of geodesics would nearly coincide.
const MAX_GEODESICS: usize = 250;

/// Largest number of vertices of a `k`-ring, inner rings first. Only vertices with many sliver triangles reach it.
const MAX_RING: usize = 1000;

/// Lower bound of the length of a geodesic, so that the bending cost, which divides by it, stays finite. Chosen by hand;
/// the surface has model size 1.
const MIN_LENGTH: f64 = 1e-9;

/// Number of vertices that one parallel task handles; chosen by hand.
const CHUNK: usize = 256;

/// A geodesic of `g`, without direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Geodesic {
    /// Its end vertices, the smaller index first.
    pub(super) ends: [u32; 2],
    /// Tangent angles at which it leaves each end, in radians.
    pub(super) angles: [f32; 2],
    /// Length, on a surface of model size 1.
    pub(super) length: f32,
    /// Alignment cost per unit length.
    pub(super) alignment: f32,
    /// The face that holds its midpoint.
    pub(super) midpoint_face: u32,
    /// Angle of its direction at the midpoint from side 0 of that face, in radians.
    pub(super) midpoint_angle: f32,
}

/// The `k`-ring of a vertex; the memory is reused from vertex to vertex.
struct Rings {
    /// Per vertex: the vertex whose `k`-ring it was last in.
    mark: Vec<u32>,
    /// The vertices of the present `k`-ring, its centre first.
    members: Vec<VertexId>,
}

impl Rings {
    /// Finds the vertices within `rings` edges of `v`.
    fn gather(&mut self, mesh: &TriMesh, v: VertexId, rings: usize) {
        self.members.clear();
        self.members.push(v);
        self.mark[v.index()] = v.0;
        let mut done = 0;
        for _ in 0..rings {
            let end = self.members.len();
            for i in done..end {
                for h in mesh.outgoing(self.members[i]) {
                    for w in [mesh.target(h), mesh.opposite(h)] {
                        if self.mark[w.index()] != v.0 && self.members.len() < MAX_RING {
                            self.mark[w.index()] = v.0;
                            self.members.push(w);
                        }
                    }
                }
            }
            done = end;
        }
    }
}

/// All geodesics of the graph, each once, from its end of smaller index to its end of larger index.
///
/// # Errors
///
/// When cancelled.
pub(super) fn geodesics(
    mesh: &TriMesh,
    corners: &Corners,
    alignment: &AlignmentCost,
    rings: usize,
    progress: &Progress,
) -> Result<Vec<Geodesic>, Cancelled> {
    let n = mesh.n_vertices();
    let memory = || (Rings { mark: vec![u32::MAX; n], members: Vec::new() }, Unfolding::default());
    let chunks: Vec<(Vec<Geodesic>, Vec<f32>)> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(memory, |(ring, work), c| {
            progress.check()?;
            let (mut kept, mut limits) = (Vec::new(), Vec::new());
            for v in (c * CHUNK..((c + 1) * CHUNK).min(n)).map(VertexId::new) {
                ring.gather(mesh, v, rings);
                limits.push(from_vertex(mesh, corners, alignment, v, ring, work, &mut kept));
            }
            Ok((kept, limits))
        })
        .collect::<Result<_, Cancelled>>()?;
    let limits: Vec<f32> = chunks.iter().flat_map(|c| &c.1).copied().collect();
    // A geodesic is kept if it is among the shortest of both ends; mesh edges are always kept.
    let kept = |g: &Geodesic| g.ends.iter().all(|&v| g.length <= limits[v as usize]) || is_edge(mesh, g);
    Ok(chunks.iter().flat_map(|c| &c.0).copied().filter(kept).collect())
}

fn is_edge(mesh: &TriMesh, g: &Geodesic) -> bool {
    edge_between(mesh, VertexId(g.ends[0]), VertexId(g.ends[1])).is_some()
}

/// A half-edge of the edge between two vertices: from `v` to `w`, or from `w` to `v` on the boundary.
pub(super) fn edge_between(mesh: &TriMesh, v: VertexId, w: VertexId) -> Option<HalfedgeId> {
    mesh.outgoing(v).find_map(|h| {
        let back = mesh.prev(h);
        if mesh.target(h) == w {
            Some(h)
        } else {
            (mesh.origin(back) == w && mesh.twin(back).is_none()).then_some(back)
        }
    })
}

/// Appends the geodesics from `v` to vertices of larger index. Returns the length above which `v` drops geodesics.
fn from_vertex(
    mesh: &TriMesh,
    corners: &Corners,
    alignment: &AlignmentCost,
    v: VertexId,
    ring: &Rings,
    work: &mut Unfolding,
    kept: &mut Vec<Geodesic>,
) -> f32 {
    let mut found: Vec<UnfoldedGeodesic> = Vec::new();
    work.all(
        mesh,
        v,
        |w| ring.mark[w.index()] == v.0,
        |g| {
            if g.target != v {
                found.push(g);
            }
        },
    );
    // Of several geodesics to a vertex the mesh edge is kept, or else the shortest.
    found.sort_by(|a, b| {
        let key = |g: &UnfoldedGeodesic| (g.target, !g.is_edge());
        key(a).cmp(&key(b)).then(a.length.total_cmp(&b.length))
    });
    found.dedup_by_key(|g| g.target);
    let limit = if found.len() > MAX_GEODESICS {
        let mut lengths: Vec<f64> = found.iter().map(|g| g.length).collect();
        *lengths.select_nth_unstable_by(MAX_GEODESICS, f64::total_cmp).1 as f32
    } else {
        f32::INFINITY
    };
    for g in found.iter().filter(|g| g.target > v) {
        let crossings = work.crossings(g);
        let (midpoint_face, midpoint_angle) = midpoint(mesh, g, &crossings);
        let angle = |h: HalfedgeId, local: f64| {
            let tangent = corners.tangent(mesh, h, local);
            // At an inner vertex the tangent angle 2π is the first half-edge again.
            if tangent >= TAU && !mesh.is_boundary_vertex(mesh.origin(h)) { tangent - TAU } else { tangent }
        };
        kept.push(Geodesic {
            ends: [v.0, g.target.0],
            angles: [angle(g.start, g.start_angle()) as f32, angle(g.end, g.end_angle()) as f32],
            length: g.length.max(MIN_LENGTH) as f32,
            alignment: alignment.of_geodesic(v, g, &crossings) as f32,
            midpoint_face: midpoint_face.0,
            midpoint_angle: midpoint_angle as f32,
        });
    }
    limit
}

/// The face that holds the midpoint of a geodesic, and the angle of its direction there from side 0.
fn midpoint(mesh: &TriMesh, g: &UnfoldedGeodesic, crossings: &[EdgeCrossing]) -> (FaceId, f64) {
    let half = 0.5 * g.length;
    let (h, angle) = match crossings.iter().find(|c| c.distance >= half) {
        Some(c) => (c.halfedge, c.angle),
        None => (g.end, g.end_angle() + PI),
    };
    (mesh.face(h), side_angle(mesh, h) + angle)
}

/// Angle from side 0 of its face to a half-edge, counter-clockwise.
fn side_angle(mesh: &TriMesh, h: HalfedgeId) -> f64 {
    let [first, second, _] = mesh.face_halfedges(mesh.face(h));
    match h.0 % 3 {
        0 => 0.0,
        1 => PI - mesh.corner_angle(second),
        _ => PI + mesh.corner_angle(first),
    }
}
