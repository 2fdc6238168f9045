//! Chord lengths in the map: node spacing (Campen, section 6.9) and whole multiples of an edge length (section 6.7).
//!
//! All arcs of a chord have the same length in the map, so one constraint on one arc fixes a chord. A chord shorter
//! than a least length is fixed at that length: patches stay wide enough to be resolved by triangles, and separatrices
//! keep their order.

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{ThroughArcs, corner_point};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::param::{CoordinateConstraint, SeamlessMap, Transition};

/// The length that a chord is fixed at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::embed) struct FixedLength {
    /// The arc that is constrained.
    pub arc: u32,
    /// Its length in the map.
    pub length: f64,
    /// Whether the length is a whole multiple of an edge length, and not the least length.
    pub whole: bool,
}

/// The fixed lengths of all chords.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::embed) struct ChordLengths {
    /// For each chord its fixed length; `None`: free.
    pub fixed: Vec<Option<FixedLength>>,
}

impl ChordLengths {
    /// All of `chords` chords free.
    pub(in crate::embed) fn free(chords: usize) -> Self {
        Self { fixed: vec![None; chords] }
    }

    /// Fixes free chords that are shorter than `least` in `map` at that length; returns their number.
    pub(in crate::embed) fn fix_short(
        &mut self,
        topology: &EmbeddingTopology,
        through_arcs: &ThroughArcs,
        chord_of: &[u32],
        map: &SeamlessMap,
        least: f64,
    ) -> usize {
        let mut added = 0;
        for (arc, &chord) in (0u32..).zip(chord_of) {
            let fixed = &mut self.fixed[chord as usize];
            if fixed.is_none() && arc_length(topology, through_arcs, map, arc).is_some_and(|l| l < least) {
                *fixed = Some(FixedLength { arc, length: least, whole: false });
                added += 1;
            }
        }
        added
    }

    /// The constraints of the fixed lengths; an arc whose length is unknown has none.
    pub(super) fn constraints(
        &self,
        topology: &EmbeddingTopology,
        through_arcs: &ThroughArcs,
    ) -> Vec<CoordinateConstraint> {
        let constraint = |fixed: &FixedLength| {
            let chain = through_arcs.length_chain(topology, fixed.arc)?;
            Some(CoordinateConstraint {
                from: corner_point(chain.start),
                crossed: chain.crossed,
                to: corner_point(chain.end),
                axis: chain.heading % 2,
                difference: if chain.heading < 2 { fixed.length } else { -fixed.length },
            })
        };
        self.fixed.iter().flatten().filter_map(constraint).collect()
    }
}

/// For each chord its first arc of known length, and that length in the map; `None` if no arc of the chord has one.
pub(in crate::embed) fn chord_lengths(
    topology: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    chord_of: &[u32],
    map: &SeamlessMap,
    chords: usize,
) -> Vec<Option<(u32, f64)>> {
    let mut found = vec![None; chords];
    for (a, &chord) in (0u32..).zip(chord_of) {
        let at = &mut found[chord as usize];
        *at = at.or_else(|| arc_length(topology, through_arcs, map, a).map(|l| (a, l)));
    }
    found
}

/// The length of arc `a` in the map, negative where its end nodes have changed places; `None` if the isoline across one
/// of its ends has no constrained node.
fn arc_length(topology: &EmbeddingTopology, through_arcs: &ThroughArcs, map: &SeamlessMap, a: u32) -> Option<f64> {
    let chain = through_arcs.length_chain(topology, a)?;
    let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
    let there = transition(&topology.mesh, map, &chain.crossed)?.inverse().apply(at(chain.end));
    let along = (there - at(chain.start))[usize::from(chain.heading % 2)];
    Some(if chain.heading < 2 { along } else { -along })
}

/// The transition along a chain of triangles, given by the half-edges crossed: `τ` of equation 6.3.
pub(in crate::embed) fn transition(mesh: &TriMesh, map: &SeamlessMap, crossed: &[HalfedgeId]) -> Option<Transition> {
    crossed.iter().try_fold(Transition::IDENTITY, |t, &h| Some(t.then(&map.transition(mesh, h)?)))
}
