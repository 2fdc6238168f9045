//! Holding chords at lengths: nodes that keep apart (Campen, section 6.9), whole multiples of an edge (section 6.7).
//!
//! All arcs of a chord have one length in the map. Where it falls below a least one it is held there by one more
//! relation, so that patches stay wide enough to be resolved by triangles, and separatrices do not change places.

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{ThroughArcs, corner_point};
use crate::mesh::TriMesh;
use crate::param::{CoordinateConstraint, SeamlessMap, Transition};

/// A chord that is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::embed) struct Held {
    /// The arc that is held.
    pub arc: u32,
    /// Its length.
    pub length: f64,
    /// Whether that is a multiple of an edge, and not just the least length.
    pub whole: bool,
}

/// The chords that are to be held at lengths.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::embed) struct Spacing {
    /// For each chord whether it is held, and how.
    pub held: Vec<Option<Held>>,
}

impl Spacing {
    /// Nothing held, for so many chords.
    pub(in crate::embed) fn none(chords: usize) -> Self {
        Self { held: vec![None; chords] }
    }

    /// Holds the chords at `least` that are shorter in `map`; returns how many.
    pub(in crate::embed) fn extend(
        &mut self,
        net: &EmbeddingTopology,
        through_arcs: &ThroughArcs,
        chord_of: &[u32],
        map: &SeamlessMap,
        least: f64,
    ) -> usize {
        let mut added = 0;
        for (arc, &chord) in (0u32..).zip(chord_of) {
            let held = &mut self.held[chord as usize];
            if held.is_none() && length(net, through_arcs, map, arc).is_some_and(|l| l < least) {
                *held = Some(Held { arc, length: least, whole: false });
                added += 1;
            }
        }
        added
    }

    /// The relations that hold the chords.
    pub(in crate::embed) fn relations(
        &self,
        net: &EmbeddingTopology,
        through_arcs: &ThroughArcs,
    ) -> Vec<CoordinateConstraint> {
        let relation = |held: &Held| {
            let length_chain = through_arcs.length_chain(net, held.arc)?;
            Some(CoordinateConstraint {
                from: corner_point(length_chain.start),
                crossed: length_chain.crossed,
                to: corner_point(length_chain.end),
                axis: length_chain.heading % 2,
                difference: if length_chain.heading < 2 { held.length } else { -held.length },
            })
        };
        self.held.iter().flatten().filter_map(relation).collect()
    }
}

/// For each chord an arc of it whose length the map tells, and that length.
pub(in crate::embed) fn lengths(
    net: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    chord_of: &[u32],
    map: &SeamlessMap,
    chords: usize,
) -> Vec<Option<(u32, f64)>> {
    let mut found = vec![None; chords];
    for (a, &chord) in (0u32..).zip(chord_of) {
        let at = &mut found[chord as usize];
        *at = at.or_else(|| length(net, through_arcs, map, a).map(|l| (a, l)));
    }
    found
}

/// The length of an arc in the map, negative where its ends have changed places; `None` where the map does not tell yet.
pub(in crate::embed) fn length(
    net: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    map: &SeamlessMap,
    a: u32,
) -> Option<f64> {
    let length_chain = through_arcs.length_chain(net, a)?;
    let at = |h: crate::mesh::HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
    let there = transition(&net.mesh, map, &length_chain.crossed)?.inverse().apply(at(length_chain.end));
    let along = (there - at(length_chain.start))[usize::from(length_chain.heading % 2)];
    Some(if length_chain.heading < 2 { along } else { -along })
}

/// The change of charts along a chain.
pub(in crate::embed) fn transition(
    mesh: &TriMesh,
    map: &SeamlessMap,
    crossed: &[crate::mesh::HalfedgeId],
) -> Option<Transition> {
    crossed.iter().try_fold(Transition::IDENTITY, |t, &h| Some(t.then(&map.transition(mesh, h)?)))
}
