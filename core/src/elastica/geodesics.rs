//! The geodesics of the graph: which vertices are joined, how long, in which directions and at what alignment cost.
//!
//! Each vertex unfolds its rings and keeps the shortest straight geodesic to each larger vertex, so that a geodesic
//! is computed once and is the same from both ends.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::alignment_cost::Weights;
use super::unfold::{Corners, EdgeCrossing, Geodesic, Unfolding};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};

/// Most geodesics kept per vertex besides its own edges; the shortest ones. A regular 4-ring has about 60, a
/// 5-ring 90, irregular ones up to twice that; the rest are hubs of slivers, where thousands would lie nearly
/// in one place.
const MAX_GEODESICS: usize = 250;

/// Largest ring looked at from one vertex, for the same reason.
const MAX_RING: usize = 1000;

/// Shortest length a geodesic counts with, so that the turning cost stays finite.
const MIN_LENGTH: f64 = 1e-9;

/// Vertices per parallel piece of work.
const CHUNK: usize = 256;

/// A geodesic between two vertices, before it has a place in the graph.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) ends: [u32; 2],
    pub(super) angles: [f32; 2],
    pub(super) length: f32,
    pub(super) alignment: f32,
    pub(super) middle_face: u32,
    pub(super) middle_angle: f32,
}

/// The rings around a vertex, with marks that are reused.
struct Rings {
    mark: Vec<u32>,
    members: Vec<VertexId>,
}

impl Rings {
    /// Marks the vertices within `rings` edges of `v`.
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

/// All geodesics of the graph, each once, from its smaller to its larger vertex.
pub(super) fn geodesics(
    mesh: &TriMesh,
    corners: &Corners,
    weights: &Weights,
    rings: usize,
    progress: &Progress,
) -> Result<Vec<Pair>, Cancelled> {
    let n = mesh.n_vertices();
    let memory = || (Rings { mark: vec![u32::MAX; n], members: Vec::new() }, Unfolding::default());
    let chunks: Vec<(Vec<Pair>, Vec<f32>)> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(memory, |(ring, work), c| {
            progress.check()?;
            let (mut pairs, mut limits) = (Vec::new(), Vec::new());
            for v in (c * CHUNK..((c + 1) * CHUNK).min(n)).map(VertexId::new) {
                ring.gather(mesh, v, rings);
                limits.push(from_vertex(mesh, corners, weights, v, ring, work, &mut pairs));
            }
            Ok((pairs, limits))
        })
        .collect::<Result<_, Cancelled>>()?;
    let limits: Vec<f32> = chunks.iter().flat_map(|c| &c.1).copied().collect();
    let kept = |p: &Pair| p.ends.iter().all(|&v| p.length <= limits[v as usize]) || is_edge(mesh, p);
    Ok(chunks.iter().flat_map(|c| &c.0).copied().filter(kept).collect())
}

fn is_edge(mesh: &TriMesh, p: &Pair) -> bool {
    edge_between(mesh, VertexId(p.ends[0]), VertexId(p.ends[1])).is_some()
}

/// A half-edge along the edge between two vertices: from `v` to `w`, or back if only that exists.
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

/// Appends the geodesics from `v` to larger vertices; returns the length beyond which `v` wants none.
fn from_vertex(
    mesh: &TriMesh,
    corners: &Corners,
    weights: &Weights,
    v: VertexId,
    ring: &Rings,
    work: &mut Unfolding,
    pairs: &mut Vec<Pair>,
) -> f32 {
    let mut found: Vec<Geodesic> = Vec::new();
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
    // Mesh edges are visited first and stay; of the others the shortest to each vertex stays.
    found.sort_by(|a, b| {
        let key = |g: &Geodesic| (g.target, !g.is_edge());
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
        let (middle_face, middle_angle) = middle(mesh, g, &crossings);
        let angle = |h: HalfedgeId, local: f64| {
            let tangent = corners.tangent(mesh, h, local);
            // An inner fan closes at 2π, where its first spoke is again.
            if tangent >= TAU && !mesh.is_boundary_vertex(mesh.origin(h)) { tangent - TAU } else { tangent }
        };
        pairs.push(Pair {
            ends: [v.0, g.target.0],
            angles: [angle(g.start, g.start_angle()) as f32, angle(g.end, g.end_angle()) as f32],
            length: g.length.max(MIN_LENGTH) as f32,
            alignment: weights.of_geodesic(v, g, &crossings) as f32,
            middle_face: middle_face.0,
            middle_angle: middle_angle as f32,
        });
    }
    limit
}

/// The triangle that holds the middle of a geodesic, and the angle of its direction there from side 0.
fn middle(mesh: &TriMesh, g: &Geodesic, crossings: &[EdgeCrossing]) -> (FaceId, f64) {
    let half = 0.5 * g.length;
    let (h, angle) = match crossings.iter().find(|c| c.distance >= half) {
        Some(c) => (c.halfedge, c.angle),
        None => (g.end, g.end_angle() + PI),
    };
    (mesh.face(h), side_angle(mesh, h) + angle)
}

/// Angle from side 0 of its triangle to a half-edge, counter-clockwise.
fn side_angle(mesh: &TriMesh, h: HalfedgeId) -> f64 {
    let [first, second, _] = mesh.face_halfedges(mesh.face(h));
    match h.0 % 3 {
        0 => 0.0,
        1 => PI - mesh.corner_angle(second),
        _ => PI + mesh.corner_angle(first),
    }
}
