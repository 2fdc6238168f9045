//! A first embedding of a layout: nodes as vertices, arcs as edge paths (Campen, section 7.8 d).
//!
//! Every region is a disc. It is mapped with little stretch onto a round disc, one equal sector per side, and its
//! node is joined by straight lines to the middle of every side; the two halves that meet in the middle of a
//! segment are its arc. Straight lines from one point do not meet, so arcs are disjoint by construction, and
//! the map makes them fair curves on the surface. A node of a region at the boundary lies on the
//! boundary, and the arcs of the segments that end there run along it.

use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::disc;
use super::piece::Submesh;
use super::structure::QuadLayout;
use crate::dual::{Arrangement, Mark, NoPath, RefinedMesh, Region, SideKind};
use crate::mesh::{TriMesh, TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// Turning of the boundary above which a vertex is a corner that attracts a node: half way to a right angle.
const CORNER_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Why a layout could not be embedded.
#[derive(Debug, Error)]
pub enum InitialEmbeddingError {
    /// A region could not be cut out as a disc.
    #[error("region {region} is not a disc: {source}")]
    NoDisc {
        /// The region.
        region: usize,
        /// What the mesh kernel says.
        source: TriMeshError,
    },
    /// The map of a region could not be computed.
    #[error("region {region}: {source}")]
    Solve {
        /// The region.
        region: usize,
        /// What the solver says.
        source: SolveError,
    },
    /// An arc could not be drawn.
    #[error("the arc in region {region} could not be drawn: {source}")]
    Draw {
        /// The region.
        region: usize,
        /// Where it failed.
        source: NoPath,
    },
    /// An arc is incomplete, which would be a defect of the arrangement.
    #[error("arc {arc} has no two halves")]
    Halves {
        /// The arc.
        arc: usize,
    },
    /// The parts do not fit together again.
    #[error("the embedded layout is not a manifold: {0}")]
    Assemble(#[from] TriMeshError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A layout drawn on a refinement of the surface.
#[derive(Debug, Clone)]
pub struct Embedding {
    /// The surface, with all arcs as edge paths marked [`Mark::Arc`].
    pub mesh: RefinedMesh,
    /// Triangle of the original mesh that each face lies in.
    pub base_face: Vec<u32>,
    /// Vertex of each node.
    pub nodes: Vec<u32>,
    /// Vertices of each arc, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
    /// A parameter that grows along each arc, at each of its vertices, from zero on: lines that part all arcs of a
    /// chord at equal fractions of it go on from patch to patch.
    pub arc_parameters: Vec<Vec<f64>>,
    /// A face inside each patch.
    pub seeds: Vec<u32>,
}

/// Embeds `layout`, the dual of `arrangement`. `preferred` names, per region, a vertex of the arrangement's mesh
/// where the node should lie, such as a field singularity.
///
/// # Errors
///
/// See [`InitialEmbeddingError`].
pub fn embed(
    arrangement: &Arrangement,
    layout: &QuadLayout,
    preferred: &[Option<VertexId>],
    progress: &Progress,
) -> Result<Embedding, InitialEmbeddingError> {
    let middles = middles(arrangement);
    let parts: Vec<RegionPart> = arrangement
        .regions
        .par_iter()
        .enumerate()
        .map(|(r, region)| {
            progress.check()?;
            RegionPart::build(arrangement, r, region, preferred[r], &middles)
        })
        .collect::<Result<_, InitialEmbeddingError>>()?;
    assemble(arrangement, layout, &parts)
}

/// The vertex in the middle of each segment, by length; always an inner one.
fn middles(arrangement: &Arrangement) -> Vec<u32> {
    let mesh = &arrangement.refined;
    let position = |v: u32| mesh.positions[v as usize];
    let middle = |halfedges: &Vec<u32>| {
        let mut along = vec![0.0];
        for &h in halfedges {
            along.push(along[along.len() - 1] + position(mesh.origin(h)).distance(position(mesh.target(h))));
        }
        let half = 0.5 * along[along.len() - 1];
        let best = (1..halfedges.len()).min_by(|&i, &j| (along[i] - half).abs().total_cmp(&(along[j] - half).abs()));
        best.map_or(u32::MAX, |i| mesh.origin(halfedges[i]))
    };
    arrangement.segments.iter().map(|s| middle(&s.halfedges)).collect()
}

/// One region with its node and its halves of arcs.
struct RegionPart {
    mesh: RefinedMesh,
    /// Vertex of the arrangement's mesh for the first vertices; those after are new.
    whole: Vec<u32>,
    /// Face of the arrangement's mesh that the region's original faces are.
    faces: Vec<u32>,
    node: u32,
    /// Half arcs from the node: segment, whether the region lies left of it, vertices.
    halves: Vec<(u32, bool, Vec<u32>)>,
}

impl RegionPart {
    fn build(
        arrangement: &Arrangement,
        r: usize,
        region: &Region,
        preferred: Option<VertexId>,
        middles: &[u32],
    ) -> Result<Self, InitialEmbeddingError> {
        let cut = |h: u32| arrangement.refined.mark(h) != Mark::Free;
        let piece = Submesh::cut_out(&arrangement.refined, &region.faces, cut)
            .map_err(|source| InitialEmbeddingError::NoDisc { region: r, source })?;
        let border = &region.borders[0];
        let sides: Vec<Vec<u32>> = border
            .iter()
            .map(|s| {
                let mut list: Vec<u32> = s.halfedges.iter().map(|&h| piece.mesh.origin(piece.local(h)).0).collect();
                list.extend(s.halfedges.last().map(|&h| piece.mesh.target(piece.local(h)).0));
                list
            })
            .collect();
        let mut mesh = RefinedMesh::new(&piece.mesh);
        let stretch = border.iter().position(|s| s.kind == SideKind::Boundary);
        let on_border = piece.mesh.vertices().filter(|&v| piece.mesh.is_boundary_vertex(v)).count();
        if stretch.is_none() && on_border == piece.mesh.n_vertices() {
            mesh.split_face(largest_face(&piece.mesh));
        }
        let disc = mesh.to_mesh().map_err(|source| InitialEmbeddingError::NoDisc { region: r, source })?;
        let node = match stretch {
            Some(k) => boundary_node(&disc, &sides[k], |v| {
                preferred.is_some_and(|p| piece.whole.get(v as usize) == Some(&p.0))
            }),
            None => preferred
                .and_then(|v| piece.whole.iter().position(|&w| w == v.0))
                .filter(|&v| !disc.is_boundary_vertex(VertexId::new(v)))
                .map_or_else(|| innermost(&disc), |v| v as u32),
        };
        mesh.uv = round_map(&disc, &sides).map_err(|source| InitialEmbeddingError::Solve { region: r, source })?;

        let mut halves = Vec::new();
        for (k, side) in border.iter().enumerate() {
            let SideKind::Segment { segment, forward } = side.kind else { continue };
            if arc_on_boundary(border, k) {
                continue;
            }
            let middle =
                sides[k].iter().copied().find(|&v| piece.whole.get(v as usize) == Some(&middles[segment as usize]));
            let middle = middle.ok_or(InitialEmbeddingError::Halves { arc: segment as usize })?;
            let path = mesh
                .insert_path((node, middle), Mark::Arc(segment), |_, _| true, |_| true, |m, v| m.uv[v as usize])
                .map_err(|source| InitialEmbeddingError::Draw { region: r, source })?;
            halves.push((segment, forward, path));
        }
        if let Some(k) = stretch {
            halves.extend(boundary_halves(border, &sides[k], k, node));
        }
        Ok(Self { mesh, whole: piece.whole, faces: region.faces.clone(), node, halves })
    }
}

/// Whether the segment at side `k` of a border ends on the boundary, next to a stretch of it.
fn arc_on_boundary(border: &[crate::dual::Side], k: usize) -> bool {
    let n = border.len();
    [(k + 1) % n, (k + n - 1) % n].iter().any(|&j| border[j].kind == SideKind::Boundary)
}

/// The halves of arcs that run along the boundary from the node to both ends of its stretch (side `k`).
fn boundary_halves(border: &[crate::dual::Side], stretch: &[u32], k: usize, node: u32) -> Vec<(u32, bool, Vec<u32>)> {
    let n = border.len();
    let at = stretch.iter().position(|&v| v == node).unwrap_or(0);
    let back: Vec<u32> = stretch[..=at].iter().rev().copied().collect();
    let onward = stretch[at..].to_vec();
    let half = |side: usize, path| match border[side].kind {
        SideKind::Segment { segment, forward } => Some((segment, forward, path)),
        _ => None,
    };
    [half((k + n - 1) % n, back), half((k + 1) % n, onward)].into_iter().flatten().collect()
}

/// The map of a disc onto the round unit disc, every side on an equal share of the circle.
pub(super) fn round_map(disc: &TriMesh, sides: &[Vec<u32>]) -> Result<Vec<DVec2>, SolveError> {
    let mut fixed = vec![None; disc.n_vertices()];
    for (k, side) in sides.iter().enumerate() {
        let along = lengths(disc.positions(), side);
        let total = along[along.len() - 1].max(f64::MIN_POSITIVE);
        for (&v, s) in side.iter().zip(along).take(side.len() - 1) {
            let turn = (k as f64 + s / total) / sides.len() as f64;
            fixed[v as usize] = Some(DVec2::from_angle(std::f64::consts::TAU * turn));
        }
    }
    disc::relaxed(disc, &fixed, disc::First::Robust)
}

/// Length along a vertex path up to each of its vertices; each step counts, however short.
pub(super) fn lengths(positions: &[DVec3], path: &[u32]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in path.windows(2) {
        let step = positions[w[0] as usize].distance(positions[w[1] as usize]);
        along.push(along[along.len() - 1] + step.max(1e-9));
    }
    along
}

/// The inner vertex farthest from the border, along edges.
fn innermost(disc: &TriMesh) -> u32 {
    let mut distance = vec![f64::INFINITY; disc.n_vertices()];
    let mut heap = BinaryHeap::new();
    for v in disc.vertices().filter(|&v| disc.is_boundary_vertex(v)) {
        distance[v.index()] = 0.0;
        heap.push(std::cmp::Reverse((crate::dual::Cost(0.0), v.0)));
    }
    while let Some(std::cmp::Reverse((crate::dual::Cost(d), v))) = heap.pop() {
        if d > distance[v as usize] {
            continue;
        }
        for h in disc.outgoing(VertexId(v)) {
            for (w, length) in [(disc.target(h), disc.vector(h).length()), {
                let p = disc.prev(h);
                (disc.origin(p), disc.vector(p).length())
            }] {
                if d + length < distance[w.index()] {
                    distance[w.index()] = d + length;
                    heap.push(std::cmp::Reverse((crate::dual::Cost(d + length), w.0)));
                }
            }
        }
    }
    let inner = disc.vertices().filter(|&v| !disc.is_boundary_vertex(v));
    inner.max_by(|a, b| distance[a.index()].total_cmp(&distance[b.index()])).map_or(0, |v| v.0)
}

/// The vertex inside a boundary stretch where the node goes: its sharpest corner, or the one preferred, or its middle.
fn boundary_node(disc: &TriMesh, stretch: &[u32], preferred: impl Fn(u32) -> bool) -> u32 {
    let turn = |v: u32| {
        let angle: f64 = disc.outgoing(VertexId(v)).map(|h| disc.corner_angle(h)).sum();
        (std::f64::consts::PI - angle).abs()
    };
    let along = lengths(disc.positions(), stretch);
    let half = 0.5 * along[along.len() - 1];
    let inner = 1..stretch.len() - 1;
    let sharpest = inner.clone().max_by(|&i, &j| turn(stretch[i]).total_cmp(&turn(stretch[j])));
    let middle = inner.min_by(|&i, &j| (along[i] - half).abs().total_cmp(&(along[j] - half).abs()));
    let preferred = (1..stretch.len() - 1).find(|&i| preferred(stretch[i]));
    match (sharpest, preferred.or(middle)) {
        (Some(i), _) if turn(stretch[i]) > CORNER_TURN => stretch[i],
        (_, Some(i)) => stretch[i],
        _ => stretch[0],
    }
}

fn largest_face(mesh: &TriMesh) -> u32 {
    mesh.faces().max_by(|&a, &b| mesh.face_area(a).total_cmp(&mesh.face_area(b))).map_or(0, |f| f.0)
}

/// Glues the regions together again.
fn assemble(
    arrangement: &Arrangement,
    layout: &QuadLayout,
    parts: &[RegionPart],
) -> Result<Embedding, InitialEmbeddingError> {
    let mut positions: Vec<DVec3> = arrangement.refined.positions.clone();
    let mut faces = Vec::new();
    let mut base_face = Vec::new();
    let mut nodes = Vec::with_capacity(parts.len());
    let mut halves: Vec<[Option<Vec<u32>>; 2]> = vec![[None, None]; layout.arcs.len()];
    for part in parts {
        let first_new = positions.len() as u32 - part.whole.len() as u32;
        let global = |v: u32| part.whole.get(v as usize).copied().unwrap_or(first_new + v);
        positions.extend(&part.mesh.positions[part.whole.len()..]);
        for f in 0..part.mesh.n_faces() as u32 {
            faces.push(part.mesh.corners(f).map(global));
            base_face.push(arrangement.refined.base_face(part.faces[part.mesh.base_face(f) as usize]));
        }
        nodes.push(global(part.node));
        for (segment, forward, path) in &part.halves {
            let path = path.iter().map(|&v| global(v)).collect();
            halves[*segment as usize][usize::from(!forward)] = Some(path);
        }
    }
    let mut mesh = RefinedMesh::new(&TriMesh::from_faces(positions, &faces)?);
    let mut arcs = Vec::with_capacity(halves.len());
    for (arc, pair) in halves.into_iter().enumerate() {
        let [Some(mut path), Some(mut second)] = pair else { return Err(InitialEmbeddingError::Halves { arc }) };
        second.pop();
        path.extend(second.into_iter().rev());
        for w in path.windows(2) {
            let h = mesh.find(w[0], w[1]).ok_or(InitialEmbeddingError::Halves { arc })?;
            mesh.set_mark(h, Mark::Arc(arc as u32));
        }
        arcs.push(path);
    }
    let seeds = arrangement.crossings.iter().map(|c| mesh.vertex_halfedge(c.vertex) / 3).collect();
    let arc_parameters = arcs.iter().map(|path| lengths(&mesh.positions, path)).collect();
    Ok(Embedding { mesh, base_face, nodes, arcs, arc_parameters, seeds })
}
