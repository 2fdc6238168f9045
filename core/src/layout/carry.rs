//! A drawn layout drawn again on another mesh of the same surface.
//!
//! What is carried from mesh to mesh are the curves dual to the layout: closed, or from boundary to boundary, each can go
//! by itself. If they cross there as they did here, their dual is the same layout, and it is drawn there as any woven
//! one; its parts only have to be told apart.

use glam::DVec3;

use super::dual::{Dual, DualCurve};
use super::initial_embedding::{Embedding, embed};
use super::matching::{Matching, matching};
use super::redraw::ReembeddingError;
use super::structure::QuadLayout;
use crate::dual::{Arrangement, Mark, RefinedMesh, remove_bigons};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::SurfaceCurve;

/// Draws `layout`, drawn as `drawing` on a surface of `n_surface` vertices, on the mesh `to`: `carried` is a line of that
/// surface on `to`, `place` a vertex of `to` at which a node should lie. `None` if the layout is another one there.
///
/// # Errors
///
/// See [`ReembeddingError`].
pub fn carry(
    (layout, drawing, n_surface): (&QuadLayout, &Embedding, usize),
    to: &TriMesh,
    carried: impl Fn(&DualCurve) -> Option<SurfaceCurve>,
    place: impl Fn(usize) -> Option<VertexId>,
    progress: &Progress,
) -> Result<Option<Embedding>, ReembeddingError> {
    let here = Dual::new(layout, drawing, &vec![false; layout.chords], n_surface, progress)?;
    let mut curves = Vec::with_capacity(layout.chords);
    for chord in 0..layout.chords as u32 {
        progress.check()?;
        match carried(&here.line(chord)) {
            Some(curve) => curves.push(curve),
            None => return Ok(None),
        }
    }
    remove_bigons(to, &mut curves);
    let there = Arrangement::new(to, &curves)?;
    let (wanted, found) = (layout.patches.len(), there.crossings.len());
    let dual = match QuadLayout::dual(&there, &[], layout.euler()) {
        Ok(dual) if found == wanted => dual,
        other => {
            tracing::debug!(wanted, found, error = ?other.err(), "curves do not cross on the other mesh as here");
            return Ok(None);
        }
    };
    let mut chords = vec![u32::MAX; layout.chords];
    for (segment, arc) in there.segments.iter().zip(&dual.arcs) {
        chords[segment.curve as usize] = arc.chord;
    }
    // Patches lie where curves cross.
    let center = |p: usize| {
        let sides = layout.patches[p].sides;
        sides.map(|(arc, _)| here.drawing.mesh.positions[here.middles[arc as usize] as usize]).iter().sum::<DVec3>()
            / 4.0
    };
    let crossing = |q: usize| there.refined.positions[there.crossings[q].vertex as usize];
    let Some(same) = matching(layout, &dual, &chords, |p, q| center(p).distance(crossing(q))) else {
        tracing::debug!("curves do not cross on the other mesh in the same order");
        return Ok(None);
    };
    let mut preferred = vec![None; dual.nodes.len()];
    for (n, &other) in same.nodes.iter().enumerate() {
        preferred[other as usize] = place(n);
    }
    Ok(Some(renumbered(embed(&there, &dual, &preferred, progress)?, &same)))
}

/// A drawing with the numbers that its parts have in the layout that was matched to the one drawn.
fn renumbered(drawing: Embedding, same: &Matching) -> Embedding {
    let Embedding { mut mesh, base_face, nodes, arcs, arc_parameters, seeds } = drawing;
    let mut number = vec![0; arcs.len()];
    for (a, &(b, _)) in (0..).zip(&same.arcs) {
        number[b as usize] = a;
    }
    // A mark is that of both half-edges.
    let first = |mesh: &RefinedMesh, h: u32| mesh.twin(h).is_none_or(|t| h < t);
    for h in 0..3 * mesh.n_faces() as u32 {
        if let Mark::Arc(b) = mesh.mark(h)
            && first(&mesh, h)
        {
            mesh.set_mark(h, Mark::Arc(number[b as usize]));
        }
    }
    let path = |&(b, along): &(u32, bool)| {
        let mut path = arcs[b as usize].clone();
        if !along {
            path.reverse();
        }
        path
    };
    let parameters = |&(b, along): &(u32, bool)| {
        let list = &arc_parameters[b as usize];
        let whole = list.last().copied().unwrap_or(0.0);
        if along { list.clone() } else { list.iter().rev().map(|t| whole - t).collect() }
    };
    Embedding {
        mesh,
        base_face,
        nodes: same.nodes.iter().map(|&n| nodes[n as usize]).collect(),
        arc_parameters: same.arcs.iter().map(parameters).collect(),
        arcs: same.arcs.iter().map(path).collect(),
        seeds: same.patches.iter().map(|&p| seeds[p as usize]).collect(),
    }
}
