//! Segments of an arrangement: the pieces of curves between crossings and ends.

use super::crossings::{Crossing, End, marked_outgoing};
use super::refined_mesh::{Mark, RefinedMesh};

/// A piece of a curve between two crossings or ends: an arc of the layout crosses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// The curve it belongs to.
    pub curve: u32,
    /// Its half-edges in order, in one of the two directions.
    pub halfedges: Vec<u32>,
    /// Whether it is a whole closed curve that no curve crosses.
    pub ring: bool,
}

/// The segments of the marked edges of a mesh.
pub(super) struct Segments {
    pub(super) segments: Vec<Segment>,
    /// Segment of each half-edge and whether it runs in the segment's direction; `None` where unmarked.
    pub(super) at: Vec<Option<(u32, bool)>>,
}

impl Segments {
    /// Finds the segments: first those at crossings, in their order, then those at ends, then uncrossed closed curves.
    pub(super) fn find(refined: &RefinedMesh, crossings: &[Crossing], ends: &[End]) -> Self {
        let mut this = Self { segments: Vec::new(), at: vec![None; 3 * refined.n_faces()] };
        let at_crossings = crossings.iter().flat_map(|c| c.spokes);
        let at_ends = ends.iter().filter_map(|e| marked_outgoing(refined, e.vertex).next());
        for h in at_crossings.chain(at_ends) {
            if this.at[h as usize].is_none() {
                this.trace(refined, h, false);
            }
        }
        for h in 0..3 * refined.n_faces() as u32 {
            if refined.mark(h) != Mark::Free && this.at[h as usize].is_none() {
                this.trace(refined, h, true);
            }
        }
        this
    }

    /// Follows marked edges from `first` to the next crossing or end, or around a closed curve.
    fn trace(&mut self, refined: &RefinedMesh, first: u32, ring: bool) {
        let id = self.segments.len() as u32;
        let Mark::Curve(curve) = refined.mark(first) else { return };
        let mut halfedges = vec![first];
        let mut h = first;
        loop {
            self.at[h as usize] = Some((id, true));
            if let Some(t) = refined.twin(h) {
                self.at[t as usize] = Some((id, false));
            }
            let marked: Vec<u32> = marked_outgoing(refined, refined.target(h)).collect();
            let back = refined.twin(h);
            let onward = marked.iter().copied().find(|&g| Some(g) != back);
            match onward {
                Some(g) if marked.len() == 2 && g != first => {
                    halfedges.push(g);
                    h = g;
                }
                _ => break,
            }
        }
        self.segments.push(Segment { curve, halfedges, ring });
    }
}
