//! The curves dual to a drawn layout.
//!
//! Every patch is mapped onto a round disc, and the middles of its opposite sides are joined there by straight lines.
//! Together these lines are one curve for each chord: an arrangement on the surface, whose dual is the layout.

use glam::DVec3;
use rayon::prelude::*;

use super::ReembeddingError;
use super::initial_embedding::{Embedding, lengths, round_map};
use super::patch::{ArcLookup, patch_faces, patch_sides};
use super::piece::Submesh;
use super::structure::QuadLayout;
use crate::dual::{Arrangement, Mark, RefinedMesh};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;

/// The curves dual to the chords of a drawn layout.
pub(super) struct Dual {
    /// Their arrangement; curve `c` is that of chord `c`.
    pub arrangement: Arrangement,
    /// Triangle of the surface for each face that the arrangement's mesh was refined from.
    pub base_face: Vec<u32>,
    /// The drawing, in which every arc has an inner vertex.
    pub drawing: Embedding,
    /// For each arc the vertex at which the curve crosses it.
    pub middles: Vec<u32>,
}

/// A curve on a surface: its points, each with the triangle in which it goes on to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct DualCurve {
    /// The points.
    pub points: Vec<(DVec3, FaceId)>,
    /// Whether it goes on from the last to the first; else it goes from boundary to boundary.
    pub closed: bool,
}

impl Dual {
    /// The curves of all chords that are not `gone`, of a layout drawn on a surface of `n_surface` vertices.
    ///
    /// # Errors
    ///
    /// See [`ReembeddingError`].
    pub(super) fn new(
        layout: &QuadLayout,
        drawing: &Embedding,
        gone: &[bool],
        n_surface: usize,
        progress: &Progress,
    ) -> Result<Self, ReembeddingError> {
        let drawing = with_inner_vertices(drawing)?;
        let middles: Vec<u32> = drawing.arcs.iter().map(|path| middle(&drawing.mesh.positions, path)).collect();
        let lookup = ArcLookup::new(&drawing);
        let parts: Vec<DualPatch> = (0..layout.patches.len())
            .into_par_iter()
            .map(|p| {
                progress.check()?;
                DualPatch::build(layout, &drawing, &lookup, &middles, gone, p)
            })
            .collect::<Result<_, ReembeddingError>>()?;
        let (refined, base_face) = assemble(&drawing, &parts)?;
        let arrangement = Arrangement::from_marked_mesh(refined, n_surface)?;
        Ok(Self { arrangement, base_face, drawing, middles })
    }

