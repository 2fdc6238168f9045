//! Transfer of an embedded layout to another mesh of the same surface.
//!
//! The curves dual to the layout are transferred one by one, and a layout dual to their arrangement gets an initial
//! embedding on the other mesh. If the curves cross there in the same order, that layout is isomorphic to the given
//! one, and its elements are renumbered accordingly. Otherwise the transfer fails.

use glam::DVec3;

use super::dual_curves::{DualCurve, DualCurves};
use super::embedding::Embedding;
use super::initial_embedding::initial_embedding;
use super::isomorphism::{Isomorphism, isomorphism};
use super::reembedding::ReembeddingError;
use super::structure::QuadLayout;
use crate::dual::{Arrangement, Mark, RefinedMesh, remove_bigons};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::SurfaceCurve;

/// Transfers `layout`, embedded as `embedding` on a surface of `n_surface` vertices, to the mesh `to`.
///
/// `transferred` maps a curve of that surface to `to`; `position` gives a vertex of `to` at which a node should lie.
/// `None` if a curve cannot be transferred or the curves do not cross in the same order.
///
/// # Errors
///
/// See [`ReembeddingError`].
pub fn transfer_embedding(
    (layout, embedding, n_surface): (&QuadLayout, &Embedding, usize),
    to: &TriMesh,
    transferred: impl Fn(&DualCurve) -> Option<SurfaceCurve>,
    position: impl Fn(usize) -> Option<VertexId>,
    progress: &Progress,
) -> Result<Option<Embedding>, ReembeddingError> {
    let here = DualCurves::new(layout, embedding, &vec![false; layout.chords], n_surface, progress)?;
    let mut curves = Vec::with_capacity(layout.chords);
    for chord in 0..layout.chords as u32 {
        progress.check()?;
        match transferred(&here.curve(chord)) {
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
            tracing::debug!(wanted, found, error = ?other.err(), "curves cross differently on the other mesh");
            return Ok(None);
        }
    };
    let mut chords = vec![u32::MAX; layout.chords];
    for (segment, arc) in there.segments.iter().zip(&dual.arcs) {
        chords[segment.curve as usize] = arc.chord;
    }
    // Patches are matched by the distance of their centres from crossings.
    let centre = |p: usize| {
        let sides = layout.patches[p].sides;
        sides.map(|(arc, _)| here.embedding.mesh.positions[here.middles[arc as usize] as usize]).iter().sum::<DVec3>()
            / 4.0
    };
    let crossing = |q: usize| there.refined.positions[there.crossings[q].vertex as usize];
    let Some(same) = isomorphism(layout, &dual, &chords, |p, q| centre(p).distance(crossing(q))) else {
        tracing::debug!("curves cross in another order on the other mesh");
        return Ok(None);
    };
    let mut preferred = vec![None; dual.nodes.len()];
    for (n, &other) in same.nodes.iter().enumerate() {
        preferred[other as usize] = position(n);
    }
    Ok(Some(renumbered(initial_embedding(&there, &dual, &preferred, progress)?, &same)))
}

/// An embedding of a layout, renumbered to that of an isomorphic layout.
fn renumbered(embedding: Embedding, same: &Isomorphism) -> Embedding {
    let Embedding { mut mesh, base_face, nodes, arcs, arc_parameters, seeds } = embedding;
    let mut number = vec![0; arcs.len()];
    for (a, &(b, _)) in (0..).zip(&same.arcs) {
        number[b as usize] = a;
    }
    // Both half-edges of an edge share a mark.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::file_testing::dual_layout;
    use crate::testing::{column, row, torus};

    #[test]
    fn layout_is_transferred_with_its_numbering() {
        let mesh = torus(12, 12);
        let curves = [row(12, 2, true, 0.4), column(12, 12, 3, true, 0.6), column(12, 12, 8, true, 0.6)];
        let (layout, embedding) = dual_layout(&mesh, &curves);
        // The original curves serve as the transferred curves of their chords, in the order of the chords.
        let arrangement = Arrangement::new(&mesh, &curves).unwrap();
        let chord_curve = |chord: usize| {
            let arc = layout.arcs.iter().position(|a| a.chord as usize == chord).unwrap();
            curves[arrangement.segments[arc].curve as usize].clone()
        };
        let next = std::cell::Cell::new(0);
        let transferred = |_: &DualCurve| {
            next.set(next.get() + 1);
            Some(chord_curve(next.get() - 1))
        };
        let own = (&layout, &embedding, mesh.n_vertices());
        let moved = transfer_embedding(own, &mesh, transferred, |_| None, &Progress::new()).unwrap().unwrap();
        for (arc, path) in layout.arcs.iter().zip(&moved.arcs) {
            assert_eq!(path[0], moved.nodes[arc.nodes[0] as usize]);
            assert_eq!(path[path.len() - 1], moved.nodes[arc.nodes[1] as usize]);
        }
        assert!(crate::layout::map_patches(&layout, &moved, &Progress::new()).is_ok());
    }

    #[test]
    fn layout_with_a_curve_that_cannot_be_transferred_is_not_transferred() {
        let mesh = torus(12, 12);
        let (layout, embedding) = dual_layout(&mesh, &[row(12, 2, true, 0.4), column(12, 12, 3, true, 0.6)]);
        let own = (&layout, &embedding, mesh.n_vertices());
        assert!(transfer_embedding(own, &mesh, |_| None, |_| None, &Progress::new()).unwrap().is_none());
    }
}
