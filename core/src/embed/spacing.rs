//! Keeping nodes apart (Campen, section 6.9).
//!
//! All arcs of a chord have one length in the map. Where it falls below a least one it is held there by one more
//! relation, so that patches stay wide enough to be resolved by triangles, and separatrices do not change places.

use super::net::Net;
use super::straight::{Crossroads, corner};
use crate::mesh::TriMesh;
use crate::param::{Relation, SeamlessMap, Transition};

/// The arcs whose chords are to be held at the least length, one for each chord.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Spacing {
    /// For each chord the arc that is held.
    pub arcs: Vec<Option<u32>>,
}

impl Spacing {
    /// Nothing held, for so many chords.
    pub(super) fn none(chords: usize) -> Self {
        Self { arcs: vec![None; chords] }
    }

    /// Adds the chords that are shorter than `least` in `map`; returns how many.
    pub(super) fn extend(
        &mut self,
        net: &Net,
        roads: &Crossroads,
        chord_of: &[u32],
        map: &SeamlessMap,
        least: f64,
    ) -> usize {
        let mut added = 0;
        for (a, &chord) in (0u32..).zip(chord_of) {
            if self.arcs[chord as usize].is_none() && length(net, roads, map, a).is_some_and(|l| l < least) {
                self.arcs[chord as usize] = Some(a);
                added += 1;
            }
        }
        added
    }

    /// The relations that hold the chords at `least`.
    pub(super) fn relations(&self, net: &Net, roads: &Crossroads, least: f64) -> Vec<Relation> {
        let relation = |a: u32| {
            let span = roads.span(net, a)?;
            Some(Relation {
                from: corner(span.start),
                crossed: span.crossed,
                to: corner(span.end),
                axis: span.heading % 2,
                difference: if span.heading < 2 { least } else { -least },
            })
        };
        self.arcs.iter().flatten().filter_map(|&a| relation(a)).collect()
    }
}

/// The length of an arc in the map, negative where its ends have changed places; `None` where the map does not tell yet.
pub(super) fn length(net: &Net, roads: &Crossroads, map: &SeamlessMap, a: u32) -> Option<f64> {
    let span = roads.span(net, a)?;
    let at = |h: crate::mesh::HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
    let there = transition(&net.mesh, map, &span.crossed)?.inverse().apply(at(span.end));
    let along = (there - at(span.start))[usize::from(span.heading % 2)];
    Some(if span.heading < 2 { along } else { -along })
}

/// The change of charts along a chain.
pub(super) fn transition(mesh: &TriMesh, map: &SeamlessMap, crossed: &[crate::mesh::HalfedgeId]) -> Option<Transition> {
    crossed.iter().try_fold(Transition::IDENTITY, |t, &h| Some(t.then(&map.transition(mesh, h)?)))
}