    /// The curve of a chord.
    pub(super) fn line(&self, chord: u32) -> DualCurve {
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

/// A drawing with the same parts, in which every arc has an inner vertex.
fn with_inner_vertices(drawing: &Embedding) -> Result<Embedding, ReembeddingError> {
    let mut mesh = RefinedMesh::new(&drawing.mesh.to_mesh()?);
    for h in 0..3 * mesh.n_faces() as u32 {
        mesh.set_mark(h, drawing.mesh.mark(h));
    }
    let mut arcs = drawing.arcs.clone();
    for (arc, path) in arcs.iter_mut().enumerate() {
        if let &[a, b] = path.as_slice() {
            let on_arc = |h: &u32| mesh.mark(*h) == Mark::Arc(arc as u32);
            let leaving = mesh.outgoing(a).into_iter().find(|h| mesh.target(*h) == b && on_arc(h));
            let arriving = || mesh.outgoing(b).into_iter().find(|h| mesh.target(*h) == a && on_arc(h));
            let h = leaving.or_else(arriving).ok_or(ReembeddingError::Arc { arc })?;
            path.insert(1, mesh.split_edge(h, 0.5));
        }
    }
    let base_face = (0..mesh.n_faces() as u32).map(|f| drawing.base_face[mesh.base_face(f) as usize]).collect();
    let arc_parameters = arcs.iter().map(|path| lengths(&mesh.positions, path)).collect();
    Ok(Embedding { mesh, base_face, nodes: drawing.nodes.clone(), arcs, arc_parameters, seeds: drawing.seeds.clone() })
}

/// The inner vertex of a path nearest to its middle.
fn middle(positions: &[DVec3], path: &[u32]) -> u32 {
    let along = lengths(positions, path);
    let half = 0.5 * along[along.len() - 1];
    let off = |i: usize| (along[i] - half).abs();
    let best = (1..path.len() - 1).min_by(|&i, &j| off(i).total_cmp(&off(j)));
    path[best.unwrap_or(0)]
}

/// A patch with the dual curves through it.
struct DualPatch {
    mesh: RefinedMesh,
    /// Vertex of the drawing for the first vertices; those after are new.
    whole: Vec<u32>,
    /// Faces of the drawing that the patch consists of.
    faces: Vec<u32>,
}

impl DualPatch {
    fn build(
        layout: &QuadLayout,
        drawing: &Embedding,
        lookup: &ArcLookup,
        middles: &[u32],
        gone: &[bool],
        p: usize,
    ) -> Result<Self, ReembeddingError> {
        let on_arc = |h: u32| drawing.mesh.mark(h) != Mark::Free;
        let faces = patch_faces(&drawing.mesh, drawing.seeds[p], on_arc);
        let piece = Submesh::cut_out(&drawing.mesh, &faces, on_arc)?;
        let sides = patch_sides(layout, lookup, &piece, p).ok_or(ReembeddingError::Patch { patch: p })?;
        let mut mesh = RefinedMesh::new(&piece.mesh);
        mesh.uv = round_map(&piece.mesh, &sides).map_err(|source| ReembeddingError::Solve { patch: p, source })?;
        for i in 0..2 {
            let ends = [i, i + 2].map(|k| layout.patches[p].sides[k].0);
            let chord = layout.arcs[ends[0] as usize].chord;
            if gone[chord as usize] {
                continue;
            }
            let at = |k: usize| {
                let arc = layout.patches[p].sides[k].0 as usize;
                sides[k].iter().copied().find(|&v| piece.whole[v as usize] == middles[arc])
            };
            let (Some(from), Some(to)) = (at(i), at(i + 2)) else { return Err(ReembeddingError::Patch { patch: p }) };
            mesh.insert_path((from, to), Mark::Curve(chord), |_, _| true, |_| false, |m, v| m.uv[v as usize])
                .map_err(|source| ReembeddingError::Draw { patch: p, source })?;
        }
        Ok(Self { mesh, whole: piece.whole, faces })
    }
}

/// Glues the patches together again, with only the dual curves marked; also tells the triangle of the surface that each
/// face lies in.
fn assemble(drawing: &Embedding, parts: &[DualPatch]) -> Result<(RefinedMesh, Vec<u32>), ReembeddingError> {
    let mut positions = drawing.mesh.positions.clone();
    let (mut faces, mut base_face, mut marks) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        let first_new = positions.len() as u32 - part.whole.len() as u32;
        let global = |v: u32| part.whole.get(v as usize).copied().unwrap_or(first_new + v);
        positions.extend(&part.mesh.positions[part.whole.len()..]);
        for f in 0..part.mesh.n_faces() as u32 {
            faces.push(part.mesh.corners(f).map(global));
            base_face.push(drawing.base_face[part.faces[part.mesh.base_face(f) as usize] as usize]);
            marks.extend((3 * f..3 * f + 3).map(|h| part.mesh.mark(h)));
        }
    }
    let mut mesh = RefinedMesh::new(&TriMesh::from_faces(positions, &faces)?);
    for (h, mark) in (0..).zip(marks).filter(|(_, mark)| *mark != Mark::Free) {
        mesh.set_mark(h, mark);
    }
    Ok((mesh, base_face))
}
