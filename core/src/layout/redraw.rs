//! The drawing of a layout without some of its chords.
//!
//! A drawn layout is turned into its dual: every patch is mapped onto a round disc, and the middles of its opposite sides
//! are joined there by straight lines, one for each chord that is kept. These lines are an arrangement of curves on the
//! surface, and the layout dual to it is drawn as any woven one ([`super::embed`]): a merged node lies in the region in
//! which those it was made of lay, every other node stays where it was.

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::collapse::{CollapseError, Collapsed};
use super::embed::{EmbedError, Embedding, embed, lengths, round_map};
use super::patch::{Lookup, border_sides, flood};
use super::piece::Piece;
use super::structure::{LayoutError, QuadLayout};
use crate::dual::{Arrangement, ArrangementError, Mark, NoRoute, RefinedMesh};
use crate::mesh::{TriMesh, TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// A layout and its drawing without some of the chords of another.
#[derive(Debug, Clone)]
pub struct Redrawn {
    /// What is left.
    pub layout: QuadLayout,
    /// Its drawing on the same surface.
    pub embedding: Embedding,
    /// For each node before the one that it has become.
    pub nodes: Vec<u32>,
    /// For each arc before the one that it has become; none for those of chords that are gone.
    pub arcs: Vec<Option<u32>>,
    /// For each chord before its number, unless it is gone.
    pub chords: Vec<Option<u32>>,
}

/// Why a layout could not be drawn without some of its chords.
#[derive(Debug, Error)]
pub enum RedrawError {
    /// What would be left is no layout.
    #[error(transparent)]
    Collapse(#[from] CollapseError),
    /// A patch is not a disc of four sides.
    #[error("patch {patch} is not drawn as a disc of four sides")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// An arc of the drawing is no path of edges.
    #[error("arc {arc} is not drawn as a path of edges")]
    Arc {
        /// The arc.
        arc: usize,
    },
    /// A patch could not be mapped.
    #[error("patch {patch}: {source}")]
    Solve {
        /// The patch.
        patch: usize,
        /// What the solver says.
        source: SolveError,
    },
    /// A dual curve could not be drawn.
    #[error("patch {patch}: {source}")]
    Draw {
        /// The patch.
        patch: usize,
        /// Where it failed.
        source: NoRoute,
    },
    /// The dual curves are no arrangement.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// The parts do not fit together again.
    #[error("the dual of the drawing is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
    /// The layout of the dual curves is not the one that was to come of it.
    #[error("the dual of the drawing is another layout: {0}")]
    Other(#[from] LayoutError),
    /// The layout could not be drawn.
    #[error(transparent)]
    Embed(#[from] EmbedError),
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Draws `layout`, drawn as `drawing` on a surface of `n_surface` vertices, without the chords that are `gone`. Of nodes
/// that merge, one for which `stays` holds keeps its place, else one of the valence of the merged node.
///
/// # Errors
///
/// See [`RedrawError`].
pub fn redraw(
    layout: &QuadLayout,
    drawing: &Embedding,
    gone: &[bool],
    stays: impl Fn(usize) -> bool,
    n_surface: usize,
    progress: &Progress,
) -> Result<Redrawn, RedrawError> {
    let collapsed = layout.without(gone)?;
    let drawing = with_inner_vertices(drawing)?;
    let middles: Vec<u32> = drawing.arcs.iter().map(|path| middle(&drawing.mesh.positions, path)).collect();
    let lookup = Lookup::new(&drawing);
    let parts: Vec<DualPatch> = (0..layout.patches.len())
        .into_par_iter()
        .map(|p| {
            progress.check()?;
            DualPatch::build(layout, &drawing, &lookup, &middles, gone, p)
        })
        .collect::<Result<_, RedrawError>>()?;
    let (refined, base_face) = assemble(&drawing, &parts)?;
    let arrangement = Arrangement::of_drawn(refined, n_surface)?;
    let dual = QuadLayout::dual(&arrangement, &[], euler(&collapsed.layout))?;
    let region = |v: u32| arrangement.region_left_of(arrangement.refined.any_outgoing(v));
    let nodes: Vec<u32> = drawing.nodes.iter().map(|&v| region(v)).collect();
    let preferred = places(layout, &drawing, &dual, &nodes, stays);
    let segment = |v: u32| arrangement.refined.outgoing(v).into_iter().find_map(|h| arrangement.segment_at(h));
    let arc = |(a, target): (usize, &Option<(u32, bool)>)| {
        target.and_then(|_| segment(middles[a])).map(|(segment, _)| segment)
    };
    let arcs: Vec<Option<u32>> = collapsed.arcs.iter().enumerate().map(arc).collect();
    check(&collapsed, &dual, &nodes)?;
    let mut embedding = embed(&arrangement, &dual, &preferred, progress)?;
    embedding.base_face.iter_mut().for_each(|f| *f = base_face[*f as usize]);
    let mut chords = vec![None; layout.chords];
    for (a, target) in arcs.iter().enumerate() {
        if let Some(target) = *target {
            chords[layout.arcs[a].chord as usize] = Some(dual.arcs[target as usize].chord);
        }
    }
    Ok(Redrawn { layout: dual, embedding, nodes, arcs, chords })
}

fn euler(layout: &QuadLayout) -> i64 {
    layout.nodes.len() as i64 - layout.arcs.len() as i64 + layout.patches.len() as i64
}

/// Checks that the layout dual to the drawn curves has the nodes that the deletion of chords has left.
fn check(collapsed: &Collapsed, dual: &QuadLayout, nodes: &[u32]) -> Result<(), RedrawError> {
    for (n, &found) in nodes.iter().enumerate() {
        let (wanted, found) = (&collapsed.layout.nodes[collapsed.nodes[n] as usize], &dual.nodes[found as usize]);
        if wanted != found {
            let (valence, corners) = (wanted.valence, found.valence);
            return Err(LayoutError::Valence { node: n, valence, corners }.into());
        }
    }
    Ok(())
}

/// The vertex at which each node of `dual` is to lie, if any: that of the only node it is made of, or of one that stays,
/// or of one of its own valence.
fn places(
    layout: &QuadLayout,
    drawing: &Embedding,
    dual: &QuadLayout,
    nodes: &[u32],
    stays: impl Fn(usize) -> bool,
) -> Vec<Option<VertexId>> {
    let mut made_of: Vec<Vec<usize>> = vec![Vec::new(); dual.nodes.len()];
    for (old, &new) in nodes.iter().enumerate() {
        made_of[new as usize].push(old);
    }
    let place = |(new, old): (usize, &Vec<usize>)| {
        let alike = |&n: &usize| layout.nodes[n] == dual.nodes[new];
        let chosen = match old.as_slice() {
            &[only] => Some(only),
            list => list.iter().copied().find(|&n| stays(n)).or_else(|| list.iter().copied().find(alike)),
        };
        chosen.map(|n| VertexId(drawing.nodes[n]))
    };
    made_of.iter().enumerate().map(place).collect()
}

/// A drawing with the same parts, in which every arc has an inner vertex.
fn with_inner_vertices(drawing: &Embedding) -> Result<Embedding, RedrawError> {
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
            let h = leaving.or_else(arriving).ok_or(RedrawError::Arc { arc })?;
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
        lookup: &Lookup,
        middles: &[u32],
        gone: &[bool],
        p: usize,
    ) -> Result<Self, RedrawError> {
        let on_arc = |h: u32| drawing.mesh.mark(h) != Mark::Free;
        let faces = flood(&drawing.mesh, drawing.seeds[p], on_arc);
        let piece = Piece::cut_out(&drawing.mesh, &faces, on_arc)?;
        let sides = border_sides(layout, lookup, &piece, p).ok_or(RedrawError::Patch { patch: p })?;
        let mut mesh = RefinedMesh::new(&piece.mesh);
        mesh.uv = round_map(&piece.mesh, &sides).map_err(|source| RedrawError::Solve { patch: p, source })?;
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
            let (Some(from), Some(to)) = (at(i), at(i + 2)) else { return Err(RedrawError::Patch { patch: p }) };
            mesh.draw((from, to), Mark::Curve(chord), |_, _| true, |_| false, |m, v| m.uv[v as usize])
                .map_err(|source| RedrawError::Draw { patch: p, source })?;
        }
        Ok(Self { mesh, whole: piece.whole, faces })
    }
}

/// Glues the patches together again, with only the dual curves marked; also tells the triangle of the surface that each
/// face lies in.
fn assemble(drawing: &Embedding, parts: &[DualPatch]) -> Result<(RefinedMesh, Vec<u32>), RedrawError> {
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
