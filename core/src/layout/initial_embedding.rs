//! The initial embedding of a layout dual to an arrangement: nodes as vertices, arcs as edge paths (Campen, section
//! 7.8 d).
//!
//! Every region is a disc. It is mapped onto the unit disc with little stretch; each side of the region gets an equal
//! sector. Straight lines in the map join the node of the region to the middle of every side. The two half arcs that
//! meet in the middle of a segment form the arc dual to it. Straight lines from one point do not meet, so arcs are
//! disjoint by construction, and the map makes them fair curves on the surface. The node of a region at the boundary
//! lies on the boundary, and the arcs dual to segments that end there run along it.

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::disc_map::unit_disc_map;
use super::embedding::{Embedding, path_lengths};
use super::structure::QuadLayout;
use super::submesh::Submesh;
use crate::dual::{Arrangement, Mark, NoPath, RefinedMesh, Region, SideKind};
use crate::mesh::{Dijkstra, TriMesh, TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// Turning angle of the boundary, in radians, above which a vertex is a corner at which a node is placed: half a right
/// angle.
const CORNER_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Why the initial embedding of a layout could not be computed.
#[derive(Debug, Error)]
pub enum InitialEmbeddingError {
    /// A region could not be cut out as a disc.
    #[error("region {region} is not a disc: {source}")]
    NoDisc {
        /// The region.
        region: usize,
        /// Why its triangles are not a manifold mesh.
        source: TriMeshError,
    },
    /// The map of a region could not be computed.
    #[error("region {region}: {source}")]
    Solve {
        /// The region.
        region: usize,
        /// The error of the solver.
        source: SolveError,
    },
    /// There is no path for a half arc.
    #[error("no path for an arc in region {region}: {source}")]
    Path {
        /// The region.
        region: usize,
        /// The vertices that no path joins.
        source: NoPath,
    },
    /// A half arc is missing. This is a defect of the arrangement.
    #[error("arc {arc} lacks a half arc")]
    Halves {
        /// The arc.
        arc: usize,
    },
    /// The regions do not form a manifold.
    #[error("the embedded layout is not a manifold: {0}")]
    Assemble(#[from] TriMeshError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The initial embedding of `layout`, the dual of `arrangement`. `preferred` gives for each region the vertex of the
/// arrangement's mesh at which the node should lie, such as a field singularity.
///
/// # Errors
///
/// See [`InitialEmbeddingError`].
pub fn initial_embedding(
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

/// The inner vertex of each segment nearest to its middle by length.
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

/// A region with its node and the halves of arcs from the node to its sides.
struct RegionPart {
    mesh: RefinedMesh,
    /// Vertex of the arrangement's mesh for each of the first vertices; the others are new.
    parent: Vec<u32>,
    /// Faces of the arrangement's mesh that form the region.
    faces: Vec<u32>,
    node: u32,
    /// Half arcs from the node: segment, whether the region lies to the segment's left, vertices.
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
        let submesh = Submesh::cut_out(&arrangement.refined, &region.faces, cut)
            .map_err(|source| InitialEmbeddingError::NoDisc { region: r, source })?;
        let border = &region.borders[0];
        let sides: Vec<Vec<u32>> = border
            .iter()
            .map(|s| {
                let mut list: Vec<u32> = s.halfedges.iter().map(|&h| submesh.mesh.origin(submesh.local(h)).0).collect();
                list.extend(s.halfedges.last().map(|&h| submesh.mesh.target(submesh.local(h)).0));
                list
            })
            .collect();
        let mut mesh = RefinedMesh::new(&submesh.mesh);
        let stretch = border.iter().position(|s| s.kind == SideKind::Boundary);
        let on_border = submesh.mesh.vertices().filter(|&v| submesh.mesh.is_boundary_vertex(v)).count();
        if stretch.is_none() && on_border == submesh.mesh.n_vertices() {
            mesh.split_face(largest_face(&submesh.mesh));
        }
        let disc = mesh.to_mesh().map_err(|source| InitialEmbeddingError::NoDisc { region: r, source })?;
        let node = match stretch {
            Some(k) => boundary_node(&disc, &sides[k], |v| {
                preferred.is_some_and(|p| submesh.parent.get(v as usize) == Some(&p.0))
            }),
            None => preferred
                .and_then(|v| submesh.parent.iter().position(|&w| w == v.0))
                .filter(|&v| !disc.is_boundary_vertex(VertexId::new(v)))
                .map_or_else(|| innermost(&disc), |v| v as u32),
        };
        mesh.uv = unit_disc_map(&disc, &sides).map_err(|source| InitialEmbeddingError::Solve { region: r, source })?;

        let mut halves = Vec::new();
        for (k, side) in border.iter().enumerate() {
            let SideKind::Segment { segment, forward } = side.kind else { continue };
            if arc_on_boundary(border, k) {
                continue;
            }
            let middle =
                sides[k].iter().copied().find(|&v| submesh.parent.get(v as usize) == Some(&middles[segment as usize]));
            let middle = middle.ok_or(InitialEmbeddingError::Halves { arc: segment as usize })?;
            let path = mesh
                .insert_path((node, middle), Mark::Arc(segment), |_, _| true, |_| true, |m, v| m.uv[v as usize])
                .map_err(|source| InitialEmbeddingError::Path { region: r, source })?;
            halves.push((segment, forward, path));
        }
        if let Some(k) = stretch {
            halves.extend(boundary_halves(border, &sides[k], k, node));
        }
        Ok(Self { mesh, parent: submesh.parent, faces: region.faces.clone(), node, halves })
    }
}

/// Whether the segment at side `k` of a border ends on the boundary: it is next to a boundary stretch.
fn arc_on_boundary(border: &[crate::dual::Side], k: usize) -> bool {
    let n = border.len();
    [(k + 1) % n, (k + n - 1) % n].iter().any(|&j| border[j].kind == SideKind::Boundary)
}

/// The half arcs along the boundary, from the node to both ends of its stretch (side `k`).
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

/// The inner vertex farthest from the border, along edges.
fn innermost(disc: &TriMesh) -> u32 {
    let mut search = Dijkstra::new(disc.n_vertices());
    for v in disc.vertices().filter(|&v| disc.is_boundary_vertex(v)) {
        search.start(v, 0.0);
    }
    while let Some((v, distance)) = search.settle() {
        for (h, w) in disc.spokes(v) {
            search.reach(w, distance + disc.vector(h).length(), ());
        }
    }
    let inner = disc.vertices().filter(|&v| !disc.is_boundary_vertex(v));
    inner.max_by(|&a, &b| search.distance(a).total_cmp(&search.distance(b))).map_or(0, |v| v.0)
}

/// The vertex inside a boundary stretch at which the node lies: the sharpest corner, else the preferred vertex, else
/// the vertex nearest to the middle.
fn boundary_node(disc: &TriMesh, stretch: &[u32], preferred: impl Fn(u32) -> bool) -> u32 {
    let turn = |v: u32| {
        let angle: f64 = disc.outgoing(VertexId(v)).map(|h| disc.corner_angle(h)).sum();
        (std::f64::consts::PI - angle).abs()
    };
    let along = path_lengths(disc.positions(), stretch);
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

/// Joins the regions to one mesh, and half arcs to arcs.
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
        let first_new = positions.len() as u32 - part.parent.len() as u32;
        let global = |v: u32| part.parent.get(v as usize).copied().unwrap_or(first_new + v);
        positions.extend(&part.mesh.positions[part.parent.len()..]);
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
    let arc_parameters = arcs.iter().map(|path| path_lengths(&mesh.positions, path)).collect();
    Ok(Embedding { mesh, base_face, nodes, arcs, arc_parameters, seeds })
}
