//! Crossings and ends of the marked curves of a refined mesh.

use super::error::ArrangementError;
use super::refined_mesh::{Mark, NONE, RefinedMesh};

/// A transversal crossing of two curves, or of a curve with itself: a patch of the layout.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Vertex of the refined mesh.
    pub vertex: u32,
    /// The four marked outgoing half-edges, counter-clockwise.
    pub spokes: [u32; 4],
}

/// The end of a curve on the boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    /// Vertex of the refined mesh.
    pub vertex: u32,
    /// The segment that ends here.
    pub segment: u32,
}

/// The marked half-edges that leave a vertex, counter-clockwise.
pub(super) fn marked_outgoing(refined: &RefinedMesh, v: u32) -> impl Iterator<Item = u32> + '_ {
    refined.outgoing(v).into_iter().filter(|&h| refined.mark(h) != Mark::Free)
}

/// Index of the crossing at vertex `v`; `crossings` are sorted by vertex.
pub(super) fn crossing_index(crossings: &[Crossing], v: u32) -> Option<usize> {
    crossings.binary_search_by_key(&v, |c| c.vertex).ok()
}

/// All crossings and ends, sorted by vertex. The segments of ends are not set yet.
pub(super) fn crossings_and_ends(refined: &RefinedMesh) -> Result<(Vec<Crossing>, Vec<End>), ArrangementError> {
    let (mut crossings, mut ends) = (Vec::new(), Vec::new());
    let mut degree = vec![0u8; refined.n_vertices()];
    let mut at_boundary = vec![false; refined.n_vertices()];
    for h in 0..3 * refined.n_faces() as u32 {
        if refined.mark(h) != Mark::Free {
            let d = &mut degree[refined.origin(h) as usize];
            *d = d.saturating_add(1);
        }
        if refined.is_boundary(h) {
            at_boundary[refined.origin(h) as usize] = true;
        }
    }
    for v in 0..refined.n_vertices() as u32 {
        match (degree[v as usize], at_boundary[v as usize]) {
            (0, _) | (2, false) => {}
            (1, true) => ends.push(End { vertex: v, segment: NONE }),
            (4, false) => {
                let marked: Vec<u32> = marked_outgoing(refined, v).collect();
                crossings.push(Crossing { vertex: v, spokes: [marked[0], marked[1], marked[2], marked[3]] });
            }
            (d, _) => return Err(ArrangementError::Degree { vertex: v, degree: d.into() }),
        }
    }
    Ok((crossings, ends))
}
