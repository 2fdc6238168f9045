//! The arrangement of curves dual to an embedded layout, one curve per chord.
//!
//! Every patch is mapped onto the unit disc, where straight lines join the middles of opposite sides. Over all patches
//! these lines form one curve per chord. The layout is dual to the arrangement of these curves.

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::disc_map::unit_disc_map;
use super::embedding::{Embedding, path_lengths};
use super::patch_disc::{ArcLookup, PatchDisc, PatchShapeError};
use super::structure::QuadLayout;
use crate::dual::{Arrangement, ArrangementError, Mark, NoPath, RefinedMesh};
use crate::mesh::{FaceId, TriMesh, TriMeshError};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// Why the curves dual to a layout could not be computed.
#[derive(Debug, Error)]
pub enum DualCurvesError {
    /// A patch is not a disc with the four sides of the layout.
    #[error(transparent)]
    Shape(#[from] PatchShapeError),
    /// An arc of the embedding is not a path of edges.
    #[error("arc {arc} is not embedded as a path of edges")]
    Arc {
        /// The arc.
        arc: usize,
    },
    /// A patch could not be mapped.
    #[error("patch {patch}: {source}")]
    Solve {
        /// The patch.
        patch: usize,
        /// The error of the solver.
        source: SolveError,
    },
    /// There is no path for a dual curve.
    #[error("no path for a dual curve in patch {patch}: {source}")]
    Path {
        /// The patch.
        patch: usize,
        /// The vertices that no path joins.
        source: NoPath,
    },
    /// The dual curves do not form an arrangement.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The patches do not form a manifold.
    #[error("the patches of the embedding do not form a manifold: {0}")]
    Mesh(#[from] TriMeshError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The curves dual to the chords of an embedded layout.
pub(super) struct DualCurves {
    /// Their arrangement; curve `c` is dual to chord `c`.
    pub arrangement: Arrangement,
    /// Triangle of the surface for each face that the arrangement's mesh was refined from.
    pub base_face: Vec<u32>,
    /// The embedding, refined such that every arc has an inner vertex.
    pub embedding: Embedding,
    /// For each arc its vertex nearest to the middle; a dual curve crosses the arc there.
    pub middles: Vec<u32>,
}

/// A curve on the surface, dual to a chord.
#[derive(Debug, Clone, PartialEq)]
pub struct DualCurve {
    /// The points, each with the triangle that contains the segment to the next point.
    pub points: Vec<(DVec3, FaceId)>,
    /// Whether it is closed; otherwise it runs from boundary to boundary.
    pub closed: bool,
}

impl DualCurves {
    /// The curves of all chords that are not `deleted`, for a layout embedded on a surface of `n_surface` vertices.
    ///
    /// # Errors
    ///
    /// See [`DualCurvesError`].
    pub(super) fn new(
        layout: &QuadLayout,
        embedding: &Embedding,
        deleted: &[bool],
        n_surface: usize,
        progress: &Progress,
    ) -> Result<Self, DualCurvesError> {
        let embedding = with_inner_vertices(embedding)?;
        let middles: Vec<u32> = embedding.arcs.iter().map(|path| middle(&embedding.mesh.positions, path)).collect();
        let lookup = ArcLookup::new(&embedding);
        let parts: Vec<DualPatch> = (0..layout.patches.len())
            .into_par_iter()
            .map(|p| {
                progress.check()?;
                DualPatch::build(layout, &embedding, &lookup, &middles, deleted, p)
            })
            .collect::<Result<_, DualCurvesError>>()?;
        let (refined, base_face) = assemble(&embedding, &parts)?;
        let arrangement = Arrangement::from_marked_mesh(refined, n_surface)?;
        Ok(Self { arrangement, base_face, embedding, middles })
    }

    /// The curve dual to a chord.
    pub(super) fn curve(&self, chord: u32) -> DualCurve {
        let refined = &self.arrangement.refined;
        let face = |h: u32| FaceId(self.base_face[refined.base_face(h / 3) as usize]);
        let at = |v: u32| refined.positions[v as usize];
        let curve_halfedges = self.arrangement.curve_halfedges(chord);
        let mut points: Vec<(DVec3, FaceId)> =
            curve_halfedges.iter().map(|&h| (at(refined.origin(h)), face(h))).collect();
        let ends =
            curve_halfedges.first().zip(curve_halfedges.last()).map(|(&a, &b)| (refined.origin(a), refined.target(b)));
        let closed = ends.is_some_and(|(a, b)| a == b);
        if !closed {
            points.extend(curve_halfedges.last().map(|&h| (at(refined.target(h)), face(h))));
        }
        DualCurve { points, closed }
    }
}

/// The embedding, refined such that every arc has an inner vertex.
fn with_inner_vertices(embedding: &Embedding) -> Result<Embedding, DualCurvesError> {
    let mut mesh = RefinedMesh::new(&embedding.mesh.to_mesh()?);
    for h in 0..3 * mesh.n_faces() as u32 {
        mesh.set_mark(h, embedding.mesh.mark(h));
    }
    let mut arcs = embedding.arcs.clone();
    for (arc, path) in arcs.iter_mut().enumerate() {
        if let &[a, b] = path.as_slice() {
            let on_arc = |h: &u32| mesh.mark(*h) == Mark::Arc(arc as u32);
            let leaving = mesh.outgoing(a).into_iter().find(|h| mesh.target(*h) == b && on_arc(h));
            let arriving = || mesh.outgoing(b).into_iter().find(|h| mesh.target(*h) == a && on_arc(h));
            let h = leaving.or_else(arriving).ok_or(DualCurvesError::Arc { arc })?;
            path.insert(1, mesh.split_edge(h, 0.5));
        }
    }
    let base_face = (0..mesh.n_faces() as u32).map(|f| embedding.base_face[mesh.base_face(f) as usize]).collect();
    let arc_parameters = arcs.iter().map(|path| path_lengths(&mesh.positions, path)).collect();
    Ok(Embedding {
        mesh,
        base_face,
        nodes: embedding.nodes.clone(),
        arcs,
        arc_parameters,
        seeds: embedding.seeds.clone(),
    })
}

/// The inner vertex of a path nearest to its middle.
fn middle(positions: &[DVec3], path: &[u32]) -> u32 {
    let along = path_lengths(positions, path);
    let half = 0.5 * along[along.len() - 1];
    let off = |i: usize| (along[i] - half).abs();
    let best = (1..path.len() - 1).min_by(|&i, &j| off(i).total_cmp(&off(j)));
    path[best.unwrap_or(0)]
}

/// A patch with the dual curves that cross it.
struct DualPatch {
    mesh: RefinedMesh,
    /// Vertex of the embedding for each of the first vertices; the others are new.
    parent: Vec<u32>,
    /// Faces of the embedding that form the patch.
    faces: Vec<u32>,
}

impl DualPatch {
    fn build(
        layout: &QuadLayout,
        embedding: &Embedding,
        lookup: &ArcLookup,
        middles: &[u32],
        deleted: &[bool],
        p: usize,
    ) -> Result<Self, DualCurvesError> {
        let PatchDisc { submesh, faces, sides } = PatchDisc::cut_out(layout, embedding, lookup, p)?;
        let mut mesh = RefinedMesh::new(&submesh.mesh);
        mesh.uv = unit_disc_map(&submesh.mesh, &sides).map_err(|source| DualCurvesError::Solve { patch: p, source })?;
        for i in 0..2 {
            let ends = [i, i + 2].map(|k| layout.patches[p].sides[k].0);
            let chord = layout.arcs[ends[0] as usize].chord;
            if deleted[chord as usize] {
                continue;
            }
            let at = |k: usize| {
                let arc = layout.patches[p].sides[k].0 as usize;
                sides[k].iter().copied().find(|&v| submesh.parent[v as usize] == middles[arc])
            };
            let (Some(from), Some(to)) = (at(i), at(i + 2)) else {
                return Err(PatchShapeError::Sides { patch: p }.into());
            };
            mesh.insert_path((from, to), Mark::Curve(chord), |_, _| true, |_| false, |m, v| m.uv[v as usize])
                .map_err(|source| DualCurvesError::Path { patch: p, source })?;
        }
        Ok(Self { mesh, parent: submesh.parent, faces })
    }
}

/// Joins the patches to one mesh in which only the dual curves are marked. Also returns the triangle of the surface
/// that each face lies in.
fn assemble(embedding: &Embedding, parts: &[DualPatch]) -> Result<(RefinedMesh, Vec<u32>), DualCurvesError> {
    let mut positions = embedding.mesh.positions.clone();
    let (mut faces, mut base_face, mut marks) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        let first_new = positions.len() as u32 - part.parent.len() as u32;
        let global = |v: u32| part.parent.get(v as usize).copied().unwrap_or(first_new + v);
        positions.extend(&part.mesh.positions[part.parent.len()..]);
        for f in 0..part.mesh.n_faces() as u32 {
            faces.push(part.mesh.corners(f).map(global));
            base_face.push(embedding.base_face[part.faces[part.mesh.base_face(f) as usize] as usize]);
            marks.extend((3 * f..3 * f + 3).map(|h| part.mesh.mark(h)));
        }
    }
    let mut mesh = RefinedMesh::new(&TriMesh::from_faces(positions, &faces)?);
    for (h, mark) in (0..).zip(marks).filter(|(_, mark)| *mark != Mark::Free) {
        mesh.set_mark(h, mark);
    }
    Ok((mesh, base_face))
}
